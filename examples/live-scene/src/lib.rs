//! A scene that is rendered every frame, and depth of field on it: how `pullfocus-gpu` is embedded into a renderer. In the manner
//! of Beck-Norén, Valter, Kinner, *Depth of Field by Simulated Heat Diffusion* (2012), whose program renders the scene, and what is
//! near once more on its own, with OpenGL.
//!
//! - [`blur`] is what an engine has to do; read that.
//! - [`draw`] is a small renderer, as an engine has one: colour, depth, and near objects in textures of their own.
//! - [`camera`] is an orbit and a lens, [`scene`] reads glTF; the program's `main.rs` is the window.

pub mod blur;
pub mod camera;
pub mod draw;
pub mod scene;

use anyhow::{Context as _, Result, bail};
use blur::{DepthOfField, is_foreground};
use camera::{NEAR, Shot};
use draw::{Part, Renderer, Targets};
use pullfocus_core::{DepthDecoding, Size};
use scene::Scene;

/// A scene on a device, for pictures of one size at a time.
pub struct Live {
    /// The device.
    pub device: wgpu::Device,
    /// What is drawn.
    pub scene: Scene,
    queue: wgpu::Queue,
    renderer: Renderer,
    targets: Targets,
    blur: DepthOfField,
    /// Whether the last frame had a foreground.
    foreground: bool,
}

impl Live {
    /// The shipped scene on `adapter`, for pictures of `size` and, in the end, of `format`, which must be an sRGB one.
    ///
    /// # Errors
    /// A device that does not open or whose bindings are too small for the picture.
    pub fn new(adapter: &wgpu::Adapter, size: Size, format: wgpu::TextureFormat) -> Result<Self> {
        let descriptor = wgpu::DeviceDescriptor {
            // One binding holds four planes of the picture: WebGPU's default, 128 MiB, ends at 16 million pixels.
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .with_context(|| format!("{} cannot be opened", adapter.get_info().name))?;
        let scene = Scene::from_glb(scene::CHESS)?;
        let renderer = Renderer::new(&device, &queue, &scene, format);
        let targets = Targets::new(&device, size);
        let blur = DepthOfField::new(&device, &queue, size)?;
        Ok(Self { device, scene, queue, renderer, targets, blur, foreground: false })
    }

    /// Goes over to pictures of another size.
    ///
    /// # Errors
    /// Bindings that are too small for it.
    pub fn resize(&mut self, size: Size) -> Result<()> {
        if size != self.targets.size {
            self.targets = Targets::new(&self.device, size);
            self.blur.resize(size)?;
        }
        Ok(())
    }

    /// One frame: draws, blurs, tone maps into `to`; submits, and does not wait.
    ///
    /// # Errors
    /// A lost device.
    pub fn frame(&mut self, shot: &Shot, to: &wgpu::TextureView) -> Result<()> {
        let size = self.targets.size;
        let view = shot.orbit.view();
        self.renderer.set_view(shot.projection(size) * view, shot.orbit.eye());

        let in_front = is_foreground(shot, size)?;
        let split = shot.blur && shot.foreground;
        let near: Vec<bool> = (self.scene.objects.iter())
            .map(|object| split && in_front(object.radius - view.transform_point3(object.centre).z))
            .collect();
        self.foreground = near.contains(&true);

        let mut encoder = self.device.create_command_encoder(&Default::default());
        self.renderer.draw(&mut encoder, (&self.targets, Part::Base), &self.scene, |i| !near[i]);
        if self.foreground {
            self.renderer.draw(&mut encoder, (&self.targets, Part::Near), &self.scene, |i| near[i]);
        }
        let mut light = &self.targets.base.color;
        if shot.blur {
            self.blur.record(&mut encoder, &self.targets, shot, self.foreground)?;
            light = &self.targets.output;
        }
        self.renderer.tone_map(&mut encoder, light, to);
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// How far away, along the camera's axis, what the last frame shows at this pixel is; infinity where nothing is. Waits for the
    /// device: a click may, a focus that follows something each frame would ask for the answer one frame later.
    ///
    /// # Errors
    /// A lost device.
    pub fn distance_at(&self, x: usize, y: usize) -> Result<f64> {
        // The near part's depth goes on from the base's, so it has both.
        let layer = if self.foreground { &self.targets.near } else { &self.targets.base };
        let Size { width, height } = self.targets.size;
        let (x, y) = (x.min(width - 1) as u32, y.min(height - 1) as u32);
        let mut texel = layer.depth.texture.as_image_copy();
        texel.origin = wgpu::Origin3d { x, y, z: 0 };
        let bytes = self.read(texel, wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 })?;
        let value = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        Ok(DepthDecoding::hardware(0.0, f64::from(NEAR)).to_metres(value, || [0.0, 0.0]))
    }

    /// Shows a frame.
    pub fn present(&self, texture: wgpu::SurfaceTexture) {
        self.queue.present(texture);
    }

    /// Waits until all that was submitted is done.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait(&self) -> Result<()> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).context("the GPU does not answer")?;
        Ok(())
    }

