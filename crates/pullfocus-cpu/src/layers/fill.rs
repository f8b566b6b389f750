//! Filling a layer where it is not seen: normalised averages at several scales, coarse ones where fine ones
//! found nothing.
//!
//! See [`pullfocus_core::layers::fill`] for the formula.
//!
//! # Practice
//! Coarse scales are computed on coarse grids, so the cost is little more than the finest grid's.

use crate::rows::{for_each_row, rows_of};
use crate::wide;
use crate::work::Work;
use pullfocus_core::layers::fill::{COARSER, LEAST_WEIGHT, SCALES, diameter, finest_step, grid_size};
use pullfocus_core::{Cancel, Plane, Result, Size};
use rayon::prelude::*;

/// Where a fill's values come from.
pub trait Sources: Sync {
    /// How many values each group has that shares a weight.
    fn groups(&self) -> &[usize];
    /// Writes row `y`: for each group its values times their weight, then the weight.
    fn weighted_rows(&self, y: usize, rows: &mut [Vec<f32>]);
}

/// Fills every value of every group from where its weight is. The planes are on the finest grid ([`finest_step`]).
pub fn fill(work: &mut Work<'_>, size: Size, sources: &impl Sources) -> Result<Vec<Plane>> {
    let first = finest_step(work.display_width);
    let count: usize = sources.groups().iter().map(|values| values + 1).sum();
    let mut levels: Vec<Vec<Plane>> = Vec::with_capacity(SCALES.len());
    let mut fine = Vec::with_capacity(count);
    for _ in 0..count {
        fine.push(work.memory.planes.take(grid_size(size, first))?);
    }
    gather(work.cancel, size, first, sources, &mut fine)?;
    levels.push(fine);
    for level in 1..SCALES.len() {
        let ratio = SCALES[level].1 / SCALES[level - 1].1;
        let mut coarse = Vec::with_capacity(count);
        for plane in &levels[level - 1] {
            let mut shrunk = work.memory.planes.take(grid_size(plane.size(), ratio))?;
            shrink(work.cancel, plane, ratio, &mut shrunk)?;
            coarse.push(shrunk);
        }
        levels.push(coarse);
    }
    for (scale, planes) in levels.iter_mut().enumerate() {
        let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
        work.smooth(&mut planes, diameter(scale, work.display_width))?;
    }

    let mut coarser: Option<(Vec<Plane>, usize)> = None;
    for (mut planes, (_, step)) in levels.into_iter().zip(SCALES).rev() {
        let mut filled = Vec::with_capacity(count);
        for &values in sources.groups() {
            let rest = planes.split_off(values + 1);
            let weights = planes.pop().unwrap_or_default();
            for plane in &mut planes {
                let below = coarser.as_ref().map(|(below, coarse)| (&below[filled.len()], coarse / step));
                divide(work.cancel, plane, &weights, below)?;
                filled.push(std::mem::take(plane));
            }
            work.memory.planes.give([weights]);
            planes = rest;
        }
        if let Some((below, _)) = coarser.replace((filled, step)) {
            work.memory.planes.give(below);
        }
    }
    Ok(coarser.map(|(planes, _)| planes).unwrap_or_default())
}

/// One row of cells of the finest grid, as sums.
struct CellRow<'a, 'b, S> {
    sources: &'a S,
    first: usize,
    last: usize,
    step: usize,
    rows: &'a mut [Vec<f32>],
    cells: &'a mut [&'b mut [f32]],
}

impl<S: Sources> wide::Work for CellRow<'_, '_, S> {
    #[inline(always)]
    fn run(self) {
        for dy in 0..self.step {
            self.sources.weighted_rows((self.first + dy).min(self.last), self.rows);
            for (cells, row) in self.cells.iter_mut().zip(self.rows.iter()) {
                add_cells(cells, row, self.step);
            }
        }
    }
}

/// Means of what the sources give over the cells of the finest grid.
fn gather(
    cancel: &Cancel,
    size: Size,
    step: usize,
    sources: &impl Sources,
    planes: &mut [Plane],
) -> Result<()> {
    let count = planes.len();
    rows_of(planes).par_iter_mut().enumerate().with_min_len(8).try_for_each_init(
        || vec![vec![0f32; size.width]; count],
        |rows, (j, cells)| {
            cancel.check()?;
            for cells in cells.iter_mut() {
                cells.fill(0.0);
            }
            wide::run(CellRow { sources, first: j * step, last: size.height - 1, step, rows, cells });
            let share = 1.0 / (step * step) as f32;
            for value in cells.iter_mut().flat_map(|cells| cells.iter_mut()) {
                *value *= share;
            }
            Ok(())
        },
    )
}

