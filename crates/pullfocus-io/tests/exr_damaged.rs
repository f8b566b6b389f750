//! Damaged and hostile files: an error or a picture, never a panic, a hang or memory without limit.

mod common;
#[path = "common/raw.rs"]
mod raw;

use common::*;
use exr::prelude::{Blocks, Compression, Vec2};
use pullfocus_io::{Document, FileError, Limits, Selection};
use std::io::Cursor;

/// Small enough that a file of a few hundred bytes cannot make the tests slow.
const LIMITS: Limits = Limits {
    max_pixels: 1 << 16,
    max_plane_bytes: 1 << 22,
    max_header_bytes: 1 << 16,
    max_channels: 64,
    max_parts: 8,
    max_chunks: 1 << 12,
    max_chunk_bytes: 1 << 20,
};

/// Everything that the program does with a file. Errors are fine; they must name the file in one line.
fn use_all(bytes: &[u8]) -> Result<(), String> {
    let run = || -> Result<(), FileError> {
        let document = Document::from_bytes("odd.exr", bytes.to_vec(), &LIMITS)?;
        document.contents();
        document.inspect()?;
        let selected = document.select(&Selection::default())?;
        let mut out = Cursor::new(Vec::new());
        document.write_to(&mut out, &selected.channels, &selected.picture)?;
        // What was accepted comes out in a form that is accepted again.
        Document::from_bytes("again.exr", out.into_inner(), &LIMITS)?.select(&Selection::default())?;
        Ok(())
    };
    run().map_err(|error| {
        let text = error.to_string();
        assert!(!text.contains('\n') && !text.contains("again.exr"), "{text}");
        assert!(text.contains("odd.exr") || text.contains("the output") || text.contains("memory"), "{text}");
        text
    })
}

fn samples() -> Vec<(String, Vec<u8>)> {
    let n = 23 * 17;
    let mut files = Vec::new();
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))] {
            let mut channels: Vec<Channel> = ["R", "G", "B", "A"].map(|name| half(name, n, 1)).into();
            channels.push(odd_float("Z", n));
            let parts = vec![part((23, 17), (2, 3), encoding(compression, blocks), channels)];
            files.push((format!("{compression} {blocks:?}"), file((30, 30), parts)));
        }
    }
    let (mut deep, chunk) = raw::deep_part();
    deep.push(raw::text("name", "deep"));
    let mut flat = raw::required("scanlineimage", [0, 0, 1, 0], &["B", "G", "R"].map(|c| (c, 1, [1, 1])));
    flat.push(raw::text("name", "flat"));
    let parts = raw::assemble(0x1802, &[deep, flat], &[(0, chunk), (1, raw::scan_line(0, &[1; 12]))]);
    files.push(("deep and flat".to_owned(), parts));
    files
}

#[test]
fn whole_files_are_read() {
    for (name, bytes) in samples() {
        assert_eq!(use_all(&bytes), Ok(()), "{name}");
    }
}

#[test]
fn files_cut_short_anywhere_are_refused() {
    for (name, bytes) in samples() {
        // Every length within the header and its table, then in steps.
        for length in (0..bytes.len()).filter(|n| *n < 700 || n % 37 == 0) {
            assert!(use_all(&bytes[..length]).is_err(), "{name} cut to {length}");
        }
    }
}

/// A small generator, so that the same damage is done in every run.
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) as usize
}

#[test]
fn flipped_bits_and_overwritten_numbers_do_no_harm() {
    let extremes = [0u32, 1, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x4000_0000, 255, 0x0001_0000];
    let mut state = 1;
    let mut refused = 0;
    for (_, bytes) in samples() {
        for round in 0..300 {
            let mut bytes = bytes.clone();
            for _ in 0..=round % 3 {
                // Half of the damage goes into the header.
                let range = if round % 2 == 0 { bytes.len().min(700) } else { bytes.len() };
                let at = random(&mut state) % (range - 4);
                if random(&mut state) & 1 == 0 {
                    bytes[at] ^= 1 << (random(&mut state) % 8);
                } else {
                    let value = extremes[random(&mut state) % extremes.len()];
                    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
                }
            }
            refused += usize::from(use_all(&bytes).is_err());
        }
    }
    assert!(refused > 1000, "the damage is real: {refused} files were refused");
}

