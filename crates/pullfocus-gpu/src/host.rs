//! One call for programs without a device of their own: opens one, brings a scene there and back.

use crate::bokeh;
use crate::coc::{Circles, Meaning, Place, Source, circles, count_blended_edges, decode_range, repair};
use crate::context::{self, Context};
use crate::diffusion::{self, Conductivity, How, Medium, Tuning};
use crate::memory::Memory;
use crate::pipeline::{self, Element, Near, layout};
use crate::planes::{Storage, groups};
use crate::recorder::{Recorder, Sink, wait};
use crate::spreading;
use crate::timer::Timer;
use crate::transfer::{download, place, upload, upload_plane};
use crate::work::Work;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::{
    Camera, Cancel, Diffusion, Distance, Error, Frame, Layering, Plane, Report, Result, Scene, Settings, Size,
};
use std::time::{Duration, Instant};

/// What kind of device an adapter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdapterKind {
    /// A card with memory of its own.
    Discrete,
    /// A GPU that shares the processor's memory.
    Integrated,
    /// A virtual machine's GPU.
    Virtual,
    /// The processor, by a software driver: no GPU unless it is asked for by name.
    Processor,
    /// The driver does not say.
    Other,
}

/// An adapter, as people know it.
#[derive(Debug, Clone, PartialEq)]
pub struct AdapterInfo {
    /// The device's name.
    pub name: String,
    /// What kind of device it is.
    pub kind: AdapterKind,
    /// The programming interface: "Vulkan", "Metal", "Dx12".
    pub backend: String,
    /// The driver and its version, as far as it says.
    pub driver: String,
    /// The most bytes in one binding: a group of up to four planes of a picture must fit.
    pub largest_binding: u64,
    /// Why it cannot be used, if it cannot.
    pub unusable: Option<String>,
}

/// Which adapter to open.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Choice {
    /// The best real GPU: discrete, then integrated, virtual, other. A software driver is none.
    #[default]
    Best,
    /// The first whose name contains this, without regard to case; a software driver too.
    Named(String),
}

/// An instance with the backends of this platform.
fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    // Validation layers, where they are installed; without names and sources in shaders, which older layers refuse.
    let checked =
        if cfg!(debug_assertions) { wgpu::InstanceFlags::VALIDATION } else { wgpu::InstanceFlags::empty() };
    descriptor.flags = checked.with_env();
    wgpu::Instance::new(descriptor)
}

impl AdapterInfo {
    fn of(adapter: &wgpu::Adapter) -> Self {
        let capabilities = adapter.get_downlevel_capabilities();
        let computes = capabilities.flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS);
        Self::new(adapter.get_info(), &adapter.limits(), computes)
    }

    fn of_device(device: &wgpu::Device) -> Self {
        Self::new(device.adapter_info(), &device.limits(), true)
    }

    fn new(info: wgpu::AdapterInfo, limits: &wgpu::Limits, computes: bool) -> Self {
        let unusable = match context::lacking(limits) {
            _ if !computes => Some("it has no compute shaders".to_owned()),
            Some((what, needed, allowed)) => {
                Some(format!("it allows {allowed} {what}, and {needed} are needed"))
            }
            None => None,
        };
        Self {
            name: info.name,
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
                wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
                wgpu::DeviceType::VirtualGpu => AdapterKind::Virtual,
                wgpu::DeviceType::Cpu => AdapterKind::Processor,
                wgpu::DeviceType::Other => AdapterKind::Other,
            },
            backend: format!("{:?}", info.backend),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            largest_binding: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            unusable,
        }
    }

    /// Order of preference.
    fn rank(&self) -> u32 {
        let kind = match self.kind {
            AdapterKind::Discrete => 0,
            AdapterKind::Integrated => 1,
            AdapterKind::Virtual => 2,
            AdapterKind::Other => 3,
            AdapterKind::Processor => 4,
        };
        kind + if self.unusable.is_some() { 10 } else { 0 }
    }
}

fn enumerate() -> Vec<(AdapterInfo, wgpu::Adapter)> {
    let adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    let mut all: Vec<_> = adapters.into_iter().map(|adapter| (AdapterInfo::of(&adapter), adapter)).collect();
    all.sort_by_key(|(info, _)| info.rank());
    all
}

/// All adapters of this machine, best first.
pub fn adapters() -> Vec<AdapterInfo> {
    enumerate().into_iter().map(|(info, _)| info).collect()
}

