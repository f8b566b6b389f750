//! Blur by diffusion: the heat equation on a picture, whose conductivity is the circle of confusion.
//!
//! # Theory
//!
//! The first paper (Kass, Lefohn, Owens 2006) takes the picture for the temperature of a plate and lets it diffuse,
//! one axis after the other (alternating directions). Along one line, for unknowns y and the picture x,
//!
//! `gamma_i (y_i - x_i) = beta_i (y_{i+1} - y_i) - beta_{i-1} (y_i - y_{i-1})`,
//!
//! with gamma the specific heat, beta the links' conductivity, none across the borders: a tridiagonal system for
//! each row, then one for each column. Every solve costs the same for every blur.
//!
//! # Changes from the paper
//!
//! - beta comes from the smaller circle of confusion of a link's two pixels (the paper's own remedy against leaks)
//!   and is calibrated by variance; see [`Calibration`](pullfocus_core::diffusion::Calibration).
//! - The implicit step may be replaced by a rational function of the same operator
//!   ([`Rational`](pullfocus_core::response::Rational)). In partial fractions that is
//!   `y = 2 Re(residue (K - pole Gamma)^-1 Gamma x)`: one complex system in place of the real one. Divided by the
//!   pole's length it becomes `(K + sigma Gamma) v = sigma Gamma x`, |sigma| = 1, the same shape as
//!   backward Euler's, with solution x where x is constant; then `y = Re v - h Im v`.
//! - Neither elimination (`lu`) nor `cyclic_reduction` carries the matrix' diagonal. They carry its row sum,
//!   which is gamma, and means in place of right-hand sides. In f32 the printed form loses up to a fifth of
//!   the value in wide blurs; these lose some 1e-6, keep constants exactly and leave the picture as it is, to
//!   the bit, where there is no blur. (A -0.0 may come back as 0.0.)
//! - gamma may be 0 along whole lines (a matte): it counts as 1e-15 there, see [`Medium::gamma`].
//!
//! # Practice
//!
//! Sixteen lines are solved side by side, one in each lane of a vector (AVX-512, AVX2 or what there is); rows
//! are transposed in 16 x 16 blocks on the way in and out. Along each axis every value is read once and
//! written once, but for a strip's own memory: 64 bytes for each unknown along the line and each number kept. Strips go to the threads of the
//! rayon pool in which the call is made, and the bytes do not depend on how many those are.

mod cyclic_reduction;
mod jacobi;
mod lanes;
mod lu;
mod number;
mod strips;
#[cfg(test)]
mod tests;

pub use lanes::Instructions;

use pullfocus_core::diffusion::{Diffusion, Integrator};
use pullfocus_core::{Cancel, Plane, Result, Size};
use strips::{Lines, MOST_PLANES, Pass, Scheme, Scratch, Term};

/// Where a medium's conductivity comes from.
#[derive(Debug, Clone, Copy)]
pub enum Conductivity<'a> {
    /// Diameters of the circle of confusion in pixels, of either sign; a link takes the smaller of its two
    /// absolute ones. Finite; blurs beyond a million pixels count as a million.
    Circle(&'a Plane),
    /// The same diameter in pixels everywhere.
    Uniform(f32),
}

/// What the planes diffuse through.
#[derive(Debug, Clone, Copy)]
pub struct Medium<'a> {
    /// How far heat goes.
    pub conductivity: Conductivity<'a>,
    /// Specific heat: how much a pixel's own value counts, 0 or more; 1 everywhere if there is none.
    ///
    /// Values below 1e-15, NaN included, count as 1e-15. Where a pixel of weight can be reached the floor cannot be
    /// seen; a line, or a stretch of it between insulating links, that has no weight at all gets its mean.
    pub gamma: Option<&'a Plane>,
    /// Pixels of height for each pixel of width ([`pullfocus_core::Frame::vertical_scale`]); 1 for square ones.
    pub vertical_scale: f32,
}

/// Memory of the solvers, kept from call to call: one strip of lines for each thread.
#[derive(Debug)]
pub struct DiffusionBuffers {
    scratches: Vec<Scratch>,
    instructions: Instructions,
}

impl Default for DiffusionBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl DiffusionBuffers {
    /// Empty buffers for this processor's widest instructions.
    pub fn new() -> Self {
        Self::with_instructions(Instructions::best())
    }

    /// Empty buffers for given instructions, or the portable ones where the processor lacks those. Results differ
    /// by rounding.
    pub fn with_instructions(instructions: Instructions) -> Self {
        let instructions = if instructions.available() { instructions } else { Instructions::Portable };
        Self { scratches: Vec::new(), instructions }
    }

    /// The instructions in use.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.scratches.iter().map(Scratch::bytes).sum()
    }
}

