//! The numbers that a system is solved in: real for backward Euler, complex for a pole of a rational integrator.
//!
//! A system is `(K + sigma Gamma) v = sigma Gamma x`, K the insulated line's Laplacian with the links' beta, sigma
//! of length 1 with a positive real part (1 for backward Euler). Both kinds of number share the elimination
//! below; neither subtracts where it could cancel.

use super::lanes::Lanes;

/// What one elimination step along the line yields.
#[derive(Clone, Copy)]
pub(super) struct Eliminated<V: Lanes, N> {
    /// For the way back, about the link to the unknown before: how far that one goes towards its successor, or,
    /// where it goes more than half the way, minus how far it stays behind.
    pub back: N,
    /// The weight gathered so far, this unknown included.
    pub weight: N,
    /// For the way forth, the same two-sided form: how far this unknown goes towards what was gathered before.
    pub forth: N,
    /// Where `forth` counts from this unknown's own value.
    pub from_own: V::Mask,
}

/// A real or complex number in each lane.
pub(super) trait Number<V: Lanes>: Copy {
    /// f32 a lane.
    const PARTS: usize;
    /// # Safety
    /// As [`Lanes::splat`].
    unsafe fn splat(value: [f32; 2]) -> Self;
    /// # Safety
    /// As [`Lanes::load`], for PARTS times 16 values.
    unsafe fn load(from: *const f32) -> Self;
    /// # Safety
    /// As [`Lanes::store`], for PARTS times 16 values.
    unsafe fn store(self, to: *mut f32);
    /// The imaginary part must be 0 where numbers are real.
    fn from_parts(re: V, im: V) -> Self;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn scale(self, by: V) -> Self;
    /// `1 / self`.
    fn recip(self, one: V) -> Self;
    fn re(self) -> V;
    /// The imaginary part, `zero` where there is none.
    fn im(self, zero: V) -> V;
    /// The largest part, for a measure of size.
    fn size(self) -> V;
    /// `re - h im`.
    fn project(self, h: V) -> V;
    /// Parts too small to matter become 0, before they turn denormal and slow.
    fn flush(self, tiny: V, zero: V) -> Self;

    /// Takes the unknown with specific heat `gamma` behind a link of conductivity `beta` after one whose gathered
    /// weight is `weight`: `t = beta weight / (weight + beta)`, new weight `sigma gamma + t`.
    fn eliminate(weight: Self, beta: V, gamma: V, sigma: Self, one: V, zero: V) -> Eliminated<V, Self>;
    /// This unknown's value from its own `x` and the value gathered before.
    fn forth(step: &Eliminated<V, Self>, before: Self, x: Self) -> Self;
    /// The final value from the gathered one and the final one after it.
    fn back(back: Self, gathered: Self, after: Self, zero: V) -> Self;
}

/// A real number in each lane.
#[derive(Clone, Copy)]
pub(super) struct Real<V>(pub V);

/// A complex number in each lane.
#[derive(Clone, Copy)]
pub(super) struct Complex<V> {
    re: V,
    im: V,
}

impl<V: Lanes> Number<V> for Real<V> {
    const PARTS: usize = 1;
    #[inline(always)]
    unsafe fn splat(value: [f32; 2]) -> Self {
        // SAFETY: the caller's promise.
        Self(unsafe { V::splat(value[0]) })
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's promise.
        Self(unsafe { V::load(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller's promise.
        unsafe { self.0.store(to) };
    }
    #[inline(always)]
    fn from_parts(re: V, _: V) -> Self {
        Self(re)
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0.add(other.0))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0.sub(other.0))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0.mul(other.0))
    }
    #[inline(always)]
    fn scale(self, by: V) -> Self {
        Self(self.0.mul(by))
    }
    #[inline(always)]
    fn recip(self, one: V) -> Self {
        Self(one.div(self.0))
    }
    #[inline(always)]
    fn re(self) -> V {
        self.0
    }
    #[inline(always)]
    fn im(self, zero: V) -> V {
        zero
    }
    #[inline(always)]
    fn size(self) -> V {
        self.0.abs()
    }
    #[inline(always)]
    fn project(self, _: V) -> V {
        self.0
    }
    #[inline(always)]
    fn flush(self, tiny: V, zero: V) -> Self {
        Self(V::select(self.0.abs().lt(tiny), zero, self.0))
    }
    #[inline(always)]
    fn eliminate(weight: Self, beta: V, gamma: V, _: Self, one: V, zero: V) -> Eliminated<V, Self> {
        let e = weight.0;
        // Two-sided, too: the smaller of the two conductors, less the little that the larger one holds back. The sum of
        // both would round away what a long series of large ones amounts to.
        let follows = beta.lt(e);
        let smaller = V::select(follows, beta, e);
        let part = smaller.mul(one.div(e.add(beta)));
        let back = V::select(follows, part, part.neg(zero));
        let t = smaller.neg_mul_add(part, smaller);
        let weight = gamma.add(t);
        let from_own = t.lt(gamma);
        let forth = V::select(from_own, t, gamma.neg(zero)).mul(one.div(weight));
        Eliminated { back: Self(back), weight: Self(weight), forth: Self(forth), from_own }
    }
    #[inline(always)]
    fn forth(step: &Eliminated<V, Self>, before: Self, x: Self) -> Self {
        let from = V::select(step.from_own, x.0, before.0);
        Self(step.forth.0.mul_add(before.0.sub(x.0), from))
    }
    #[inline(always)]
    fn back(back: Self, gathered: Self, after: Self, zero: V) -> Self {
        let from = V::select(back.0.lt(zero), after.0, gathered.0);
        Self(back.0.mul_add(after.0.sub(gathered.0), from))
    }
}

