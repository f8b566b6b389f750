//! Sixteen f32 side by side, one for each of sixteen lines that are solved together.
//!
//! Three widths of machine share one shape: AVX-512 holds the sixteen in one register, AVX2 in two, and the
//! portable form is an array that the compiler lays out as it can (four SSE or NEON registers). All kernels are
//! written once, over [`Lanes`]; [`Instructions::run`] picks the machine's own copy when a pass starts.

/// Number of lines solved side by side, on every machine; strips are cut the same way everywhere.
pub(super) const LANES: usize = 16;

/// Sixteen f32. `splat` and `load` are unsafe because they need the processor to have the instructions; a value
/// is then the proof that it does, so everything that takes one is safe.
pub(super) trait Lanes: Copy {
    /// One bit a lane.
    type Mask: Copy;
    /// # Safety
    /// The processor must have the type's instructions.
    unsafe fn splat(value: f32) -> Self;
    /// # Safety
    /// As [`Lanes::splat`], and 16 f32 must be readable at `from`, at any alignment.
    unsafe fn load(from: *const f32) -> Self;
    /// # Safety
    /// 16 f32 must be writable at `to`, at any alignment.
    unsafe fn store(self, to: *mut f32);
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self * by + to`, rounded once where the machine can.
    fn mul_add(self, by: Self, to: Self) -> Self;
    /// `from - self * by`, rounded once where the machine can.
    fn neg_mul_add(self, by: Self, from: Self) -> Self;
    /// `self < other ? self : other`: `other` where one is NaN.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`: `other` where one is NaN.
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn lt(self, other: Self) -> Self::Mask;
    /// `mask ? yes : no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Whether any lane is set.
    fn any(mask: Self::Mask) -> bool;
    /// Rows become columns.
    fn transpose(block: &mut [Self; LANES]);
    /// Asks for the cache line at `at`, which may be any address.
    fn prefetch(at: *const f32);

    #[inline(always)]
    fn neg(self, zero: Self) -> Self {
        zero.sub(self)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; LANES] {
        let mut out = [0.0; LANES];
        // SAFETY: the array holds 16 values.
        unsafe { self.store(out.as_mut_ptr()) };
        out
    }
}

/// Work that runs once for a given width of machine.
pub(super) trait Kernel {
    type Output;
    /// # Safety
    /// The processor must have the instructions of `V`.
    unsafe fn run<V: Lanes>(self) -> Self::Output;
}

/// The instructions that the solvers use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// What the target has for certain.
    Portable,
    /// AVX2 with FMA.
    Avx2,
    /// AVX-512 F with FMA.
    Avx512,
}

impl Instructions {
    /// All, from the plainest to the widest.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// Whether this processor has them.
    pub fn available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => is_x86_feature_detected!("avx512f") && Self::Avx2.available(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The widest that this processor has.
    pub fn best() -> Self {
        Self::ALL.into_iter().rev().find(|i| i.available()).unwrap_or(Self::Portable)
    }

    /// Runs `kernel` with these instructions, or with the portable ones where they are missing.
    #[inline]
    pub(super) fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` asked the processor.
            Self::Avx512 if self.available() => unsafe { x86::with_avx512(kernel) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `available` asked the processor.
            Self::Avx2 if self.available() => unsafe { x86::with_avx2(kernel) },
            // SAFETY: an array needs no instructions.
            _ => unsafe { kernel.run::<Array>() },
        }
    }
}

/// The portable form.
#[derive(Clone, Copy)]
#[repr(C, align(16))]
pub(super) struct Array([f32; LANES]);

impl Array {
    #[inline(always)]
    fn map2(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for (l, o) in out.iter_mut().enumerate() {
            *o = f(self.0[l], other.0[l]);
        }
        Self(out)
    }

    #[inline(always)]
    fn map3(self, b: Self, c: Self, f: impl Fn(f32, f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for (l, o) in out.iter_mut().enumerate() {
            *o = f(self.0[l], b.0[l], c.0[l]);
        }
        Self(out)
    }
}

impl Lanes for Array {
    type Mask = [bool; LANES];
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; LANES])
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller promises 16 values.
        Self(unsafe { from.cast::<[f32; LANES]>().read() })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller promises room for 16 values.
        unsafe { to.cast::<[f32; LANES]>().write(self.0) };
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.map2(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.map2(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.map2(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.map2(other, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, by: Self, to: Self) -> Self {
        // Not f32::mul_add: without an FMA unit that is a library call.
        self.map3(by, to, |a, b, c| a * b + c)
    }
    #[inline(always)]
    fn neg_mul_add(self, by: Self, from: Self) -> Self {
        self.map3(by, from, |a, b, c| c - a * b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.map2(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.map2(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.map2(self, |a, _| a.abs())
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        let mut mask = [false; LANES];
        for (l, m) in mask.iter_mut().enumerate() {
            *m = self.0[l] < other.0[l];
        }
        mask
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let mut out = no;
        for (l, o) in out.0.iter_mut().enumerate() {
            *o = if mask[l] { yes.0[l] } else { *o };
        }
        out
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        mask.into_iter().any(|m| m)
    }
    // One copy: unrolled into every kernel it is a third of the crate's time to compile.
    #[inline(never)]
    fn transpose(block: &mut [Self; LANES]) {
        for i in 0..LANES {
            for j in 0..i {
                let a = block[i].0[j];
                block[i].0[j] = block[j].0[i];
                block[j].0[i] = a;
            }
        }
    }
    #[inline(always)]
    fn prefetch(at: *const f32) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: SSE is part of the target, and a prefetch never faults.
        unsafe {
            std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(at.cast());
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = at;
    }
}

#[cfg(target_arch = "x86_64")]
#[path = "lanes_x86.rs"]
mod x86;

#[cfg(test)]
mod tests {
    use super::*;

    struct Transpose;
    impl Kernel for Transpose {
        type Output = [[f32; LANES]; LANES];
        unsafe fn run<V: Lanes>(self) -> Self::Output {
            // SAFETY: the caller promises the instructions.
            let mut block = unsafe { [V::splat(0.0); LANES] };
            for (i, row) in block.iter_mut().enumerate() {
                let values: [f32; LANES] = std::array::from_fn(|j| (100 * i + j) as f32);
                // SAFETY: the array holds 16 values.
                *row = unsafe { V::load(values.as_ptr()) };
            }
            V::transpose(&mut block);
            block.map(Lanes::to_array)
        }
    }

    #[test]
    fn blocks_are_transposed_on_every_machine() {
        for instructions in Instructions::ALL.into_iter().filter(|i| i.available()) {
            let block = instructions.run(Transpose);
            for (i, row) in block.iter().enumerate() {
                for (j, value) in row.iter().enumerate() {
                    assert_eq!(*value, (100 * j + i) as f32, "{instructions:?} {i} {j}");
                }
            }
        }
    }
}
