//! Depth to circles of confusion, a frame at a time.

use crate::planes::workgroups;
use crate::recorder::Recorder;
use crate::shader::{Constant, Part, Spec, part, uniform};
use pullfocus_core::coc::CocCurve;
use pullfocus_core::depth::{REPAIR_BLENDED, REPAIR_NOTICE_STRIDE, REPAIR_SLOPE, REPAIR_STEP};
use pullfocus_core::{Camera, DepthDecoding, DepthKind, Error, Frame, Result, Settings, Size};

uniform! {
    /// See `coc.wgsl`.
    CocParams {
        width: u32,
        height: u32,
        kind: u32,
        protect: u32,
        unit_m: f32,
        clip: f32,
        scale: f32,
        shift: f32,
        at_infinity: f32,
        metre_pixels: f32,
        front: f32,
        back: f32,
        largest: f32,
        near: f32,
        far: f32,
        unused: f32,
        tangents: [f32; 4],
    }
}

uniform! {
    /// See `depth_repair.wgsl`.
    RepairParams {
        width: u32,
        height: u32,
        distances: u32,
        stride: u32,
        step: f32,
        slope: f32,
        blended_low: f32,
        blended_high: f32,
    }
}

uniform! {
    /// See `read_depth.wgsl`.
    ReadDepthParams { width: u32, height: u32 }
}

/// What a distance channel's numbers mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Meaning {
    /// Depth, to be decoded.
    Depth(DepthDecoding),
    /// Signed diameters of the circle of confusion in pixels, positive behind focus.
    Coc,
}

/// Where a distance channel lies.
#[derive(Debug, Clone, Copy)]
pub enum Source<'a> {
    /// A plane of f32.
    Plane(&'a wgpu::Buffer),
    /// The red channel of a colour texture.
    Texture(&'a wgpu::TextureView),
    /// A depth texture.
    DepthTexture(&'a wgpu::TextureView),
}

impl<'a> Source<'a> {
    fn part(self) -> Part {
        match self {
            Self::Plane(_) => part!("source_buffer"),
            Self::Texture(_) => part!("source_texture"),
            Self::DepthTexture(_) => part!("source_depth"),
        }
    }

    fn binding(self) -> wgpu::BindingResource<'a> {
        match self {
            Self::Plane(buffer) => buffer.as_entire_binding(),
            Self::Texture(view) | Self::DepthTexture(view) => wgpu::BindingResource::TextureView(view),
        }
    }
}

/// A buffer's distance from the start of a recording: smallest and largest diameter as ordered bits.
pub fn decode_range(bytes: &[u8]) -> [f32; 2] {
    let key = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let value = |key: u32| f32::from_bits(if key & (1 << 31) != 0 { key & !(1 << 31) } else { !key });
    let (low, high) = (key(0), key(4));
    if low > high { [0.0, 0.0] } else { [value(low), value(high)] }
}

/// Where an element lies among those of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// It is the whole picture.
    Alone,
    /// Behind a foreground.
    Behind,
    /// In front.
    Front,
}

/// An element's circles of confusion.
#[derive(Debug)]
pub struct Circles {
    /// What makes them.
    pub curve: CocCurve,
    /// Signed diameters; in front they are as the lens alone makes them.
    pub coc: wgpu::Buffer,
    /// The smallest and the largest of them ([`decode_range`]), and room for how many layers there are.
    pub range: wgpu::Buffer,
    /// Behind a foreground: as the lens alone makes them.
    pub lens: Option<wgpu::Buffer>,
}

/// Writes circles of confusion of `source`.
///
/// # Errors
/// As [`curve`]; [`Error::DeviceLimit`], [`Error::OutOfMemory`].
pub fn circles(
    recorder: &mut Recorder<'_>,
    (frame, camera, settings): (&Frame, Option<&Camera>, &Settings),
    meaning: &Meaning,
    source: Source<'_>,
    place: Place,
) -> Result<Circles> {
    let size = frame.data.size;
    let curve = curve(frame, camera, settings, meaning)?;
    let mut write = |curve: &CocCurve| -> Result<_> {
        let (coc, range) = (recorder.take_plane(size)?, recorder.take(size, 12)?);
        circle_of_confusion(recorder, (frame, camera, curve), meaning, source, &coc, &range)?;
        Ok((coc, range))
    };
    let (coc, range) = write(&if place == Place::Front { curve.lens_alone() } else { curve })?;
    let mut lens = None;
    if place == Place::Behind {
        let (plane, range) = write(&curve.lens_alone())?;
        recorder.give([range]);
        lens = Some(plane);
    }
    Ok(Circles { curve, coc, range, lens })
}

