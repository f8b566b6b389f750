//! Formulas of pyramid spreading (third paper, section 5), for every backend: which level a size belongs to, what a level gets,
//! how levels are enlarged. Level l has cells of 2^l pixels; level 0 is the picture.
//!
//! What a pixel becomes in the end is its splat on a level and what enlarging makes of that. Both are known, so the splat is made
//! to have exactly what is lacking: the sum 1, its centre where the pixel is, and the wanted variance less what
//! enlarging adds. (The paper's Program 1 has a deviation of 1/3 of a cell and a printed normalisation, with which a pixel's weight
//! swings by more than twice with its place in the cell.)

use crate::method::{Mipmap, Quality};
use crate::psf::{discrete_gaussian, gaussian_reach};

/// Cells that every level has beside the picture on each side: what lies there comes back when it is enlarged. Enlarging two
/// cells of edge needs two of the next level.
pub const EDGE: usize = 2;

/// Variance, in squared fine cells, of one enlargement: of the weights 1, 5, 10, 10, 5, 1.
const ENLARGING: f64 = 1.25;

/// The weights with which fine cell `at` takes the coarse cells before its own, its own, and after it, along one axis: the
/// subdivision of quartic B-splines, (1, 5, 10, 10, 5, 1) / 16 for cells whose centres lie between each other's, and half of
/// that, since a coarse cell's light is shared among two.
#[inline(always)]
pub fn enlarging(at: isize) -> [f32; 3] {
    if at % 2 == 0 { [5.0 / 32.0, 10.0 / 32.0, 1.0 / 32.0] } else { [1.0 / 32.0, 10.0 / 32.0, 5.0 / 32.0] }
}

/// Variance along each axis, in square pixels, that enlarging level `level` down to the picture adds.
pub fn enlarged_variance(level: usize) -> f64 {
    ENLARGING * (4f64.powi(level as i32) - 1.0) / 3.0
}

/// Variance in squared cells of the splat on `level` for a PSF of `variance` square pixels; less than 0 where enlarging alone
/// is wider.
#[inline(always)]
pub fn cell_variance(variance: f64, level: usize) -> f64 {
    // 4^-level, by its exponent.
    let part = f64::from_bits((1023 - 2 * level as u64) << 52);
    (variance + ENLARGING / 3.0) * part - ENLARGING / 3.0
}

/// How long, in splats' variances, the change from one level to the next takes.
const FADE: f64 = 1.6;

impl Quality {
    /// The least variance of a splat in squared cells, from which on a level is used. At 9/16 (a deviation of 3/4) what a lattice
    /// of cells adds to a Gaussian, `exp(-2 pi^2 variance)`, is 2e-5, and enlarging leaves a hundredth of that; 7/2 is as
    /// wide on the next finer level.
    pub fn least_variance(self) -> f64 {
        match self {
            Self::Standard => 9.0 / 16.0,
            Self::Fine => 3.5,
        }
    }
}

/// The least variance of splats in tables, for levels above 0.
pub const LEAST_TABLED: f32 = 0.5;

/// The level for a PSF of `variance` square pixels, and the share of the next coarser one: a pixel's PSF is drawn exactly on
/// both, mixed by the share.
#[inline(always)]
pub fn level_of(variance: f64, quality: Quality) -> (usize, f32) {
    let (least, wide) = (quality.least_variance(), FADE * quality.least_variance());
    // The last level whose splat has at least `wide`: 4^level is at most this.
    let cells = (variance + ENLARGING / 3.0) / (wide + ENLARGING / 3.0);
    let exponent = (cells.to_bits() >> 52) as usize;
    let level = exponent.saturating_sub(1023) / 2;
    let share = (cell_variance(variance, level + 1) - least) / (wide - least);
    (level, share.max(0.0) as f32)
}

