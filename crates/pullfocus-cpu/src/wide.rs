//! Plain loops compiled a second time for AVX2, and the copy that the processor can run.
//!
//! The numbers are the same: no operation is fused or reordered, only more of them run at once.

/// A piece of work. `run` should be `#[inline(always)]`, as should what it calls in its loops: only what is
/// inlined gets the wider instructions.
pub trait Work {
    /// Does the work.
    fn run(self);
}

/// Runs `work` with the widest instructions there are.
pub fn run(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has AVX2.
        unsafe { with_avx2(work) };
        return;
    }
    work.run();
}

/// # Safety
/// The processor must have AVX2.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn with_avx2(work: impl Work) {
    work.run();
}
