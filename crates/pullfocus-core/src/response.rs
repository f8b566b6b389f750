//! Frequency responses of one diffusion, as functions of the operator's eigenvalue `s` (on a uniform medium
//! `s = beta omega^2`): what a blur does to a wave, and the poles that say which systems to solve.
//!
//! # Theory
//! After unit time the heat equation leaves `exp(-s)` of a wave: a Gaussian. Backward Euler leaves `1 / (1 + s)`.
//! Any rational function with poles off the positive axis can take their place, one complex tridiagonal
//! solve per pair of poles, and whatever its coefficients keep at `s = 0` is kept on every medium: value 1 keeps
//! constants and energy, slope -1 makes the variance that of beta.
//!
//! A lens does not spread light as heat does but over a disc, whose transform `2 J1(w c / 2) / (w c / 2)` is a
//! function of s as well. No product of a function of rows and one of columns has round level lines other than
//! the Gaussian: products fitted to the disc draw each light as a square or with a cross in it. But a sum of products
//! can be round, and costs no further solve where the poles are shared ([`DiscResponse`]).

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// `r(s) = (1 + a s) / (1 + (1 + a) s + b s^2)`, with `s = beta omega^2` on a uniform medium: 1 at 0 with slope
/// -1 (so the variance is exact for every a and b), 0 at infinity (so no ghost of a bright pixel stays).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rational {
    /// Coefficient of s above.
    pub a: f64,
    /// Coefficient of s^2 below.
    pub b: f64,
}

/// One pole of a [`Rational`] and its residue; the other is its conjugate. `r(s) = 2 Re(residue / (s - pole))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pole {
    /// (real, imaginary); the real part is below 0.
    pub pole: [f64; 2],
    /// (real, imaginary).
    pub residue: [f64; 2],
}

impl Rational {
    /// The closest to a Gaussian: largest error of the frequency response 0.013.
    pub const GAUSSIAN: Self = Self { a: -0.1681, b: 0.4878 };

    /// The response at `s`.
    pub fn response(self, s: f64) -> f64 {
        (1.0 + self.a * s) / (1.0 + (1.0 + self.a) * s + self.b * s * s)
    }

    /// The complex pole in the upper half plane and its residue.
    ///
    /// # Errors
    /// [`Error::Setting`] where the poles are not a complex pair left of the imaginary axis.
    pub fn pole(self) -> Result<Pole> {
        let Self { a, b } = self;
        let discriminant = 4.0 * b - (1.0 + a) * (1.0 + a);
        if !(a > -1.0 && discriminant > 0.0 && b.is_finite()) {
            return Err(Error::Setting {
                name: "rational integrator b",
                value: b,
                reason: "gives no pair of complex poles left of the axis; it needs a > -1 and 4 b > (1 + a)^2",
            });
        }
        let re = -(1.0 + a) / (2.0 * b);
        let im = discriminant.sqrt() / (2.0 * b);
        // residue = (1 + a p) / (b (p - conj p)) = (1 + a p) / (2 i b im)
        let (num_re, num_im) = (1.0 + a * re, a * im);
        let scale = 1.0 / (2.0 * b * im);
        Ok(Pole { pole: [re, im], residue: [num_im * scale, -num_re * scale] })
    }
}

/// A complex number, (real, imaginary).
pub type Complex = [f64; 2];