/// A device with its pipelines and buffers, which stay from frame to frame.
#[derive(Debug)]
pub struct Host {
    info: AdapterInfo,
    context: Context,
    memory: Memory,
    storage: Storage,
    tuning: Tuning,
    size: Size,
    timer: Option<Timer>,
}

impl Host {
    /// Opens an adapter, with all of its limits.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with what there is.
    pub fn open(choice: &Choice) -> Result<Self> {
        let all = enumerate();
        let names: Vec<String> = all.iter().map(|(info, _)| info.name.clone()).collect();
        let fits = |info: &AdapterInfo| match choice {
            Choice::Best => info.kind != AdapterKind::Processor && info.unusable.is_none(),
            Choice::Named(name) => info.name.to_lowercase().contains(&name.to_lowercase()),
        };
        let Some((info, adapter)) = all.into_iter().find(|(info, _)| fits(info)) else {
            let there = if names.is_empty() { "there is none".into() } else { names.join(", ") };
            return Err(match choice {
                Choice::Best => Error::NoDevice {
                    wanted: "no GPU was found".into(),
                    found: format!("adapters here: {there}; a software one must be asked for by name"),
                },
                Choice::Named(name) => Error::NoDevice {
                    wanted: format!("no adapter is called {name}"),
                    found: format!("adapters here: {there}"),
                },
            });
        };
        if let Some(reason) = info.unusable {
            return Err(Error::NoDevice { wanted: format!("{} cannot be used", info.name), found: reason });
        }
        let wanted = wgpu::Features::TIMESTAMP_QUERY & adapter.features();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("pullfocus"),
            required_features: wanted,
            required_limits: adapter.limits(),
            memory_hints: wgpu::MemoryHints::Performance,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
            Error::NoDevice { wanted: format!("{} cannot be opened", info.name), found: error.to_string() }
        })?;
        let context = Context::new(&device, &queue);
        let lost = context.when_lost();
        device.set_device_lost_callback(move |_, reason| lost(reason));
        // What is not caught by a scope is a fault of this crate, the end of the device or of its memory; each ends the
        // frame, not the program.
        let faults = context.faults();
        device.on_uncaptured_error(std::sync::Arc::new(move |error: wgpu::Error| {
            tracing::error!(%error, "device");
            match error {
                wgpu::Error::OutOfMemory { .. } => faults.no_memory(),
                error => faults.lost(error.to_string()),
            }
        }));
        Self::with_context(context)
    }

    /// A host on a device that is there already.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] for a device that cannot blur at all ([`Context::is_usable`]); [`Error::OutOfMemory`].
    pub fn with_context(context: Context) -> Result<Self> {
        let memory = Memory::new(&context)?;
        let timer = Timer::new(&context);
        Ok(Self {
            info: AdapterInfo::of_device(context.device()),
            context,
            memory,
            storage: Storage::Full,
            tuning: Tuning::default(),
            size: Size::default(),
            timer,
        })
    }

    /// What was opened.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// The device's context.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// How planes lie in the device's memory from the next frame on.
    pub fn set_storage(&mut self, storage: Storage) {
        self.storage = storage;
    }

    /// How work is cut from the next frame on.
    pub fn set_tuning(&mut self, tuning: Tuning) {
        self.tuning = tuning;
    }

    /// How planes lie in the device's memory.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// How work is cut.
    pub fn tuning(&self) -> Tuning {
        self.tuning
    }

    /// Bytes of device memory held.
    pub fn bytes(&self) -> u64 {
        self.memory.bytes()
    }

    /// The context and the buffers, to record with.
    pub(crate) fn parts(&mut self) -> (&Context, &mut Memory) {
        (&self.context, &mut self.memory)
    }

    /// Diffuses planes in place, through the circle of confusion `circle` (diameters in pixels), with specific heat `gamma`
    /// where it is given; the same as `pullfocus_cpu::diffusion::diffuse`.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn diffuse(
        &mut self,
        planes: &mut [Plane],
        (circle, gamma, vertical_scale): (&Plane, Option<&Plane>, f32),
        settings: &Diffusion,
        cancel: &Cancel,
    ) -> Result<()> {
        settings.check()?;
        let Some(size) = planes.first().map(Plane::size) else { return Ok(()) };
        for plane in planes.iter() {
            plane.expect_size("a plane to diffuse", size)?;
        }
        circle.expect_size("the circle of confusion", size)?;
        if let Some(gamma) = gamma {
            gamma.expect_size("the specific heat", size)?;
        }
        cancel.check()?;
        if size.area() == 0 {
            return Ok(());
        }
        if self.size != size {
            self.memory.clear();
            self.size = size;
        }
        let sink = Sink::Host { encoder: None, cancel, work: 0 };
        let mut recorder = Recorder::new(&self.context, &mut self.memory, sink, None)?;
        let sources: Vec<&Plane> = planes.iter().collect();
        let sizes = groups(sources.len());
        let groups = upload(&mut recorder, size, &sources, &sizes, self.storage, false)?;
        let circle = upload_plane(&mut recorder, circle)?;
        let gamma = gamma.map(|gamma| upload_plane(&mut recorder, gamma)).transpose()?;
        let medium =
            Medium { conductivity: Conductivity::Circle(&circle), gamma: gamma.as_ref(), vertical_scale };
        let all: Vec<_> = groups.iter().collect();
        let how = How { tuning: self.tuning, ..How::default() };
        diffusion::diffuse(&mut recorder, size, &all, &medium, settings, &how)?;
        let values = download(&mut recorder, size, &groups, planes.len())?;
        recorder.give(groups.into_iter().map(|group| group.buffer).chain([circle]).chain(gamma));
        recorder.finish()?;
        place(&values, planes)
    }

    /// Replaces `scene.base.picture` by the picture through the lens; the same as `pullfocus_cpu::Renderer::render`, up to
    /// rounding.
    ///
    /// # Errors
    /// Any [`Error`]; the picture is then as it was.
    pub fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        settings.check()?;
        spreading::check(settings)?;
        scene.check()?;
        cancel.check()?;
        let size = scene.frame.data.size;
        bokeh::check(&self.context, size, settings)?;
        let mut report = Report::default();
        if size.area() == 0 {
            return Ok(report);
        }
        if self.size != size {
            self.memory.clear();
            self.size = size;
        }
        if let Some(timer) = &mut self.timer {
            timer.reset();
        }
        let start = Instant::now();
        let sink = Sink::Host { encoder: None, cancel, work: 0 };
        let mut recorder = Recorder::new(&self.context, &mut self.memory, sink, self.timer.as_mut())?;
        recorder.stage("load");
        let camera = (&scene.frame, camera, settings);
        let below = if scene.foreground.is_some() { Place::Behind } else { Place::Alone };
        let base = Resident::new(&mut recorder, &scene.base, camera, self.storage, below)?;
        let near = match &scene.foreground {
            Some(element) => Some(Resident::new(&mut recorder, element, camera, self.storage, Place::Front)?),
            None => None,
        };
        report.add("upload", start.elapsed());

        let start = Instant::now();
        let range = base.range.clone();
        let mut work = Work::new(&mut recorder, &scene.frame, settings, self.storage, self.tuning, range);
        work.look_for_lights(&scene.frame, settings)?;
        let found = work.look.as_ref().map(|look| look.total.clone());
        let over = near.as_ref().zip(base.lens.as_ref());
        let over = over.map(|(near, behind)| Near { element: &near.element, behind, curve: &near.curve });
        pipeline::render(&mut work, &base.element, over.as_ref(), settings)?;
        recorder.flush()?;
        report.add("blur", start.elapsed());

        let start = Instant::now();
        if let Some(found) = found {
            let bytes = recorder.read(&found, 4)?;
            report.highlights = Some(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) as usize);
            recorder.give([found]);
        }
        report.coc_range = base.coc_range(&mut recorder)?;
        let in_focus = report.coc_range == [0.0, 0.0];
        report.blended_depth_edges = base.blended_edges(&mut recorder)?;
        if let Some(near) = &near {
            let lens = near.coc_range(&mut recorder)?;
            let [low, high] = lens.map(|c| near.curve.shape(f64::from(c)));
            report.coc_range = [report.coc_range[0].min(low), report.coc_range[1].max(high)];
            if report.blended_depth_edges.is_none() {
                report.blended_depth_edges = near.blended_edges(&mut recorder)?;
            }
        }
        report.layers = usize::from(near.is_some())
            + match settings.layering {
                Layering::Single => 1,
                Layering::Background { layers, .. } => 1 + layers as usize,
                // All in focus: the picture itself.
                Layering::General { .. } if in_focus => 1,
                Layering::General { .. } => base.layers_found(&mut recorder)?,
            };
        let values = download(&mut recorder, size, &base.element.groups, base.element.planes)?;
        base.give_back(&mut recorder);
        if let Some(near) = near {
            near.give_back(&mut recorder);
        }
        recorder.finish()?;
        report.add("download", start.elapsed());
        if let Some(timer) = &self.timer {
            // The device's own clock says where the time went.
            let times = timer.read(&self.context)?;
            if times.whole && !times.stages.is_empty() {
                report.stages.retain(|stage| stage.name != "blur");
                for (name, time) in times.stages {
                    report.add(name, time);
                }
            }
        }
        // Only now, when nothing can fail any more but memory.
        place(&values, scene.base.picture.planes_mut())?;
        Ok(report)
    }
}

