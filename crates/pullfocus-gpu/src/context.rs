//! What lives as long as a device: the device itself, its limits, its pipelines.

use crate::shader::{self, Interface, Slot, Spec, Uniform};
use crate::textures::RenderKernel;
use pullfocus_core::{Error, Result, Size};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A device, ready to blur. Pipelines are compiled when they are first needed and stay.
///
/// It is cheap to share (`Arc` inside) and belongs to the caller's device: nothing is global.
#[derive(Debug, Clone)]
pub struct Context {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    device: wgpu::Device,
    queue: wgpu::Queue,
    name: String,
    limits: wgpu::Limits,
    /// Whether marked loops are written out.
    unrolls: bool,
    kernels: Mutex<HashMap<Spec, Arc<Kernel>>>,
    render_kernels: Mutex<HashMap<(Spec, wgpu::TextureFormat), Arc<RenderKernel>>>,
    faults: Faults,
}

/// What went wrong on a device, outside of any call.
#[derive(Debug, Clone, Default)]
pub(crate) struct Faults(Arc<Mutex<Option<Fault>>>);

#[derive(Debug, Clone)]
enum Fault {
    Lost(String),
    Memory,
}

impl Faults {
    pub fn lost(&self, reason: String) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Fault::Lost(reason));
    }

    /// The driver had no memory for something, once: that frame fails and others may not.
    pub fn no_memory(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(Fault::Memory);
    }

    fn check(&self, device: &str) -> Result<()> {
        let mut fault = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match &*fault {
            None => Ok(()),
            Some(Fault::Lost(reason)) => {
                Err(Error::DeviceLost { device: device.to_owned(), reason: reason.clone() })
            }
            Some(Fault::Memory) => {
                *fault = None;
                let (what, size) = ("a transfer to a GPU", Size::default());
                Err(Error::OutOfMemory { what, size, bytes: 0 })
            }
        }
    }
}

/// A pipeline and its interface.
#[derive(Debug)]
pub struct Kernel {
    /// A number of its own, for caches.
    pub id: u64,
    pub pipeline: wgpu::ComputePipeline,
    pub layout: wgpu::BindGroupLayout,
    pub interface: Interface,
    pub label: String,
}

static NEXT_KERNEL: AtomicU64 = AtomicU64::new(0);

type OfLimits = fn(&wgpu::Limits) -> u32;

/// What a device must allow: WebGPU's defaults, or less.
const LEAST: [(&str, u32, OfLimits); 5] = [
    ("storage buffers in one stage", 8, |limits| limits.max_storage_buffers_per_shader_stage),
    ("invocations in one workgroup", 256, |limits| limits.max_compute_invocations_per_workgroup),
    ("invocations along x in one workgroup", 256, |limits| limits.max_compute_workgroup_size_x),
    ("invocations along y in one workgroup", 16, |limits| limits.max_compute_workgroup_size_y),
    ("bytes of memory in one workgroup", 16 << 10, |limits| limits.max_compute_workgroup_storage_size),
];

/// The first of what a device must allow and does not: what, how much is needed, how much is allowed.
pub(crate) fn lacking(limits: &wgpu::Limits) -> Option<(&'static str, u32, u32)> {
    let all = LEAST.iter().map(|&(what, needed, of)| (what, needed, of(limits)));
    all.into_iter().find(|&(_, needed, allowed)| allowed < needed)
}

impl Context {
    /// Whether a device with these limits has what the blur needs, which WebGPU's defaults do. [`Context::check_limits`] says
    /// what is missing.
    pub fn is_usable(limits: &wgpu::Limits) -> bool {
        lacking(limits).is_none()
    }

