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

use anyhow::{Context as _, Result};
use camera::Shot;
use pullfocus_core::{DepthDecoding, Size};

/// A scene on a device, for pictures of one size at a time.
pub struct Live {
    /// The device.
    pub device: wgpu::Device,
    /// What is drawn.
    pub scene: scene::Scene,
    queue: wgpu::Queue,
    size: Size,
    renderer: draw::Renderer,
    targets: draw::Targets,
    blur: blur::DepthOfField,
}

impl Live {
    /// The shipped scene, which `scene/make.py` makes, for pictures of `size`. One binding holds four planes of a picture: a device with
    /// WebGPU's default limits, 128 MiB, ends at 16 million pixels; the adapter's own may be more.
    ///
    /// # Errors
    /// A device whose bindings are too small for the picture.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: Size) -> Result<Self> {
        let scene = scene::Scene::from_glb(include_bytes!("../scene/chess.glb"))?;
        let renderer = draw::Renderer::new(device, &scene);
        let targets = draw::Targets::new(device, size);
        let blur = blur::DepthOfField::new(device, queue, size)?;
        Ok(Self { device: device.clone(), scene, queue: queue.clone(), size, renderer, targets, blur })
    }

    /// One frame: draws, blurs, tone maps; submits, and does not wait. `size` may be another one each time.
    ///
    /// # Errors
    /// A lost device, or bindings that are too small; a focus distance within the focal length.
    pub fn frame(&mut self, shot: &Shot, size: Size) -> Result<&wgpu::TextureView> {
        if size != self.size {
            self.blur.resize(size)?;
            (self.targets, self.size) = (draw::Targets::new(&self.device, size), size);
        }
        let Self { scene, renderer, targets, .. } = self;
        let (camera, view) = (shot.camera()?, shot.view());
        renderer.set_view(&self.queue, shot.projection(size), view);
        let is_near = |object: &scene::Object| {
            let (centre, radius) = object.sphere;
            let back = radius - view.transform_point3(centre).z;
            shot.blur && shot.foreground && blur::is_foreground(&camera, size, back)
        };
        let near: Vec<bool> = scene.objects.iter().map(is_near).collect();

        let mut encoder = self.device.create_command_encoder(&Default::default());
        renderer.draw(&mut encoder, targets, scene, &near);
        if shot.blur {
            self.blur.record(&mut encoder, targets, (&camera, shot.look), near.contains(&true))?;
        }
        renderer.tone_map(&mut encoder, targets, shot.blur);
        self.queue.submit([encoder.finish()]);
        Ok(&targets.shown)
    }

    /// How far away, along the camera's axis, what the last frame shows at this pixel is; infinity where nothing is. Waits for the
    /// device: a click may, a focus that follows something each frame would ask for the answer one frame later.
    ///
    /// # Errors
    /// A lost device.
    pub fn distance_at(&self, x: usize, y: usize) -> Result<f64> {
        let (x, y) = (x.min(self.size.width - 1) as u32, y.min(self.size.height - 1) as u32);
        let bytes = self.read(&self.targets.near.depth, (x, y), wgpu::Extent3d::default())?;
        let depth = bytemuck::pod_read_unaligned(&bytes);
        Ok(DepthDecoding::hardware(0.0, f64::from(camera::NEAR)).to_metres(depth, || [0.0, 0.0]))
    }

    /// The last frame.
    ///
    /// # Errors
    /// A lost device.
    pub fn picture(&self) -> Result<image::RgbImage> {
        let extent = self.targets.shown.texture().size();
        let bytes = self.read(&self.targets.shown, (0, 0), extent)?;
        let picture = image::RgbaImage::from_raw(extent.width, extent.height, bytes);
        Ok(image::DynamicImage::from(picture.context("rows are missing")?).into_rgb8())
    }

    /// A part of a texture of four bytes a texel.
    fn read(&self, from: &wgpu::TextureView, (x, y): (u32, u32), extent: wgpu::Extent3d) -> Result<Vec<u8>> {
        let row = (4 * extent.width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * extent.height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let origin = wgpu::Origin3d { x, y, z: 0 };
        let from = wgpu::TexelCopyTextureInfo { origin, ..from.texture().as_image_copy() };
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row: Some(row), ..Default::default() };
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(from, wgpu::TexelCopyBufferInfo { buffer: &buffer, layout }, extent);
        self.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely()).context("the GPU does not answer")?;
        let mapped = buffer.get_mapped_range(..).context("the GPU gave no answer")?;
        Ok(mapped.chunks(row as usize).flat_map(|row| &row[..4 * extent.width as usize]).copied().collect())
    }
}