/// [`level_of`] for either choice: with [`Mipmap::Nearest`] one level alone, the coarsest on which the splat is not narrower than
/// the quality's least.
#[inline(always)]
pub fn level_with(variance: f64, quality: Quality, mipmap: Mipmap) -> (usize, f32) {
    let (level, share) = level_of(variance, quality);
    match mipmap {
        Mipmap::Linear => (level, share),
        // The next one has a share from its least variance on.
        Mipmap::Nearest => (level + usize::from(share > 0.0), 0.0),
    }
}

/// The largest variance in squared cells that a splat has, on an axis whose PSF has `ratio` times the variance that chooses the
/// level.
pub fn most_variance(quality: Quality, ratio: f64) -> f64 {
    // Where the next level has taken over; enlarging once adds to what four times that level's is.
    let own = 4.0 * FADE * quality.least_variance() + ENLARGING;
    // The finest level has no enlarging, coarse ones a third of a cell's 1.25.
    ratio * (own + ENLARGING / 3.0)
}

/// Cells to either side of a splat of at most `most` squared cells: three deviations of the very largest, which has little share
/// (and is held to its sum and variance all the same); 3 at the least, the paper's 7 x 7.
pub fn reach(most: f64) -> usize {
    ((3.0 * most.sqrt()).ceil() as usize).max(3)
}

/// Cells to either side that a splat of `variance` squared cells has, `most` at the most: on the finest level what a naive Gaussian has,
/// elsewhere three and a half deviations and half a cell, for its place within one.
pub fn reach_of(variance: f64, finest: bool, most: usize) -> usize {
    let own = if finest && variance == 0.0 {
        0
    } else if finest {
        gaussian_reach(variance)
    } else {
        (3.5 * variance.sqrt() + 0.5).ceil() as usize
    };
    own.min(most)
}

/// Levels whose tables differ: from there on positions within a cell are rounded to 64ths.
pub const LEVEL_PHASES: usize = 7;
/// Positions within a cell of the last of these levels.
pub const PHASES: usize = 1 << (LEVEL_PHASES - 1);

/// How far the `phase`-th of a cell's pixels on `level` lies from the cell's middle, in cells.
pub fn phase_offset(level: usize, phase: usize) -> f64 {
    (phase as f64 + 0.5) / (1 << level) as f64 - 0.5
}

