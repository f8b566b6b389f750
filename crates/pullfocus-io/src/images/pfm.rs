//! Portable float maps: three lines of text, then floats, the lowest row first.
//!
//! `PF` (RGB) or `Pf` (grey), width and height, and a number whose sign gives the byte order (negative:
//! little-endian). The number's size is a note about units on which readers disagree (Middlebury's stereo set
//! writes 1/255 there for disparities in whole pixels): samples are never multiplied by it.

use super::Source;
use super::samples::{Alpha, Data, Samples};
use crate::error::{FileError, FileResult};
use pullfocus_core::Plane;
use std::io::{self, Read, Write};

/// The text at the start is never longer than this.
const LONGEST_HEADER: usize = 256;

pub(super) fn read(source: &Source<'_>, mut reader: impl Read) -> FileResult<Samples> {
    let mut used = 0;
    let mut word = |what: &str| -> FileResult<String> {
        let mut word = String::new();
        loop {
            let mut byte = [0];
            match reader.read_exact(&mut byte) {
                Ok(()) => {}
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                    return Err(source.damaged(format!("it ends before its {what}")));
                }
                Err(error) => return Err(FileError::io(source.path, "read", error)),
            }
            used += 1;
            if used > LONGEST_HEADER {
                return Err(source.damaged(format!("its first {LONGEST_HEADER} bytes hold no {what}")));
            }
            match byte[0] {
                // Exactly one white space ends a word: after the scale, samples begin.
                b if b.is_ascii_whitespace() && !word.is_empty() => return Ok(word),
                b if b.is_ascii_whitespace() => {}
                b if b.is_ascii_graphic() => word.push(char::from(b)),
                _ => return Err(source.damaged(format!("its {what} is no text"))),
            }
        }
    };
    let grey = match word("magic number")?.as_str() {
        "PF" => false,
        "Pf" => true,
        other => return Err(source.damaged(format!("it starts with {other:?} and not with PF or Pf"))),
    };
    let mut length = |what: &str| -> FileResult<u64> {
        let text = word(what)?;
        text.parse::<u32>().map(u64::from).map_err(|_| source.damaged(format!("its {what} is {text:?}")))
    };
    let (width, height) = (length("width")?, length("height")?);
    let text = word("scale")?;
    let scale = match text.parse::<f32>() {
        Ok(scale) if scale.is_finite() && scale != 0.0 => scale,
        _ => {
            return Err(
                source.damaged(format!("its scale is {text:?}, but it must be a number other than 0"))
            );
        }
    };
    let mut notes = Vec::new();
    if scale.abs() != 1.0 {
        notes.push(format!("its scale of {} is not applied to its numbers", scale.abs()));
    }

    let channels = if grey { 1 } else { 3 };
    let size = source.check_size(width, height, channels, 4 * channels)?;
    let row_len = size.width * channels as usize;
    let needed = row_len as u64 * 4 * height;
    let held = source.length.saturating_sub(used as u64);
    if held < needed {
        return Err(source.damaged(format!("its samples take {needed} bytes, but only {held} are there")));
    }
    let mut data: Vec<f32> = source.zeros(size, row_len * size.height)?;
    let mut bytes = vec![0u8; row_len * 4];
    for row in data.chunks_exact_mut(row_len).rev() {
        reader.read_exact(&mut bytes).map_err(|error| FileError::io(source.path, "read", error))?;
        for (value, bytes) in row.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *value = if scale < 0.0 { f32::from_le_bytes(*bytes) } else { f32::from_be_bytes(*bytes) };
        }
    }
    Ok(Samples {
        size,
        channels: channels as usize,
        planar: false,
        grey,
        alpha: Alpha::None,
        data: Data::F32(data),
        orientation: 1,
        profile: None,
        notes,
    })
}

/// Writes one plane as `Pf` or three as `PF`, little-endian, scale 1.
pub(super) fn write(out: &mut impl Write, planes: &[&Plane]) -> io::Result<()> {
    let Some(first) = planes.first() else { return Ok(()) };
    let size = first.size();
    let magic = if planes.len() == 1 { "Pf" } else { "PF" };
    write!(out, "{magic}\n{} {}\n-1.0\n", size.width, size.height)?;
    let mut bytes = Vec::with_capacity(size.width * planes.len() * 4);
    for y in (0..size.height).rev() {
        bytes.clear();
        for x in 0..size.width {
            for plane in planes {
                bytes.extend(plane.at(x, y).to_le_bytes());
            }
        }
        out.write_all(&bytes)?;
    }
    Ok(())
}