/// Adds each `step` values of a row to its cell; the last value stands in for those beyond the border.
#[inline(always)]
fn add_cells(cells: &mut [f32], values: &[f32], step: usize) {
    if step == 1 {
        for (cell, value) in cells.iter_mut().zip(values) {
            *cell += value;
        }
        return;
    }
    if step == 2 {
        for (cell, pair) in cells.iter_mut().zip(values.chunks_exact(2)) {
            *cell += pair[0] + pair[1];
        }
        if let (Some(cell), [last]) = (cells.last_mut(), values.chunks_exact(2).remainder()) {
            *cell += 2.0 * last;
        }
        return;
    }
    let missing = cells.len() * step - values.len();
    for (cell, values) in cells.iter_mut().zip(values.chunks(step)) {
        *cell += values.iter().sum::<f32>();
    }
    if let (Some(cell), Some(last)) = (cells.last_mut(), values.last()) {
        *cell += missing as f32 * last;
    }
}

/// Means over `ratio` x `ratio` values; the border's values stand in for those beyond.
fn shrink(cancel: &Cancel, from: &Plane, ratio: usize, to: &mut Plane) -> Result<()> {
    let height = from.size().height;
    for_each_row(to, cancel, |j, row| {
        row.fill(0.0);
        for dy in 0..ratio {
            add_cells(row, from.row((j * ratio + dy).min(height - 1)), ratio);
        }
        let share = 1.0 / (ratio * ratio) as f32;
        for value in row {
            *value *= share;
        }
    })
}

/// `f = (sum + eps f_coarser) / (weight + eps)`; at the coarsest scale the plain quotient.
fn divide(
    cancel: &Cancel,
    sums: &mut Plane,
    weights: &Plane,
    coarser: Option<(&Plane, usize)>,
) -> Result<()> {
    let width = sums.size().width;
    for_each_row(sums, cancel, |y, row| match coarser {
        None => {
            for (value, weight) in row.iter_mut().zip(weights.row(y)) {
                *value = if *weight > LEAST_WEIGHT { *value / *weight } else { 0.0 };
            }
        }
        Some((coarse, ratio)) => {
            let mut above = vec![0.0; width];
            enlarge_row(coarse, ratio, y, 0, &mut above);
            for ((value, weight), above) in row.iter_mut().zip(weights.row(y)).zip(&above) {
                *value = (*value + COARSER * above) / (weight + COARSER);
            }
        }
    })
}

/// Row `y` of `plane` enlarged `ratio` times (1 or an even number), bilinearly, from column `x0` on; `x0` is
/// a multiple of the ratio.
#[inline(always)]
pub fn enlarge_row(plane: &Plane, ratio: usize, y: usize, x0: usize, out: &mut [f32]) {
    if ratio == 1 {
        out.copy_from_slice(&plane.row(y)[x0..][..out.len()]);
        return;
    }
    let size = plane.size();
    // Where a pixel lies between the node before its cell's or that cell's, and the next one.
    let place = |at: usize| {
        let t = (at % ratio) as f32 + 0.5 - 0.5 * ratio as f32;
        let cell = at / ratio;
        let part = t / ratio as f32;
        if part < 0.0 { (cell.saturating_sub(1), cell, 1.0 + part) } else { (cell, cell + 1, part) }
    };
    let (j0, j1, down) = place(y);
    let (above, below) = (plane.row(j0), plane.row(j1.min(size.height - 1)));
    let node = |i: usize| above[i] + (below[i] - above[i]) * down;
    let first = x0 / ratio;
    let mut before = node(first.saturating_sub(1));
    let mut own = node(first);
    for (k, cell) in out.chunks_mut(ratio).enumerate() {
        let after = node((first + k + 1).min(size.width - 1));
        for (r, value) in cell.iter_mut().enumerate() {
            let part = (r as f32 + 0.5) / ratio as f32 - 0.5;
            *value = if part < 0.0 { own + (own - before) * part } else { own + (after - own) * part };
        }
        (before, own) = (own, after);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enlarging_is_bilinear_and_stays_within_the_border() {
        let plane = Plane::from_fn(Size::new(5, 4), |x, y| (3 * x + 7 * y) as f32).unwrap();
        for ratio in [1usize, 2, 4, 8] {
            for y in 0..4 * ratio {
                let mut row = vec![0.0; 5 * ratio];
                enlarge_row(&plane, ratio, y, 0, &mut row);
                for (x, value) in row.iter().enumerate() {
                    let at = |i: usize, n: usize| {
                        ((i as f32 + 0.5) / ratio as f32 - 0.5).clamp(0.0, n as f32 - 1.0)
                    };
                    let expected = 3.0 * at(x, 5) + 7.0 * at(y, 4);
                    // Sums of a few f32 below 40.
                    assert!((value - expected).abs() < 1e-4, "{ratio} {x} {y} {value} {expected}");
                }
                let mut part = vec![0.0; 2 * ratio];
                enlarge_row(&plane, ratio, y, ratio, &mut part);
                assert_eq!(part, row[ratio..3 * ratio]);
            }
        }
    }
}
