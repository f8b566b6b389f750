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
//! - Neither elimination (`lu`) nor `cyclic_reduction`, nor its parallel form, carries the matrix' diagonal. They carry
//!   its row sum, which is gamma, and means in place of right-hand sides. In f32 the printed form loses up to a fifth of
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
mod forms;
mod jacobi;
mod lanes;
mod lu;
mod number;
mod parallel_cyclic_reduction;
mod run;
mod strips;
#[cfg(test)]
mod tests;

pub use lanes::Instructions;

use pullfocus_core::diffusion::{Diffusion, JacobiStop, Solver};
use pullfocus_core::scheme::{FIELDS, Scheme, Shape};
use pullfocus_core::{Cancel, Plane, Result, Size};
use strips::{Lines, Pass, Scratch};

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
    /// What planes become between rows and columns of a round response.
    fields: Vec<Plane>,
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
        Self { scratches: Vec::new(), fields: Vec::new(), instructions }
    }

    /// The instructions in use.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let fields: usize = self.fields.iter().map(|f| f.size().area() * size_of::<f32>()).sum();
        fields + self.scratches.iter().map(Scratch::bytes).sum::<usize>()
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
    let scheme = Scheme::new(settings)?;
    let call = Call { size, medium, settings, scheme: &scheme, floor_at_zero, cancel };
    if settings.solver != Solver::Lu {
        return planes.iter_mut().try_for_each(|plane| call.whole(plane, buffers));
    }
    // Groups as even as can be: five planes are three and two, not four and one.
    let most = if scheme.shape == Shape::Round { most_round(size) } else { MOST_PLANES };
    let per_group = planes.len().div_ceil(planes.len().div_ceil(most));
    for group in planes.chunks_mut(per_group) {
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

/// The most planes that elimination takes together; they share a strip's factors.
const MOST_PLANES: usize = 4;

/// How many planes of a round response go together: each needs three more between rows and columns, so a large
/// picture's go one by one.
fn most_round(size: Size) -> usize {
    if size.area() > 1 << 25 { 1 } else { MOST_PLANES }
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
        let DiffusionBuffers { scratches, fields, instructions } = buffers;
        self.passes(planes.map(|plane| &mut **plane), fields, |pass| {
            run::solve(pass, *instructions, scratches)
        })
    }

    fn whole(&self, plane: &mut Plane, buffers: &mut DiffusionBuffers) -> Result<()> {
        let DiffusionBuffers { scratches, fields, instructions } = buffers;
        self.passes([plane], fields, |pass| run::solve_whole(pass, *instructions, scratches))
    }

    /// Rows and columns, as often as the integrator has steps.
    fn passes<const P: usize>(
        &self,
        planes: [&mut Plane; P],
        fields: &mut Vec<Plane>,
        mut solve: impl FnMut(&Pass<'_, P>) -> Result<[f32; P]>,
    ) -> Result<()> {
        let mut pointers = planes.map(|plane| {
            let mut fields = [std::ptr::null_mut(); FIELDS];
            fields[0] = plane.data_mut().as_mut_ptr();
            fields
        });
        if self.scheme.shape == Shape::Round {
            if fields.len() < P * (FIELDS - 1) {
                fields.resize_with(P * (FIELDS - 1), Plane::default);
            }
            let mut fields = fields.iter_mut();
            for pointer in pointers.iter_mut().flat_map(|p| &mut p[1..]) {
                let field = fields.next().expect("as many as there are pointers");
                field.resize(self.size)?;
                *pointer = field.data_mut().as_mut_ptr();
            }
        }
        let (circle, uniform) = match self.medium.conductivity {
            Conductivity::Circle(plane) => (Some(plane.data().as_ptr()), 0.0),
            Conductivity::Uniform(diameter) => (None, diameter),
        };
        let beta = f64::from(self.settings.calibration.factor()) / f64::from(self.scheme.steps);
        let vertical = f64::from(self.medium.vertical_scale);
        let mut pass = Pass {
            planes: pointers,
            circle,
            uniform,
            gamma: self.medium.gamma.map(|g| g.data().as_ptr()),
            lines: Lines::rows(self.size),
            columns: false,
            beta,
            scheme: self.scheme,
            solver: self.settings.solver,
            lower: [f32::NEG_INFINITY; P],
            cancel: self.cancel,
        };
        let mut least = [f32::NEG_INFINITY; P];
        for step in 0..self.scheme.steps {
            pass.lines = Lines::rows(self.size);
            pass.columns = false;
            pass.beta = beta;
            let smallest = solve(&pass)?;
            if step == 0 && self.floor_at_zero {
                least = smallest;
            }
            pass.lines = Lines::columns(self.size, pointers[0][0]);
            if matches!(self.settings.solver, Solver::Jacobi(JacobiStop::Tolerance(_))) {
                // The lines of a strip stop together: which they are must not depend on where memory lies.
                pass.lines.first = 0;
            }
            pass.columns = true;
            pass.beta = beta * vertical * vertical;
            if step + 1 == self.scheme.steps {
                pass.lower = least;
            }
            solve(&pass)?;
        }
        Ok(())
    }
}
