//! Cyclic reduction in the gather form of the first paper's figure 5, for any length.
//!
//! Each level keeps every second unknown (the odd ones) of the level below: it eliminates the even ones, each of
//! which then lies between two that stay. Level by level the pyramid holds the row sum g (gamma on the lowest
//! level), the links' beta, and the mean x that the unknown stands for, in place of the figure's a, b, c and y:
//! with the eliminated neighbours' pivots `b = g + beta_left + beta_right`,
//!
//! - `g' = g + (beta_left / b_left) g_left + (beta_right / b_right) g_right`,
//! - `beta' = beta_left beta_right / b` across each eliminated unknown,
//! - `x' = x + (beta_left g_left / b_left (x_left - x) + ...) / g'`,
//!
//! and on the way down `y = x + (beta_left (y_left - x) + beta_right (y_right - x)) / b` for the even ones. Sums of
//! positive terms throughout; where the figure has lengths 2^k - 1 only, a neighbour that is missing here has
//! beta 0.
//!
//! The levels may end early: what is left is solved by [`parallel_cyclic_reduction`]. So the hybrid is a shorter
//! pyramid, and parallel cyclic reduction alone one with a single level.

use super::forms::{Constants, Form};
use super::lanes::{LANES, Lanes};
use super::number::Number;
use super::parallel_cyclic_reduction;
use super::strips::Bench;
use pullfocus_core::diffusion::{HYBRID_REST, Solver};

/// Rows of memory for lines of `n`: the sum of terms, what it keeps, then g, beta and x for each unknown of the
/// pyramid, which has fewer than 2 n.
pub(super) fn rows<F: Form>(n: usize, parts: usize) -> usize {
    n * (F::OUT + F::KEPT) + 2 * n * parts * 3
}

/// The unknowns of one level.
#[derive(Clone, Copy)]
pub(super) struct Level {
    at: *mut f32,
    pub n: usize,
    slot: usize,
}

impl Level {
    /// # Safety
    /// `j < n`, and the processor has the instructions.
    #[inline(always)]
    pub unsafe fn get<V: Lanes, N: Number<V>>(self, j: usize, field: usize) -> N {
        // SAFETY: the caller's promise.
        unsafe { N::load(self.at.add(j * self.slot + field * N::PARTS * LANES)) }
    }

    /// # Safety
    /// As [`Level::get`].
    #[inline(always)]
    pub unsafe fn set<V: Lanes, N: Number<V>>(self, j: usize, field: usize, value: N) {
        // SAFETY: the caller's promise.
        unsafe { value.store(self.at.add(j * self.slot + field * N::PARTS * LANES)) };
    }

    fn above(self) -> Self {
        // SAFETY: the pyramid has 2 n slots.
        Self { at: unsafe { self.at.add(self.n * self.slot) }, n: self.n / 2, slot: self.slot }
    }
}

/// Field numbers: the row sum, the link to the next unknown (0 at the last), the value.
pub(super) const G: usize = 0;
pub(super) const BETA: usize = 1;
pub(super) const X: usize = 2;

/// How many unknowns are left to parallel cyclic reduction; with one, it has nothing to do.
fn rest(solver: Solver) -> usize {
    match solver {
        Solver::ParallelCyclicReduction => usize::MAX,
        Solver::Hybrid => HYBRID_REST,
        _ => 1,
    }
}

/// Solves one strip; the smallest value that came in, or 0.
///
/// # Safety
/// The processor must have the instructions of `V`, and the bench [`rows`] rows for the solver.
#[inline(always)]
pub(super) unsafe fn solve<V: Lanes, N: Number<V>, F: Form>(bench: &Bench<'_, 1>) -> [f32; 1] {
    let pass = bench.pass;
    let n = pass.lines.unknowns;
    let rest = rest(pass.solver);
    let sum = bench.solver_rows();
    // SAFETY: all levels together have fewer than 2 n unknowns, and the caller promises memory for as many.
    unsafe {
        let kept = sum.add(n * F::OUT * LANES);
        let base = Level { at: kept.add(n * F::KEPT * LANES), n, slot: N::PARTS * 3 * LANES };
        let mut least = [0.0];
        for (t, term) in pass.scheme.terms.iter().enumerate() {
            let k = Constants::<V, N>::new(pass.beta, term);
            let smallest = if t == 0 {
                fill::<V, N, F, true>(bench, base, kept, &k)
            } else {
                fill::<V, N, F, false>(bench, base, kept, &k)
            };
            let mut levels = [base; usize::BITS as usize];
            let mut top = 0;
            while levels[top].n > rest {
                levels[top + 1] = levels[top].above();
                reduce::<V, N>(levels[top], levels[top + 1], &k);
                top += 1;
            }
            // Then no unknown that is left has links: its mean is its value.
            parallel_cyclic_reduction::solve::<V, N>(levels[top], &k);
            for level in (0..top).rev() {
                substitute::<V, N>(levels[level], levels[level + 1], &k);
            }
            if t == 0 {
                least = [smallest];
                bench.add_term::<V, N, F, true>(sum, kept, &k, |j| base.get(j, X));
            } else {
                bench.add_term::<V, N, F, false>(sum, kept, &k, |j| base.get(j, X));
            }
        }
        bench.put_sum::<V, F>(sum);
        least
    }
}

