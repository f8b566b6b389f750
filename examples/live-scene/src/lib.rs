//! A scene that is rendered every frame, and depth of field on it: how `pullfocus-gpu` is embedded into a renderer. In the manner
//! of Beck-Norén, Valter, Kinner, *Depth of Field by Simulated Heat Diffusion* (2012), whose program renders the scene, and what is
//! near once more on its own, with OpenGL.
//!
//! - [`blur`] is what an engine has to do; read that.
//! - [`Live`] is a small forward renderer, as an engine has one: colour, depth, and near objects in textures of their own; [`draw`] is
//!   what it is made of.
//! - [`camera`] is an orbit and a lens, [`scene`] reads glTF; the program's `main.rs` is the window.

pub mod blur;
pub mod camera;
pub mod draw;
pub mod scene;

use anyhow::{Context as _, Result};
use camera::Shot;
use draw::{begin, group, pipeline};
use glam::Mat4;
use pullfocus_core::{DepthDecoding, Size};
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};
use wgpu::{BufferUsages, Color, LoadOp, TextureView};

/// A scene on a device, for pictures of one size at a time.
pub struct Live {
    /// The device.
    pub device: wgpu::Device,
    /// What is drawn.
    pub scene: scene::Scene,
    queue: wgpu::Queue,
    size: Size,
    /// What it is drawn into.
    pub targets: draw::Targets,
    blur: blur::DepthOfField,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    view: wgpu::Buffer,
    group: wgpu::BindGroup,
    surface: wgpu::RenderPipeline,
    nearest: wgpu::RenderPipeline,
    tone: wgpu::RenderPipeline,
}

impl Live {
    /// The shipped scene, which `scene/make.py` makes, for pictures of `size`. One binding holds the highlights of
    /// a picture, 16 bytes a pixel: a device with WebGPU's default limits, 128 MiB, ends at 8.3 million pixels (without highlights, by the
    /// aperture, at 12.6 million); the adapter's own may be more. A frame of a larger picture is an error with both numbers.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: Size) -> Result<Self> {
        let scene = scene::Scene::from_glb(include_bytes!("../scene/chess.glb"))?;
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let looks: Vec<_> = scene.objects.iter().map(|object| object.look).collect();
        let objects = buffer(bytemuck::cast_slice(&looks), BufferUsages::STORAGE);
        let view = buffer(&[0; size_of::<[Mat4; 2]>()], BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let solid = device.create_shader_module(wgpu::include_wgsl!("scene.wgsl"));
        let screen = device.create_shader_module(wgpu::include_wgsl!("screen.wgsl"));
        let surface = pipeline(device, &solid, "surface", draw::COLOR, true);
        Ok(Self {
            device: device.clone(),
            queue: queue.clone(),
            size,
            targets: draw::Targets::new(device, size),
            blur: blur::DepthOfField::new(device, queue, size)?,
            vertices: buffer(bytemuck::cast_slice(&scene.vertices), BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&scene.indices), BufferUsages::INDEX),
            scene,
            group: group(device, &surface, [view.as_entire_binding(), objects.as_entire_binding()]),
            view,
            surface,
            nearest: pipeline(device, &screen, "nearest", draw::DEPTH, false),
            tone: pipeline(device, &screen, "tone", draw::SHOWN, false),
        })
    }

    /// One frame: draws, blurs, tone maps; submits, and does not wait. `size` may be another one each time.
    pub fn frame(&mut self, shot: &Shot, size: Size) -> Result<()> {
        if size != self.size {
            self.blur.resize(size)?;
            (self.targets, self.size) = (draw::Targets::new(&self.device, size), size);
        }
        let (camera, view) = (shot.camera()?, shot.view());
        let projection = shot.projection(size) * view;
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&[projection, view.inverse()]));
        let is_near = |scene::Object { sphere: (centre, radius), .. }: &scene::Object| {
            let back = radius - view.transform_point3(*centre).z;
            shot.blur && shot.foreground && blur::is_foreground(&camera, size, back)
        };
        let near: Vec<bool> = self.scene.objects.iter().map(is_near).collect();

        let (targets, mut encoder) = (&self.targets, self.device.create_command_encoder(&Default::default()));
        let dusk = Color { r: 0.30, g: 0.26, b: 0.30, a: 1.0 };
        // Near objects go on with the others' depth, so that they are hidden where something is nearer still.
        for (which, layer, sky, depth) in [
            (false, &targets.base, dusk, LoadOp::Clear(0.0)),
            (true, &targets.near, Color::TRANSPARENT, LoadOp::Load),
        ] {
            let color = (&targets.color_samples, Some(&layer.color), sky);
            let mut pass = begin(&mut encoder, color, Some((&targets.depth_samples, depth)));
            pass.set_pipeline(&self.surface);
            pass.set_bind_group(0, &self.group, &[]);
            pass.set_vertex_buffer(0, self.vertices.slice(..));
            pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (i, object) in (0..).zip(&self.scene.objects).filter(|(i, _)| near[*i as usize] == which) {
                pass.draw_indexed(object.indices.clone(), 0, i..i + 1);
            }
            drop(pass);
            self.screen(&mut encoder, &self.nearest, &targets.depth_samples, &layer.depth);
        }
        if shot.blur {
            self.blur.record(&mut encoder, targets, (&camera, shot.look), near.contains(&true))?;
        }
        let light = if shot.blur { &targets.output } else { &targets.base.color };
        self.screen(&mut encoder, &self.tone, light, &targets.shown);
        self.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// One picture from another.
    fn screen(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        from: &TextureView,
        to: &TextureView,
    ) {
        let group = group(&self.device, pipeline, [wgpu::BindingResource::TextureView(from)]);
        let mut pass = begin(encoder, (to, None, Color::BLACK), None);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// How far away, along the camera's axis, what the last frame shows at this pixel is; infinity where nothing is. Waits for the
    /// device: a click may, a focus that follows something each frame would ask for the answer one frame later.
    pub fn distance_at(&self, x: usize, y: usize) -> Result<f64> {
        let [x, y] = [x.min(self.size.width - 1), y.min(self.size.height - 1)].map(|at| at as u32);
        let bytes = self.read(&self.targets.near.depth, [x, y], wgpu::Extent3d::default())?;
        let depth = bytemuck::pod_read_unaligned(&bytes);
        Ok(DepthDecoding::hardware(0.0, f64::from(camera::NEAR)).to_metres(depth, || [0.0, 0.0]))
    }

    /// The last frame.
    pub fn picture(&self) -> Result<image::RgbImage> {
        let extent = self.targets.shown.texture().size();
        let bytes = self.read(&self.targets.shown, [0, 0], extent)?;
        let picture = image::RgbaImage::from_raw(extent.width, extent.height, bytes);
        Ok(image::DynamicImage::from(picture.context("rows are missing")?).into_rgb8())
    }

    /// A part of a texture of four bytes a texel.
    fn read(&self, from: &TextureView, [x, y]: [u32; 2], extent: wgpu::Extent3d) -> Result<Vec<u8>> {
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
