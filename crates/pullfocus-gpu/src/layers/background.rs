//! The first paper's midground and background (section 3.1); the CPU's `layers::background` has the theory.

use crate::planes::{Group, workgroups};
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::{Layering, Result};

uniform! {
    /// See `matte.wgsl`.
    MatteParams { width: u32, height: u32, low: f32, high: f32 }
}

uniform! {
    /// See `blend.wgsl`.
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
    let circle = Group::take(work.recorder, size, 1, crate::Storage::Full)?;
    let shape = Spec::new(&[part!("layers/matte")], &[]);
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
            let [low, high] = Layering::background_ramp(layer, threshold);
            if let (Some(original), true) = (&original, layer > 0) {
                let encoder = work.recorder.encoder();
                encoder.copy_buffer_to_buffer(original, 0, &behind.buffer, 0, bytes);
            }
            work.recorder.stage("background");
            let params = MatteParams { width, height, low, high };
            work.recorder.run(&shape, &params, &[coc, &matte, &circle.buffer], workgroups(size))?;
            work.smooth(size, &[&circle], high, Some(&matte))?;
            work.blur(&[&behind], &circle.buffer, Some(&matte))?;
            work.recorder.stage("composite");
            let [lane, px] = group.parts();
            let blend = Spec::new(&[lane, px, part!("layers/blend")], &[]);
            let params = BlendParams { width, height };
            let buffers = [&matte, &behind.buffer, &group.buffer];
            work.recorder.run(&blend, &params, &buffers, workgroups(size))?;
        }
        work.recorder.give([behind.buffer].into_iter().chain(original));
    }
    work.recorder.give([matte, circle.buffer]);
    Ok(())
}