/// One axis of a splat: the weights of the cells from `-reach` to `reach` for a Gaussian of `variance` squared cells whose middle
/// lies `offset` cells from the middle one's. Their sum is 1, their mean `offset`, and their variance `variance`, exactly: the Gaussian is
/// multiplied with the parabola for which that holds. On the `finest` level the Gaussian is the lattice's
/// ([`discrete_gaussian`]), which is the pixel itself at 0.
pub fn splat(variance: f64, offset: f64, finest: bool, reach: usize) -> Vec<f64> {
    let distances: Vec<f64> = (0..2 * reach + 1).map(|i| i as f64 - reach as f64 - offset).collect();
    let mut weights: Vec<f64> = if finest {
        let half = discrete_gaussian(variance, reach);
        (0..2 * reach + 1).map(|i| half[i.abs_diff(reach)]).collect()
    } else {
        distances.iter().map(|d| (-d * d / (2.0 * variance)).exp()).collect()
    };
    if variance == 0.0 {
        return weights;
    }
    let moment = |n: i32| weights.iter().zip(&distances).map(|(w, d)| w * d.powi(n)).sum::<f64>();
    let [m0, m1, m2, m3, m4] = [0, 1, 2, 3, 4].map(moment);
    // (a, b, c) of a + b d + c d^2, by Cramer's rule, for the moments 1, 0 and the variance.
    let rows = [[m0, m1, m2], [m1, m2, m3], [m2, m3, m4]];
    let determinant = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let with = |column: usize| {
        let mut replaced = rows;
        for (row, wanted) in replaced.iter_mut().zip([1.0, 0.0, variance]) {
            row[column] = wanted;
        }
        determinant(replaced) / determinant(rows)
    };
    let [a, b, c] = [with(0), with(1), with(2)];
    weights.iter_mut().zip(&distances).for_each(|(w, d)| *w *= a + b * d + c * d * d);
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_splat_has_its_moments_exactly() {
        for quality in [Quality::Standard, Quality::Fine] {
            let most = most_variance(quality, 1.0);
            let reach = reach(most);
            for finest in [true, false] {
                // The finest level's narrowest reaches one cell.
                assert_eq!(reach_of(0.0, finest, reach), if finest { 0 } else { 1 });
                for variance in [0.02, 0.5, 0.5625, 0.9, 2.0, 4.0, most] {
                    if !finest && variance < 0.5 {
                        continue;
                    }
                    let reach = reach_of(variance, finest, reach);
                    let offsets: &[f64] = if finest { &[0.0] } else { &[-0.5, -0.25, 0.1, 0.49] };
                    for &offset in offsets {
                        let weights = splat(variance, offset, finest, reach);
                        let moment = |n: i32| -> f64 {
                            let of = |(i, w): (usize, &f64)| w * (i as f64 - reach as f64 - offset).powi(n);
                            weights.iter().enumerate().map(of).sum()
                        };
                        let found = [moment(0) - 1.0, moment(1), moment(2) - variance];
                        // f64 rounding of a determinant.
                        assert!(found.iter().all(|e| e.abs() < 1e-9), "{variance} at {offset}: {found:?}");
                        // The parabola corrects; it does not carve.
                        assert!(weights.iter().all(|w| *w > -1e-4), "{variance} at {offset}: {weights:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn enlarging_has_its_variance_and_keeps_light() {
        // One coarse cell at 0, whose middle lies at 0.5 in fine cells.
        let cells: Vec<(f64, f64)> = (-4..6)
            .map(|at: isize| {
                let before = at.div_euclid(2) - 1;
                let weight = (0..3).find(|k| before + k == 0).map_or(0.0, |k| enlarging(at)[k as usize]);
                (at as f64 - 0.5, f64::from(weight))
            })
            .collect();
        let moment = |n: i32| cells.iter().map(|(d, w)| w * d.powi(n)).sum::<f64>();
        assert_eq!([moment(0), moment(1), moment(2)], [1.0, 0.0, ENLARGING]);
        assert_eq!(enlarged_variance(2), ENLARGING * (1.0 + 4.0));
        // f64 rounding.
        assert!((cell_variance(30.0, 2) - (30.0 - enlarged_variance(2)) / 16.0).abs() < 1e-14);
        assert_eq!(cell_variance(0.0, 0), 0.0);
    }

    #[test]
    fn levels_follow_each_other_without_a_jump() {
        for quality in [Quality::Standard, Quality::Fine] {
            let mut last = 0.0;
            for i in 0..20_000 {
                let variance = 1.0005f64.powi(i) - 1.0;
                let (level, share) = level_of(variance, quality);
                let at = level as f32 + share;
                // A step of 1/2000 in variance, over a fade of a fifth of that.
                assert!((0.0..1.0).contains(&share) && at >= last && at - last < 0.01, "{variance}: {at}");
                last = at;
                let alone = level_with(variance, quality, Mipmap::Nearest);
                assert_eq!(alone, (level + usize::from(share > 0.0), 0.0), "{variance}");
                assert_eq!(level_with(variance, quality, Mipmap::Linear), (level, share));
                let used = if share > 0.0 { level + 1 } else { level };
                let least = cell_variance(variance, used);
                // f64 rounding.
                assert!(used == 0 || least >= quality.least_variance() - 1e-12, "{variance}: {least}");
                // The next would be too narrow, or has no share yet.
                let (next, wide) = (cell_variance(variance, level + 1), FADE * quality.least_variance());
                assert!(next < wide + 1e-9 && (level == 0 || cell_variance(variance, level) > wide - 1e-9));
                assert!(cell_variance(variance, level) <= most_variance(quality, 1.0));
            }
        }
    }
}
