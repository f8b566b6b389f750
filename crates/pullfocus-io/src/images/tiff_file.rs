//! TIFF, through the crate `tiff`: `image` reads neither grey floats, which depth comes in, nor which kind of
//! alpha there is.

use super::Source;
use super::codec::one_line;
use super::samples::{Alpha, Data, Samples};
use crate::error::{FileError, FileResult, RAISE_THE_LIMIT};
use std::io::{BufRead, ErrorKind, Seek};
use tiff::decoder::{Decoder, DecodingResult, DecodingSampleType, Limits};
use tiff::tags::{SampleFormat, Tag};
use tiff::{ColorType, TiffError};

const USUAL: &str = "save it as grey or RGB with 8 or 16 bits or as float";

pub(super) fn read<R: BufRead + Seek>(source: &Source<'_>, reader: R) -> FileResult<Samples> {
    let failed = |error| failed(source, error);
    let unsupported = |what: String| FileError::unsupported(source.path, what, USUAL);
    let mut limits = Limits::default();
    let most = usize::try_from(source.limits.max_plane_bytes).unwrap_or(usize::MAX);
    limits.decoding_buffer_size = most;
    limits.intermediate_buffer_size = most;
    // Offsets of strips and tiles: no more bytes than the file has.
    limits.ifd_value_size = usize::try_from(source.length).unwrap_or(usize::MAX).min(most);
    let mut decoder = Decoder::new(reader).map_err(failed)?.with_limits(limits);

    let (width, height) = decoder.dimensions().map_err(failed)?;
    let color = decoder.colortype().map_err(failed)?;
    let samples: u16 = decoder.find_tag_unsigned(Tag::SamplesPerPixel).map_err(failed)?.unwrap_or(1);
    let extra: Vec<u16> =
        decoder.find_tag_unsigned_vec(Tag::ExtraSamples).map_err(failed)?.unwrap_or_default();
    let grey = match color {
        ColorType::Gray(_) | ColorType::GrayA(_) | ColorType::Multiband { .. } => true,
        ColorType::RGB(_) | ColorType::RGBA(_) => false,
        other => return Err(unsupported(format!("a TIFF of {}", kind_name(other)))),
    };
    let bits = color.bit_depth();
    if !matches!(bits, 8 | 16 | 32 | 64) {
        return Err(unsupported(format!("a TIFF of {bits} bits a sample")));
    }
    let colors = if grey { 1 } else { 3 };
    let mut notes = Vec::new();
    // 1 is associated alpha and 2 straight; others, and samples beyond, are masks and spot colours.
    let alpha = match (extra.first(), usize::from(samples) > colors) {
        (_, false) => Alpha::None,
        (Some(1), _) => Alpha::Associated,
        (Some(2), _) => Alpha::Straight,
        // Old programs leave the tag out.
        (None, true) if usize::from(samples) == colors + 1 => Alpha::Straight,
        _ => {
            notes.push("its samples beside the colours are not alpha, and are left out".to_owned());
            Alpha::None
        }
    };
    let bytes = u64::from(samples) * u64::from(bits / 8);
    let size = source.check_size(width.into(), height.into(), samples.into(), bytes)?;
    let orientation: u8 = decoder
        .find_tag_unsigned(Tag::Orientation)
        .ok()
        .flatten()
        .filter(|o| (1..=8).contains(o))
        .unwrap_or(1);
    if let Ok(formats) = decoder.get_tag_u16_vec(Tag::SampleFormat) {
        let usable = [SampleFormat::Uint.to_u16(), SampleFormat::IEEEFP.to_u16()];
        if formats.iter().any(|format| !usable.contains(format)) {
            return Err(unsupported("a TIFF of signed or undefined numbers".to_owned()));
        }
    }

    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();

    let whole = || unsupported(format!("a TIFF of {bits}-bit whole numbers"));
    let layout = decoder.image_buffer_layout().map_err(failed)?;
    // The crate leaves samples out that are neither colour nor alpha.
    let pixel = size.area().saturating_mul(usize::from(bits / 8));
    let channels = layout.complete_len / pixel;
    let needed = colors + usize::from(alpha != Alpha::None);
    if channels < needed || channels * pixel != layout.complete_len {
        return Err(unsupported("a TIFF whose samples lie in an unusual order".to_owned()));
    }
    let len = size.area() * channels;
    let mut decoded = match layout.sample_type.ok_or_else(whole)? {
        DecodingSampleType::U8 => DecodingResult::U8(source.zeros(size, len)?),
        DecodingSampleType::U16 => DecodingResult::U16(source.zeros(size, len)?),
        DecodingSampleType::U32 => DecodingResult::U32(source.zeros(size, len)?),
        DecodingSampleType::F16 => DecodingResult::F16(source.zeros(size, len)?),
        DecodingSampleType::F32 => DecodingResult::F32(source.zeros(size, len)?),
        DecodingSampleType::F64 => DecodingResult::F64(source.zeros(size, len)?),
        _ => return Err(whole()),
    };
    decoder.read_image_bytes(decoded.as_buffer(0).as_bytes_mut()).map_err(failed)?;
    let data = match decoded {
        DecodingResult::U8(data) => Data::U8(data),
        DecodingResult::U16(data) => Data::U16(data),
        DecodingResult::U32(data) => Data::U32(data),
        DecodingResult::F16(data) => Data::F32(data.into_iter().map(|value| value.to_f32()).collect()),
        DecodingResult::F32(data) => Data::F32(data),
        DecodingResult::F64(data) => Data::F32(data.into_iter().map(|value| value as f32).collect()),
        _ => return Err(whole()),
    };
    let planar = layout.planes > 1;
    Ok(Samples { size, channels, planar, grey, alpha, data, orientation, profile, notes })
}

fn kind_name(color: ColorType) -> &'static str {
    match color {
        ColorType::Palette(_) => "palette colours",
        ColorType::CMYK(_) | ColorType::CMYKA(_) => "printing colours (CMYK)",
        ColorType::YCbCr(_) => "YCbCr colours",
        ColorType::Lab(_) => "L*a*b* colours",
        _ => "unusual colours",
    }
}

fn failed(source: &Source<'_>, error: TiffError) -> FileError {
    match error {
        TiffError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => {
            source.damaged("it ends too early")
        }
        TiffError::IoError(error)
            if matches!(
                error.kind(),
                ErrorKind::InvalidData | ErrorKind::InvalidInput | ErrorKind::Other
            ) =>
        {
            source.damaged(one_line(error))
        }
        TiffError::IoError(error) => FileError::io(source.path, "read", error),
        TiffError::UnsupportedError(error) => FileError::unsupported(source.path, one_line(error), USUAL),
        TiffError::LimitsExceeded => {
            FileError::unsupported(source.path, "decoding it takes more memory than allowed", RAISE_THE_LIMIT)
        }
        other => source.damaged(one_line(other)),
    }
}
