//! AVX2 and AVX-512 forms of [`Lanes`].
//!
//! Every method is inlined into [`with_avx2`] or [`with_avx512`], where the instructions are switched on.

use super::{Array, Kernel, LANES, Lanes};
use std::arch::x86_64::*;

/// # Safety
/// The processor must have AVX-512 F, AVX2 and FMA.
#[target_feature(enable = "avx512f,avx2,fma")]
pub(super) unsafe fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: the caller promises the instructions.
    unsafe { kernel.run::<One512>() }
}

/// # Safety
/// The processor must have AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
    // SAFETY: the caller promises the instructions.
    unsafe { kernel.run::<Two256>() }
}

/// One 512-bit register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct One512(__m512);

/// Two 256-bit registers.
#[derive(Clone, Copy)]
pub(super) struct Two256(__m256, __m256);

/// Wraps intrinsics that touch registers only.
macro_rules! registers {
    ($e:expr) => {
        // SAFETY: works on registers only, and a value of the type proves that the processor has them.
        unsafe { $e }
    };
}

impl Lanes for One512 {
    type Mask = __mmask16;
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the caller promises AVX-512.
        Self(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller promises AVX-512 and 16 values.
        Self(unsafe { _mm512_loadu_ps(from) })
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller promises room for 16 values.
        unsafe { _mm512_storeu_ps(to, self.0) };
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(registers!(_mm512_add_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(registers!(_mm512_sub_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(registers!(_mm512_mul_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(registers!(_mm512_div_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn mul_add(self, by: Self, to: Self) -> Self {
        Self(registers!(_mm512_fmadd_ps(self.0, by.0, to.0)))
    }
    #[inline(always)]
    fn neg_mul_add(self, by: Self, from: Self) -> Self {
        Self(registers!(_mm512_fnmadd_ps(self.0, by.0, from.0)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(registers!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(registers!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(registers!(_mm512_abs_ps(self.0)))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        registers!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(registers!(_mm512_mask_blend_ps(mask, no.0, yes.0)))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        mask != 0
    }
    #[inline(always)]
    fn transpose(block: &mut [Self; LANES]) {
        // SAFETY: `One512` is a `__m512` and nothing else.
        let r: [__m512; LANES] = unsafe { std::mem::transmute(*block) };
        // Pairs, then fours within each 128-bit quarter, then the quarters.
        let mut t = r;
        for i in 0..8 {
            t[2 * i] = registers!(_mm512_unpacklo_ps(r[2 * i], r[2 * i + 1]));
            t[2 * i + 1] = registers!(_mm512_unpackhi_ps(r[2 * i], r[2 * i + 1]));
        }
        let mut f = t;
        for i in 0..4 {
            let (a, b, c, d) = (t[4 * i], t[4 * i + 1], t[4 * i + 2], t[4 * i + 3]);
            f[4 * i] = registers!(_mm512_shuffle_ps::<0x44>(a, c));
            f[4 * i + 1] = registers!(_mm512_shuffle_ps::<0xEE>(a, c));
            f[4 * i + 2] = registers!(_mm512_shuffle_ps::<0x44>(b, d));
            f[4 * i + 3] = registers!(_mm512_shuffle_ps::<0xEE>(b, d));
        }
        for i in 0..4 {
            let (a, b, c, d) = (f[i], f[4 + i], f[8 + i], f[12 + i]);
            let ab_even = registers!(_mm512_shuffle_f32x4::<0x88>(a, b));
            let ab_odd = registers!(_mm512_shuffle_f32x4::<0xDD>(a, b));
            let cd_even = registers!(_mm512_shuffle_f32x4::<0x88>(c, d));
            let cd_odd = registers!(_mm512_shuffle_f32x4::<0xDD>(c, d));
            block[i] = Self(registers!(_mm512_shuffle_f32x4::<0x88>(ab_even, cd_even)));
            block[4 + i] = Self(registers!(_mm512_shuffle_f32x4::<0x88>(ab_odd, cd_odd)));
            block[8 + i] = Self(registers!(_mm512_shuffle_f32x4::<0xDD>(ab_even, cd_even)));
            block[12 + i] = Self(registers!(_mm512_shuffle_f32x4::<0xDD>(ab_odd, cd_odd)));
        }
    }
    #[inline(always)]
    fn prefetch(at: *const f32) {
        Array::prefetch(at);
    }
}

impl Lanes for Two256 {
    type Mask = (__m256, __m256);
    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        // SAFETY: the caller promises AVX2.
        unsafe { Self(_mm256_set1_ps(value), _mm256_set1_ps(value)) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        // SAFETY: the caller promises AVX2 and 16 values.
        unsafe { Self(_mm256_loadu_ps(from), _mm256_loadu_ps(from.add(8))) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        // SAFETY: the caller promises room for 16 values.
        unsafe {
            _mm256_storeu_ps(to, self.0);
            _mm256_storeu_ps(to.add(8), self.1);
        }
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        registers!(Self(_mm256_add_ps(self.0, other.0), _mm256_add_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        registers!(Self(_mm256_sub_ps(self.0, other.0), _mm256_sub_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        registers!(Self(_mm256_mul_ps(self.0, other.0), _mm256_mul_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        registers!(Self(_mm256_div_ps(self.0, other.0), _mm256_div_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn mul_add(self, by: Self, to: Self) -> Self {
        registers!(Self(_mm256_fmadd_ps(self.0, by.0, to.0), _mm256_fmadd_ps(self.1, by.1, to.1)))
    }
    #[inline(always)]
    fn neg_mul_add(self, by: Self, from: Self) -> Self {
        registers!(Self(_mm256_fnmadd_ps(self.0, by.0, from.0), _mm256_fnmadd_ps(self.1, by.1, from.1)))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        registers!(Self(_mm256_min_ps(self.0, other.0), _mm256_min_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        registers!(Self(_mm256_max_ps(self.0, other.0), _mm256_max_ps(self.1, other.1)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        registers!({
            let sign = _mm256_set1_ps(-0.0);
            Self(_mm256_andnot_ps(sign, self.0), _mm256_andnot_ps(sign, self.1))
        })
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        registers!((
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0),
            _mm256_cmp_ps::<_CMP_LT_OQ>(self.1, other.1)
        ))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        registers!(Self(_mm256_blendv_ps(no.0, yes.0, mask.0), _mm256_blendv_ps(no.1, yes.1, mask.1)))
    }
    #[inline(always)]
    fn any(mask: Self::Mask) -> bool {
        registers!(_mm256_movemask_ps(mask.0) | _mm256_movemask_ps(mask.1)) != 0
    }
    #[inline(always)]
    fn transpose(block: &mut [Self; LANES]) {
        // The block's quarters: each is transposed, and the two off the diagonal change places.
        let zero = registers!(_mm256_setzero_ps());
        let (mut a, mut b, mut c, mut d) = ([zero; 8], [zero; 8], [zero; 8], [zero; 8]);
        for i in 0..8 {
            (a[i], b[i]) = (block[i].0, block[i].1);
            (c[i], d[i]) = (block[8 + i].0, block[8 + i].1);
        }
        let (a, b, c, d) = (transpose_8(a), transpose_8(b), transpose_8(c), transpose_8(d));
        for i in 0..8 {
            block[i] = Self(a[i], c[i]);
            block[8 + i] = Self(b[i], d[i]);
        }
    }
    #[inline(always)]
    fn prefetch(at: *const f32) {
        Array::prefetch(at);
    }
}

#[inline(always)]
fn transpose_8(r: [__m256; 8]) -> [__m256; 8] {
    let mut t = r;
    for i in 0..4 {
        t[2 * i] = registers!(_mm256_unpacklo_ps(r[2 * i], r[2 * i + 1]));
        t[2 * i + 1] = registers!(_mm256_unpackhi_ps(r[2 * i], r[2 * i + 1]));
    }
    let mut f = t;
    for i in 0..2 {
        let (a, b, c, d) = (t[4 * i], t[4 * i + 1], t[4 * i + 2], t[4 * i + 3]);
        f[4 * i] = registers!(_mm256_shuffle_ps::<0x44>(a, c));
        f[4 * i + 1] = registers!(_mm256_shuffle_ps::<0xEE>(a, c));
        f[4 * i + 2] = registers!(_mm256_shuffle_ps::<0x44>(b, d));
        f[4 * i + 3] = registers!(_mm256_shuffle_ps::<0xEE>(b, d));
    }
    let mut out = f;
    for i in 0..4 {
        out[i] = registers!(_mm256_permute2f128_ps::<0x20>(f[i], f[4 + i]));
        out[4 + i] = registers!(_mm256_permute2f128_ps::<0x31>(f[i], f[4 + i]));
    }
    out
}
