//! Settings of the diffusion method (first paper): what one blur is calibrated to, how it is integrated, who
//! solves the systems.
//!
//! One axis of one step is `gamma_i (y_i - x_i) = beta_i (y_{i+1} - y_i) - beta_{i-1} (y_i - y_{i-1})`
//! (first paper, equation 5), with beta on the links between pixels, zero at the borders, and taken from the
//! smaller of a link's two absolute diameters.

use crate::error::{Error, Result};
use crate::response::Rational;
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
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
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
    /// A rational function of both axes that spreads as a round aperture does, not as heat:
    /// [`crate::response::DiscResponse::LENS`]. Two complex solves per axis.
    #[default]
    Disc,
}

/// Who solves the tridiagonal systems. All carry the row sum gamma instead of the diagonal, so nothing cancels.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Elimination along each line: the CPU's many lines side by side, the GPU's in chunks; exact; the fast one of
    /// each backend.
    #[default]
    Lu,
    /// Cyclic reduction in the gather form of the first paper's figure 5, for any length; exact.
    CyclicReduction,
    /// Parallel cyclic reduction (Zhang, Cohen, Owens 2010, "Fast Tridiagonal Solvers on the GPU"): each step frees every
    /// unknown from its two neighbours, so that links reach twice as far, until they reach beyond the line; exact.
    ParallelCyclicReduction,
    /// Cyclic reduction until at most [`HYBRID_REST`] unknowns are left, parallel cyclic reduction of those, then cyclic
    /// reduction's way down (Zhang, Cohen, Owens 2010); exact.
    Hybrid,
    /// Jacobi sweeps (second paper, equation 2.13): approximate.
    Jacobi(JacobiStop),
}

/// How many unknowns [`Solver::Hybrid`] leaves to parallel cyclic reduction: two for each thread of a GPU's warp of 32. Fewer
/// would leave some of them idle on cyclic reduction's last levels, more only add work.
pub const HYBRID_REST: usize = 64;

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
            Integrator::BackwardEuler { .. } | Integrator::Disc => {}
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
