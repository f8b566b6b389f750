//! LU: elimination along each line, sixteen lines side by side.
//!
//! Instead of the diagonal the gathered weight e is carried, `e_i = sigma gamma_i + t_i` with
//! `t_i = beta_{i-1} e_{i-1} / (e_{i-1} + beta_{i-1})` (two conductors in series), and instead of the right-hand
//! side the gathered mean u: forth `u_i = x_i + (t_i / e_i) (u_{i-1} - x_i)`, back
//! `y_i = u_i + (beta_i / (e_i + beta_i)) (y_{i+1} - u_i)`. Both are means with weights that add to one, so a
//! constant stays itself and a link without conductivity changes nothing, to the bit; nothing cancels.
//! A mean is counted from the side that has more weight, so that a value without weight leaves no rounding
//! error behind, however large it is.

use super::forms::{Constants, Form};
use super::lanes::{LANES, Lanes};
use super::number::Number;
use super::strips::{Bench, Inputs, Outputs};
use pullfocus_core::scheme::{FIELDS, MOST_TERMS};

/// After so many unknowns what has faded is set to 0, before it turns denormal and slow.
const FLUSH: usize = 16;

/// Rows of memory for lines of `n`.
pub(super) fn rows<F: Form>(n: usize, planes: usize, parts: usize, terms: usize) -> usize {
    n * (terms * parts * (1 + planes) + planes * F::KEPT)
}

#[derive(Clone, Copy)]
struct Forth<V, N, const P: usize> {
    weight: N,
    circle: V,
    values: [N; P],
    least: [V; P],
}

#[derive(Clone, Copy)]
struct Back<N, const P: usize> {
    link: N,
    values: [N; P],
}

/// Solves one strip; the smallest value that came in, or 0, for each plane.
///
/// # Safety
/// The processor must have the instructions of `V`, and the bench [`rows`] rows for the solver.
#[inline(always)]
pub(super) unsafe fn solve<V: Lanes, N: Number<V>, F: Form, const P: usize>(
    bench: &Bench<'_, P>,
) -> [f32; P] {
    let pass = bench.pass;
    let (n, chunk) = (pass.lines.unknowns, pass.lines.chunk);
    let terms = &pass.scheme.terms;
    let slot = N::PARTS * (1 + P) * LANES;
    let memory = bench.solver_rows();
    // SAFETY: chunks stay within the n unknowns, slots and kept values within the rows that the caller promises.
    unsafe {
        let slots = |t: usize, from: usize| memory.add((t * n + from) * slot);
        let kept = |from: usize| memory.add(terms.len() * n * slot + from * P * F::KEPT * LANES);
        let zero = V::splat(0.0);
        let start = N::from_parts(zero, zero);
        let mut forths = [Forth {
            // No link leads to the first unknown; any weight will do before it.
            weight: N::from_parts(V::splat(1.0), zero),
            circle: zero,
            values: [start; P],
            least: [zero; P],
        }; MOST_TERMS];
        for from in (0..n).step_by(chunk) {
            let len = chunk.min(n - from);
            let inputs = bench.inputs::<V, F>(from, len);
            for (t, term) in terms.iter().enumerate() {
                let k = Constants::new(pass.beta, term);
                if t == 0 {
                    forth::<V, N, F, P, true>(&mut forths[t], &inputs, len, slots(t, from), kept(from), &k);
                } else {
                    forth::<V, N, F, P, false>(&mut forths[t], &inputs, len, slots(t, from), kept(from), &k);
                }
            }
        }
        let mut backs = [Back { link: start, values: [start; P] }; MOST_TERMS];
        for from in (0..n).step_by(chunk).rev() {
            let len = chunk.min(n - from);
            let to = bench.outputs::<F>(from);
            for (t, term) in terms.iter().enumerate() {
                let k = Constants::new(pass.beta, term);
                let mut lower = [V::splat(f32::NEG_INFINITY); P];
                if t + 1 == terms.len() {
                    for (p, lower) in lower.iter_mut().enumerate() {
                        *lower = V::splat(pass.lower[p]);
                    }
                }
                if t == 0 {
                    back::<V, N, F, P, true>(&mut backs[t], &to, len, slots(t, from), kept(from), &k, &lower);
                } else {
                    back::<V, N, F, P, false>(
                        &mut backs[t],
                        &to,
                        len,
                        slots(t, from),
                        kept(from),
                        &k,
                        &lower,
                    );
                }
            }
            bench.written::<V, F>(from, len);
        }
        let mut least = [0.0; P];
        for (p, least) in least.iter_mut().enumerate() {
            *least = forths[0].least[p].to_array().into_iter().fold(0.0, f32::min);
        }
        least
    }
}

