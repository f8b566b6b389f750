//! Any bytes as an OpenEXR file: header, contents, pixels, and out again.
//!
//! Run with `RUSTC_BOOTSTRAP=1 cargo +stable fuzz run exr -- -max_len=65536 -rss_limit_mb=1024 -timeout=10`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pullfocus_io::{Document, FileResult, Limits, Selection};
use std::io::Cursor;

/// Small: a file of a few kilobytes has no business with more, and time goes into finding things.
const LIMITS: Limits = Limits {
    max_pixels: 1 << 14,
    max_plane_bytes: 1 << 20,
    max_header_bytes: 1 << 16,
    max_channels: 64,
    max_parts: 8,
    max_chunks: 1 << 10,
    max_chunk_bytes: 1 << 18,
};

fn run(bytes: &[u8]) -> FileResult<()> {
    let document = Document::from_bytes("fuzz.exr", bytes.to_vec(), &LIMITS)?;
    document.contents();
    let _ = document.inspect();
    let selected = document.select(&Selection::default())?;
    let mut out = Cursor::new(Vec::new());
    document.write_to(&mut out, &selected.channels, &selected.picture)?;
    // What was read and written is a picture that can be read and written.
    let again = Document::from_bytes("again.exr", out.into_inner(), &LIMITS).expect("our own output opens");
    let second = again.select(&Selection::default()).expect("our own output decodes");
    assert_eq!(selected.channels, second.channels);
    Ok(())
}

fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = run(bytes) {
        assert!(!error.to_string().contains('\n'));
    }
});