fn circle_of_confusion(
    recorder: &mut Recorder<'_>,
    (frame, camera, curve): (&Frame, Option<&Camera>, &CocCurve),
    meaning: &Meaning,
    source: Source<'_>,
    coc: &wgpu::Buffer,
    range: &wgpu::Buffer,
) -> Result<()> {
    let size = frame.data.size;
    let params = params(frame, camera, curve, meaning);
    let empty = recorder.memory.empty_range.clone();
    recorder.encoder().copy_buffer_to_buffer(&empty, 0, range, 0, 8);
    let spec = Spec::new(&[part!("numbers"), source.part(), part!("shape"), part!("coc")], &[]);
    let bindings = [source.binding(), coc.as_entire_binding(), range.as_entire_binding()];
    recorder.run_bound(&spec, &params, &bindings, workgroups(Size::new(size.width, size.height.div_ceil(8))))
}

/// What makes circles of confusion of such numbers.
///
/// # Errors
/// [`Error::NoCamera`] where depth is given without one; [`Error::Setting`].
pub fn curve(
    frame: &Frame,
    camera: Option<&Camera>,
    settings: &Settings,
    meaning: &Meaning,
) -> Result<CocCurve> {
    match meaning {
        Meaning::Coc => CocCurve::limits(frame, &settings.coc),
        Meaning::Depth(decoding) => {
            decoding.check()?;
            let camera = camera.ok_or(Error::NoCamera)?;
            CocCurve::new(camera.circle_of_confusion(frame), frame, &settings.coc)
        }
    }
}

fn params(frame: &Frame, camera: Option<&Camera>, curve: &CocCurve, meaning: &Meaning) -> CocParams {
    let Size { width, height } = frame.data.size;
    let none = DepthDecoding::default();
    let (decoding, is_coc) = match meaning {
        Meaning::Coc => (&none, true),
        Meaning::Depth(decoding) => (decoding, false),
    };
    let half_width = camera.filter(|_| !is_coc).map_or(0.0, Camera::half_width_tangent);
    let (kind, scale, shift) = match decoding.kind {
        _ if is_coc => (5, 0.0, 0.0),
        DepthKind::Planar => (0, 0.0, 0.0),
        DepthKind::Ray => (1, 0.0, 0.0),
        DepthKind::Inverse => (2, 0.0, 0.0),
        DepthKind::Disparity { scale, shift } => (3, scale, shift),
        DepthKind::Normalized { near_m, far_m, inverted: false } => (4, far_m - near_m, near_m),
        DepthKind::Normalized { near_m, far_m, inverted: true } => (6, far_m - near_m, near_m),
    };
    let first = frame.ray_tangents(half_width, 0, 0);
    let next = frame.ray_tangents(half_width, 1, 1);
    // As core's `to_metres`: files round their far clip.
    let clip = decoding.far_clip_m.map_or(0.0, |far| 1.0 / (far * (1.0 - 1e-4)));
    let [near, far] = curve.protect.unwrap_or_default();
    CocParams {
        width: width as u32,
        height: height as u32,
        kind,
        protect: curve.protect.is_some().into(),
        unit_m: decoding.unit_m as f32,
        clip: clip as f32,
        scale: scale as f32,
        shift: shift as f32,
        at_infinity: curve.formula.at_infinity as f32,
        metre_pixels: curve.formula.metre_pixels as f32,
        front: curve.front as f32,
        back: curve.back as f32,
        largest: curve.max as f32,
        near: near as f32,
        far: far as f32,
        unused: 0.0,
        tangents: [
            first[0] as f32,
            first[1] as f32,
            (next[0] - first[0]) as f32,
            (next[1] - first[1]) as f32,
        ],
    }
}

