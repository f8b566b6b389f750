//! Anti-aliased depth: noticing it and mending it.
//!
//! # Theory
//! A filtered depth holds, at an edge, a mean of a near and a far distance: a distance where nothing is. The
//! blur there is wrong, and the edge gets an outline. If the filter worked on the channel's own numbers then
//! the value's place between the two plateaus beside it *is* the share of the pixel that each covers, so the
//! pixel is given back to the one that covers more of it. Everything here works on the channel's numbers as
//! the file holds them, before they are decoded.
//!
//! # Practice
//! A pixel lies on an edge if the range of the 3 x 3 pixels around it is wide for its distance
//! ([`REPAIR_STEP`]) and nearly as wide as that of the 5 x 5 around it; on a slope, however steep, the wider window has twice the
//! range. On an edge, a value in the middle [`REPAIR_BLENDED`] of the range is blended.

use crate::rows::{fold_rows, for_each_row};
use pullfocus_core::depth::{REPAIR_BLENDED, REPAIR_NOTICE_STRIDE, REPAIR_SLOPE, REPAIR_STEP};
use pullfocus_core::{Cancel, DepthDecoding, Plane, Result};

/// What a pixel's surroundings say about it.
enum Place {
    Plain,
    Edge,
    Blended { mended: f32 },
}

fn place(plane: &Plane, decoding: &DepthDecoding, x: usize, y: usize) -> Place {
    let size = plane.size();
    let range = |reach: usize| {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for v in y.saturating_sub(reach)..(y + reach + 1).min(size.height) {
            for &value in &plane.row(v)[x.saturating_sub(reach)..(x + reach + 1).min(size.width)] {
                let value = decoding.plateau(value);
                low = low.min(value);
                high = high.max(value);
            }
        }
        (low, high)
    };
    let (low, high) = range(1);
    let step = high - low;
    if step <= REPAIR_STEP * high.abs().max(low.abs()) {
        return Place::Plain;
    }
    let (low5, high5) = range(2);
    if high5 - low5 > REPAIR_SLOPE * step {
        return Place::Plain;
    }
    let value = decoding.plateau(plane.at(x, y));
    let part = (value - low) / step;
    if part > REPAIR_BLENDED[0] && part < REPAIR_BLENDED[1] {
        Place::Blended { mended: if part < 0.5 { low } else { high } }
    } else {
        Place::Edge
    }
}

/// The part of the depth's edge pixels that hold a value from neither side; none where there are no edges.
pub fn blended_edges(plane: &Plane, decoding: &DepthDecoding, cancel: &Cancel) -> Result<Option<f32>> {
    let size = plane.size();
    let count = |i: usize| {
        let mut edges = [0u64; 2];
        for x in 0..size.width {
            match place(plane, decoding, x, i * REPAIR_NOTICE_STRIDE) {
                Place::Plain => {}
                Place::Edge => edges[0] += 1,
                Place::Blended { .. } => edges[1] += 1,
            }
        }
        edges
    };
    let counts = fold_rows(size.height.div_ceil(REPAIR_NOTICE_STRIDE), cancel, count, |a, b| {
        [a[0] + b[0], a[1] + b[1]]
    })?;
    Ok(counts
        .filter(|[clean, blended]| clean + blended > 0)
        .map(|[clean, blended]| blended as f32 / (clean + blended) as f32))
}

/// Writes `plane` into `mended`, with every blended edge value replaced by the plateau that covers more of
/// the pixel.
pub fn repair(plane: &Plane, decoding: &DepthDecoding, cancel: &Cancel, mended: &mut Plane) -> Result<()> {
    mended.resize(plane.size())?;
    for_each_row(mended, cancel, |y, row| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = match place(plane, decoding, x, y) {
                Place::Blended { mended } => mended,
                Place::Plain | Place::Edge => plane.at(x, y),
            };
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;
    use pullfocus_testkit::scenes::{box_filtered, centre_sampled};

    /// A near disc before a slope, with nothing behind its upper half.
    fn scene(size: Size) -> Plane {
        Plane::from_fn(size, |x, y| {
            let (u, v) = (x as f32 / size.width as f32, y as f32 / size.height as f32);
            let disc = (u - 0.5).powi(2) + (v - 0.5).powi(2) < 0.09;
            match (disc, v < 0.4) {
                (true, _) => 1.5,
                (false, true) => 1e6,
                (false, false) => 4.0 / (v - 0.3),
            }
        })
        .unwrap()
    }

    #[test]
    fn filtered_depth_is_noticed_and_mended_clean_depth_is_left_alone() {
        let large = scene(Size::new(1600, 1280));
        let (clean, filtered) = (centre_sampled(&large, 5), box_filtered(&large, 5));
        let (decoding, cancel) = (DepthDecoding::default(), Cancel::new());
        let noticed = |plane: &Plane| blended_edges(plane, &decoding, &cancel).unwrap().unwrap();
        let (of_clean, of_filtered) = (noticed(&clean), noticed(&filtered));
        assert!(of_clean < 0.5 * pullfocus_core::report::ANTI_ALIASED_FROM, "{of_clean}");
        assert!(of_filtered > pullfocus_core::report::ANTI_ALIASED_FROM, "{of_filtered}");

        let mut mended = Plane::default();
        repair(&clean, &decoding, &cancel, &mut mended).unwrap();
        assert_eq!(mended, clean, "clean depth stays as it is");
        repair(&filtered, &decoding, &cancel, &mut mended).unwrap();
        // How many pixels lie at a depth where nothing is: more than 5 % from the true one, in dioptres of the nearest.
        let wrong = |plane: &Plane| {
            let pairs = plane.data().iter().zip(clean.data());
            pairs.filter(|(a, b)| (1.0 / *a - 1.0 / *b).abs() > 0.05 / 1.5).count()
        };
        let (before, after) = (wrong(&filtered), wrong(&mended));
        // What is left are pixels that both sides cover about equally: either depth is true of half of them.
        assert!(before > 200 && after < before / 4, "{before} {after}");
    }

    #[test]
    fn slopes_are_no_edges() {
        let slope = Plane::from_fn(Size::new(64, 48), |x, y| 1.0 + 0.5 * x as f32 + 0.3 * y as f32).unwrap();
        let decoding = DepthDecoding::default();
        let mut mended = Plane::default();
        repair(&slope, &decoding, &Cancel::new(), &mut mended).unwrap();
        assert_eq!(mended, slope);
    }
}
