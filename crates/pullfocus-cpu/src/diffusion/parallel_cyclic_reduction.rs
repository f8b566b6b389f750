//! Parallel cyclic reduction (Zhang, Cohen, Owens 2010, "Fast Tridiagonal Solvers on the GPU"), in the form of
//! `cyclic_reduction`: row sums g, links beta, means x.
//!
//! A step at distance d takes each unknown j from its neighbours l = j - d and r = j + d, all at once. With a and c the
//! links of an unknown to both sides and the neighbours' pivots `p = g + a + c`,
//!
//! - `w_l = (a_j / p_l) g_l`, `w_r = (c_j / p_r) g_r`,
//! - `g' = g + w_l + w_r`,
//! - `x' = x + (w_l (x_l - x) + w_r (x_r - x)) / g'`,
//! - links `a_j a_l / p_l` to j - 2 d and `c_j c_r / p_r` to j + 2 d.
//!
//! When 2 d reaches beyond the line no links are left, and every mean is its unknown's value. That is the work of
//! cyclic reduction's first level for each doubling of the length: made for machines with a thread for each unknown.

use super::cyclic_reduction::{BETA, G, Level, X};
use super::forms::Constants;
use super::lanes::Lanes;
use super::number::Number;

/// Solves a level's system in place: its values become the solution.
///
/// # Safety
/// The processor must have the instructions, and the level its memory.
#[inline(always)]
pub(super) unsafe fn solve<V: Lanes, N: Number<V>>(level: Level, k: &Constants<V, N>) {
    let mut distance = 1;
    while distance < level.n {
        // Every distance-th unknown is one system, which the others do not touch.
        for first in 0..distance {
            // SAFETY: `first` is below n; the rest is the caller's promise.
            unsafe { step(level, first, distance, k) };
        }
        distance *= 2;
    }
}

/// One step of the system of every `distance`-th unknown from `first` on. Going along it, an unknown is written when what
/// its successor needs of it is in registers.
///
/// # Safety
/// As [`solve`], and `first` must be below n.
#[inline(always)]
unsafe fn step<V: Lanes, N: Number<V>>(level: Level, first: usize, distance: usize, k: &Constants<V, N>) {
    let none = N::from_parts(k.zero, k.zero);
    // SAFETY: `first` is below n, and `next` is asked before it is read.
    unsafe {
        let (mut j, mut g, mut beta, mut x): (_, N, N, N) =
            (first, level.get(first, G), level.get(first, BETA), level.get(first, X));
        let mut r = g.add(beta).recip(k.one);
        // What the unknown before gives: its weight w_l and its value.
        let (mut pull_left, mut x_left) = (none, x);
        loop {
            let next = j + distance;
            let has_next = next < level.n;
            let (mut g_next, mut beta_next, mut x_next, mut r_next) = (g, none, x, r);
            let (mut pull_right, mut link) = (none, none);
            if has_next {
                (g_next, beta_next, x_next) = (level.get(next, G), level.get(next, BETA), level.get(next, X));
                r_next = beta.add(g_next).add(beta_next).recip(k.one);
                let part = beta.mul(r_next);
                pull_right = part.mul(g_next);
                // Links fade with every step.
                link = part.mul(beta_next).flush(k.tiny, k.zero);
            }
            let sum = g.add(pull_left).add(pull_right);
            let r_sum = sum.recip(k.one);
            let (share_left, share_right) = (pull_left.mul(r_sum), pull_right.mul(r_sum));
            let change = share_left.mul(x_left.sub(x)).add(share_right.mul(x_next.sub(x)));
            level.set(j, G, sum);
            level.set(j, BETA, link);
            level.set(j, X, x.add(change));
            if !has_next {
                return;
            }
            (pull_left, x_left) = (beta.mul(r).mul(g), x);
            (j, g, beta, x, r) = (next, g_next, beta_next, x_next, r_next);
        }
    }
}