impl<V: Lanes> Complex<V> {
    #[inline(always)]
    fn norm(self) -> V {
        self.re.mul_add(self.re, self.im.mul(self.im))
    }
}

impl<V: Lanes> Number<V> for Complex<V> {
    const PARTS: usize = 2;
    #[inline(always)]
    unsafe fn splat(value: [f32; 2]) -> Self {
        // SAFETY: the caller's promise.
        unsafe { Self { re: V::splat(value[0]), im: V::splat(value[1]) } }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller's promise.
        unsafe { Self { re: V::load(from), im: V::load(from.add(super::lanes::LANES)) } }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller's promise.
        unsafe {
            self.re.store(to);
            self.im.store(to.add(super::lanes::LANES));
        }
    }
    #[inline(always)]
    fn from_parts(re: V, im: V) -> Self {
        Self { re, im }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { re: self.re.add(other.re), im: self.im.add(other.im) }
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { re: self.re.sub(other.re), im: self.im.sub(other.im) }
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            re: self.im.neg_mul_add(other.im, self.re.mul(other.re)),
            im: self.re.mul_add(other.im, self.im.mul(other.re)),
        }
    }
    #[inline(always)]
    fn scale(self, by: V) -> Self {
        Self { re: self.re.mul(by), im: self.im.mul(by) }
    }
    #[inline(always)]
    fn recip(self, one: V) -> Self {
        let r = one.div(self.norm());
        Self { re: self.re.mul(r), im: self.im.mul(r).neg(one.sub(one)) }
    }
    #[inline(always)]
    fn re(self) -> V {
        self.re
    }
    #[inline(always)]
    fn im(self, _: V) -> V {
        self.im
    }
    #[inline(always)]
    fn size(self) -> V {
        self.re.abs().max(self.im.abs())
    }
    #[inline(always)]
    fn project(self, h: V) -> V {
        h.neg_mul_add(self.im, self.re)
    }
    #[inline(always)]
    fn flush(self, tiny: V, zero: V) -> Self {
        Self {
            re: V::select(self.re.abs().lt(tiny), zero, self.re),
            im: V::select(self.im.abs().lt(tiny), zero, self.im),
        }
    }
    #[inline(always)]
    fn eliminate(e: Self, beta: V, gamma: V, sigma: Self, one: V, zero: V) -> Eliminated<V, Self> {
        let square = e.norm();
        let pivot = Self { re: e.re.add(beta), im: e.im };
        let r = one.div(pivot.norm());
        // Numerators of e / (e + beta) and beta / (e + beta) over |e + beta|^2; real parts are positive, so no sum cancels.
        let follows = beta.mul(beta).lt(square);
        let beta_r = beta.mul(r);
        let part = Self {
            re: V::select(follows, pivot.re.mul(beta_r), square.mul(r).add(beta_r.mul(e.re))),
            im: beta_r.mul(V::select(follows, e.im.neg(zero), e.im)),
        };
        let back = Self {
            re: V::select(follows, part.re, part.re.neg(zero)),
            im: V::select(follows, part.im, part.im.neg(zero)),
        };
        let smaller = Self { re: V::select(follows, beta, e.re), im: V::select(follows, zero, e.im) };
        let t = Self {
            re: smaller.im.mul_add(part.im, smaller.re.neg_mul_add(part.re, smaller.re)),
            im: smaller.re.neg_mul_add(part.im, smaller.im.neg_mul_add(part.re, smaller.im)),
        };
        let own = sigma.scale(gamma);
        let weight = own.add(t);
        let from_own = t.norm().lt(gamma.mul(gamma));
        let own_neg = own.neg(zero);
        let num =
            Self { re: V::select(from_own, t.re, own_neg.re), im: V::select(from_own, t.im, own_neg.im) };
        let r = one.div(weight.norm());
        let forth = Self {
            re: num.re.mul_add(weight.re, num.im.mul(weight.im)).mul(r),
            im: num.re.neg_mul_add(weight.im, num.im.mul(weight.re)).mul(r),
        };
        Eliminated { back, weight, forth, from_own }
    }
    #[inline(always)]
    fn forth(step: &Eliminated<V, Self>, before: Self, x: Self) -> Self {
        let d = before.sub(x);
        let from_re = V::select(step.from_own, x.re, before.re);
        let from_im = V::select(step.from_own, x.im, before.im);
        let f = step.forth;
        Self {
            re: f.im.neg_mul_add(d.im, f.re.mul_add(d.re, from_re)),
            im: f.im.mul_add(d.re, f.re.mul_add(d.im, from_im)),
        }
    }
    #[inline(always)]
    fn back(b: Self, gathered: Self, after: Self, zero: V) -> Self {
        let d = after.sub(gathered);
        let stays = b.re.lt(zero);
        let from_re = V::select(stays, after.re, gathered.re);
        let from_im = V::select(stays, after.im, gathered.im);
        Self {
            re: b.im.neg_mul_add(d.im, b.re.mul_add(d.re, from_re)),
            im: b.im.mul_add(d.re, b.re.mul_add(d.im, from_im)),
        }
    }
}

impl<V: Lanes> Complex<V> {
    #[inline(always)]
    fn neg(self, zero: V) -> Self {
        Self { re: self.re.neg(zero), im: self.im.neg(zero) }
    }
}
