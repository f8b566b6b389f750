//! What goes into a pass's systems and what is made of their solutions: three forms for the same solvers.

use super::lanes::Lanes;
use super::number::Number;
use pullfocus_core::scheme::{FIELDS, LEAST_GAMMA, MOST_BETA, Term};

/// The constants of one term in registers.
#[derive(Clone, Copy)]
pub(super) struct Constants<V, N> {
    pub zero: V,
    pub one: V,
    pub two: V,
    pub half: V,
    pub beta: V,
    pub most_beta: V,
    pub least_gamma: V,
    pub tiny: V,
    pub sigma: N,
    pub h: V,
    pub share: V,
    pub mix: [[V; 3]; FIELDS],
    pub start: [V; FIELDS],
}

impl<V: Lanes, N: Number<V>> Constants<V, N> {
    /// # Safety
    /// The processor must have the instructions.
    #[inline(always)]
    pub unsafe fn new(beta: f64, term: &Term) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            // Loops, not array maps: those would be compiled without the instructions.
            let mut mix = [[V::splat(0.0); 3]; FIELDS];
            let mut start = [V::splat(0.0); FIELDS];
            for field in 0..FIELDS {
                start[field] = V::splat(term.start[field]);
                for (part, to) in mix[field].iter_mut().enumerate() {
                    *to = V::splat(term.mix[field][part]);
                }
            }
            Self {
                zero: V::splat(0.0),
                one: V::splat(1.0),
                two: V::splat(2.0),
                half: V::splat(0.5),
                beta: V::splat((beta * term.beta) as f32),
                most_beta: V::splat(MOST_BETA),
                least_gamma: V::splat(LEAST_GAMMA),
                tiny: V::splat(1e-30),
                sigma: N::splat(term.sigma),
                h: V::splat(term.h),
                share: V::splat(term.share),
                mix,
                start,
            }
        }
    }

    /// beta of the link between two circles: of the smaller one, squared.
    #[inline(always)]
    pub fn link(&self, a: V, b: V) -> V {
        let c = a.abs().min(b.abs());
        c.mul(c).mul(self.beta).min(self.most_beta)
    }
}

/// One unknown's fields of one plane; a form uses the first IN or OUT of them.
pub(super) type Fields<V> = [V; FIELDS];

/// What a pass does around its solves.
pub(super) trait Form {
    /// Fields that come in for each plane.
    const IN: usize;
    /// Fields that go out for each plane; the first is the plane itself.
    const OUT: usize;
    /// Values for each unknown and plane that are kept from the way in for the way out.
    const KEPT: usize;

    /// The known side of a term's system.
    fn known<V: Lanes, N: Number<V>, const FIRST: bool>(fields: &Fields<V>, k: &Constants<V, N>) -> N;

    /// What to keep, the first KEPT of two.
    fn keep<V: Lanes>(fields: &Fields<V>) -> [V; 2];

    /// The fields after a term with solution `v`; `before` is what the terms before it gave.
    fn result<V: Lanes, N: Number<V>, const FIRST: bool>(
        v: N,
        kept: [V; 2],
        before: Fields<V>,
        k: &Constants<V, N>,
    ) -> Fields<V>;
}

/// Rows and columns of a product: a plane in, a plane out.
pub(super) struct Separable;

impl Form for Separable {
    const IN: usize = 1;
    const OUT: usize = 1;
    const KEPT: usize = 0;

    #[inline(always)]
    fn known<V: Lanes, N: Number<V>, const FIRST: bool>(fields: &Fields<V>, k: &Constants<V, N>) -> N {
        N::from_parts(fields[0], k.zero)
    }

    #[inline(always)]
    fn keep<V: Lanes>(fields: &Fields<V>) -> [V; 2] {
        [fields[0]; 2]
    }

    #[inline(always)]
    fn result<V: Lanes, N: Number<V>, const FIRST: bool>(
        v: N,
        _: [V; 2],
        before: Fields<V>,
        k: &Constants<V, N>,
    ) -> Fields<V> {
        let value = v.project(k.h);
        if FIRST { [value; FIELDS] } else { [k.share.mul_add(value.sub(before[0]), before[0]); FIELDS] }
    }
}

/// The rows of a sum of products: a plane in, four fields out. See [`pullfocus_core::scheme`].
pub(super) struct RoundRows;

impl Form for RoundRows {
    const IN: usize = 1;
    const OUT: usize = FIELDS;
    const KEPT: usize = 0;

    #[inline(always)]
    fn known<V: Lanes, N: Number<V>, const FIRST: bool>(fields: &Fields<V>, k: &Constants<V, N>) -> N {
        N::from_parts(fields[0], k.zero)
    }

    #[inline(always)]
    fn keep<V: Lanes>(fields: &Fields<V>) -> [V; 2] {
        [fields[0]; 2]
    }

    #[inline(always)]
    fn result<V: Lanes, N: Number<V>, const FIRST: bool>(
        v: N,
        _: [V; 2],
        before: Fields<V>,
        k: &Constants<V, N>,
    ) -> Fields<V> {
        if FIRST {
            return [v.re(), v.im(k.zero), k.zero, k.zero];
        }
        let changes = [before[1], v.re().sub(before[0]), v.im(k.zero)];
        let mut out = before;
        for (field, out) in out.iter_mut().enumerate() {
            *out = before[0].mul(k.start[field]);
            for (change, weight) in changes.into_iter().zip(k.mix[field]) {
                *out = weight.mul_add(change, *out);
            }
        }
        out
    }
}

/// The columns of a sum of products: four fields in, a plane out.
pub(super) struct RoundColumns;

impl Form for RoundColumns {
    const IN: usize = FIELDS;
    const OUT: usize = 1;
    const KEPT: usize = 2;

    #[inline(always)]
    fn known<V: Lanes, N: Number<V>, const FIRST: bool>(fields: &Fields<V>, k: &Constants<V, N>) -> N {
        if FIRST {
            N::from_parts(fields[1], fields[2])
        } else {
            N::from_parts(k.half.mul_add(fields[0], k.zero.sub(fields[1])), fields[3])
        }
    }

    #[inline(always)]
    fn keep<V: Lanes>(fields: &Fields<V>) -> [V; 2] {
        [fields[0], fields[1]]
    }

    #[inline(always)]
    fn result<V: Lanes, N: Number<V>, const FIRST: bool>(
        v: N,
        [q, re]: [V; 2],
        before: Fields<V>,
        k: &Constants<V, N>,
    ) -> Fields<V> {
        if FIRST {
            return [v.re(); FIELDS];
        }
        // As in `known`, to the bit.
        let known = k.half.mul_add(q, k.zero.sub(re));
        let change = before[0].sub(re).abs().add(v.re().sub(known).abs());
        let sum = k.two.mul(before[0].add(v.re()));
        [V::select(change.lt(k.tiny), q, sum); FIELDS]
    }
}
