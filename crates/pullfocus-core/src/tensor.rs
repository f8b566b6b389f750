//! Settings and formulas of the tensor filter (third paper, section 6), for every backend: where its sites lie, how far apart, and
//! what each of its two steps has of the blur.
//!
//! A blur is a matrix whose rows and columns vary smoothly where it is wide. It is put together from few separable terms
//! down its diagonal: each **site** gathers one average under a Gaussian and spreads it as a Gaussian.
//!
//! # The factors
//! Sites d apart, each with the weight d^2 of the pixels that it stands for, gathering with the variance g and spreading with h:
//! a wave of f cycles a pixel comes out as itself, times `exp(-2 pi^2 (g + h) f^2)`, and at each frequency `f - n / d` as
//! well, times `exp(-2 pi^2 (g f^2 + h (n / d - f)^2))`. The first is the wanted Gaussian if **g + h = c^2 / 16 = v**. The second is
//! a pattern that is not in the picture. It is largest for n = 1 and `f = h / v / d`, where it is `exp(-2 pi^2 g h / (v d^2))`.
//!
//! Spreading is what a lens does, gathering is not. So a site gathers with the least g that keeps the pattern down to [`PATTERN`]
//! ([`gathered`]):
//!
//! ```text
//! g h / v = K d^2,   K = -ln(PATTERN) / (2 pi^2)   =>   g = v / 2 (1 - sqrt(1 - 4 K d^2 / v)).
//! ```
//!
//! Where every pixel is a site nothing is sampled, and g is 0. At the largest spacing, `d^2 = v / (4 K)`, both steps have half of the
//! variance. (The paper has halves everywhere. Its printed 0.8 and 4.0, found by trial and error, put sites a quarter of a radius apart,
//! without saying how many deviations a radius is.)

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// How [`crate::Method::Tensor`] works.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Tensor {
    /// Where the sites lie.
    pub sites: Sites,
    /// How far apart sites lie at most, in standard deviations of the blur along its narrower axis; [`LEAST_SPACING`] to
    /// [`MOST_SPACING`]. Denser sites cost more and leave less of a pattern.
    pub spacing: f64,
    /// How a site gathers.
    pub gather: Gathering,
    /// How a site spreads.
    pub spread: Spreading,
}

impl Default for Tensor {
    fn default() -> Self {
        Self {
            sites: Sites::default(),
            spacing: DEFAULT_SPACING,
            gather: Gathering::default(),
            spread: Spreading::default(),
        }
    }
}

/// Where the tensor filter's sites lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sites {
    /// In the middle of each leaf of a quadtree over the circles of confusion: every pixel is in a leaf that suits its circle, and all around.
    #[default]
    Quadtree,
    /// At pixels whose place is a multiple of their own skip level, which is the spacing rounded down (third paper, Program 3).
    /// Small blurred things between sharp ones can be without any site.
    Skip,
}

/// How a site of the tensor filter gathers its average.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Gathering {
    /// Pixel by pixel under the Gaussian. Sites are fewer where they are wide, so the cost does not grow with the circle's area; it is several
    /// times the pyramid's.
    Naive,
    /// A small Gaussian on a level of the reduced picture.
    #[default]
    Pyramid,
    /// Three boxes for the Gaussian, by differences of a picture that was summed up three times along each axis (Heckbert 1986).
    RepeatedIntegration,
}

/// How a site of the tensor filter spreads its average.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spreading {
    /// Pixel by pixel.
    Naive,
    /// As [`crate::Method::Pyramid`] does.
    #[default]
    Pyramid,
}

/// The least [`Tensor::spacing`].
pub const LEAST_SPACING: f64 = 0.25;
/// The largest: beyond `1 / sqrt(4 K)` no two steps keep the pattern down.
pub const MOST_SPACING: f64 = 0.84;
/// Chosen by measurement: see the method's page.
pub const DEFAULT_SPACING: f64 = 0.6;

/// The most that the pattern of the sites has of the worst wave's amplitude.
pub const PATTERN: f64 = 1e-3;

/// The variance with which a site gathers, in square pixels, along an axis on which the blur has `variance` square pixels and sites lie
/// `distance` pixels apart; the rest is left for spreading. 0 where every pixel is a site, half of it at the most.
#[inline(always)]
pub fn gathered(variance: f64, distance: f64) -> f64 {
    // -4 ln(PATTERN) / (2 pi^2).
    const FOUR_K: f64 = 1.399_803_882;
    if distance <= 1.0 {
        return 0.0;
    }
    0.5 * variance * (1.0 - (1.0 - FOUR_K * distance * distance / variance).max(0.0).sqrt())
}

/// How much larger than the least circle the largest one in and around a leaf may be.
pub const EVEN: f32 = 1.25;

/// How much wider than a cell the spacing is where that is a leaf altogether.
pub const FADE: f32 = 0.25;
/// How far below [`EVEN`] circles are even enough for a leaf altogether.
pub const EVEN_FADE: f32 = 0.1;

/// Sites that are continued beyond each border, at most: the spacing is at least half of what is allowed, except where
/// circles vary quickly.
pub const BEYOND: usize = 8;

impl Tensor {
    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(self) -> Result<()> {
        if (LEAST_SPACING..=MOST_SPACING).contains(&self.spacing) {
            return Ok(());
        }
        let reason = "must lie between 0.25 and 0.84 standard deviations";
        Err(Error::Setting { name: "spacing of the tensor filter", value: self.spacing, reason })
    }

    /// The most that sites may lie apart where circles have `diameter` pixels along their narrower axis, in pixels.
    #[inline(always)]
    pub fn distance(self, diameter: f32) -> f32 {
        self.spacing as f32 * 0.25 * diameter
    }