#[test]
fn absurd_sizes_are_refused_from_the_header() {
    let huge = |window: [i32; 4]| {
        raw::assemble(2, &[raw::required("scanlineimage", window, &[("R", 1, [1, 1])])], &[])
    };
    for window in [
        [0, 0, i32::MAX - 1, i32::MAX - 1],
        [i32::MIN, i32::MIN, i32::MAX, i32::MAX],
        [0, 0, 1 << 29, 1 << 29],
        [0, 0, 70_000, 0],
        [5, 5, 4, 4],
        [i32::MAX - 3, 0, i32::MAX - 1, 0],
    ] {
        let text = use_all(&huge(window)).unwrap_err();
        assert!(text.contains("limit") || text.contains("damaged"), "{text}");
    }
    let names: Vec<String> = (0..1000).map(|n| format!("c{n:04}")).collect();
    let channels: Vec<(&str, u32, [i32; 2])> = names.iter().map(|name| (name.as_str(), 1, [1, 1])).collect();
    let many = raw::assemble(2, &[raw::required("scanlineimage", [0, 0, 0, 0], &channels)], &[]);
    assert!(use_all(&many).unwrap_err().contains("channels is 1000"));

    let mut tiny_tiles = raw::required("tiledimage", [0, 0, 255, 255], &[("R", 1, [1, 1])]);
    for level_mode in [0u8, 1, 2] {
        let mut tiles = raw::ints(&[1, 1]);
        tiles.push(level_mode);
        tiny_tiles.retain(|attribute| attribute.0 != "tiles");
        tiny_tiles.push(("tiles".to_owned(), "tiledesc".to_owned(), tiles));
        let text = use_all(&raw::assemble(0x202, std::slice::from_ref(&tiny_tiles), &[])).unwrap_err();
        assert!(text.contains("blocks"), "{text}");
    }

    let part = raw::required("scanlineimage", [0, 0, 0, 0], &[("R", 1, [1, 1])]);
    let parts: Vec<raw::Attributes> = (0..100).map(|_| part.clone()).collect();
    assert!(use_all(&raw::assemble(0x1002, &parts, &[])).unwrap_err().contains("parts"));

    // A header that claims to go on for ever.
    let mut endless = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    endless.extend(b"a\0string\0");
    endless.extend((i32::MAX).to_le_bytes());
    endless.resize(1 << 18, b'x');
    assert!(use_all(&endless).unwrap_err().contains("header"));
}

#[test]
fn other_files_are_told_apart() {
    for bytes in [&b""[..], b"\x89PNG\r\n\x1a\n0000", b"P6 1 1 255 abc"] {
        assert!(use_all(bytes).unwrap_err().contains("not an OpenEXR file"));
    }
    let error = Document::open(std::path::Path::new("no/such/file.exr"), &LIMITS).unwrap_err();
    assert!(error.to_string().starts_with("no/such/file.exr: cannot open"), "{error}");
    let error = Document::open(std::env::temp_dir(), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("not a file") || error.to_string().contains("cannot open"), "{error}");
}

#[test]
fn unfinished_renders_are_told_apart() {
    let bytes = samples().swap_remove(0).1;
    // Renderers write the table last: a file of which half is there has zeros in it.
    let whole = document(&bytes).contents();
    assert_eq!(whole.parts[0].kind, "scan lines");
    let table = bytes.len() - 17 * (8 + 23 * 12) - 17 * 8;
    let mut unfinished = bytes.clone();
    unfinished[table + 8 * 9..table + 8 * 17].fill(0);
    let text = use_all(&unfinished).unwrap_err();
    assert!(text.contains("8 of 17 blocks") && text.contains("still being rendered"), "{text}");
}

#[test]
fn a_dwa_block_cannot_ask_for_more_than_its_pixels() {
    let (_, bytes) =
        samples().into_iter().find(|(name, _)| name.contains("dwaa") && name.contains("Scan")).unwrap();
    // The first block follows the table of one entry: row, size, then eleven numbers of 8 bytes.
    let document = document(&bytes);
    assert_eq!(document.contents().parts[0].compression, "DWAA");
    let sizes = (0..bytes.len() - 96).find(|&at| {
        let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        number(at) == 2 && (1..10).all(|n| number(at + 8 * n) < 100_000)
    });
    let sizes = sizes.unwrap();
    for n in 1..10 {
        let mut bytes = bytes.clone();
        bytes[sizes + 8 * n..][..8].copy_from_slice(&(1u64 << 40).to_le_bytes());
        assert!(use_all(&bytes).unwrap_err().contains("DWA"), "number {n}");
    }
}
