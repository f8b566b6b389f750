//! The small Gaussians that the pyramid's levels get, as tables.

use super::footprint::{of_place, place};
use pullfocus_core::Quality;
use pullfocus_core::pyramid::{
    LEAST_TABLED, LEVEL_PHASES, PHASES, most_variance, phase_offset, reach, reach_of, splat,
};

/// Weights of one axis by position in a cell and variance. Between two variances they are mixed, which keeps sum, mean and variance
/// exactly.
#[derive(Debug)]
pub struct Table {
    /// The variance of the first entry after 0.
    first: f32,
    /// Variances for each position.
    entries: usize,
    stride: usize,
    /// [position][variance][weight].
    weights: Vec<f32>,
    /// Cells to either side that each variance has.
    reaches: Vec<usize>,
}

impl Table {
    /// For middles at each of `offsets` from the middle of the cell, and variances from `first` (on the `finest` level from 0) to `most`.
    fn new(offsets: impl Iterator<Item = f64>, first: f32, finest: bool, most: f64, stride: usize) -> Self {
        let reach = reach(most);
        let entries = place(most as f32, first).0 + 2;
        let of = |entry: usize| f64::from(of_place(entry, first));
        let reaches: Vec<usize> = (0..entries).map(|entry| reach_of(of(entry), finest, reach)).collect();
        let mut weights: Vec<f32> = Vec::new();
        for offset in offsets {
            for entry in 0..entries {
                // What comes before the first is never asked for, but on the finest level.
                let entry = if finest { entry } else { entry.max(1) };
                let own = reaches[entry];
                weights.resize(weights.len() + reach - own, 0.0);
                weights.extend(splat(of(entry), offset, finest, own).into_iter().map(|w| w as f32));
                weights.resize(weights.len().next_multiple_of(stride), 0.0);
            }
        }
        Self { first, entries, stride, weights, reaches }
    }

    /// Returns how many cells to either side of the middle one have any.
    #[inline(always)]
    fn weights(&self, position: usize, variance: f32, out: &mut [f32]) -> usize {
        let (entry, part) = place(variance, self.first);
        let entry = entry.min(self.entries - 2);
        let at = (position * self.entries + entry) * self.stride;
        let (low, high) = self.weights[at..at + 2 * self.stride].split_at(self.stride);
        for ((out, low), high) in out.iter_mut().zip(low).zip(high) {
            *out = low + (high - low) * part;
        }
        // Of two that are mixed the later one has more; of the first alone there is nothing of it.
        self.reaches[if part == 0.0 { entry } else { entry + 1 }]
    }
}

/// Weights of one axis for every level, position of the pixel in its cell, and variance.
#[derive(Debug)]
pub struct Splats {
    /// Cells to either side.
    pub reach: usize,
    /// Weights of one splat, `2 reach + 1` of them and zeros up to a whole number of vectors.
    pub stride: usize,
    /// One for each level up to the last whose positions differ.
    levels: Vec<Table>,
    /// For middles of cells of their own level, and for those half a cell farther on.
    cells: [Table; 2],
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
        let levels = (0..LEVEL_PHASES).map(|level| {
            let offsets = (0..1 << level).map(|phase| phase_offset(level, phase));
            Table::new(offsets, first(level), level == 0, most, stride)
        });
        let cell = |offset| Table::new(std::iter::once(offset), LEAST_TABLED, false, most, stride);
        Self { reach, stride, levels: levels.collect(), cells: [cell(0.0), cell(0.5)] }
    }

    /// The weights of the pixel at `position` along the axis on a level: those of the cells from `(position >> level) - reach`
    /// on. Returns how many to either side of the middle one are not 0.
    #[inline(always)]
    pub fn weights(&self, level: usize, position: usize, variance: f32, out: &mut [f32]) -> usize {
        let tabled = level.min(LEVEL_PHASES - 1);
        let phase = (position & ((1 << level) - 1)) >> (level - tabled);
        debug_assert!(phase < PHASES);
        self.levels[tabled].weights(phase, variance, out)
    }

    /// The weights, on a level, of the middle of a cell of 2^`cell` pixels, the `position`-th along the axis: those of the cells from
    /// [`middle`] less `reach` on. The level is `cell - 1` at least. On the finest level what is spread is the lattice's Gaussian, down to the
    /// pixel itself, and what is gathered a sampled one, of 1/2 at least.
    #[inline(always)]
    pub fn of_cell(
        &self,
        (cell, position): (usize, i32),
        level: usize,
        variance: f32,
        spreads: bool,
        out: &mut [f32],
    ) {
        // All of them are written, to the last zero.
        let _ = match level.checked_sub(cell) {
            None => self.cells[1].weights(0, variance, out),
            Some(0) if cell > 0 || !spreads => self.cells[0].weights(0, variance, out),
            Some(up) => self.weights(up, position as usize, variance, out),
        };
    }
}

/// The cell, on a level, in which the middle of a cell of 2^`cell` pixels lies, or which ends there.
#[inline(always)]
pub fn middle(cell: usize, level: usize, position: i32) -> isize {
    if level < cell { 2 * position as isize } else { position as isize >> (level - cell) }
}
