//! Filling a layer where it is not seen: normalised averages at several scales, coarse ones where fine ones
//! found nothing.
//!
//! # Theory
//! At each scale values and weights are smoothed alike (one backward-Euler step with constant beta: the papers' tool) and
//! divided, `f = (smooth(w x) + eps f_coarser) / (smooth(w) + eps)`: where weight is near, the average of what
//! is near; where none is, the coarser scale's answer. Nothing is singular, however large the hole.
//!
//! # Practice
//! Coarse scales are computed on coarse grids, so the cost is little more than the finest grid's.

use crate::rows::{for_each_row, rows_of};
use crate::work::Work;
use pullfocus_core::split::unit;
use pullfocus_core::{Cancel, Plane, Result, Size};
use rayon::prelude::*;

/// Standard deviation in units ([`unit`]) and grid step, from fine to coarse.
const SCALES: [(f32, usize); 4] = [(1.5, 1), (4.0, 2), (12.0, 8), (64.0, 16)];
/// What the coarser scale weighs beside the finer one's own.
const COARSER: f32 = 0.003;

/// The grid of the finest scale, for pictures of this width: one value for each `step` x `step` pixels.
pub fn finest_step(display_width: f32) -> usize {
    let mut step = FINEST;
    while (2 * step) as f32 <= unit(display_width) * FINEST as f32 * 1.01 {
        step *= 2;
    }
    step
}

/// Pixels a step of the finest grid at a width of 960.
const FINEST: usize = 1;

/// Values on a coarse grid: node (i, j) is the mean of the pixels `i step .. (i + 1) step` across, and so down.
pub fn grid_size(size: Size, step: usize) -> Size {
    Size::new(size.width.div_ceil(step), size.height.div_ceil(step))
}

/// Where a fill's values come from: a row of source `k` at row `y` of the picture.
pub trait Sources: Sync {
    /// Number of sources.
    fn count(&self) -> usize;
    /// Writes row `y` of source `k` for all columns.
    fn row(&self, k: usize, y: usize, out: &mut [f32]);
    /// Writes row `y` of the weights.
    fn weights(&self, y: usize, out: &mut [f32]);
}

/// Fills every source from where its weight is. The planes are on the finest grid ([`finest_step`]).
pub fn fill(work: &mut Work<'_>, size: Size, sources: &impl Sources) -> Result<Vec<Plane>> {
    let first = finest_step(work.display_width);
    let count = sources.count();
    let mut levels: Vec<Vec<Plane>> = Vec::with_capacity(SCALES.len());
    let mut fine = Vec::with_capacity(count + 1);
    for _ in 0..=count {
        fine.push(work.memory.planes.take(grid_size(size, first))?);
    }
    gather(work.cancel, size, first, sources, &mut fine)?;
    levels.push(fine);
    for level in 1..SCALES.len() {
        let ratio = SCALES[level].1 / SCALES[level - 1].1;
        let mut coarse = Vec::with_capacity(count + 1);
        for plane in &levels[level - 1] {
            let mut half = work.memory.planes.take(grid_size(plane.size(), ratio))?;
            shrink(work.cancel, plane, ratio, &mut half)?;
            coarse.push(half);
        }
        levels.push(coarse);
    }
    for (planes, (deviation, step)) in levels.iter_mut().zip(SCALES) {
        // A circle of diameter d has the variance d^2 / 16 along an axis.
        let diameter = 4.0 * deviation * unit(work.display_width) / (step * first / FINEST) as f32;
        let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
        work.smooth(&mut planes, diameter)?;
    }

    let mut coarser: Option<(Vec<Plane>, usize)> = None;
    for (mut planes, (_, step)) in levels.into_iter().zip(SCALES).rev() {
        let Some(weights) = planes.pop() else { continue };
        for (k, plane) in planes.iter_mut().enumerate() {
            let below = coarser.as_ref().map(|(below, coarse_step)| (&below[k], coarse_step / step));
            divide(work.cancel, plane, &weights, below)?;
        }
        work.memory.planes.give([weights]);
        if let Some((below, _)) = coarser.replace((planes, step)) {
            work.memory.planes.give(below);
        }
    }
    Ok(coarser.map(|(planes, _)| planes).unwrap_or_default())
}

/// Means of value times weight, then of the weight, over the cells of the finest grid.
fn gather(
    cancel: &Cancel,
    size: Size,
    step: usize,
    sources: &impl Sources,
    planes: &mut [Plane],
) -> Result<()> {
    let grid = grid_size(size, step);
    if grid.area() == 0 {
        return Ok(());
    }
    rows_of(planes).par_iter_mut().enumerate().with_min_len(8).try_for_each_init(
        || (vec![0f32; size.width], vec![0f32; size.width]),
        |(weights, values), (j, out)| {
            cancel.check()?;
            for plane in out.iter_mut() {
                plane.fill(0.0);
            }
            for dy in 0..step {
                let y = (j * step + dy).min(size.height - 1);
                sources.weights(y, weights);
                let (last, planes) = match out.split_last_mut() {
                    Some(split) => split,
                    None => return Ok(()),
                };
                add_cells(last, weights, step);
                for (k, plane) in planes.iter_mut().enumerate() {
                    sources.row(k, y, values);
                    for (value, weight) in values.iter_mut().zip(weights.iter()) {
                        *value *= weight;
                    }
                    add_cells(plane, values, step);
                }
            }
            let share = 1.0 / (step * step) as f32;
            for plane in out.iter_mut() {
                for value in plane.iter_mut() {
                    *value *= share;
                }
            }
            Ok(())
        },
    )
}

/// Adds each `step` values of a row to its cell; the last value stands in for those beyond the border.
fn add_cells(cells: &mut [f32], values: &[f32], step: usize) {
    if step == 1 {
        for (cell, value) in cells.iter_mut().zip(values) {
            *cell += value;
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
                // Less than this is what is left of weights dozens of deviations away.
                *value = if *weight > 1e-18 { *value / *weight } else { 0.0 };
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

/// Row `y` of `plane` enlarged `ratio` times, bilinearly, from column `x0` on.
pub fn enlarge_row(plane: &Plane, ratio: usize, y: usize, x0: usize, out: &mut [f32]) {
    if ratio == 1 {
        out.copy_from_slice(&plane.row(y)[x0..][..out.len()]);
        return;
    }
    let size = plane.size();
    let place = |at: usize, nodes: usize| {
        let t = (at as f32 + 0.5) / ratio as f32 - 0.5;
        let low = t.floor();
        let index = low as isize;
        let clamp = |i: isize| i.clamp(0, nodes as isize - 1) as usize;
        (clamp(index), clamp(index + 1), t - low)
    };
    let (j0, j1, down) = place(y, size.height);
    let (above, below) = (plane.row(j0), plane.row(j1));
    let node = |i: usize| above[i] + (below[i] - above[i]) * down;
    let mut x = 0;
    while x < out.len() {
        // All pixels of one cell half lie between the same two nodes.
        let (i0, i1, _) = place(x0 + x, size.width);
        let (left, right) = (node(i0), node(i1));
        let start = x;
        while x < out.len() {
            let (k0, k1, across) = place(x0 + x, size.width);
            if (k0, k1) != (i0, i1) && x > start {
                break;
            }
            out[x] = left + (right - left) * across;
            x += 1;
        }
    }
}
