//! The first paper's midground and background (section 3.1); the CPU's `layers::background` has the theory.

use super::alone::{clear, leave};
use crate::planes::{Group, Storage, workgroups};
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::{Layering, Method, Result, Size};

uniform! {
    /// See `matte.wgsl`.
    MatteParams { width: u32, height: u32, low: f32, high: f32 }
}

uniform! {
    /// See `blend.wgsl` and `unseen.wgsl`.
    BlendParams { width: u32, height: u32 }
}

/// Blurs `picture` as a midground over `layers` background layers; `threshold` is in pixels.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn blur_over_background(
    work: &mut Work<'_, '_>,
    picture: &[&Group],
    coc: &wgpu::Buffer,
    layers: u32,
    threshold: f32,
) -> Result<()> {
    let size = work.size;
    let (width, height) = (size.width as u32, size.height as u32);
    let matte = work.recorder.take_plane(size)?;
    let circle = work.recorder.take_plane(size)?;
    for &group in picture {
        let bytes = group.buffer.size();
        let behind = Group { buffer: work.recorder.take(size, bytes)?, ..group.clone() };
        // The midground's blur overwrites what the layers behind are made from.
        let original = if layers > 1 { Some(work.recorder.take(size, bytes)?) } else { None };
        for copy in std::iter::once(&behind.buffer).chain(&original) {
            work.recorder.encoder().copy_buffer_to_buffer(&group.buffer, 0, copy, 0, bytes);
        }
        work.recorder.stage("midground");
        work.blur(&[group], coc, None)?;
        for layer in 0..layers {
            let ramp = Layering::background_ramp(layer, threshold);
            if let (Some(original), true) = (&original, layer > 0) {
                let encoder = work.recorder.encoder();
                encoder.copy_buffer_to_buffer(original, 0, &behind.buffer, 0, bytes);
            }
            work.recorder.stage("background");
            blur_background(work, &behind, coc, ramp, [&matte, &circle])?;
            work.recorder.stage("composite");
            let [lane, px] = group.parts();
            let blend = Spec::new(&[lane, px, part!("layers/blend")], &[]);
            let params = BlendParams { width, height };
            let buffers = [&matte, &behind.buffer, &group.buffer];
            work.recorder.run(&blend, &params, &buffers, workgroups(size))?;
        }
        work.recorder.give([behind.buffer].into_iter().chain(original));
    }
    work.recorder.give([matte, circle]);
    Ok(())
}

/// Replaces `picture` by one of its layers alone, or by its matte: number 0 is the last of `layers` background layers, number `layers`
/// the midground. See the CPU's `layers::background` for coverage in the order of depth.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn one_over_background(
    work: &mut Work<'_, '_>,
    picture: &[&Group],
    coc: &wgpu::Buffer,
    [layers, number]: [u32; 2],
    threshold: f32,
) -> Result<()> {
    if number > layers {
        clear(work, picture);
        return Ok(());
    }
    let size = work.size;
    let [matte, circle] = [work.recorder.take_plane(size)?, work.recorder.take_plane(size)?];
    if !work.show.is_matte() && number == layers {
        work.recorder.stage("midground");
        work.blur(picture, coc, None)?;
    } else if !work.show.is_matte() {
        work.recorder.stage("background");
        let ramp = Layering::background_ramp(layers - 1 - number, threshold);
        for group in picture {
            let unseen = match work.method {
                Method::Diffusion => None,
                _ => Some(copy_of(work, group)?),
            };
            blur_background(work, group, coc, ramp, [&matte, &circle])?;
            if let Some(unseen) = unseen {
                fill_unseen(work, group, unseen, ramp[1], &matte)?;
            }
        }
    }
    work.recorder.stage("composite");
    if number > 0 {
        let ramp = Layering::background_ramp(layers - number, threshold);
        make_matte(work, coc, ramp, [&matte, &circle])?;
        leave(work, picture, Some(&matte))?;
    } else if work.show.is_matte() {
        leave(work, picture, None)?;
    }
    work.recorder.give([matte, circle]);
    Ok(())
}

/// A group with the same values.
fn copy_of(work: &mut Work<'_, '_>, group: &Group) -> Result<Group> {
    let bytes = group.buffer.size();
    let copy = Group { buffer: work.recorder.take(work.size, bytes)?, ..group.clone() };
    work.recorder.encoder().copy_buffer_to_buffer(&group.buffer, 0, &copy.buffer, 0, bytes);
    Ok(copy)
}

/// Fills a background layer where it is not seen at all, from `unseen`, the picture before the blur; see the CPU's.
fn fill_unseen(
    work: &mut Work<'_, '_>,
    layer: &Group,
    unseen: Group,
    diameter: f32,
    matte: &wgpu::Buffer,
) -> Result<()> {
    work.smooth(work.size, &[&unseen], diameter, Some(matte))?;
    let [lane, px] = layer.parts();
    let spec = Spec::new(&[lane, px, part!("layers/unseen")], &[]);
    let params = BlendParams { width: work.size.width as u32, height: work.size.height as u32 };
    let buffers = [matte, &unseen.buffer, &layer.buffer];
    work.recorder.run(&spec, &params, &buffers, workgroups(work.size))?;
    work.recorder.give([unseen.buffer]);
    Ok(())
}

/// Writes where a background layer is seen, and its diameters there.
fn make_matte(
    work: &mut Work<'_, '_>,
    coc: &wgpu::Buffer,
    [low, high]: [f32; 2],
    [matte, circle]: [&wgpu::Buffer; 2],
) -> Result<()> {
    let Size { width, height } = work.size;
    let params = MatteParams { width: width as u32, height: height as u32, low, high };
    let spec = Spec::new(&[part!("layers/matte")], &[]);
    work.recorder.run(&spec, &params, &[coc, matte, circle], workgroups(work.size))
}

/// Blurs a group as a background layer, without what is nearer than its ramp. Leaves its matte.
fn blur_background(
    work: &mut Work<'_, '_>,
    group: &Group,
    coc: &wgpu::Buffer,
    ramp: [f32; 2],
    [matte, circle]: [&wgpu::Buffer; 2],
) -> Result<()> {
    make_matte(work, coc, ramp, [matte, circle])?;
    let carried = Group { buffer: circle.clone(), planes: 1, storage: Storage::Full, layer: None };
    work.smooth(work.size, &[&carried], ramp[1], Some(matte))?;
    work.blur(&[group], circle, Some(matte))
}