fn mul([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// A response of both axes with two pole pairs shared by rows and columns:
/// `R(sx, sy) = 2 Re sum_ij [ A_ij g_i(sx) g_j(sy) + B_ij conj(g_i(sx)) g_j(sy) ]`, `g_i(s) = 1 / (s - p_i)`, A
/// symmetric, B Hermitian.
///
/// Rows: a complex field `u_i = (K_x - p_i Gamma)^-1 Gamma x` for each pole. Columns: for each pole one solve with
/// the right-hand side `Gamma sum_i (A_ij u_i + B_ij conj(u_i))`; the result is twice the real part of their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscResponse {
    /// Poles in the upper half plane, left of the imaginary axis.
    pub poles: [Complex; 2],
    /// Weights of `g_i(sx) g_j(sy)`.
    pub a: [[Complex; 2]; 2],
    /// Weights of `conj(g_i(sx)) g_j(sy)`.
    pub b: [[Complex; 2]; 2],
}

impl DiscResponse {
    /// Fitted to a uniform disc, and to nothing else: as close to it in the mean as two pole pairs come while the kernel
    /// does not rise by more than 2 % on the way outwards (a ripple there draws a grid into every light) and
    /// is nowhere below -0.00011 of its peak (a lobe draws a dark ring around bright lights). On a uniform
    /// medium its edge response is off the disc's by 0.016 of a diameter (the Gaussian's by 0.028), its contour at half the
    /// peak lies at 0.75 of the radius along the axes and 0.79 along the diagonals (the Gaussian's at 0.53 and 0.58), and
    /// beyond twice the radius nothing is above 1e-5 of the peak. Without the bounds on ripple and lobe the
    /// edge comes to 0.008: sharper pictures, with a grid in the lights and rings around them.
    pub const LENS: Self = Self {
        poles: [[-0.300013013352518, 5.319274910684282], [-2.781241605294482, 1.8426024258067155]],
        a: [
            [[-9.086926096498432, -1.7038836907389812], [13.302694478487435, 5.247270072671302]],
            [[13.302694478487435, 5.247270072671302], [-31.636541677119325, -5.639473364712886]],
        ],
        b: [
            [[-1.8704857342080743, 0.0], [-3.3534510725983133, 3.05350443141582]],
            [[-3.3534510725983133, -3.05350443141582], [23.353913448559357, 0.0]],
        ],
    };

    /// The response at `(sx, sy)`.
    pub fn response(&self, sx: f64, sy: f64) -> f64 {
        let pole = |s: f64, [re, im]: Complex| {
            let (re, im) = (s - re, -im);
            let size = re * re + im * im;
            [re / size, -im / size]
        };
        let mut sum = 0.0;
        for i in 0..2 {
            for j in 0..2 {
                let (x, y) = (pole(sx, self.poles[i]), pole(sy, self.poles[j]));
                sum += mul(self.a[i][j], mul(x, y))[0] + mul(self.b[i][j], mul([x[0], -x[1]], y))[0];
            }
        }
        2.0 * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_and_residues_give_the_function_back() {
        let rational = Rational::GAUSSIAN;
        let Pole { pole, residue } = rational.pole().unwrap();
        assert!(pole[0] < 0.0);
        for s in [0.0, 0.1, 1.0, 7.0, 300.0] {
            let (re, im) = (s - pole[0], -pole[1]);
            let sum = 2.0 * (residue[0] * re + residue[1] * im) / (re * re + im * im);
            assert!((sum - rational.response(s)).abs() < 1e-12, "{s}");
        }
    }

    #[test]
    fn the_default_stays_close_to_a_gaussian() {
        let worst = (0..4000)
            .map(|i| f64::from(i) * 0.01)
            .map(|s| (Rational::GAUSSIAN.response(s) - (-s).exp()).abs())
            .fold(0.0, f64::max);
        // 0.013 is what an independent f64 implementation measured.
        assert!(worst < 0.0135, "{worst}");
    }

    #[test]
    fn the_disc_keeps_light_and_variance() {
        let lens = DiscResponse::LENS;
        assert!((lens.response(0.0, 0.0) - 1.0).abs() < 1e-9);
        let h = 1e-5;
        let slope = (lens.response(h, 0.0) - lens.response(0.0, 0.0)) / h;
        // A one-sided difference: its own error is of the size of h.
        assert!((slope + 1.0).abs() < 1e-4, "{slope}");
        assert!(lens.response(1e9, 0.0).abs() < 1e-6, "no ghost of a bright pixel stays");
    }

    #[test]
    fn the_disc_never_amplifies_and_treats_the_axes_alike() {
        for i in 0..120 {
            for j in 0..120 {
                let (sx, sy) = (1.08f64.powi(i) * 0.01 - 0.01, 1.08f64.powi(j) * 0.01 - 0.01);
                let r = DiscResponse::LENS.response(sx, sy);
                // 1 at the origin, up to the rounding of the coefficients.
                assert!(r.abs() <= 1.0 + 1e-9, "{sx} {sy} {r}");
                assert!((r - DiscResponse::LENS.response(sy, sx)).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn the_disc_is_closer_to_a_disc_than_heat_is() {
        // The disc's transform in s: w c / 2 = sqrt(8 s), by the series of 2 J1(z) / z.
        let disc = |s: f64| {
            let (mut term, mut sum) = (1.0, 0.0);
            for k in 0..60 {
                sum += term;
                term *= -2.0 * s / (f64::from(k + 1) * f64::from(k + 2));
            }
            sum
        };
        let worst = |f: &dyn Fn(f64, f64) -> f64| {
            (0..500)
                .map(|i| f64::from(i) * 0.01)
                .flat_map(|s| [(f(s, 0.0) - disc(s)).abs(), (f(0.5 * s, 0.5 * s) - disc(s)).abs()])
                .fold(0.0, f64::max)
        };
        let lens = worst(&|sx, sy| DiscResponse::LENS.response(sx, sy));
        let heat = worst(&|sx, sy| (-sx - sy).exp());
        // The fit's figures are 0.108 and 0.183.
        assert!(lens < 0.6 * heat, "{lens} {heat}");
    }
}
