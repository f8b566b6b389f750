//! A small forward renderer: shadow map, scene, sky, with four samples a pixel; then tone mapping.

use crate::scene::{Look, Scene, Vertex};
use glam::{Mat4, Vec3, Vec4};
use pullfocus_core::Size;
use wgpu::TextureFormat as Format;
use wgpu::TextureUsages as Use;
use wgpu::util::{BufferInitDescriptor, DeviceExt as _};

const COLOR: Format = Format::Rgba16Float;
const DEPTH: Format = Format::Depth32Float;
const SAMPLES: u32 = 4;
const SHADOW_SIDE: u32 = 2048;

/// A texture and the view of all of it.
pub struct Texture {
    /// The texture.
    pub texture: wgpu::Texture,
    /// All of it.
    pub view: wgpu::TextureView,
}

impl Texture {
    fn new(device: &wgpu::Device, size: Size, format: Format, sample_count: u32, usage: Use) -> Self {
        let (width, height) = (size.width as u32, size.height as u32);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | Use::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Self { view: texture.create_view(&Default::default()), texture }
    }
}

/// A picture with depth, one sample a pixel: what the blur reads.
pub struct Layer {
    /// Linear light, premultiplied.
    pub color: Texture,
    /// The depth buffer's numbers.
    pub depth: Texture,
}

/// All textures of one size.
pub struct Targets {
    /// Their size.
    pub size: Size,
    /// The scene, or with a foreground the rest of it.
    pub base: Layer,
    /// Near objects on their own.
    pub near: Layer,
    /// The picture through the lens.
    pub output: Texture,
    color_samples: Texture,
    depth_samples: Texture,
}

impl Targets {
    /// Makes them.
    pub fn new(device: &wgpu::Device, size: Size) -> Self {
        let texture = |format, samples, usage| Texture::new(device, size, format, samples, usage);
        let layer = || Layer {
            color: texture(COLOR, 1, Use::TEXTURE_BINDING),
            depth: texture(Format::R32Float, 1, Use::TEXTURE_BINDING | Use::COPY_SRC),
        };
        Self {
            size,
            base: layer(),
            near: layer(),
            output: texture(COLOR, 1, Use::TEXTURE_BINDING),
            color_samples: texture(COLOR, SAMPLES, Use::empty()),
            depth_samples: texture(DEPTH, SAMPLES, Use::TEXTURE_BINDING),
        }
    }
}

/// `View` in `scene.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct View {
    projection: Mat4,
    unprojection: Mat4,
    sun: Mat4,
    to_sun: Vec4,
    eye: Vec4,
}

/// Which part of the scene is drawn where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Into [`Targets::base`], with the sky.
    Base,
    /// Into [`Targets::near`], over nothing; what the base hides stays hidden.
    Near,
}

/// A pipeline and what it reads.
type Bound = (wgpu::BindGroup, wgpu::RenderPipeline);

/// Pipelines and what is in the scene.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    view: wgpu::Buffer,
    surface: Bound,
    sky: Bound,
    nearest: wgpu::RenderPipeline,
    tone: wgpu::RenderPipeline,
}

