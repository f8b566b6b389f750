//! The picture in the window: drawn by a pass of its own inside of egui's.

use super::cube::Cube;
use super::texture::Texture;
use crate::color::{self, Table};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait};
use eframe::{egui, wgpu};
use pullfocus_core::coc::CocCurve;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How linear light becomes light on a screen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Transform {
    /// sRGB's curve, clipped at white: what `--preview-png` writes.
    #[default]
    Srgb,
    /// A film's shoulder (Narkowicz 2015, "ACES Filmic Tone Mapping Curve"), then sRGB's curve.
    Filmic,
    /// The numbers as they are: for pictures that are encoded already, and for mattes.
    Raw,
    /// A view of an OpenColorIO config, as a table; sRGB until there is one.
    Ocio,
}

impl Transform {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Srgb, Self::Filmic, Self::Raw, Self::Ocio];

    /// Its name, and what it does.
    pub fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::Srgb => ("sRGB", "Linear light on an sRGB screen; what is brighter than white is white."),
            Self::Filmic => (
                "Filmic",
                "Bright light rolls off as on film (Narkowicz's fit of ACES), so that highlights keep their shape.",
            ),
            Self::Raw => ("Raw", "The file's numbers as they are, without a curve."),
            Self::Ocio => (
                "OCIO",
                "A view of an OpenColorIO config: the studio's own, or the built-in one of ACES. It is chosen below.",
            ),
        }
    }

    /// What the shader does, for what is written to files: linear light to an encoded value of 0 to 1.
    pub fn apply(self, linear: f32, gain: f32) -> f32 {
        let light = if linear.is_nan() { 0.0 } else { (linear * gain).max(0.0) };
        match self {
            // Without a table, which is for three colours at once.
            Self::Srgb | Self::Ocio => pullfocus_core::srgb::encode(light.min(1.0)),
            Self::Filmic => {
                let x = light.min(1e4);
                let curve = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
                pullfocus_core::srgb::encode(curve.clamp(0.0, 1.0))
            }
            Self::Raw => light.min(1.0),
        }
    }

    /// The same for red, green and blue. `table` is the config's view, where there is one.
    pub fn colors(self, linear: [f32; 3], gain: f32, table: Option<&Table>) -> [f32; 3] {
        match table {
            Some(table) if self == Self::Ocio => table.apply(linear.map(|linear| linear * gain)),
            _ => linear.map(|linear| self.apply(linear, gain)),
        }
    }
}

/// What a side shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A texture of linear light.
    Light = 0,
    /// A texture of encoded colours.
    Encoded = 1,
    /// Distances, near is bright.
    Depth = 2,
    /// Circles of confusion.
    Coc = 3,
}

/// See `display.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Params {
    corner: [f32; 2],
    origin: [f32; 2],
    step: [f32; 2],
    wipe: f32,
    gain: f32,
    transform: u32,
    overlay: f32,
    kinds: [u32; 2],
    shaper: [f32; 2],
    /// Four floats begin at a multiple of their size.
    gap: [f32; 2],
    curves: [Curve; 2],
    ranges: [f32; 4],
    areas: [Area; 3],
}

/// See `display.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Curve {
    formula: [f32; 4],
    limits: [f32; 4],
}

impl Curve {
    fn of(curve: &CocCurve) -> Self {
        let [low, high] = curve.protect.unwrap_or_default();
        Self {
            formula: [
                curve.formula.at_infinity as f32,
                curve.formula.metre_pixels as f32,
                curve.front as f32,
                curve.back as f32,
            ],
            limits: [
                curve.max.min(1e30) as f32,
                low as f32,
                high as f32,
                if curve.protect.is_some() { 1.0 } else { 0.0 },
            ],
        }
    }
}

/// A rectangle of picture pixels, parts included.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Area {
    /// Upper left corner.
    pub origin: [f32; 2],
    /// Width and height.
    pub size: [f32; 2],
}

/// One side of the border.
#[derive(Debug, Clone)]
pub struct Side {
    /// What it shows.
    pub kind: Kind,
    /// That.
    pub texture: Option<Texture>,
    /// Where it lies, however many pixels the texture has.
    pub area: Area,
}

/// One picture to draw.
#[derive(Debug, Clone)]
pub struct Paint {
    /// Where in the window, in points.
    pub rect: egui::Rect,
    /// Picture pixel at the rectangle's corner.
    pub origin: [f32; 2],
    /// Picture pixels in a point, across and down.
    pub step: [f32; 2],
    /// Left and right of the border.
    pub sides: [Side; 2],
    /// Where the border is, as a part of the rectangle; none for one side alone, the left one.
    pub wipe: Option<f32>,
    /// Distances, metres or circles of confusion, and where they lie.
    pub distances: Option<(Texture, Area)>,
    /// Whether distances are circles of confusion.
    pub are_coc: bool,
    /// The circle of confusion of a distance, left and right of the border.
    pub curves: [CocCurve; 2],
    /// Diameter that has its full colour.
    pub coc_range: f32,
    /// Nearest and farthest distance, for the view of depth.
    pub depth_range: [f32; 2],
    /// Opacity of the circles of confusion over light, 0 to 1.
    pub overlay: f32,
    /// Factor on light.
    pub gain: f32,
    /// From light to the screen.
    pub transform: Transform,
    /// The config's view, where there is one.
    pub table: Option<Arc<Table>>,
}

