//! The small Gaussians that the pyramid's levels get, as tables.

use super::footprint::{of_place, place};
use pullfocus_core::Quality;
use pullfocus_core::pyramid::{
    LEAST_TABLED, LEVEL_PHASES, PHASES, most_variance, phase_offset, reach, reach_of, splat,
};

/// Weights of one axis for every level, position of the pixel in its cell, and variance. Between two variances they
/// are mixed, which keeps sum, mean and variance exactly.
#[derive(Debug)]
pub struct Splats {
    /// Cells to either side.
    pub reach: usize,
    /// Weights of one splat, `2 reach + 1` of them and zeros up to a whole number of vectors.
    pub stride: usize,
    /// One table for each level up to the last whose positions differ: [phase][variance][weight].
    levels: Vec<Vec<f32>>,
    /// Variances in each.
    entries: Vec<usize>,
    /// Cells to either side that each of them has.
    reaches: Vec<Vec<usize>>,
}

/// The variance of the first table entry after 0: the finest level starts at the pixel itself.
fn first(level: usize) -> f32 {
    if level == 0 { 1.0 / 64.0 } else { LEAST_TABLED }
}

impl Splats {
    /// The tables of an axis whose variances are `ratio` times those that choose the level.
    pub fn new(quality: Quality, ratio: f32) -> Self {
        let most = most_variance(quality, f64::from(ratio));
        let reach = reach(most);
        let stride = (2 * reach + 1).next_multiple_of(8);
        let (mut levels, mut entries, mut reaches) = (Vec::new(), Vec::new(), Vec::new());
        for level in 0..LEVEL_PHASES {
            let count = place(most as f32, first(level)).0 + 2;
            let mut table = Vec::with_capacity((count * stride) << level);
            let own: Vec<usize> = (0..count)
                .map(|entry| reach_of(f64::from(of_place(entry, first(level))), level == 0, reach))
                .collect();
            for phase in 0..1 << level {
                for entry in 0..count {
                    // What comes before the first is never asked for, but on the finest level.
                    let entry = if level > 0 { entry.max(1) } else { entry };
                    let variance = f64::from(of_place(entry, first(level)));
                    let skipped = reach - own[entry];
                    let weights = splat(variance, phase_offset(level, phase), level == 0, own[entry]);
                    table.resize(table.len() + skipped, 0.0);
                    table.extend(weights.into_iter().map(|w| w as f32));
                    table.resize(table.len().next_multiple_of(stride), 0.0);
                }
            }
            levels.push(table);
            entries.push(count);
            reaches.push(own);
        }
        Self { reach, stride, levels, entries, reaches }
    }

    /// The weights of the pixel at `position` along the axis on a level: those of the cells from `(position >> level) - reach`
    /// on. Returns how many to either side of the middle one are not 0.
    #[inline(always)]
    pub fn weights(&self, level: usize, position: usize, variance: f32, out: &mut [f32]) -> usize {
        let tabled = level.min(LEVEL_PHASES - 1);
        let phase = (position & ((1 << level) - 1)) >> (level - tabled);
        debug_assert!(phase < PHASES);
        let (entry, part) = place(variance, first(level));
        let entry = entry.min(self.entries[tabled] - 2);
        let at = (phase * self.entries[tabled] + entry) * self.stride;
        let (low, high) = self.levels[tabled][at..at + 2 * self.stride].split_at(self.stride);
        for ((out, low), high) in out.iter_mut().zip(low).zip(high) {
            *out = low + (high - low) * part;
        }
        // Of two that are mixed the later one has more; of the first alone there is nothing of it.
        self.reaches[tabled][if part == 0.0 { entry } else { entry + 1 }]
    }
}