/// An element of a scene on the device.
struct Resident {
    element: Element,
    curve: CocCurve,
    range: wgpu::Buffer,
    /// Its circles as the lens alone makes them, where a foreground lies over it.
    lens: Option<wgpu::Buffer>,
    /// Clean and blended depth edges, where there is depth.
    edges: Option<wgpu::Buffer>,
}

impl Resident {
    fn new(
        recorder: &mut Recorder<'_>,
        element: &pullfocus_core::Element,
        camera: (&Frame, Option<&Camera>, &Settings),
        storage: Storage,
        place: Place,
    ) -> Result<Self> {
        let size = camera.0.data.size;
        let planes: Vec<&Plane> = element.picture.planes().collect();
        let groups = upload(recorder, size, &planes, &layout(planes.len()), storage, true)?;
        recorder.stage("circle of confusion");
        let source = upload_plane(recorder, element.distance.plane())?;
        let mut edges = None;
        let circles = match &element.distance {
            Distance::Coc(_) => circles(recorder, camera, &Meaning::Coc, Source::Plane(&source), place)?,
            Distance::Depth { decoding, .. } => {
                let counts = recorder.take(size, 8)?;
                count_blended_edges(recorder, size, &source, decoding, &counts)?;
                edges = Some(counts);
                let meaning = Meaning::Depth(*decoding);
                if camera.2.repair_depth {
                    let mended = repair(recorder, size, &source, decoding)?;
                    let circles = circles(recorder, camera, &meaning, Source::Plane(&mended), place)?;
                    recorder.give([mended]);
                    circles
                } else {
                    circles(recorder, camera, &meaning, Source::Plane(&source), place)?
                }
            }
        };
        // Later uploads are written before what is recorded here has run.
        recorder.flush()?;
        recorder.give([source]);
        let Circles { curve, coc, range, lens } = circles;
        let element = Element { groups, colors: element.picture.colors.len(), planes: planes.len(), coc };
        Ok(Self { element, curve, range, lens, edges })
    }