/// The pipeline.
#[derive(Debug)]
pub struct Display {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    black: wgpu::TextureView,
    cube: Cube,
}

impl Display {
    /// Compiles the shader for a window of this format.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("display.wgsl"));
        let texture = |binding, filterable, view_dimension| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable },
                view_dimension,
                multisampled: false,
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("display"),
            entries: &[
                wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                    count: None,
                },
                wgpu::BindGroupLayoutEntry {
                    binding: 1,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                    count: None,
                },
                texture(2, true, wgpu::TextureViewDimension::D2),
                texture(3, true, wgpu::TextureViewDimension::D2),
                texture(4, false, wgpu::TextureViewDimension::D2),
                texture(5, false, wgpu::TextureViewDimension::D3),
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("display"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
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
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("display"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let black = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("nothing yet"),
            size: wgpu::Extent3d::default(),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self {
            device: device.clone(),
            queue: queue.clone(),
            pipeline,
            layout,
            sampler,
            black: black.create_view(&Default::default()),
            cube: Cube::new(device),
        }
    }
}

impl Paint {
    fn params(&self, points: f32) -> Params {
        let rect = self.rect;
        // Screen pixels before the border; beyond all of them for one side.
        let wipe = self.wipe.map_or(1e9, |part| (part * rect.width() * points).round());
        Params {
            corner: [rect.min.x * points, rect.min.y * points],
            origin: self.origin,
            step: self.step.map(|step| step / points),
            wipe,
            gain: self.gain,
            transform: match self.transform {
                Transform::Srgb => 0,
                Transform::Filmic => 1,
                Transform::Raw => 2,
                Transform::Ocio if self.table.is_some() => 3,
                Transform::Ocio => 0,
            },
            overlay: if self.distances.is_some() { self.overlay } else { 0.0 },
            kinds: [self.sides[0].kind as u32, self.sides[1].kind as u32],
            shaper: color::shaper(),
            gap: [0.0; 2],
            curves: self.curves.each_ref().map(Curve::of),
            ranges: [
                self.coc_range.max(1e-3),
                1.0 / self.depth_range[0].max(1e-6),
                1.0 / self.depth_range[1].max(1e-6),
                if self.are_coc { 1.0 } else { 0.0 },
            ],
            areas: [
                self.sides[0].area,
                self.sides[1].area,
                self.distances.as_ref().map_or(self.sides[0].area, |(_, area)| *area),
            ],
        }
    }
}

impl Display {
    /// A picture, ready for egui to draw into a window of so many pixels to a point.
    pub fn paint(self: &Arc<Self>, paint: &Paint, points: f32) -> egui::PaintCallback {
        let params = paint.params(points);
        let device = &self.device;
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: size_of::<Params>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&params));
        let view = |texture: Option<&Texture>| {
            texture.map_or_else(|| self.black.clone(), |texture| texture.view.clone())
        };
        let [left, right] = paint.sides.each_ref().map(|side| view(side.texture.as_ref()));
        let distances = view(paint.distances.as_ref().map(|(texture, _)| texture));
        let cube = self.cube.view(device, &self.queue, paint.table.as_ref());
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.layout,
            entries: &[
                entry(0, uniform.as_entire_binding()),
                entry(1, wgpu::BindingResource::Sampler(&self.sampler)),
                entry(2, wgpu::BindingResource::TextureView(&left)),
                entry(3, wgpu::BindingResource::TextureView(&right)),
                entry(4, wgpu::BindingResource::TextureView(&distances)),
                entry(5, wgpu::BindingResource::TextureView(&cube)),
            ],
        });
        let [left, right] = paint.sides.each_ref().map(|side| side.texture.clone());
        let textures = [left, right, paint.distances.as_ref().map(|(texture, _)| texture.clone())];
        Callback::new_paint_callback(
            paint.rect,
            Painted { display: Arc::clone(self), group, _textures: textures },
        )
    }
}

/// A picture on its way into egui's pass.
struct Painted {
    display: Arc<Display>,
    group: wgpu::BindGroup,
    /// While this is on its way nobody else may write into them.
    _textures: [Option<Texture>; 3],
}

impl CallbackTrait for Painted {
    fn paint(&self, _: egui::PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.display.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white_and_nothing_is_nan() {
        // A power in f32: one unit in the last place.
        assert!((Transform::Srgb.apply(1.0, 1.0) - 1.0).abs() < 1e-6);
        assert_eq!(Transform::Raw.apply(0.25, 2.0), 0.5);
        // The published curve's value at 1.
        let white = Transform::Filmic.apply(1.0, 1.0);
        assert!((white - pullfocus_core::srgb::encode(2.54 / 3.16)).abs() < 1e-6, "{white}");
        for transform in Transform::ALL {
            for light in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e30] {
                let shown = transform.apply(light, 1.0);
                assert!((0.0..=1.0).contains(&shown), "{transform:?} {light}: {shown}");
            }
        }
    }
}
