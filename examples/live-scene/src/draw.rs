//! A small forward renderer, as an engine has one: the scene with four samples a pixel, then tone mapping.

use crate::scene::{Look, Scene, Vertex};
use glam::Mat4;
use pullfocus_core::Size;
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};
use wgpu::{BufferUsages, Color, LoadOp, TextureFormat as Format, TextureUsages as Use, TextureView};

const COLOR: Format = Format::Rgba16Float;
const DEPTH: Format = Format::Depth32Float;
const SHOWN: Format = Format::Rgba8Unorm;
const SAMPLES: u32 = 4;

/// A picture with depth, one sample a pixel: what the blur reads.
pub struct Layer {
    /// Linear light, premultiplied.
    pub color: TextureView,
    /// The depth buffer's numbers.
    pub depth: TextureView,
}

/// All textures of one size.
pub struct Targets {
    /// The scene, or with a foreground the rest of it.
    pub base: Layer,
    /// Near objects on their own; its depth is the whole scene's.
    pub near: Layer,
    /// The picture through the lens.
    pub output: TextureView,
    /// What is shown: sRGB.
    pub shown: TextureView,
    color_samples: TextureView,
    depth_samples: TextureView,
}

impl Targets {
    /// Makes them.
    pub fn new(device: &wgpu::Device, size: Size) -> Self {
        let texture = |format, sample_count, usage| {
            let (width, height) = (size.width as u32, size.height as u32);
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let layer = || Layer {
            color: texture(COLOR, 1, Use::empty()),
            depth: texture(Format::R32Float, 1, Use::COPY_SRC),
        };
        Self {
            base: layer(),
            near: layer(),
            output: texture(COLOR, 1, Use::empty()),
            shown: texture(SHOWN, 1, Use::COPY_SRC),
            color_samples: texture(COLOR, SAMPLES, Use::empty()),
            depth_samples: texture(DEPTH, SAMPLES, Use::empty()),
        }
    }
}

/// Pipelines and what is in the scene.
pub struct Renderer {
    device: wgpu::Device,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    view: wgpu::Buffer,
    group: wgpu::BindGroup,
    surface: wgpu::RenderPipeline,
    nearest: wgpu::RenderPipeline,
    tone: wgpu::RenderPipeline,
}

impl Renderer {
    /// For one scene.
    pub fn new(device: &wgpu::Device, scene: &Scene) -> Self {
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let looks: Vec<Look> = scene.objects.iter().map(|object| object.look).collect();
        let objects = buffer(bytemuck::cast_slice(&looks), BufferUsages::STORAGE);
        let view = buffer(&[0; size_of::<[Mat4; 2]>()], BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let solid = device.create_shader_module(wgpu::include_wgsl!("scene.wgsl"));
        let screen = device.create_shader_module(wgpu::include_wgsl!("screen.wgsl"));
        let surface = pipeline(device, &solid, "surface", COLOR, true);
        Self {
            device: device.clone(),
            vertices: buffer(bytemuck::cast_slice(&scene.vertices), BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&scene.indices), BufferUsages::INDEX),
            group: group(device, &surface, [view.as_entire_binding(), objects.as_entire_binding()]),
            view,
            surface,
            nearest: pipeline(device, &screen, "nearest", Format::R32Float, false),
            tone: pipeline(device, &screen, "tone", SHOWN, false),
        }
    }

    /// Where the next frame is seen from.
    pub fn set_view(&self, queue: &wgpu::Queue, projection: Mat4, view: Mat4) {
        queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&[projection * view, view.inverse()]));
    }

    /// Draws the scene's objects into two layers: those that are near into one, then the others. The near ones go on with the others' depth,
    /// so that they are hidden where something is nearer still.
    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets, scene: &Scene, near: &[bool]) {
        let dusk = Color { r: 0.30, g: 0.26, b: 0.30, a: 1.0 };
        for (which, layer, sky, depth) in [
            (false, &targets.base, dusk, LoadOp::Clear(0.0)),
            (true, &targets.near, Color::TRANSPARENT, LoadOp::Load),
        ] {
            let color = (&targets.color_samples, Some(&layer.color), sky);
            let mut pass = begin(encoder, color, Some((&targets.depth_samples, depth)));
            pass.set_pipeline(&self.surface);
            pass.set_bind_group(0, &self.group, &[]);
            pass.set_vertex_buffer(0, self.vertices.slice(..));
            pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
            for (i, object) in (0..).zip(&scene.objects).filter(|(i, _)| near[*i as usize] == which) {
                pass.draw_indexed(object.indices.clone(), 0, i..i + 1);
            }
            drop(pass);
            self.screen(encoder, &self.nearest, &targets.depth_samples, &layer.depth);
        }
    }

    /// Tone maps the picture through the lens, or with no lens the scene's, into the one that is shown.
    pub fn tone_map(&self, encoder: &mut wgpu::CommandEncoder, targets: &Targets, lens: bool) {
        let light = if lens { &targets.output } else { &targets.base.color };
        self.screen(encoder, &self.tone, light, &targets.shown);
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
}

/// Colour goes to a texture that is cleared before, and from there, as one sample a pixel, to a second one.
fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    (view, resolve_target, clear): (&TextureView, Option<&TextureView>, Color),
    depth: Option<(&TextureView, LoadOp<f32>)>,
) -> wgpu::RenderPass<'a> {
    let store = wgpu::StoreOp::Store;
    let ops = wgpu::Operations { load: LoadOp::Clear(clear), store };
    let color = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(color)],
        depth_stencil_attachment: depth.map(|(view, load)| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations { load, store }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}

fn group<const N: usize>(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resources: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let layout = &pipeline.get_bind_group_layout(0);
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// For solid objects, or for one triangle over the whole picture.
fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    fragment: &str,
    format: Format,
    solid: bool,
) -> wgpu::RenderPipeline {
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let (array_stride, step_mode) = (size_of::<Vertex>() as u64, wgpu::VertexStepMode::Vertex);
    let vertices = [Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes: &attributes })];
    let (compilation_options, cull_mode) = (Default::default(), solid.then_some(wgpu::Face::Back));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        // As the shader says.
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: if solid { &vertices } else { &[] },
        },
        primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
        depth_stencil: solid.then(|| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            // Reversed: nearer is greater.
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: if solid { SAMPLES } else { 1 }, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options,
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