/// Diffuses `planes`, in place, through one medium. All planes have the medium's size, which may be anything,
/// nothing included. Values must be finite; others spread along their lines.
///
/// With `floor_at_zero` results stay at or above the least value of their plane, or 0 if that is less: the
/// rational integrators have a small negative lobe.
///
/// # Errors
/// [`pullfocus_core::Error::SizeMismatch`], [`pullfocus_core::Error::Setting`],
/// [`pullfocus_core::Error::OutOfMemory`] (a strip's memory), and [`pullfocus_core::Error::Cancelled`], after which the
/// planes are partly diffused.
pub fn diffuse(
    planes: &mut [&mut Plane],
    medium: &Medium<'_>,
    settings: &Diffusion,
    floor_at_zero: bool,
    buffers: &mut DiffusionBuffers,
    cancel: &Cancel,
) -> Result<()> {
    settings.check()?;
    let Some(size) = planes.first().map(|p| p.size()) else { return Ok(()) };
    for plane in planes.iter() {
        plane.expect_size("a plane to diffuse", size)?;
    }
    if let Conductivity::Circle(circle) = medium.conductivity {
        circle.expect_size("the circle of confusion", size)?;
    }
    if let Some(gamma) = medium.gamma {
        gamma.expect_size("the specific heat", size)?;
    }
    cancel.check()?;
    if size.area() == 0 {
        return Ok(());
    }
    let scheme = scheme(settings)?;
    // Groups as even as can be: five planes are three and two, not four and one.
    let per_group = planes.len().div_ceil(planes.len().div_ceil(MOST_PLANES));
    for group in planes.chunks_mut(per_group) {
        let call = Call { size, medium, settings, scheme: &scheme, floor_at_zero, cancel };
        match group {
            [a] => call.group([a], buffers)?,
            [a, b] => call.group([a, b], buffers)?,
            [a, b, c] => call.group([a, b, c], buffers)?,
            [a, b, c, d] => call.group([a, b, c, d], buffers)?,
            _ => unreachable!("groups have one to four planes"),
        }
    }
    Ok(())
}

struct Call<'a> {
    size: Size,
    medium: &'a Medium<'a>,
    settings: &'a Diffusion,
    scheme: &'a Scheme,
    floor_at_zero: bool,
    cancel: &'a Cancel,
}

impl Call<'_> {
    fn group<const P: usize>(
        &self,
        planes: [&mut &mut Plane; P],
        buffers: &mut DiffusionBuffers,
    ) -> Result<()> {
        let planes = planes.map(|plane| plane.data_mut().as_mut_ptr());
        let (circle, uniform) = match self.medium.conductivity {
            Conductivity::Circle(plane) => (Some(plane.data().as_ptr()), 0.0),
            Conductivity::Uniform(diameter) => (None, diameter),
        };
        let beta = f64::from(self.settings.calibration.factor()) / f64::from(self.scheme.steps);
        let vertical = f64::from(self.medium.vertical_scale);
        let mut pass = Pass {
            planes,
            circle,
            uniform,
            gamma: self.medium.gamma.map(|g| g.data().as_ptr()),
            lines: Lines::rows(self.size),
            beta,
            scheme: self.scheme,
            solver: self.settings.solver,
            lower: [f32::NEG_INFINITY; P],
            cancel: self.cancel,
        };
        let mut least = [f32::NEG_INFINITY; P];
        for step in 0..self.scheme.steps {
            pass.lines = Lines::rows(self.size);
            pass.beta = beta;
            let smallest = strips::solve(&pass, buffers.instructions, &mut buffers.scratches)?;
            if step == 0 && self.floor_at_zero {
                least = smallest;
            }
            pass.lines = Lines::columns(self.size, planes[0]);
            pass.beta = beta * vertical * vertical;
            if step + 1 == self.scheme.steps {
                pass.lower = least;
            }
            strips::solve(&pass, buffers.instructions, &mut buffers.scratches)?;
        }
        Ok(())
    }
}

/// The systems that an integrator asks for.
fn scheme(settings: &Diffusion) -> Result<Scheme> {
    Ok(match settings.integrator {
        Integrator::BackwardEuler { steps } => Scheme {
            complex: false,
            terms: vec![Term { sigma: [1.0, 0.0], beta: 1.0, h: 0.0, share: 1.0 }],
            steps,
        },
        // KERNEL AUTHOR, from the lead: please implement Integrator::Disc next (it is the default now and matters most):
        // pullfocus_core::response::DiscResponse, the solves are in its docs (rows: one complex field per pole, kept
        // complex; columns: one complex solve per pole with complex right-hand sides; f64 model in /tmp/r2/blur.py
        // `diffuse`, kind 'ns'). Identity must stay exact where no link conducts, constants kept. In bands/strips as
        // suits the caches; at most 4 complex planes of temporaries per plane of the picture, taken a group at a time.
        // Add its speed to the bench and the unit tests (f64 reference). Until then the Gaussian stands in.
        Integrator::Disc => {
            let pole = pullfocus_core::response::Rational::GAUSSIAN.pole()?;
            Scheme { complex: true, terms: vec![term(pole.pole, pole.residue)], steps: 1 }
        }
        Integrator::Rational(rational) => {
            let poles = [rational.pole()?];
            Scheme { complex: true, terms: poles.iter().map(|p| term(p.pole, p.residue)).collect(), steps: 1 }
        }
    })
}

/// `2 Re(residue (K - pole Gamma)^-1 Gamma x)` as `share (Re v - h Im v)` with `(K / |pole| + sigma Gamma) v = sigma
/// Gamma x`: sigma = -pole / |pole|, and `2 Re(rho v)` with rho = -residue / pole, whose share of a constant is 2 Re(rho).
fn term(pole: [f64; 2], residue: [f64; 2]) -> Term {
    let length = pole[0].hypot(pole[1]);
    let square = length * length;
    let rho = [
        -(residue[0] * pole[0] + residue[1] * pole[1]) / square,
        -(residue[1] * pole[0] - residue[0] * pole[1]) / square,
    ];
    Term {
        sigma: [(-pole[0] / length) as f32, (-pole[1] / length) as f32],
        beta: 1.0 / length,
        h: (rho[1] / rho[0]) as f32,
        share: (2.0 * rho[0]) as f32,
    }
}
