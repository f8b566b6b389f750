//! What the renderer is made of: textures, pipelines, passes.

use crate::scene::Vertex;
use pullfocus_core::Size;
use wgpu::{Color, LoadOp, TextureFormat as Format, TextureUsages as Use, TextureView};

/// Light.
pub const COLOR: Format = Format::Rgba16Float;
/// The depth buffer's numbers, one a pixel.
pub const DEPTH: Format = Format::R32Float;
/// sRGB, encoded by the shader.
pub const SHOWN: Format = Format::Rgba8Unorm;
const DEPTH_SAMPLES: Format = Format::Depth32Float;
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
    /// What is shown.
    pub shown: TextureView,
    /// Four samples a pixel.
    pub color_samples: TextureView,
    /// Four samples a pixel.
    pub depth_samples: TextureView,
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
        let layer =
            || Layer { color: texture(COLOR, 1, Use::empty()), depth: texture(DEPTH, 1, Use::COPY_SRC) };
        Self {
            base: layer(),
            near: layer(),
            output: texture(COLOR, 1, Use::empty()),
            shown: texture(SHOWN, 1, Use::COPY_SRC),
            color_samples: texture(COLOR, SAMPLES, Use::empty()),
            depth_samples: texture(DEPTH_SAMPLES, SAMPLES, Use::empty()),
        }
    }
}

/// Colour goes to a texture that is cleared before, and from there, as one sample a pixel, to a second one.
pub fn begin<'a>(
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

/// What a pipeline reads.
pub fn group<const N: usize>(
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
pub fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    fragment: &str,
    format: Format,
    solid: bool,
) -> wgpu::RenderPipeline {
    let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let (array_stride, step_mode) = (size_of::<Vertex>() as u64, wgpu::VertexStepMode::Vertex);
    let vertices = [Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes: &attributes })];
    let cull_mode = solid.then_some(wgpu::Face::Back);
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
            format: DEPTH_SAMPLES,
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
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