    /// A part of a texture of four bytes a texel; its rows lie 256 bytes, or a multiple of that, apart.
    fn read(&self, from: wgpu::TexelCopyTextureInfo<'_>, extent: wgpu::Extent3d) -> Result<Vec<u8>> {
        let row = (4 * extent.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * extent.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer: &buffer, layout }, extent);
        self.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.wait()?;
        Ok(buffer.get_mapped_range(..).context("the GPU gave no answer")?.to_vec())
    }
}

/// Pictures without a window.
pub struct Studio {
    /// The scene; its format is [`Studio::FORMAT`].
    pub live: Live,
    target: wgpu::Texture,
}

impl Studio {
    /// What pictures are.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

    /// The shipped scene on `adapter`.
    ///
    /// # Errors
    /// As [`Live::new`].
    pub fn new(adapter: &wgpu::Adapter, size: Size) -> Result<Self> {
        let live = Live::new(adapter, size, Self::FORMAT)?;
        let (width, height) = (size.width as u32, size.height as u32);
        let target = live.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: Self::FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        Ok(Self { live, target })
    }

    /// Renders a frame and waits for it.
    ///
    /// # Errors
    /// As [`Live::frame`].
    pub fn frame(&mut self, shot: &Shot) -> Result<()> {
        self.live.frame(shot, &self.target.create_view(&Default::default()))?;
        self.live.wait()
    }

    /// The last frame.
    ///
    /// # Errors
    /// A lost device.
    pub fn picture(&self) -> Result<image::RgbImage> {
        let size = self.target.size();
        let bytes = self.live.read(self.target.as_image_copy(), size)?;
        let row = bytes.len() / size.height as usize;
        Ok(image::RgbImage::from_fn(size.width, size.height, |x, y| {
            let at = y as usize * row + 4 * x as usize;
            image::Rgb([bytes[at], bytes[at + 1], bytes[at + 2]])
        }))
    }
}

/// An instance of the platform's own interfaces: Vulkan, Metal, Direct3D 12.
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    // Validation layers, where they are installed; without names in shaders, which older layers refuse.
    descriptor.flags =
        if cfg!(debug_assertions) { wgpu::InstanceFlags::VALIDATION } else { wgpu::InstanceFlags::empty() };
    wgpu::Instance::new(descriptor)
}

/// The best adapter, or the one whose name contains `name`. A software one must be asked for by name, or `software` be true; for a
/// window it must be able to draw on its `surface`.
///
/// # Errors
/// No such adapter; the message says which there are.
pub fn adapter(
    instance: &wgpu::Instance,
    (name, software): (Option<&str>, bool),
    surface: Option<&wgpu::Surface<'_>>,
) -> Result<wgpu::Adapter> {
    use wgpu::DeviceType::{Cpu, DiscreteGpu, IntegratedGpu, Other, VirtualGpu};
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    all.retain(|adapter| surface.is_none_or(|surface| adapter.is_surface_supported(surface)));
    let order = [DiscreteGpu, IntegratedGpu, VirtualGpu, Other, Cpu];
    all.sort_by_key(|adapter| order.iter().position(|kind| *kind == adapter.get_info().device_type));
    let names: Vec<String> = all.iter().map(|adapter| adapter.get_info().name).collect();
    let found = all.into_iter().find(|adapter| {
        let info = adapter.get_info();
        match name {
            Some(name) => info.name.to_lowercase().contains(&name.to_lowercase()),
            None => software || info.device_type != Cpu,
        }
    });
    let there = names.join(", ");
    match (found, name) {
        (Some(adapter), _) => Ok(adapter),
        (None, _) if names.is_empty() => {
            bail!("this machine has no graphics adapter; install a driver for Vulkan")
        }
        (None, Some(name)) => bail!("no graphics adapter is called {name}; there is: {there}"),
        (None, None) => bail!("no GPU was found; a software one must be asked for, with --device: {there}"),
    }
}
