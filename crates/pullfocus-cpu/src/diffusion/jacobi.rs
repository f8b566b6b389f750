//! Jacobi (second paper, equation 2.13, with the first paper's min rule): every unknown from its neighbours' values
//! of the sweep before, `y = x + (beta_left (y_left - x) + beta_right (y_right - x)) / (gamma + beta_left +
//! beta_right)`, beginning with `y = x`.
//!
//! A sweep multiplies the error by about `2 beta / (gamma + 2 beta)`: wide blurs take very many. The complex
//! systems of a rational integrator converge too, since `|sigma gamma + 2 beta| > 2 beta` for a sigma with a
//! positive real part.

use super::forms::{Constants, Form};
use super::lanes::{LANES, Lanes};
use super::number::Number;
use super::strips::Bench;
use pullfocus_core::Result;
use pullfocus_core::diffusion::{JACOBI_MOST_SWEEPS, JacobiStop};

/// Rows of memory for lines of `n`: the sum of terms, what it keeps, two shares, x, and the values of two sweeps.
pub(super) fn rows<F: Form>(n: usize, parts: usize) -> usize {
    n * (F::OUT + F::KEPT + 5 * parts)
}

/// The sections of a strip's memory; each has a number for every unknown.
#[derive(Clone, Copy)]
struct Sections {
    kept: *mut f32,
    left: *mut f32,
    right: *mut f32,
    x: *mut f32,
    old: *mut f32,
    new: *mut f32,
}

/// Solves one strip; the smallest value that came in, or 0. A tolerance is met when all sixteen lines meet it, each
/// by its own largest value.
///
/// # Errors
/// [`pullfocus_core::Error::Cancelled`]; it is asked before each sweep.
///
/// # Safety
/// The processor must have the instructions of `V`, and the bench [`rows`] rows for the solver.
#[inline(always)]
pub(super) unsafe fn solve<V: Lanes, N: Number<V>, F: Form>(
    bench: &Bench<'_, 1>,
    until: JacobiStop,
) -> Result<[f32; 1]> {
    let pass = bench.pass;
    let n = pass.lines.unknowns;
    let sum = bench.solver_rows();
    let mut least = [0.0];
    // SAFETY: the sections add up to the rows that the caller promises.
    unsafe {
        let kept = sum.add(n * F::OUT * LANES);
        let first = kept.add(n * F::KEPT * LANES);
        let section = |i: usize| first.add(i * n * N::PARTS * LANES);
        let sections = Sections {
            kept,
            left: section(0),
            right: section(1),
            x: section(2),
            old: section(3),
            new: section(4),
        };
        for (t, term) in pass.scheme.terms.iter().enumerate() {
            let k = Constants::<V, N>::new(pass.beta, term);
            let at = |from: *const f32, j: usize| N::load(from.add(j * N::PARTS * LANES));
            if t == 0 {
                least = [fill::<V, N, F, true>(bench, sections, &k)];
                let solution = sweep::<V, N>(bench, sections, until, &k)?;
                bench.add_term::<V, N, F, true>(sum, kept, &k, |j| at(solution, j));
            } else {
                fill::<V, N, F, false>(bench, sections, &k);
                let solution = sweep::<V, N>(bench, sections, until, &k)?;
                bench.add_term::<V, N, F, false>(sum, kept, &k, |j| at(solution, j));
            }
        }
        bench.put_sum::<V, F>(sum);
    }
    Ok(least)
}

