//! How layers are filled where they are not seen: scales, grids, weights; the same for every backend.
//!
//! At each scale values and weights are smoothed alike (one backward-Euler step with constant beta: the papers' tool) and
//! divided, `f = (smooth(w x) + eps f_coarser) / (smooth(w) + eps)`: where weight is near, the average of what
//! is near; where none is, the coarser scale's answer. Nothing is singular, however large the hole.

use crate::size::Size;
use crate::split::unit;

/// Standard deviation in units ([`unit()`]) and grid step in nodes of the finest grid, from fine to coarse.
pub const SCALES: [(f32, usize); 4] = [(1.5, 1), (4.0, 2), (12.0, 8), (64.0, 16)];

/// What the coarser scale weighs beside the finer one's own (eps).
pub const COARSER: f32 = 0.003;

/// Less weight than this is what is left of weights dozens of deviations away: the coarsest scale is 0 there.
pub const LEAST_WEIGHT: f32 = 1e-18;

/// The grid of the finest scale, for pictures of this width: one value for each `step` x `step` pixels, 1 at a width
/// of 960 and below.
pub fn finest_step(display_width: f32) -> usize {
    let mut step = 1;
    while (2 * step) as f32 <= unit(display_width) * 1.01 {
        step *= 2;
    }
    step
}

/// Values on a coarse grid: node (i, j) is the mean of the pixels `i step .. (i + 1) step` across, and so down; the
/// border's pixels stand in for those beyond.
pub fn grid_size(size: Size, step: usize) -> Size {
    Size::new(size.width.div_ceil(step), size.height.div_ceil(step))
}

/// The circle of confusion, in nodes of the scale's own grid, whose blur has the deviation of scale `scale`: one
/// of diameter d has the variance `d^2 / 16` along an axis.
pub fn diameter(scale: usize, display_width: f32) -> f32 {
    let (deviation, step) = SCALES[scale];
    4.0 * deviation * unit(display_width) / (step * finest_step(display_width)) as f32
}