impl Renderer {
    /// For one scene, and pictures in the end of `format`, an sRGB one.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene, format: Format) -> Self {
        let buffer = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let looks: Vec<Look> = scene.objects.iter().map(|object| object.look).collect();
        let objects = buffer(bytemuck::cast_slice(&looks), wgpu::BufferUsages::STORAGE);
        let view =
            buffer(&[0; size_of::<View>()], wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST);
        let side = Size::new(SHADOW_SIDE as usize, SHADOW_SIDE as usize);
        let shadow_map = Texture::new(device, side, DEPTH, 1, Use::TEXTURE_BINDING);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            compare: Some(wgpu::CompareFunction::LessEqual),
            ..Default::default()
        });

        let module = |source: &'static str| {
            let source = wgpu::ShaderSource::Wgsl(source.into());
            device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source })
        };
        let (scene_module, screen) =
            (module(include_str!("scene.wgsl")), module(include_str!("screen.wgsl")));
        let make = |module, entries, vertices, depth, target| {
            pipeline(device, &Kind { module, entries, vertices, depth, target })
        };
        // Reversed depth: nearer is greater, and the sky's 0 is drawn where nothing else was.
        let depth = Some((wgpu::CompareFunction::GreaterEqual, SAMPLES));
        let sun_depth = Some((wgpu::CompareFunction::LessEqual, 1));
        let surface = make(&scene_module, ("vertex", Some("surface")), true, depth, Some(COLOR));
        let sky = make(&scene_module, ("sky_corner", Some("sky_pixel")), false, depth, Some(COLOR));
        let shadow = make(&scene_module, ("shadow", None), true, sun_depth, None);
        let nearest = make(&screen, ("corner", Some("nearest")), false, None, Some(Format::R32Float));
        let tone = make(&screen, ("corner", Some("tone")), false, None, Some(format));

        use wgpu::BindingResource::{Sampler, TextureView};
        let (from, things) = (view.as_entire_binding(), objects.as_entire_binding());
        let shadows = [from.clone(), things.clone(), TextureView(&shadow_map.view), Sampler(&sampler)];
        let renderer = Self {
            device: device.clone(),
            queue: queue.clone(),
            vertices: buffer(bytemuck::cast_slice(&scene.vertices), wgpu::BufferUsages::VERTEX),
            indices: buffer(bytemuck::cast_slice(&scene.indices), wgpu::BufferUsages::INDEX),
            surface: (group(device, &surface, &shadows), surface),
            sky: (group(device, &sky, &shadows[..1]), sky),
            view: view.clone(),
            nearest,
            tone,
        };
        let shadow = (group(device, &shadow, &shadows[..2]), shadow);
        renderer.draw_shadow(scene, &shadow, &shadow_map);
        renderer
    }

    /// Sun and scene stand still: once is enough.
    fn draw_shadow(&self, scene: &Scene, shadow: &Bound, map: &Texture) {
        self.set_view(Mat4::IDENTITY, Vec3::ZERO);
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = begin(&mut encoder, None, Some((&map.view, wgpu::LoadOp::Clear(1.0))));
        self.draw_objects(&mut pass, shadow, scene, |_| true);
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// Where the next frame is seen from.
    pub fn set_view(&self, projection: Mat4, eye: Vec3) {
        let to_sun = Vec3::new(-0.90, 0.44, 0.08).normalize();
        // The table and what stands on it.
        let sun = glam::camera::rh::proj::directx::orthographic(-0.5, 0.5, -0.5, 0.5, 0.5, 3.5)
            * glam::camera::rh::view::look_at_mat4(2.0 * to_sun, Vec3::ZERO, Vec3::Y);
        let (to_sun, eye) = (to_sun.extend(0.0), eye.extend(1.0));
        let view = View { projection, unprojection: projection.inverse(), sun, to_sun, eye };
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&view));
    }

    /// Draws the objects that `which` accepts by their numbers, then the depth texture of that part.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        (targets, part): (&Targets, Part),
        scene: &Scene,
        which: impl Fn(usize) -> bool,
    ) {
        // The near part goes on with the base's depth, so that it is hidden where the base is nearer still.
        let (layer, depth) = match part {
            Part::Base => (&targets.base, wgpu::LoadOp::Clear(0.0)),
            Part::Near => (&targets.near, wgpu::LoadOp::Load),
        };
        let color = Color { view: &targets.color_samples.view, resolve: Some(&layer.color.view) };
        let mut pass = begin(encoder, Some(color), Some((&targets.depth_samples.view, depth)));
        self.draw_objects(&mut pass, &self.surface, scene, which);
        if part == Part::Base {
            pass.set_pipeline(&self.sky.1);
            pass.set_bind_group(0, &self.sky.0, &[]);
            pass.draw(0..3, 0..1);
        }
        drop(pass);
        self.screen(encoder, &self.nearest, &targets.depth_samples.view, &layer.depth.view);
    }

    /// Tone maps `light` into a picture to be shown.
    pub fn tone_map(&self, encoder: &mut wgpu::CommandEncoder, light: &Texture, to: &wgpu::TextureView) {
        self.screen(encoder, &self.tone, &light.view, to);
    }

    fn draw_objects(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        (group, pipeline): &Bound,
        scene: &Scene,
        which: impl Fn(usize) -> bool,
    ) {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        for (i, object) in scene.objects.iter().enumerate().filter(|(i, _)| which(*i)) {
            pass.draw_indexed(object.indices.clone(), object.base_vertex, i as u32..i as u32 + 1);
        }
    }

    /// One picture from another.
    fn screen(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        from: &wgpu::TextureView,
        to: &wgpu::TextureView,
    ) {
        let from = [wgpu::BindingResource::TextureView(from)];
        let group = group(&self.device, pipeline, &from);
        let mut pass = begin(encoder, Some(Color { view: to, resolve: None }), None);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Where colour goes, and the texture of one sample a pixel that is made of it.
struct Color<'a> {
    view: &'a wgpu::TextureView,
    resolve: Option<&'a wgpu::TextureView>,
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    color: Option<Color<'_>>,
    depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
) -> wgpu::RenderPass<'a> {
    let ops =
        wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    let color = color.map(|color| wgpu::RenderPassColorAttachment {
        view: color.view,
        depth_slice: None,
        resolve_target: color.resolve,
        ops,
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: if color.is_some() { std::slice::from_ref(&color) } else { &[] },
        depth_stencil_attachment: depth.map(|(view, load)| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}

fn group(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let layout = &pipeline.get_bind_group_layout(0);
    let entries: Vec<_> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// What the pipelines differ in.
struct Kind<'a> {
    module: &'a wgpu::ShaderModule,
    entries: (&'a str, Option<&'a str>),
    vertices: bool,
    /// Which depth passes, and samples a pixel.
    depth: Option<(wgpu::CompareFunction, u32)>,
    target: Option<Format>,
}

fn pipeline(device: &wgpu::Device, kind: &Kind<'_>) -> wgpu::RenderPipeline {
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let vertices = [Some(wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    })];
    let targets = [kind.target.map(Into::into)];
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: kind.entries.1.or(Some(kind.entries.0)),
        // As the shader says.
        layout: None,
        vertex: wgpu::VertexState {
            module: kind.module,
            entry_point: Some(kind.entries.0),
            compilation_options: Default::default(),
            buffers: if kind.vertices { &vertices } else { &[] },
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: kind.vertices.then_some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: kind.depth.map(|(compare, _)| wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: kind.depth.map_or(1, |(_, samples)| samples),
            ..Default::default()
        },
        fragment: kind.entries.1.map(|entry| wgpu::FragmentState {
            module: kind.module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
