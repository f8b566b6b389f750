//! PNG, JPEG and HDR, through the crate `image`.

use super::samples::{Alpha, Data, Samples};
use super::{Format, Source};
use crate::error::{FileError, FileResult, RAISE_THE_LIMIT};
use image::{ColorType, ImageDecoder, ImageError, ImageFormat, ImageReader};
use std::io::{BufRead, ErrorKind, Seek};

pub(super) fn read<R: BufRead + Seek>(source: &Source<'_>, reader: R) -> FileResult<Samples> {
    let format = match source.format {
        Format::Png => ImageFormat::Png,
        Format::Jpeg => ImageFormat::Jpeg,
        _ => ImageFormat::Hdr,
    };
    let mut reader = ImageReader::with_format(reader, format);
    let mut limits = image::Limits::no_limits();
    // Sizes are checked below, with better words; this is for what decoders take beside the pixels.
    limits.max_alloc = Some(source.limits.max_plane_bytes);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(|error| failed(source, error))?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let channels = u64::from(color.channel_count());
    let size =
        source.check_size(width.into(), height.into(), channels, u64::from(color.bytes_per_pixel()))?;
    // A tag that cannot be read turns nothing.
    let orientation = decoder.orientation().map_or(1, |orientation| orientation.to_exif());
    let profile = decoder.icc_profile().ok().flatten();

    let bytes = usize::try_from(decoder.total_bytes()).unwrap_or(usize::MAX);
    let sample = usize::from(color.bytes_per_pixel() / color.channel_count());
    if bytes != size.area().saturating_mul(usize::from(color.bytes_per_pixel())) {
        return Err(source.damaged("its size contradicts itself"));
    }
    let mut decoded: Vec<u8> = source.zeros(size, bytes)?;
    decoder.read_image(&mut decoded).map_err(|error| failed(source, error))?;
    let data = match sample {
        1 => Data::U8(decoded),
        2 => Data::U16(decoded.as_chunks::<2>().0.iter().map(|&b| u16::from_ne_bytes(b)).collect()),
        _ => Data::F32(decoded.as_chunks::<4>().0.iter().map(|&b| f32::from_ne_bytes(b)).collect()),
    };
    let grey = matches!(color, ColorType::L8 | ColorType::L16 | ColorType::La8 | ColorType::La16);
    let alpha = if color.has_alpha() { Alpha::Straight } else { Alpha::None };
    let channels = channels as usize;
    let notes = Vec::new();
    Ok(Samples { size, channels, planar: false, grey, alpha, data, orientation, profile, notes })
}

/// The reason in one line: some decoders write several.
pub(super) fn one_line(reason: impl ToString) -> String {
    reason.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

fn failed(source: &Source<'_>, error: ImageError) -> FileError {
    match error {
        ImageError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            source.damaged("it ends too early")
        }
        ImageError::IoError(error)
            if matches!(
                error.kind(),
                ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::Other
            ) =>
        {
            source.damaged(one_line(error))
        }
        ImageError::IoError(error) => FileError::io(source.path, "read", error),
        ImageError::Unsupported(error) => FileError::unsupported(
            source.path,
            one_line(error),
            "save it in a more usual form, 8 or 16 bit grey or RGB",
        ),
        ImageError::Limits(error) => FileError::unsupported(
            source.path,
            format!("decoding it takes more memory than allowed ({})", one_line(error)),
            RAISE_THE_LIMIT,
        ),
        other => source.damaged(one_line(other)),
    }
}