/// A distance channel as a plane.
///
/// # Errors
/// [`Error::DeviceLimit`], [`Error::OutOfMemory`].
pub fn read_depth(recorder: &mut Recorder<'_>, size: Size, source: Source<'_>) -> Result<wgpu::Buffer> {
    let plane = recorder.take_plane(size)?;
    let params = ReadDepthParams { width: size.width as u32, height: size.height as u32 };
    let spec = Spec::new(&[source.part(), part!("read_depth")], &[]);
    let bindings = [source.binding(), plane.as_entire_binding()];
    recorder.run_bound(&spec, &params, &bindings, workgroups(size))?;
    Ok(plane)
}

fn repair_params(size: Size, decoding: &DepthDecoding) -> RepairParams {
    RepairParams {
        width: size.width as u32,
        height: size.height as u32,
        distances: matches!(decoding.kind, DepthKind::Planar | DepthKind::Ray).into(),
        stride: REPAIR_NOTICE_STRIDE as u32,
        step: REPAIR_STEP,
        slope: REPAIR_SLOPE,
        blended_low: REPAIR_BLENDED[0],
        blended_high: REPAIR_BLENDED[1],
    }
}

fn repair_spec(count: bool) -> Spec {
    Spec::new(&[part!("numbers"), part!("depth_repair")], &[("COUNT", Constant::Flag(count))])
}

/// A plane of depth with every blended edge value replaced by the one that covers more of the pixel.
///
/// # Errors
/// [`Error::DeviceLimit`], [`Error::OutOfMemory`].
pub fn repair(
    recorder: &mut Recorder<'_>,
    size: Size,
    depth: &wgpu::Buffer,
    decoding: &DepthDecoding,
) -> Result<wgpu::Buffer> {
    let mended = recorder.take_plane(size)?;
    let nothing = recorder.memory.nothing.clone();
    let buffers = [depth, &mended, &nothing];
    recorder.run(&repair_spec(false), &repair_params(size, decoding), &buffers, workgroups(size))?;
    Ok(mended)
}

/// Counts clean and blended depth edges into `counts` (two u32), in some of the rows.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn count_blended_edges(
    recorder: &mut Recorder<'_>,
    size: Size,
    depth: &wgpu::Buffer,
    decoding: &DepthDecoding,
    counts: &wgpu::Buffer,
) -> Result<()> {
    recorder.encoder().clear_buffer(counts, 0, None);
    let nothing = recorder.memory.nothing.clone();
    let buffers = [depth, &nothing, counts];
    let looked_at = Size::new(size.width, size.height.div_ceil(REPAIR_NOTICE_STRIDE));
    recorder.run(&repair_spec(true), &repair_params(size, decoding), &buffers, workgroups(looked_at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::depth::{HALF_MAX, NOTHING_FROM};
    use pullfocus_core::picture::LARGEST;

    #[test]
    fn ranges_come_back_in_order() {
        let key = |x: f32| {
            let bits = x.to_bits();
            if bits >> 31 != 0 { !bits } else { bits | 1 << 31 }
        };
        let numbers = [f32::NEG_INFINITY, -3.5, -1e-30, 0.0, 1e-30, 2.25, 1e9];
        assert!(numbers.windows(2).all(|pair| key(pair[0]) < key(pair[1])));
        for pair in numbers.windows(2) {
            let bytes: Vec<u8> = pair.iter().flat_map(|&x| key(x).to_le_bytes()).collect();
            assert_eq!(decode_range(&bytes), [pair[0], pair[1]]);
        }
        let empty = [u32::MAX.to_le_bytes(), 0u32.to_le_bytes()].concat();
        assert_eq!(decode_range(&empty), [0.0, 0.0]);
    }

    #[test]
    fn the_shaders_numbers_are_cores() {
        let text = part!("numbers").text;
        for line in [
            format!("const HALF_MAX: f32 = {HALF_MAX:?};"),
            format!("const NOTHING_FROM: f32 = {NOTHING_FROM:e};"),
            format!("const LARGEST: f32 = {LARGEST:e};"),
        ] {
            assert!(text.contains(&line), "{line}");
        }
    }
}