/// Sweeps until it is time to stop; where the solution is.
#[inline(always)]
unsafe fn sweep<V: Lanes, N: Number<V>>(
    bench: &Bench<'_, 1>,
    sections: Sections,
    until: JacobiStop,
    k: &Constants<V, N>,
) -> Result<*const f32> {
    let n = bench.pass.lines.unknowns;
    let Sections { left, right, x, mut old, mut new, .. } = sections;
    let (sweeps, tolerance) = match until {
        JacobiStop::Sweeps(sweeps) => (sweeps, None),
        JacobiStop::Tolerance(tolerance) => (JACOBI_MOST_SWEEPS, Some(tolerance)),
    };
    for _ in 0..sweeps {
        bench.pass.cancel.check()?;
        let (mut change, mut largest) = (k.zero, k.zero);
        for j in 0..n {
            // SAFETY: j is below n, the number of unknowns of each section.
            unsafe {
                let at = |from: *const f32, j: usize| -> N { N::load(from.add(j * N::PARTS * LANES)) };
                // The shares at the ends are 0; any value will do there.
                let (before, after) = (at(old, j.saturating_sub(1)), at(old, (j + 1).min(n - 1)));
                let own = at(x, j);
                let pull = at(left, j).mul(before.sub(own)).add(at(right, j).mul(after.sub(own)));
                let y = own.add(pull);
                y.store(new.add(j * N::PARTS * LANES));
                if tolerance.is_some() {
                    change = change.max(y.sub(at(old, j)).size());
                    largest = largest.max(y.size());
                }
            }
        }
        std::mem::swap(&mut old, &mut new);
        if let Some(tolerance) = tolerance {
            // SAFETY: k is the proof of the instructions.
            let tolerance = unsafe { V::splat(tolerance) };
            if !V::any(largest.mul(tolerance).lt(change)) {
                break;
            }
        }
    }
    Ok(old)
}

/// An unknown's shares of its neighbours' values: beta over the diagonal.
///
/// # Safety
/// `j` must be in the sections.
#[inline(always)]
unsafe fn share<V: Lanes, N: Number<V>>(
    sections: Sections,
    j: usize,
    gamma: V,
    left: V,
    right: V,
    k: &Constants<V, N>,
) {
    let r = k.sigma.scale(gamma).add(N::from_parts(left.add(right), k.zero)).recip(k.one);
    // SAFETY: the caller's promise.
    unsafe {
        r.scale(left).store(sections.left.add(j * N::PARTS * LANES));
        r.scale(right).store(sections.right.add(j * N::PARTS * LANES));
    }
}

/// Shares, x and the first guess.
#[inline(always)]
unsafe fn fill<V: Lanes, N: Number<V>, F: Form, const FIRST: bool>(
    bench: &Bench<'_, 1>,
    sections: Sections,
    k: &Constants<V, N>,
) -> f32 {
    let (n, chunk) = (bench.pass.lines.unknowns, bench.pass.lines.chunk);
    let part = N::PARTS * LANES;
    let mut least = k.zero;
    let mut kept = sections.kept;
    // An unknown's shares wait until the circle after it is known.
    let (mut last, mut last_gamma, mut last_left) = (k.zero, k.one, k.zero);
    // SAFETY: as in `solve`.
    unsafe {
        for from in (0..n).step_by(chunk) {
            let len = chunk.min(n - from);
            let inputs = bench.inputs::<V, F>(from, len);
            for i in 0..len {
                let j = from + i;
                let circle: V = inputs.circle.load(i);
                let link = k.link(last, circle);
                if j > 0 {
                    share(sections, j - 1, last_gamma, last_left, link, k);
                }
                (last, last_left) = (circle, link);
                last_gamma = inputs.gamma.load::<V>(i).max(k.least_gamma);
                let fields = inputs.fields::<V, F>(0, i);
                least = least.min(fields[0]);
                if FIRST {
                    for value in F::keep(&fields).into_iter().take(F::KEPT) {
                        value.store(kept);
                        kept = kept.add(LANES);
                    }
                }
                let x = F::known::<V, N, FIRST>(&fields, k);
                x.store(sections.x.add(j * part));
                x.store(sections.old.add(j * part));
            }
        }
        share(sections, n - 1, last_gamma, last_left, k.zero, k);
    }
    least.to_array().into_iter().fold(0.0, f32::min)
}
