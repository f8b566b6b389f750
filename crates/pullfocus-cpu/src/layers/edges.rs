//! Depth edges: the pixels that hold two colours and one depth.

use crate::rows::for_each_row;
use crate::work::Work;
use pullfocus_core::layers::general::EDGE_STEP;
use pullfocus_core::split::{Split, smoothstep, unit};
use pullfocus_core::{Plane, Result};

/// A picture's depth edges.
pub struct Edges {
    /// Smallest diameter of the 3 x 3 pixels around: the nearest thing there.
    pub near: Plane,
    /// Largest diameter of the 3 x 3 pixels around: the farthest thing there.
    pub far: Plane,
    /// How much of an edge between layers the pixel is, 0 to 1.
    pub strength: Plane,
}

/// Finds the edges of `coc`.
pub fn find(work: &mut Work<'_>, coc: &Plane, split: &Split) -> Result<Edges> {
    let size = coc.size();
    let mut near = work.memory.planes.take(size)?;
    let mut far = work.memory.planes.take(size)?;
    let mut strength = work.memory.planes.take(size)?;
    for (plane, pick) in [(&mut near, f32::min as fn(f32, f32) -> f32), (&mut far, f32::max)] {
        for_each_row(plane, work.cancel, |y, row| {
            row.copy_from_slice(coc.row(y));
            let above = coc.row(y.saturating_sub(1));
            let below = coc.row((y + 1).min(size.height - 1));
            for ((value, &a), &b) in row.iter_mut().zip(above).zip(below) {
                *value = pick(*value, pick(a, b));
            }
            let mut before = row.first().copied().unwrap_or_default();
            for x in 0..row.len() {
                let own = row[x];
                let after = row.get(x + 1).copied().unwrap_or(own);
                row[x] = pick(own, pick(before, after));
                before = own;
            }
        })?;
    }
    let unit = unit(work.display_width);
    let ramps: Vec<_> = (0..split.layers()).map(|layer| split.ramps(layer)).collect();
    for_each_row(&mut strength, work.cancel, |y, row| {
        for ((strength, &near), &far) in row.iter_mut().zip(near.row(y)).zip(far.row(y)) {
            let step = (far - near) / unit;
            *strength = if step <= EDGE_STEP[0] {
                0.0
            } else {
                let (near, far) = (split.position(near), split.position(far));
                let apart: f32 =
                    ramps.iter().map(|ramps| (ramps.at(near).seen - ramps.at(far).seen).abs()).sum();
                smoothstep((step - EDGE_STEP[0]) / (EDGE_STEP[1] - EDGE_STEP[0])) * apart.min(1.0)
            };
        }
    })?;
    Ok(Edges { near, far, strength })
}

impl Edges {
    /// Gives the planes back.
    pub fn give_back(self, work: &mut Work<'_>) {
        work.memory.planes.give([self.near, self.far, self.strength]);
    }
}
