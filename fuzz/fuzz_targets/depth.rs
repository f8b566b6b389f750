//! Any numbers as a depth channel and its decoding: refused settings aside, every value is a distance.
//!
//! Run with `RUSTC_BOOTSTRAP=1 cargo +stable fuzz run depth`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pullfocus_core::{DepthDecoding, DepthKind, Frame, Size};

/// The next eight bytes as a number, 0 at the end.
fn number(bytes: &mut &[u8]) -> f64 {
    let Some((first, rest)) = bytes.split_first_chunk::<8>() else { return 0.0 };
    *bytes = rest;
    f64::from_le_bytes(*first)
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&choice, mut bytes)) = bytes.split_first() else { return };
    let (a, b) = (number(&mut bytes), number(&mut bytes));
    let kind = match choice & 7 {
        0 => DepthKind::Planar,
        1 => DepthKind::Ray,
        2 => DepthKind::Inverse,
        3 => DepthKind::Disparity { scale: a, shift: b },
        _ => DepthKind::Normalized { near_m: a, far_m: b, inverted: choice & 8 != 0 },
    };
    let far_clip_m = (choice & 16 != 0).then(|| number(&mut bytes));
    let decoding = DepthDecoding { kind, unit_m: number(&mut bytes), far_clip_m };
    if decoding.check().is_err() {
        return;
    }
    let frame = Frame::full(Size::new(64, 48));
    let half_width = number(&mut bytes).abs();
    for (index, value) in bytes.chunks_exact(4).enumerate().take(64 * 48) {
        let value = f32::from_le_bytes(value.try_into().expect("four bytes"));
        let metres = decoding.metres_at(&frame, half_width, value, index % 64, index / 64);
        assert!(metres > 0.0, "{decoding:?} makes {value} into {metres}");
    }
});
