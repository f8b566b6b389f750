//! Filling a layer where it is not seen: normalised averages at several scales, coarse ones where fine ones found nothing.
//! See [`pullfocus_core::layers::fill`] for the formula.
//!
//! Values stand in groups of three, with the weight that they share as the fourth: one smoothing does all of it.

use crate::planes::{Group, Storage, workgroups};
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::layers::fill::{COARSER, LEAST_WEIGHT, SCALES, diameter, grid_size};
use pullfocus_core::{Result, Size};

uniform! {
    /// See `shrink.wgsl`.
    ShrinkParams { fine_width: u32, fine_height: u32, width: u32, height: u32, ratio: u32 }
}

uniform! {
    /// See `divide.wgsl`.
    DivideParams {
        width: u32,
        height: u32,
        coarse_width: u32,
        coarse_height: u32,
        ratio: u32,
        coarser: f32,
        least_weight: f32,
    }
}

/// Fills three values (times their weight in x, y, z; the weight in w) of every group from where the weight is. Groups
/// are on the finest grid ([`pullfocus_core::layers::fill::finest_step`]) and of f32; what comes back in w means nothing.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`], a host's
/// [`pullfocus_core::Error::Cancelled`].
pub fn fill(work: &mut Work<'_, '_>, grid: Size, weighted: Vec<Group>) -> Result<Vec<Group>> {
    let shrink = Spec::new(&[part!("layers/shrink")], &[]);
    let mut levels = vec![(grid, weighted)];
    for scale in 1..SCALES.len() {
        let ratio = SCALES[scale].1 / SCALES[scale - 1].1;
        let (fine_size, fine) = &levels[scale - 1];
        let size = grid_size(*fine_size, ratio);
        let params = ShrinkParams {
            fine_width: fine_size.width as u32,
            fine_height: fine_size.height as u32,
            width: size.width as u32,
            height: size.height as u32,
            ratio: ratio as u32,
        };
        // Groups do not wait for each other within a pass, whose barriers are all at its beginning.
        work.recorder.end_pass();
        let mut coarse = Vec::with_capacity(fine.len());
        for group in fine {
            let shrunk = Group::take(work.recorder, size, 4, Storage::Full)?;
            let shrunk = Group { layer: group.layer, ..shrunk };
            work.recorder.run(&shrink, &params, &[&group.buffer, &shrunk.buffer], workgroups(size))?;
            coarse.push(shrunk);
        }
        levels.push((size, coarse));
    }
    for (scale, (size, groups)) in levels.iter().enumerate() {
        let groups: Vec<&Group> = groups.iter().collect();
        work.smooth(*size, &groups, diameter(scale, work.display_width), None)?;
    }

    let divide = Spec::new(&[part!("layers/enlarge"), part!("layers/divide")], &[]);
    let mut coarser: Option<(Size, Vec<Group>)> = None;
    for (scale, (size, groups)) in levels.into_iter().enumerate().rev() {
        let (coarse_size, ratio) = match &coarser {
            Some((coarse_size, _)) => (*coarse_size, SCALES[scale + 1].1 / SCALES[scale].1),
            None => (size, 0),
        };
        let params = DivideParams {
            width: size.width as u32,
            height: size.height as u32,
            coarse_width: coarse_size.width as u32,
            coarse_height: coarse_size.height as u32,
            ratio: ratio as u32,
            coarser: COARSER,
            least_weight: LEAST_WEIGHT,
        };
        let nothing = work.recorder.memory.nothing.clone();
        work.recorder.end_pass();
        for (i, group) in groups.iter().enumerate() {
            let above = coarser.as_ref().map_or(&nothing, |(_, above)| &above[i].buffer);
            work.recorder.run(&divide, &params, &[above, &group.buffer], workgroups(size))?;
        }
        if let Some((_, above)) = coarser.replace((size, groups)) {
            work.recorder.give(above.into_iter().map(|group| group.buffer));
        }
    }
    Ok(coarser.map(|(_, groups)| groups).unwrap_or_default())
}
