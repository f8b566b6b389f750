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
//! ([`STEP`]) and nearly as wide as that of the 5 x 5 around it; on a slope, however steep, the wider window has twice the
//! range. On an edge, a value in the middle [`BLENDED`] of the range is blended.

use crate::rows::{fold_rows, for_each_row};
use pullfocus_core::{Cancel, DepthDecoding, DepthKind, Plane, Result};

/// An edge's step, as a part of the larger of its two values.
const STEP: f32 = 0.1;
/// A slope doubles its range from 3 to 5 pixels; an edge between plateaus keeps it. Between the two.
const SLOPE: f32 = 1.5;
/// Values within these parts of the range are neither of the plateaus.
const BLENDED: [f32; 2] = [0.08, 0.92];

/// What a pixel's surroundings say about it.
enum Place {
    Plain,
    Edge,
    Blended { mended: f32 },
}

/// Values that mean "nothing there" as the farthest value, so that they can be a plateau.
fn plateau(decoding: &DepthDecoding, value: f32) -> f32 {
    match decoding.kind {
        DepthKind::Planar | DepthKind::Ray => {
            let nothing = !(value.abs() > 0.0 && value.abs() < 1e9);
            if nothing { 1e9 } else { value.abs() }
        }
        _ if value.is_finite() => value,
        _ => 0.0,
    }
}

fn place(plane: &Plane, decoding: &DepthDecoding, x: usize, y: usize) -> Place {
    let size = plane.size();
    let range = |reach: usize| {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for v in y.saturating_sub(reach)..(y + reach + 1).min(size.height) {
            for &value in &plane.row(v)[x.saturating_sub(reach)..(x + reach + 1).min(size.width)] {
                let value = plateau(decoding, value);
                low = low.min(value);
                high = high.max(value);
            }
        }
        (low, high)
    };
    let (low, high) = range(1);
    let step = high - low;
    if step <= STEP * high.abs().max(low.abs()) {
        return Place::Plain;
    }
    let (low5, high5) = range(2);
    if high5 - low5 > SLOPE * step {
        return Place::Plain;
    }
    let value = plateau(decoding, plane.at(x, y));
    let part = (value - low) / step;
    if part > BLENDED[0] && part < BLENDED[1] {
        Place::Blended { mended: if part < 0.5 { low } else { high } }
    } else {
        Place::Edge
    }
}

/// One row in so many is looked at to notice filtered depth: edges run through many rows.
const NOTICE_STRIDE: usize = 16;

/// The part of the depth's edge pixels that hold a value from neither side; none where there are no edges.
pub fn blended_edges(plane: &Plane, decoding: &DepthDecoding, cancel: &Cancel) -> Result<Option<f32>> {
    let size = plane.size();
    let count = |i: usize| {
        let mut edges = [0u64; 2];
        for x in 0..size.width {
            match place(plane, decoding, x, i * NOTICE_STRIDE) {
                Place::Plain => {}
                Place::Edge => edges[0] += 1,
                Place::Blended { .. } => edges[1] += 1,
            }
        }
        edges
    };
    let counts =
        fold_rows(size.height.div_ceil(NOTICE_STRIDE), cancel, count, |a, b| [a[0] + b[0], a[1] + b[1]])?;
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