    /// How much of a cell of 2^`level` pixels is a leaf with one site, from 0 to 1, if circles in it and in the eight cells of its size around
    /// it, from which it gathers as well, have `least` to `most` pixels along their narrower axis; the rest is left to its four parts. It
    /// falls to 0 where the cell is as wide as the spacing, and where `most` is [`EVEN`] times `least`, without a jump. Whatever lies in a
    /// cell has no less.
    #[inline(always)]
    pub fn leaf(self, level: usize, least: f32, most: f32) -> f32 {
        if level == 0 {
            return 1.0;
        }
        let narrow = (self.distance(least) / (1u64 << level) as f32 - 1.0) / FADE;
        let even = (EVEN * least - most) / (EVEN_FADE * least);
        // No number, of circles of 0, is none of these.
        if narrow > 0.0 && even > 0.0 { narrow.min(1.0) * even.min(1.0) } else { 0.0 }
    }

    /// The skip level of a pixel whose circle has `diameter` pixels along its narrower axis, 1 or more: it is a site if both its
    /// row and its column are multiples of this.
    #[inline(always)]
    pub fn skip(self, diameter: f32) -> usize {
        (self.distance(diameter) as usize).max(1)
    }
}

/// How many more sites lie beyond the border in line with one whose neighbours are `distance` pixels away, along an axis on which
/// the blur has `variance` square pixels: what gathers there spreads into the picture as well.
pub fn beyond(variance: f64, distance: f64) -> usize {
    // Both steps have to reach: out with one, and back with the other.
    let gathered = gathered(variance, distance);
    let reach = crate::psf::CUT * gathered.min(variance - gathered).sqrt();
    ((reach / distance).ceil() as usize).min(BEYOND)
}

/// The box of `n` pixels whose threefold convolution is next narrower than a Gaussian of `variance` square pixels, and the share of
/// the one with two pixels more, with which both together have this variance. `n` is odd for sites in the middle of a pixel
/// and even for those `between` pixels. Three boxes of n have the variance `(n^2 - 1) / 4` (Heckbert 1986, section 3).
pub fn three_boxes(variance: f64, between: bool) -> (usize, f64) {
    let first = if between { 2 } else { 1 };
    let side = (4.0 * variance.max(0.0) + 1.0).sqrt();
    let n = first + 2 * (0.5 * (side - first as f64)).max(0.0) as usize;
    let of = |n: usize| (n * n - 1) as f64 / 4.0;
    let share = (variance - of(n)) / (of(n + 2) - of(n));
    (n, share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn boxes_have_the_variance_that_is_asked_for() {
        for between in [false, true] {
            for i in 0..400 {
                let variance = 0.75 + 0.3 * f64::from(i);
                let (n, share) = three_boxes(variance, between);
                let of = |n: usize| 3.0 * (n * n - 1) as f64 / 12.0;
                let found = (1.0 - share) * of(n) + share * of(n + 2);
                // f64 rounding.
                assert!((found - variance).abs() < 1e-9 * variance, "{variance}: {n} {share}");
                assert!(n % 2 == usize::from(!between) && (0.0..=1.0).contains(&share));
            }
        }
        assert_eq!(three_boxes(0.0, false), (1, 0.0));
    }

    #[test]
    fn what_lies_in_a_leaf_is_one_no_less() {
        let tensor = Tensor { spacing: 0.8, ..Tensor::default() };
        for level in 1..6 {
            for (least, most) in [(10.0, 11.0), (40.0, 46.0), (46.0, 50.1), (400.0, 410.0)] {
                assert!(tensor.leaf(level - 1, least + 0.2, most) >= tensor.leaf(level, least, most));
            }
        }
        assert_eq!((tensor.leaf(0, 0.0, 900.0), tensor.leaf(1, 0.0, 0.0)), (1.0, 0.0));
        // 0.8 of a deviation of 12.5 px is 10.
        assert_eq!(
            (tensor.leaf(3, 50.0, 57.0), tensor.leaf(4, 50.0, 57.0), tensor.leaf(3, 50.0, 63.0)),
            (1.0, 0.0, 0.0)
        );
        let half = tensor.leaf(3, 45.0, 45.0);
        // f32 rounding.
        assert!((half - 0.5).abs() < 1e-5, "{half}");
        assert_eq!([0.0, 9.0, 40.0].map(|c| tensor.skip(c)), [1, 1, 8]);
    }

    /// The second wave that sampling makes of one, over all waves.
    #[test]
    fn the_pattern_is_kept_down() {
        for (variance, distance) in [(6.0, 2.0), (40.0, 2.0), (40.0, 4.0), (800.0, 16.0)] {
            let g = gathered(variance, distance);
            let at =
                |f: f64| (-2.0 * PI * PI * (g * f * f + (variance - g) * (1.0 / distance - f).powi(2))).exp();
            let worst = (0..10_000).map(|i| at(f64::from(i) / 1e4 / distance)).fold(0.0, f64::max);
            // The steps of f.
            assert!((worst / PATTERN - 1.0).abs() < 1e-4, "{variance} {distance}: {worst}");
            assert!(g <= 0.5 * variance);
        }
        let largest = MOST_SPACING * 5.0;
        assert!(gathered(25.0, largest) < 12.5 && gathered(25.0, 1.0) == 0.0);
    }

    #[test]
    fn spacings_have_a_range() {
        let with = |spacing| Tensor { spacing, ..Tensor::default() }.check();
        assert!(with(0.25).is_ok() && with(0.84).is_ok() && Tensor::default().check().is_ok());
        for odd in [0.2, 0.85, f64::NAN] {
            assert!(matches!(with(odd), Err(Error::Setting { .. })), "{odd}");
        }
    }
}
