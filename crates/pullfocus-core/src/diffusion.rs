//! Settings of the diffusion method (first paper): what one blur is calibrated to, how it is integrated, who
//! solves the systems.
//!
//! One axis of one step is `gamma_i (y_i - x_i) = beta_i (y_{i+1} - y_i) - beta_{i-1} (y_i - y_{i-1})`
//! (first paper, equation 5), with beta on the links between pixels, zero at the borders, and taken from the
//! smaller of a link's two absolute diameters.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// What beta, the heat conductivity of a link, is for a circle of confusion of diameter c pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Calibration {
    /// `c^2 / 32`: the variance of a uniform disc of diameter c.
    #[default]
    Variance,
    /// `c^2`: the first paper's letter (after equation 9).
    Kass,
    /// `(c / 2)^2`: the second paper's, which takes d as the radius.
    Beck,
}

impl Calibration {
    /// The factor k in `beta = k c^2`.
    pub fn factor(self) -> f32 {
        match self {
            Self::Variance => 1.0 / 32.0,
            Self::Kass => 1.0,
            Self::Beck => 0.25,
        }
    }
}

/// How the heat equation is followed through time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// The papers' implicit step, this many times with beta divided by as much. One step's impulse response
    /// is a two-sided exponential per axis; many tend to a Gaussian.
    BackwardEuler {
        /// Number of (rows, columns) steps, at least 1.
        steps: u32,
    },
    /// One rational function in place of `exp(-s)`: one complex solve per axis, as close to a Gaussian as
    /// sixteen backward-Euler steps.
    Rational(Rational),
}

impl Default for Integrator {
    fn default() -> Self {
        Self::Rational(Rational::GAUSSIAN)
    }
}

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

/// Who solves the tridiagonal systems. All carry the row sum gamma instead of the diagonal, so nothing cancels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Elimination along each line, many lines side by side: the CPU's own, exact.
    #[default]
    Lu,
    /// Cyclic reduction in the gather form of the first paper's figure 5, for any length; exact.
    CyclicReduction,
    /// Jacobi sweeps (second paper, equation 2.13): approximate.
    Jacobi(JacobiStop),
}

/// When Jacobi stops.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JacobiStop {
    /// After this many sweeps along each axis.
    Sweeps(u32),
    /// When no value changed by more than this part of the largest value, or after [`JACOBI_MOST_SWEEPS`].
    Tolerance(f32),
}

/// Jacobi with a tolerance gives up here: a bound for every picture.
pub const JACOBI_MOST_SWEEPS: u32 = 20_000;

impl Default for JacobiStop {
    /// The second paper's count for a smooth picture.
    fn default() -> Self {
        Self::Sweeps(400)
    }
}

/// The diffusion method's settings.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Diffusion {
    /// Blur width for a circle of confusion.
    pub calibration: Calibration,
    /// Time integration.
    pub integrator: Integrator,
    /// Linear solver.
    pub solver: Solver,
}

impl Diffusion {
    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        match self.integrator {
            Integrator::BackwardEuler { steps: 0 } => {
                return Err(Error::Setting { name: "steps", value: 0.0, reason: "must be 1 or more" });
            }
            Integrator::BackwardEuler { .. } => {}
            Integrator::Rational(rational) => {
                rational.pole()?;
            }
        }
        match self.solver {
            Solver::Jacobi(JacobiStop::Sweeps(0)) => {
                Err(Error::Setting { name: "sweeps", value: 0.0, reason: "must be 1 or more" })
            }
            Solver::Jacobi(JacobiStop::Tolerance(t)) if !(t > 0.0 && t < 1.0) => Err(Error::Setting {
                name: "tolerance",
                value: f64::from(t),
                reason: "must lie between 0 and 1",
            }),
            _ => Ok(()),
        }
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
}
