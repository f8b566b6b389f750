//! Jacobi (second paper, equation 2.13, with the first paper's min rule): every unknown from its neighbours' values
//! of the sweep before, `y = x + (beta_left (y_left - x) + beta_right (y_right - x)) / (gamma + beta_left +
//! beta_right)`, beginning with `y = x`.
//!
//! A sweep multiplies the error by about `2 beta / (gamma + 2 beta)`: wide blurs take very many. The complex
//! systems of a rational integrator converge too, since `|sigma gamma + 2 beta| > 2 beta` for a sigma with a
//! positive real part.

use super::lanes::{LANES, Lanes};
use super::number::Number;
use super::strips::{Bench, CHUNK, Constants, stop};
use pullfocus_core::Result;
use pullfocus_core::diffusion::JacobiStop;

/// Rows of memory for lines of `n`: the sum of terms, two shares, the planes, and their values of
/// two sweeps.
pub(super) fn rows(n: usize, planes: usize, parts: usize) -> usize {
    n * (2 * parts + planes * (2 + 2 * parts))
}

/// Solves one strip; the smallest value that came in, or 0, for each plane.
///
/// # Errors
/// [`pullfocus_core::Error::Cancelled`]; it is asked before each sweep.
///
/// # Safety
/// The processor must have the instructions of `V`, and the bench [`rows`] rows for the solver.
#[inline(always)]
pub(super) unsafe fn solve<V: Lanes, N: Number<V>, const P: usize>(
    bench: &Bench<'_, P>,
    until: JacobiStop,
) -> Result<[f32; P]> {
    let pass = bench.pass;
    let n = pass.lines.unknowns;
    let part = N::PARTS * LANES;
    let sum = bench.solver_rows();
    // SAFETY: the sections add up to the rows that the caller promises; indices stay below n.
    unsafe {
        let shares = sum.add(n * P * LANES);
        let xs = shares.add(2 * n * part);
        let mut old = xs.add(n * P * LANES);
        let mut new = old.add(n * P * part);
        let (sweeps, tolerance) = stop(until);
        let mut least = [0.0; P];
        for (t, term) in pass.scheme.terms.iter().enumerate() {
            let k = Constants::<V, N>::new(pass.beta, term);
            least = fill(bench, shares, xs, old, &k);
            for _ in 0..sweeps {
                pass.cancel.check()?;
                let (mut change, mut largest) = (k.zero, k.zero);
                for j in 0..n {
                    let left = N::load(shares.add(2 * j * part));
                    let right = N::load(shares.add((2 * j + 1) * part));
                    // The shares at the ends are 0; any value will do there.
                    let (before, after) = (j.saturating_sub(1), (j + 1).min(n - 1));
                    for p in 0..P {
                        let x = N::from_real(V::load(xs.add((j * P + p) * LANES)), k.zero);
                        let value = |j: usize| N::load(old.add((j * P + p) * part)).sub(x);
                        let y = x.add(left.mul(value(before))).add(right.mul(value(after)));
                        y.store(new.add((j * P + p) * part));
                        if tolerance.is_some() {
                            let was: N = N::load(old.add((j * P + p) * part));
                            change = change.max(y.sub(was).size());
                            largest = largest.max(y.size());
                        }
                    }
                }
                std::mem::swap(&mut old, &mut new);
                if let Some(tolerance) = tolerance
                    && !V::any(largest.mul(V::splat(tolerance)).lt(change))
                {
                    break;
                }
            }
            bench.add_term(sum, t == 0, &k, |j, p| N::load(old.add((j * P + p) * part)));
        }
        bench.put_sum::<V>(sum);
        Ok(least)
    }
}

#[inline(always)]
unsafe fn fill<V: Lanes, N: Number<V>, const P: usize>(
    bench: &Bench<'_, P>,
    shares: *mut f32,
    xs: *mut f32,
    start: *mut f32,
    k: &Constants<V, N>,
) -> [f32; P] {
    let n = bench.pass.lines.unknowns;
    let part = N::PARTS * LANES;
    let mut least = [k.zero; P];
    // An unknown's shares wait until the circle after it is known.
    let (mut last, mut last_gamma, mut last_left) = (k.zero, k.one, k.zero);
    // SAFETY: as in `solve`.
    unsafe {
        let set = |j: usize, gamma: V, left: V, right: V| {
            let r = k.sigma.scale(gamma).add(N::from_real(left.add(right), k.zero)).recip(k.one);
            r.scale(left).store(shares.add(2 * j * part));
            r.scale(right).store(shares.add((2 * j + 1) * part));
        };
        for from in (0..n).step_by(CHUNK) {
            let len = CHUNK.min(n - from);
            let inputs = bench.inputs::<V>(from, len);
            for i in 0..len {
                let j = from + i;
                let circle: V = inputs.circle.load(i);
                let link = k.link(last, circle);
                if j > 0 {
                    set(j - 1, last_gamma, last_left, link);
                }
                (last, last_left) = (circle, link);
                last_gamma = inputs.gamma.load::<V>(i).max(k.least_gamma);
                for p in 0..P {
                    let x: V = inputs.planes[p].load(i);
                    least[p] = least[p].min(x);
                    x.store(xs.add((j * P + p) * LANES));
                    N::from_real(x, k.zero).store(start.add((j * P + p) * part));
                }
            }
        }
        set(n - 1, last_gamma, last_left, k.zero);
    }
    least.map(|v| v.to_array().into_iter().fold(0.0, f32::min))
}