/// The lowest level: gamma, beta and the known values.
#[inline(always)]
unsafe fn fill<V: Lanes, N: Number<V>, F: Form, const FIRST: bool>(
    bench: &Bench<'_, 1>,
    base: Level,
    mut kept: *mut f32,
    k: &Constants<V, N>,
) -> f32 {
    let mut least = k.zero;
    let mut last = k.zero;
    let chunk = bench.pass.lines.chunk;
    for from in (0..base.n).step_by(chunk) {
        let len = chunk.min(base.n - from);
        // SAFETY: unknowns below n.
        unsafe {
            let inputs = bench.inputs::<V, F>(from, len);
            for i in 0..len {
                let j = from + i;
                let circle: V = inputs.circle.load(i);
                if j > 0 {
                    base.set(j - 1, BETA, N::from_parts(k.link(last, circle), k.zero));
                }
                last = circle;
                base.set(j, BETA, N::from_parts(k.zero, k.zero));
                base.set(j, G, k.sigma.scale(inputs.gamma.load::<V>(i).max(k.least_gamma)));
                let fields = inputs.fields::<V, F>(0, i);
                least = least.min(fields[0]);
                if FIRST {
                    for value in F::keep(&fields).into_iter().take(F::KEPT) {
                        value.store(kept);
                        kept = kept.add(LANES);
                    }
                }
                base.set(j, X, F::known::<V, N, FIRST>(&fields, k));
            }
        }
    }
    least.to_array().into_iter().fold(0.0, f32::min)
}

/// Figure 5, lines 1 to 8: the level above gathers from the one below.
#[inline(always)]
unsafe fn reduce<V: Lanes, N: Number<V>>(from: Level, to: Level, k: &Constants<V, N>) {
    let none = N::from_parts(k.zero, k.zero);
    for j in 0..to.n {
        let i = 2 * j + 1;
        // SAFETY: i - 1 and i are below n, i + 1 and i + 2 are asked before they are read.
        unsafe {
            let left: N = from.get(i - 1, BETA);
            let right: N = from.get(i, BETA);
            let before = if i > 1 { from.get(i - 2, BETA) } else { none };
            let g_left: N = from.get(i - 1, G);
            let part_left = left.mul(before.add(g_left).add(left).recip(k.one));
            let pull_left = part_left.mul(g_left);
            let has_right = i + 1 < from.n;
            let (mut pull_right, mut beta) = (none, none);
            if has_right {
                let after: N = from.get(i + 1, BETA);
                let g_right: N = from.get(i + 1, G);
                let part_right = right.mul(right.add(g_right).add(after).recip(k.one));
                pull_right = part_right.mul(g_right);
                beta = part_right.mul(after);
            }
            let g = from.get::<V, N>(i, G).add(pull_left).add(pull_right);
            to.set(j, G, g);
            to.set(j, BETA, beta);
            let r = g.recip(k.one);
            let (share_left, share_right) = (pull_left.mul(r), pull_right.mul(r));
            let x: N = from.get(i, X);
            let mut sum = share_left.mul(from.get::<V, N>(i - 1, X).sub(x));
            if has_right {
                sum = sum.add(share_right.mul(from.get::<V, N>(i + 1, X).sub(x)));
            }
            to.set(j, X, x.add(sum));
        }
    }
}

/// Figure 5, lines 10 to 16: the odd unknowns take their values from above, the even ones from their neighbours.
#[inline(always)]
unsafe fn substitute<V: Lanes, N: Number<V>>(to: Level, above: Level, k: &Constants<V, N>) {
    let none = N::from_parts(k.zero, k.zero);
    for i in 0..to.n {
        // SAFETY: (i - 1) / 2 and i / 2 of the level above are there where to.n says that i - 1 and i + 1 are.
        unsafe {
            if i % 2 == 1 {
                to.set(i, X, above.get::<V, N>(i / 2, X));
                continue;
            }
            let left = if i > 0 { to.get(i - 1, BETA) } else { none };
            let right: N = to.get(i, BETA);
            let r = left.add(to.get(i, G)).add(right).recip(k.one);
            let (share_left, share_right) = (left.mul(r), right.mul(r));
            let x: N = to.get(i, X);
            let mut y = x;
            if i > 0 {
                y = y.add(share_left.mul(above.get::<V, N>(i / 2 - 1, X).sub(x)));
            }
            if i + 1 < to.n {
                y = y.add(share_right.mul(above.get::<V, N>(i / 2, X).sub(x)));
            }
            to.set(i, X, y);
        }
    }
}