    fn coc_range(&self, recorder: &mut Recorder<'_>) -> Result<[f32; 2]> {
        Ok(decode_range(&recorder.read(&self.range, 8)?))
    }

    fn layers_found(&self, recorder: &mut Recorder<'_>) -> Result<usize> {
        let bytes = recorder.read(&self.range, 12)?;
        Ok(u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]) as usize)
    }

    fn blended_edges(&self, recorder: &mut Recorder<'_>) -> Result<Option<f32>> {
        let Some(counts) = &self.edges else { return Ok(None) };
        let bytes = recorder.read(counts, 8)?;
        let count = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
        let (clean, blended) = (count(0), count(4));
        let edges = clean + blended;
        Ok((edges > 0).then(|| blended as f32 / edges as f32))
    }

    fn give_back(self, recorder: &mut Recorder<'_>) {
        let groups = self.element.groups.into_iter().map(|group| group.buffer);
        recorder.give(groups.chain([self.element.coc, self.range]).chain(self.lens).chain(self.edges));
    }
}

/// How long an answer that is on its way is waited for, how often.
const ANSWER: Duration = Duration::from_millis(20);
const MOST_TRIES: u32 = 500;

/// Maps a readable buffer and copies what is in it; waits for the device.
///
/// # Errors
/// [`Error::DeviceLost`].
pub(crate) fn read_buffer(context: &Context, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>> {
    let slice = buffer.slice(..bytes);
    let (sender, receiver) = std::sync::mpsc::channel();
    slice.map_async(wgpu::MapMode::Read, move |result| {
        let _ = sender.send(result);
    });
    wait(context)?;
    let lost = |reason: String| Error::DeviceLost { device: context.name().to_owned(), reason };
    // The answer may come by way of another thread that waits for the same device.
    let mut tries = 0;
    let answer = loop {
        match receiver.recv_timeout(ANSWER) {
            Ok(answer) => break answer,
            Err(_) if tries < MOST_TRIES => wait(context)?,
            Err(_) => return Err(lost("it did not answer".into())),
        }
        tries += 1;
    };
    answer.map_err(|error| lost(error.to_string()))?;
    let bytes = slice.get_mapped_range().map_err(|error| lost(error.to_string()))?.to_vec();
    buffer.unmap();
    Ok(bytes)
}