#[inline(always)]
unsafe fn forth<V: Lanes, N: Number<V>, F: Form, const P: usize, const FIRST: bool>(
    state: &mut Forth<V, N, P>,
    inputs: &Inputs<P>,
    len: usize,
    mut slots: *mut f32,
    mut kept: *mut f32,
    k: &Constants<V, N>,
) {
    let mut s = *state;
    for i in 0..len {
        // SAFETY: the caller has `len` unknowns, slots and kept values.
        unsafe {
            let circle: V = inputs.circle.load(i);
            let gamma = inputs.gamma.load::<V>(i).max(k.least_gamma);
            let beta = k.link(s.circle, circle);
            let step = N::eliminate(s.weight, beta, gamma, k.sigma, k.one, k.zero);
            step.back.store(slots);
            slots = slots.add(N::PARTS * LANES);
            for p in 0..P {
                let fields = inputs.fields::<V, F>(p, i);
                if FIRST {
                    s.least[p] = s.least[p].min(fields[0]);
                    for value in F::keep(&fields).into_iter().take(F::KEPT) {
                        value.store(kept);
                        kept = kept.add(LANES);
                    }
                }
                let x = F::known::<V, N, FIRST>(&fields, k);
                s.values[p] = N::forth(&step, s.values[p], x);
                s.values[p].store(slots);
                slots = slots.add(N::PARTS * LANES);
            }
            s.weight = step.weight;
            s.circle = circle;
        }
        if i % FLUSH == FLUSH - 1 {
            for value in &mut s.values {
                *value = value.flush(k.tiny, k.zero);
            }
        }
    }
    *state = s;
}

#[inline(always)]
unsafe fn back<V: Lanes, N: Number<V>, F: Form, const P: usize, const FIRST: bool>(
    state: &mut Back<N, P>,
    to: &Outputs<P>,
    len: usize,
    slots: *const f32,
    kept: *const f32,
    k: &Constants<V, N>,
    lower: &[V; P],
) {
    let mut s = *state;
    for i in (0..len).rev() {
        // SAFETY: the caller has `len` unknowns, slots and kept values.
        unsafe {
            let mut slot = slots.add(i * N::PARTS * (1 + P) * LANES);
            let link = s.link;
            s.link = N::load(slot);
            for (p, &lower) in lower.iter().enumerate() {
                slot = slot.add(N::PARTS * LANES);
                s.values[p] = N::back(link, N::load(slot), s.values[p], k.zero);
                let mut keeps = [k.zero; 2];
                for (which, keep) in keeps.iter_mut().enumerate().take(F::KEPT) {
                    *keep = V::load(kept.add(((i * P + p) * F::KEPT + which) * LANES));
                }
                let mut fields = [k.zero; FIELDS];
                if !FIRST {
                    for (field, before) in fields.iter_mut().enumerate().take(F::OUT) {
                        *before = V::load(to.fields[p][field].add(i * to.stride));
                    }
                }
                fields = F::result::<V, N, FIRST>(s.values[p], keeps, fields, k);
                fields[0] = fields[0].max(lower);
                for (field, value) in fields.into_iter().enumerate().take(F::OUT) {
                    value.store(to.fields[p][field].add(i * to.stride));
                }
            }
        }
        if i % FLUSH == 0 {
            for value in &mut s.values {
                *value = value.flush(k.tiny, k.zero);
            }
        }
    }
    *state = s;
}
