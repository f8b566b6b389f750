//! Counting a picture's diameters and cutting it into layers, without looking at it from outside: cuts and their number
//! are known to the device alone.

use super::scale_parts;
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::split::{BINS, PLACE_DEVIATION, WEIGHTS_DEVIATION, knee, reach, unit};
use pullfocus_core::{Result, Size};

uniform! {
    /// See `census.wgsl`.
    CensusParams { width: u32, height: u32, knee: f32, per_step: f32 }
}

uniform! {
    /// See `split.wgsl`.
    SplitParams {
        pixels: f32,
        layers: u32,
        knee: f32,
        unit: f32,
        weights_reach: u32,
        place_reach: u32,
    }
}

/// Pixels that a workgroup counts: 64 columns, 8 rows for each of 4 rows of threads.
const TILE: [usize; 2] = [64, 32];
/// Kinds of counts, and words of each.
const WORDS: usize = 4 * 2;

/// Bytes of a `Split` (`scale.wgsl`): its head, then ramps and cuts.
pub const SPLIT_BYTES: u64 = 16 + 2 * 16 * MOST_LAYERS as u64;

/// Cuts the picture whose diameters are `coc` into at most `layers` layers: the buffer of a `Split`.
///
/// # Errors
/// [`pullfocus_core::Error::OutOfMemory`].
pub fn split(work: &mut Work<'_, '_>, coc: &wgpu::Buffer, layers: u32) -> Result<wgpu::Buffer> {
    let Size { width, height } = work.size;
    let (knee, unit) = (knee(work.display_width), unit(work.display_width));
    let totals = work.recorder.take(work.size, (BINS * WORDS * 4) as u64)?;
    work.recorder.encoder().clear_buffer(&totals, 0, None);
    let params = CensusParams { width: width as u32, height: height as u32, knee, per_step: 1.0 / unit };
    let [constants, scale] = scale_parts();
    let census = Spec::new(&[constants, scale, part!("layers/census")], &[]);
    let groups = [width.div_ceil(TILE[0]) as u32, height.div_ceil(TILE[1]) as u32, 1];
    work.recorder.run(&census, &params, &[coc, &totals], groups)?;

    let split = work.recorder.take(work.size, SPLIT_BYTES)?;
    let params = SplitParams {
        pixels: work.size.area() as f32,
        layers: layers.clamp(1, MOST_LAYERS),
        knee,
        unit,
        weights_reach: reach(WEIGHTS_DEVIATION) as u32,
        place_reach: reach(PLACE_DEVIATION) as u32,
    };
    let cut = Spec::new(&[constants, scale, part!("layers/split")], &[]);
    work.recorder.run(&cut, &params, &[&totals, &split], [1, 1, 1])?;
    work.recorder.give([totals]);
    Ok(split)
}
