//! From a pass to threads, instructions and solvers.
//!
//! Workers take the next strip when they have done one; which takes which has no influence on any value.

use super::forms::{Form, RoundColumns, RoundRows, Separable};
use super::lanes::{Instructions, Kernel, Lanes};
use super::number::{Complex, Number, Real};
use super::strips::{Bench, Pass, Scratch, Strip};
use super::{cyclic_reduction, jacobi, lu};
use pullfocus_core::Result;
use pullfocus_core::diffusion::Solver;
use pullfocus_core::scheme::Shape;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

const REAL: u8 = 0;
const COMPLEX: u8 = 1;
const ROUND_ROWS: u8 = 2;
const ROUND_COLUMNS: u8 = 3;

struct LuKernel<'a, const P: usize, const KIND: u8>(Bench<'a, P>);

impl<const P: usize, const KIND: u8> Kernel for LuKernel<'_, P, KIND> {
    type Output = [f32; P];
    #[inline(always)]
    unsafe fn run<V: Lanes>(self) -> Self::Output {
        // SAFETY: the caller promises the instructions; `lu` made the bench with its rows.
        unsafe {
            match KIND {
                REAL => lu::solve::<V, Real<V>, Separable, P>(&self.0),
                COMPLEX => lu::solve::<V, Complex<V>, Separable, P>(&self.0),
                ROUND_ROWS => lu::solve::<V, Complex<V>, RoundRows, P>(&self.0),
                _ => lu::solve::<V, Complex<V>, RoundColumns, P>(&self.0),
            }
        }
    }
}

/// The solvers that hold a whole strip in memory, one plane at a time.
struct WholeKernel<'a, const KIND: u8>(Bench<'a, 1>);

impl<const KIND: u8> WholeKernel<'_, KIND> {
    #[inline(always)]
    unsafe fn solve<V: Lanes, N: Number<V>, F: Form>(&self) -> Result<[f32; 1]> {
        // SAFETY: the caller promises the instructions; `whole` made the bench with the solver's rows.
        unsafe {
            match self.0.pass.solver {
                Solver::Jacobi(stop) => jacobi::solve::<V, N, F>(&self.0, stop),
                _ => Ok(cyclic_reduction::solve::<V, N, F>(&self.0)),
            }
        }
    }
}

impl<const KIND: u8> Kernel for WholeKernel<'_, KIND> {
    type Output = Result<[f32; 1]>;
    #[inline(always)]
    unsafe fn run<V: Lanes>(self) -> Self::Output {
        // SAFETY: the caller's promise.
        unsafe {
            match KIND {
                REAL => self.solve::<V, Real<V>, Separable>(),
                COMPLEX => self.solve::<V, Complex<V>, Separable>(),
                ROUND_ROWS => self.solve::<V, Complex<V>, RoundRows>(),
                _ => self.solve::<V, Complex<V>, RoundColumns>(),
            }
        }
    }
}

fn lu<const P: usize, F: Form, const KIND: u8>(
    pass: &Pass<'_, P>,
    strip: Strip,
    instructions: Instructions,
    scratch: &mut Scratch,
) -> Result<[f32; P]> {
    let parts = if KIND == REAL { 1 } else { 2 };
    let rows = lu::rows::<F>(pass.lines.unknowns, P, parts, pass.scheme.terms.len());
    Ok(instructions.run(LuKernel::<P, KIND>(Bench::new(pass, strip, scratch, rows)?)))
}

fn whole<F: Form, const KIND: u8>(
    pass: &Pass<'_, 1>,
    strip: Strip,
    instructions: Instructions,
    scratch: &mut Scratch,
) -> Result<[f32; 1]> {
    let parts = if KIND == REAL { 1 } else { 2 };
    let rows = match pass.solver {
        Solver::Jacobi(_) => jacobi::rows::<F>(pass.lines.unknowns, parts),
        _ => cyclic_reduction::rows::<F>(pass.lines.unknowns, parts),
    };
    instructions.run(WholeKernel::<KIND>(Bench::new(pass, strip, scratch, rows)?))
}

/// Solves every line of a pass by elimination; the smallest value that came in (0 at most) for each plane.
pub(super) fn solve<const P: usize>(
    pass: &Pass<'_, P>,
    instructions: Instructions,
    scratches: &mut Vec<Scratch>,
) -> Result<[f32; P]> {
    each_strip(pass, scratches, |strip, scratch| match pass.scheme.shape {
        Shape::Real => lu::<P, Separable, REAL>(pass, strip, instructions, scratch),
        Shape::Complex => lu::<P, Separable, COMPLEX>(pass, strip, instructions, scratch),
        Shape::Round if !pass.columns => lu::<P, RoundRows, ROUND_ROWS>(pass, strip, instructions, scratch),
        Shape::Round => lu::<P, RoundColumns, ROUND_COLUMNS>(pass, strip, instructions, scratch),
    })
}

/// The same by the solver of the settings, one plane at a time.
pub(super) fn solve_whole(
    pass: &Pass<'_, 1>,
    instructions: Instructions,
    scratches: &mut Vec<Scratch>,
) -> Result<[f32; 1]> {
    each_strip(pass, scratches, |strip, scratch| match pass.scheme.shape {
        Shape::Real => whole::<Separable, REAL>(pass, strip, instructions, scratch),
        Shape::Complex => whole::<Separable, COMPLEX>(pass, strip, instructions, scratch),
        Shape::Round if !pass.columns => whole::<RoundRows, ROUND_ROWS>(pass, strip, instructions, scratch),
        Shape::Round => whole::<RoundColumns, ROUND_COLUMNS>(pass, strip, instructions, scratch),
    })
}

fn each_strip<const P: usize>(
    pass: &Pass<'_, P>,
    scratches: &mut Vec<Scratch>,
    solve: impl Fn(Strip, &mut Scratch) -> Result<[f32; P]> + Sync,
) -> Result<[f32; P]> {
    let strips = pass.lines.strips();
    // Below some thousand unknowns, waking threads takes longer than the work.
    let small = pass.lines.lines * pass.lines.unknowns < 1 << 12;
    let workers = if small { 1 } else { rayon::current_num_threads().clamp(1, strips.max(1)) };
    if scratches.len() < workers {
        scratches.resize_with(workers, Scratch::default);
    }
    let next = AtomicUsize::new(0);
    let work = |scratch: &mut Scratch| -> Result<[f32; P]> {
        let mut least = [0.0; P];
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= strips {
                return Ok(least);
            }
            pass.cancel.check()?;
            least = smaller(least, solve(pass.lines.strip(index), scratch)?);
        }
    };
    if workers == 1 {
        return work(&mut scratches[0]);
    }
    scratches[..workers]
        .par_iter_mut()
        .with_max_len(1)
        .map(work)
        .try_reduce(|| [0.0; P], |a, b| Ok(smaller(a, b)))
}

fn smaller<const P: usize>(a: [f32; P], b: [f32; P]) -> [f32; P] {
    std::array::from_fn(|p| a[p].min(b[p]))
}
