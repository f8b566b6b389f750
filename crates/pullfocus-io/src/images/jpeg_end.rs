//! Whether a JPEG has its end: decoders fill with grey what was cut off, and say nothing.

use super::Source;
use crate::error::{FileError, FileResult};
use std::io::{BufRead, ErrorKind, Read, Result, Seek};

/// Refuses a JPEG without an end-of-image marker; gives the reader back at its start.
///
/// Segments are stepped over whole, so that the marker of a small picture within them does not count; what
/// follows the marker is not looked at.
pub(super) fn check<R: BufRead + Seek>(source: &Source<'_>, mut reader: R) -> FileResult<R> {
    match find_end(&mut reader) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
            return Err(source.damaged("it ends too early"));
        }
        Err(error) => return Err(FileError::io(source.path, "read", error)),
    }
    reader.rewind().map_err(|error| FileError::io(source.path, "read", error))?;
    Ok(reader)
}

/// ITU-T T.81, B.1.1: markers are 0xFF and a byte that is neither 0xFF (filling) nor 0 (data that is 0xFF).
fn find_end<R: BufRead + Seek>(reader: &mut R) -> Result<()> {
    loop {
        reader.skip_until(0xff)?;
        let mut marker = 0xff;
        while marker == 0xff {
            marker = byte(reader)?;
        }
        match marker {
            // End of image.
            0xd9 => return Ok(()),
            // Data, and markers without a segment: temporary, restart, start of image.
            0x00 | 0x01 | 0xd0..=0xd8 => {}
            _ => {
                let length = u16::from_be_bytes([byte(reader)?, byte(reader)?]);
                // The length counts its own two bytes.
                reader.seek_relative(i64::from(length.saturating_sub(2)))?;
            }
        }
    }
}

fn byte(reader: &mut impl Read) -> Result<u8> {
    let mut byte = [0];
    reader.read_exact(&mut byte)?;
    Ok(byte[0])
}
