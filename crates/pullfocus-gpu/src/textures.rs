//! The caller's textures: colour in, colour out.

use crate::context::{self, Context};
use crate::memory::bind_to;
use crate::planes::{Group, Storage, workgroups};
use crate::recorder::{self, Recorder};
use crate::shader::{self, Slot, Spec, part, uniform};
use pullfocus_core::{Error, Result, Size};
use std::sync::Arc;

uniform! {
    /// See `load.wgsl`.
    LoadParams { width: u32, height: u32, alpha: u32 }
}

uniform! {
    /// See `store.wgsl`.
    StoreParams { width: u32, height: u32, alpha: u32 }
}

/// A pipeline that renders into one format.
#[derive(Debug)]
pub struct RenderKernel {
    pub pipeline: wgpu::RenderPipeline,
    pub layout: wgpu::BindGroupLayout,
    pub slots: Vec<(u32, Slot)>,
}

/// Brings a colour texture into a group; without alpha that plane is 0.
///
/// # Errors
/// [`Error::DeviceLimit`], [`Error::OutOfMemory`].
pub fn load(
    recorder: &mut Recorder<'_>,
    size: Size,
    texture: &wgpu::TextureView,
    alpha: bool,
    storage: Storage,
) -> Result<Group> {
    let group = Group::take(recorder, size, 4, storage)?;
    let [lane, px] = group.parts();
    let spec = Spec::new(&[lane, px, part!("numbers"), part!("mend"), part!("load")], &[]);
    let params = LoadParams { width: size.width as u32, height: size.height as u32, alpha: alpha.into() };
    let bindings = [wgpu::BindingResource::TextureView(texture), group.buffer.as_entire_binding()];
    recorder.run_bound(&spec, &params, &bindings, workgroups(size))?;
    Ok(group)
}

/// Whether a format gives numbers, in some form.
pub fn reads_as_floats(format: wgpu::TextureFormat) -> bool {
    !format.is_depth_stencil_format()
        && matches!(format.sample_type(None, None), Some(wgpu::TextureSampleType::Float { .. }))
}

/// Refuses textures that cannot be bound as a picture.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_picture(view: &wgpu::TextureView, usage: wgpu::TextureUsages) -> Result<()> {
    let texture = view.texture();
    if texture.dimension() != wgpu::TextureDimension::D2 {
        return Err(Error::Unsupported {
            what: "a texture of one or three dimensions",
            reason: "pictures have width and height; give a view of a two-dimensional texture",
        });
    }
    if texture.sample_count() != 1 {
        return Err(Error::Unsupported {
            what: "a texture with several samples for each pixel",
            reason: "one value for each pixel is read and written; resolve it first",
        });
    }
    if !texture.usage().contains(usage) {
        return Err(Error::Unsupported {
            what: "a texture without the usage that is needed",
            reason: "inputs need TEXTURE_BINDING, the output RENDER_ATTACHMENT",
        });
    }
    Ok(())
}

/// Refuses textures of whole numbers, and such as may not be used so.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn check_color(texture: &wgpu::TextureView, usage: wgpu::TextureUsages) -> Result<()> {
    if !reads_as_floats(texture.texture().format()) {
        return Err(Error::Unsupported {
            what: "a colour texture of this format",
            reason: "it must be read as numbers between 0 and 1 or as floating point",
        });
    }
    check_picture(texture, usage)
}

/// The format of a view that is rendered into: `given`, or its texture's own. Refuses those that the texture has no views of.
///
/// # Errors
/// [`Error::Unsupported`].
pub fn format_of(
    view: &wgpu::TextureView,
    given: Option<wgpu::TextureFormat>,
) -> Result<wgpu::TextureFormat> {
    let own = view.texture().format();
    let format = given.unwrap_or(own);
    if format.remove_srgb_suffix() != own.remove_srgb_suffix() {
        return Err(Error::Unsupported {
            what: "an output format that its texture has no views of",
            reason: "it must be the texture's own, or that with or without sRGB",
        });
    }
    Ok(format)
}

/// Renders a group into the caller's texture: a pass of one triangle over `size` pixels.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn store(
    recorder: &mut Recorder<'_>,
    size: Size,
    group: &Group,
    alpha: bool,
    (texture, format): (&wgpu::TextureView, wgpu::TextureFormat),
) -> Result<()> {
    let kernel = kernel(recorder.context, group, format);
    let params = StoreParams { width: size.width as u32, height: size.height as u32, alpha: alpha.into() };
    let offset = recorder.uniform(bytemuck::bytes_of(&params))?;
    let bind_group = bind_to(
        recorder.context,
        ("store", &kernel.layout, &kernel.slots),
        &recorder.memory.uniforms,
        &[group.buffer.as_entire_binding()],
    );
    recorder.end_pass();
    let stamps = recorder.timer.as_mut().and_then(|timer| timer.writes()).map(|writes| {
        wgpu::RenderPassTimestampWrites {
            query_set: writes.query_set,
            beginning_of_pass_write_index: writes.beginning_of_pass_write_index,
            end_of_pass_write_index: writes.end_of_pass_write_index,
        }
    });
    let mut pass =
        recorder::open(recorder.context, &mut recorder.sink).begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("pullfocus store"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: texture,
                depth_slice: None,
                resolve_target: None,
                // The triangle covers all pixels: a tiler need not bring what was there.
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            timestamp_writes: stamps,
            ..Default::default()
        });
    pass.set_pipeline(&kernel.pipeline);
    pass.set_bind_group(0, &bind_group, &[offset]);
    pass.set_viewport(0.0, 0.0, size.width as f32, size.height as f32, 0.0, 1.0);
    pass.draw(0..3, 0..1);
    Ok(())
}

/// The shader of [`store`].
pub fn store_spec(group: &Group) -> Spec {
    let [lane, px] = group.parts();
    Spec::new(&[lane, px, part!("store")], &[])
}

fn kernel(context: &Context, group: &Group, format: wgpu::TextureFormat) -> Arc<RenderKernel> {
    let spec = store_spec(group);
    context.render_kernel((spec, format), |(spec, format)| {
        let (label, source) = (spec.label(), spec.source());
        let interface = shader::interface(&source).unwrap_or_else(|error| panic!("{label}: {error}"));
        if let Err(error) = shader::same_layout::<StoreParams>(&interface) {
            panic!("{label}: {error}");
        }
        let device = context.device();
        let module = context::trusted(device, &label, source);
        let layout = context::layout(device, &label, &interface, wgpu::ShaderStages::FRAGMENT);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(&label),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(&label),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("pixel"),
                compilation_options: Default::default(),
                targets: &[Some((*format).into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        RenderKernel { pipeline, layout, slots: interface.slots }
    })
}