    /// Takes the caller's device and queue.
    ///
    /// The device must allow compute shaders with 8 storage buffers; workgroups of 256 invocations and 16 KiB
    /// (WebGPU's defaults) are enough for lines of 8192 pixels, larger ones are used where there are. With less
    /// ([`Context::is_usable`]) there are no [`crate::Buffers`]. Large pictures need
    /// large bindings: request the adapter's `max_storage_buffer_binding_size` and `max_buffer_size`.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        // A processor has no registers to win by it, and compiles for long.
        let unrolls = device.adapter_info().device_type != wgpu::DeviceType::Cpu;
        Self::with_loops(device, queue, unrolls)
    }

    /// The same, with loops over what a thread has in registers written out or not; for tests.
    #[doc(hidden)]
    pub fn with_loops(device: &wgpu::Device, queue: &wgpu::Queue, unrolls: bool) -> Self {
        Self {
            inner: Arc::new(Inner {
                device: device.clone(),
                queue: queue.clone(),
                name: device.adapter_info().name,
                limits: device.limits(),
                unrolls,
                kernels: Mutex::default(),
                render_kernels: Mutex::default(),
                faults: Faults::default(),
            }),
        }
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.inner.device
    }

    /// The queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.inner.queue
    }

    /// The device's name, for messages.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// The device's limits.
    pub fn limits(&self) -> &wgpu::Limits {
        &self.inner.limits
    }

    /// Refuses a device that does not have what the blur needs.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] with the first limit that is too small.
    pub fn check_limits(&self) -> Result<()> {
        let Some((what, needed, allowed)) = lacking(self.limits()) else { return Ok(()) };
        Err(Error::DeviceLimit {
            device: self.name().to_owned(),
            what,
            needed: needed.into(),
            allowed: allowed.into(),
            instead: "request a device with WebGPU's default limits, or render on the processor",
        })
    }

    /// What an engine calls, with the reason, from its own device-lost callback: every later recording is then
    /// [`Error::DeviceLost`]. It does not keep the device alive, so the device may own it.
    pub fn when_lost(&self) -> impl Fn(String) + Send + Sync + 'static {
        let faults = self.faults();
        move |reason| faults.lost(reason)
    }

    /// Where a host's callbacks leave what they hear; it does not keep the device alive.
    pub(crate) fn faults(&self) -> Faults {
        self.inner.faults.clone()
    }

    /// # Errors
    /// [`Error::DeviceLost`] once the device is known to be lost; [`Error::OutOfMemory`] once, after it had no memory for
    /// a transfer.
    pub fn check(&self) -> Result<()> {
        self.inner.faults.check(self.name())
    }

    /// How many pipelines there are.
    pub fn pipelines(&self) -> usize {
        self.inner.kernels.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// What all pipelines so far are made of.
    #[cfg(test)]
    pub(crate) fn specs(&self) -> Vec<Spec> {
        let kernels = self.inner.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        let render_kernels = self.inner.render_kernels.lock().unwrap_or_else(PoisonError::into_inner);
        kernels.keys().chain(render_kernels.keys().map(|(spec, _)| spec)).cloned().collect()
    }

    /// The kernel of `spec`, whose uniform is a `U`; compiled if it is new.
    ///
    /// # Panics
    /// If a shader of this crate does not compile, or lies otherwise in memory than `U`: tests walk all of them.
    pub(crate) fn kernel<U: Uniform>(&self, spec: &Spec) -> Arc<Kernel> {
        let mut kernels = self.inner.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = kernels.get(spec) {
            return kernel.clone();
        }
        let kernel = Arc::new(self.compile::<U>(spec));
        kernels.insert(spec.clone(), kernel.clone());
        kernel
    }

    /// The render pipeline of `key`, made by `make` if it is new.
    pub(crate) fn render_kernel(
        &self,
        key: (Spec, wgpu::TextureFormat),
        make: impl FnOnce(&(Spec, wgpu::TextureFormat)) -> RenderKernel,
    ) -> Arc<RenderKernel> {
        let mut kernels = self.inner.render_kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = kernels.get(&key) {
            return kernel.clone();
        }
        let kernel = Arc::new(make(&key));
        kernels.insert(key, kernel.clone());
        kernel
    }

    fn compile<U: Uniform>(&self, spec: &Spec) -> Kernel {
        let label = spec.label();
        let source = if self.inner.unrolls { spec.unrolled() } else { spec.source() };
        let interface = shader::interface(&source).unwrap_or_else(|error| panic!("{label}: {error}"));
        if let Err(error) = shader::same_layout::<U>(&interface) {
            panic!("{label}: {error}");
        }
        let device = self.device();
        let module = trusted(device, &label, source);
        let layout = layout(device, &label, &interface, wgpu::ShaderStages::COMPUTE);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(&label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(&label),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions {
                zero_initialize_workgroup_memory: false,
                ..Default::default()
            },
            cache: None,
        });
        tracing::debug!(label, workgroup_bytes = interface.workgroup_bytes, "compiled");
        let id = NEXT_KERNEL.fetch_add(1, Ordering::Relaxed);
        Kernel { id, pipeline, layout, interface, label }
    }
}

/// A module of this crate. Without debug assertions no bounds are checked and no loops counted: every index is guarded in
/// the shaders themselves and every loop ends, which builds with the checks (all tests) show.
pub(crate) fn trusted(device: &wgpu::Device, label: &str, source: String) -> wgpu::ShaderModule {
    let descriptor =
        wgpu::ShaderModuleDescriptor { label: Some(label), source: wgpu::ShaderSource::Wgsl(source.into()) };
    if cfg!(debug_assertions) {
        return device.create_shader_module(descriptor);
    }
    // SAFETY: see above; the text is this crate's own and depends on no input.
    unsafe { device.create_shader_module_trusted(descriptor, wgpu::ShaderRuntimeChecks::unchecked()) }
}

/// The layout of a shader's bindings.
pub(crate) fn layout(
    device: &wgpu::Device,
    label: &str,
    interface: &Interface,
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = interface
        .slots
        .iter()
        .map(|&(binding, slot)| {
            let ty = match slot {
                Slot::Uniform { size } => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: true,
                    min_binding_size: wgpu::BufferSize::new(size),
                },
                Slot::Storage { read_only } => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                Slot::Texture => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                Slot::DepthTexture => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
            };
            wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}
