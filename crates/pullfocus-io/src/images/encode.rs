//! Writing pictures: from linear, premultiplied planes to what each format holds.

use super::{Format, Profile, pfm};
use crate::error::{FileError, FileResult};
use crate::output::{Existing, PendingFile};
use image::codecs::{hdr::HdrEncoder, jpeg::JpegEncoder, png::PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError, Rgb};
use pullfocus_core::{Picture, Plane, srgb};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::{self, Seek, Write};
use std::path::Path;
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Predictor, TiffEncoder, TiffValue, colortype};
use tiff::tags::{ExtraSamples, Tag, Type};

/// How exactly numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Bits {
    /// 8-bit whole numbers, sRGB.
    Eight,
    /// 16-bit whole numbers, sRGB.
    Sixteen,
    /// Floats, linear.
    Float,
}

/// A format and what it leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Encoding {
    format: Format,
    bits: Bits,
    /// 1 to 100; only JPEG asks.
    jpeg_quality: u8,
}

impl Encoding {
    /// The encoding that a file of this name is to have. Without `bits`, PNG and TIFF get 16 bits.
    ///
    /// # Errors
    /// [`FileError::Argument`] for an ending that is not known or is OpenEXR's, or bits that the format lacks.
    pub fn for_name(path: &Path, bits: Option<Bits>) -> FileResult<Self> {
        let refuse = |reason: &str| {
            Err(FileError::Argument { what: path.display().to_string(), reason: reason.to_owned() })
        };
        let Some(format) = Format::of_name(path) else {
            return refuse("the name's ending says no format; use exr, png, jpg, tif, hdr or pfm");
        };
        let (usual, allowed): (Bits, &[Bits]) = match format {
            Format::OpenExr => return refuse("an OpenEXR file is written as a document with channels"),
            Format::Png => (Bits::Sixteen, &[Bits::Eight, Bits::Sixteen]),
            Format::Jpeg => (Bits::Eight, &[Bits::Eight]),
            Format::Tiff => (Bits::Sixteen, &[Bits::Eight, Bits::Sixteen, Bits::Float]),
            Format::Hdr | Format::Pfm => (Bits::Float, &[Bits::Float]),
        };
        let bits = bits.unwrap_or(usual);
        if !allowed.contains(&bits) {
            return refuse(match format {
                Format::Png => "PNG holds 8 or 16 bits; for floats use exr, tif or pfm",
                Format::Jpeg => "JPEG holds 8 bits; for more use png, tif or exr",
                _ => "HDR and PFM hold floats; for 8 or 16 bits use png or tif",
            });
        }
        Ok(Self { format, bits, jpeg_quality: 92 })
    }

    /// With another quality of JPEG, 1 to 100 (92 if nothing is said).
    pub fn with_jpeg_quality(self, quality: u8) -> Self {
        Self { jpeg_quality: quality.clamp(1, 100), ..self }
    }

    /// The format.
    pub fn format(self) -> Format {
        self.format
    }

    /// How exactly numbers are stored.
    pub fn bits(self) -> Bits {
        self.bits
    }

    fn holds_alpha(self) -> bool {
        matches!(self.format, Format::Png | Format::Tiff)
    }
}

/// Writes a linear, premultiplied picture of one (grey) or three colour planes to `out`. `file` is for messages.
///
/// - Whole numbers: sRGB, clipped to 0..1, rounded, not dithered; NaN is 0. Alpha is stored straight, so
///   colour is divided by it; colour where alpha is 0 (emission) is kept, but such a file no longer says
///   that it shines. JPEG has no alpha: the picture is seen over black.
/// - Floats: linear and as they are, alpha associated (TIFF) or dropped (HDR, PFM). HDR holds no negative
///   numbers, no NaN (both become 0) and nothing above 1e37, and grey as RGB.
///
/// # Errors
/// [`FileError::Io`], and [`FileError::Unsupported`] for a picture that the format cannot hold.
pub fn write_image(
    out: impl Write + Seek,
    file: &Path,
    picture: &Picture,
    encoding: Encoding,
) -> FileResult<()> {
    picture.check()?;
    write_planes(out, file, picture, encoding, false, None)
}

/// Writes the picture under `path` by way of a temporary name ([`PendingFile`]); false if, with
/// [`Existing::Keep`], somebody else finished it meanwhile.
///
/// # Errors
/// As [`write_image`] and [`PendingFile`].
pub fn save(path: &Path, picture: &Picture, encoding: Encoding, existing: Existing) -> FileResult<bool> {
    save_with_profile(path, picture, encoding, None, existing)
}

/// As [`save`], with the colour profile of the file that the picture comes from, where it says the same of this one:
/// PNG, JPEG and TIFF of whole numbers for a profile of whole numbers, TIFF of floats for one of floats.
///
/// # Errors
/// As [`save`].
pub fn save_with_profile(
    path: &Path,
    picture: &Picture,
    encoding: Encoding,
    profile: Option<&Profile>,
    existing: Existing,
) -> FileResult<bool> {
    picture.check()?;
    let mut file = PendingFile::create(path, existing)?;
    write_planes(&mut file, path, picture, encoding, false, profile)?;
    file.commit()
}

/// As [`save`], for planes that are sRGB-encoded already: charts, maps of differences. In a format of floats
/// they become linear.
///
/// # Errors
/// As [`save`].
pub fn save_srgb(
    path: &Path,
    planes: &[Plane; 3],
    encoding: Encoding,
    existing: Existing,
) -> FileResult<bool> {
    let mut picture = Picture::opaque(planes.to_vec());
    picture.check()?;
    let floats = encoding.bits == Bits::Float;
    if floats {
        for value in picture.colors.iter_mut().flat_map(|plane| plane.data_mut()) {
            *value = srgb::decode(*value);
        }
    }
    let mut file = PendingFile::create(path, existing)?;
    write_planes(&mut file, path, &picture, encoding, !floats, None)?;
    file.commit()
}

/// As [`save`], a PNG of 8 or 16 bits whatever `path`'s ending.
///
/// # Errors
/// As [`save`]; [`FileError::Argument`] for floats.
pub fn write_png(path: &Path, picture: &Picture, bits: Bits, existing: Existing) -> FileResult<bool> {
    let encoding = Encoding::for_name(Path::new("a.png"), Some(bits))?;
    save(path, picture, encoding, existing)
}

fn write_planes(
    mut out: impl Write + Seek,
    file: &Path,
    picture: &Picture,
    encoding: Encoding,
    encoded: bool,
    profile: Option<&Profile>,
) -> FileResult<()> {
    let size = picture.size();
    let profile = profile.filter(|profile| profile.fits(encoding, picture.colors.len())).map(Profile::bytes);
    let too_large = || {
        FileError::unsupported(
            file,
            format!("the format cannot hold {size} pixels"),
            "write an exr, png or tif",
        )
    };
    let side = if encoding.format == Format::Jpeg { usize::from(u16::MAX) } else { i32::MAX as usize };
    if size.width > side || size.height > side || size.area() == 0 {
        return Err(too_large());
    }
    let (width, height) = (size.width as u32, size.height as u32);
    if !matches!(picture.colors.len(), 1 | 3) {
        return Err(FileError::unsupported(
            file,
            format!("a picture of {} colour planes does not fit", picture.colors.len()),
            "write an exr, or choose one or three planes",
        ));
    }
    let alpha = picture.alpha.as_ref().filter(|_| encoding.holds_alpha());
    let channels = picture.colors.len() + usize::from(alpha.is_some());
    let failed = |error: ImageError| match error {
        ImageError::IoError(error) => FileError::io(file, "write", error),
        other => FileError::io(file, "write", io::Error::other(other.to_string())),
    };
    let color = |sixteen: bool| match (channels, sixteen) {
        (1, false) => ExtendedColorType::L8,
        (2, false) => ExtendedColorType::La8,
        (3, false) => ExtendedColorType::Rgb8,
        (_, false) => ExtendedColorType::Rgba8,
        (1, true) => ExtendedColorType::L16,
        (2, true) => ExtendedColorType::La16,
        (3, true) => ExtendedColorType::Rgb16,
        (_, true) => ExtendedColorType::Rgba16,
    };
    match (encoding.format, encoding.bits) {
        (Format::Png, Bits::Sixteen) => {
            let codes = codes::<u16>(picture, alpha, encoded);
            let bytes: Vec<u8> = codes.into_iter().flat_map(u16::to_ne_bytes).collect();
            let encoder = with_profile(PngEncoder::new(&mut out), profile);
            encoder.write_image(&bytes, width, height, color(true)).map_err(failed)
        }
        (Format::Png, _) => {
            let codes = codes::<u8>(picture, alpha, encoded);
            let encoder = with_profile(PngEncoder::new(&mut out), profile);
            encoder.write_image(&codes, width, height, color(false)).map_err(failed)
        }
        (Format::Jpeg, _) => {
            let codes = codes::<u8>(picture, None, encoded);
            let encoder = JpegEncoder::new_with_quality(&mut out, encoding.jpeg_quality);
            let encoder = with_profile(encoder, profile);
            encoder.write_image(&codes, width, height, color(false)).map_err(failed)
        }
        (Format::Hdr, _) => {
            let plane = |c: usize| &picture.colors[c.min(picture.colors.len() - 1)];
            let (red, green, blue) = (plane(0).data(), plane(1).data(), plane(2).data());
            let pixels: Vec<Rgb<f32>> =
                (0..size.area()).map(|i| rounded_for_rgbe([red[i], green[i], blue[i]])).collect();
            HdrEncoder::new(&mut out).encode(&pixels, size.width, size.height).map_err(failed)
        }
        (Format::Pfm, _) => {
            let planes: Vec<&Plane> = picture.colors.iter().collect();
            pfm::write(&mut out, &planes).map_err(|error| FileError::io(file, "write", error))
        }
        (Format::Tiff, bits) => {
            // The crate has no colour type of grey with alpha: grey is repeated there.
            let repeated = Picture {
                colors: match (picture.colors.as_slice(), alpha) {
                    ([grey], Some(_)) => vec![grey.clone(), grey.clone(), grey.clone()],
                    _ => vec![],
                },
                alpha: None,
            };
            let picture = if repeated.colors.is_empty() { picture } else { &repeated };
            let tiff = Tiff { out: &mut out, width, height, float: bits == Bits::Float, profile };
            match (bits, channels) {
                (Bits::Eight, 1) => tiff.write::<colortype::Gray8>(&codes(picture, alpha, encoded)),
                (Bits::Eight, 3) => tiff.write::<colortype::RGB8>(&codes(picture, alpha, encoded)),
                (Bits::Eight, _) => tiff.write::<colortype::RGBA8>(&codes(picture, alpha, encoded)),
                (Bits::Sixteen, 1) => tiff.write::<colortype::Gray16>(&codes(picture, alpha, encoded)),
                (Bits::Sixteen, 3) => tiff.write::<colortype::RGB16>(&codes(picture, alpha, encoded)),
                (Bits::Sixteen, _) => tiff.write::<colortype::RGBA16>(&codes(picture, alpha, encoded)),
                (Bits::Float, 1) => tiff.write::<colortype::Gray32Float>(&floats(picture, alpha)),
                (Bits::Float, 3) => tiff.write::<colortype::RGB32Float>(&floats(picture, alpha)),
                (Bits::Float, _) => tiff.write::<colortype::RGBA32Float>(&floats(picture, alpha)),
            }
            .map_err(|error| match error {
                tiff::TiffError::IoError(error) => FileError::io(file, "write", error),
                // Beyond 4 GiB.
                _ => too_large(),
            })
        }
        (Format::OpenExr, _) => Err(too_large()),
    }
}

/// An encoder that lays the profile into the file.
fn with_profile<E: ImageEncoder>(mut encoder: E, profile: Option<&[u8]>) -> E {
    if let Some(profile) = profile {
        // These formats have a place for it.
        let _ = encoder.set_icc_profile(profile.to_vec());
    }
    encoder
}

/// Where a TIFF goes, its size and its colour profile.
struct Tiff<'a, W> {
    out: W,
    width: u32,
    height: u32,
    /// Floats, with alpha associated; otherwise whole numbers, with alpha straight.
    float: bool,
    profile: Option<&'a [u8]>,
}

/// Bytes that mean nothing to TIFF itself, as it wants profiles.
struct Opaque<'a>(&'a [u8]);

impl TiffValue for Opaque<'_> {
    const BYTE_LEN: u8 = 1;
    const FIELD_TYPE: Type = Type::UNDEFINED;

    fn count(&self) -> usize {
        self.0.len()
    }

    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(self.0)
    }
}

impl<W: Write + Seek> Tiff<'_, W> {
    fn write<C: colortype::ColorType>(self, samples: &[C::Inner]) -> tiff::TiffResult<()>
    where
        [C::Inner]: TiffValue,
    {
        let predictor = if self.float { Predictor::None } else { Predictor::Horizontal };
        let mut encoder = TiffEncoder::new(self.out)?
            .with_compression(Compression::Deflate(DeflateLevel::Balanced))
            .with_predictor(predictor);
        let mut image = encoder.new_image::<C>(self.width, self.height)?;
        if C::BITS_PER_SAMPLE.len() == 4 {
            // Not `image.extra_samples`, which adds a fifth.
            let kind =
                if self.float { ExtraSamples::AssociatedAlpha } else { ExtraSamples::UnassociatedAlpha };
            image.encoder().write_tag(Tag::ExtraSamples, &[kind.to_u16()][..])?;
        }
        if let Some(profile) = self.profile {
            image.encoder().write_tag(Tag::IccProfile, Opaque(profile))?;
        }
        image.write_data(samples)
    }
}

/// Whole numbers that stand for 0 to 1.
trait Code: Copy + Send + Sync + Default {
    fn of(value: f32) -> Self;
}

impl Code for u8 {
    fn of(value: f32) -> Self {
        // `as` makes NaN 0 and keeps to the range.
        (value * 255.0 + 0.5) as Self
    }
}

impl Code for u16 {
    fn of(value: f32) -> Self {
        (value * 65535.0 + 0.5) as Self
    }
}

/// Interleaved codes: colour straight and sRGB-encoded (unless it is already), then alpha.
fn codes<T: Code>(picture: &Picture, alpha: Option<&Plane>, encoded: bool) -> Vec<T> {
    let channels = picture.colors.len() + usize::from(alpha.is_some());
    let size = picture.size();
    let mut codes = vec![T::default(); size.area() * channels];
    codes.par_chunks_mut((size.width * channels).max(1)).enumerate().for_each(|(y, row)| {
        for (c, plane) in picture.colors.iter().enumerate() {
            for (x, &value) in plane.row(y).iter().enumerate() {
                let value = match alpha.map(|alpha| alpha.at(x, y)) {
                    Some(alpha) if alpha > 0.0 => value / alpha,
                    _ => value,
                };
                row[x * channels + c] =
                    T::of(if encoded { value } else { srgb::encode(value.max(0.0).clamp(0.0, 1.0)) });
            }
        }
        if let Some(alpha) = alpha {
            for (x, &value) in alpha.row(y).iter().enumerate() {
                row[x * channels + channels - 1] = T::of(value);
            }
        }
    });
    codes
}

/// Interleaved floats, as they are.
fn floats(picture: &Picture, alpha: Option<&Plane>) -> Vec<f32> {
    let planes: Vec<&Plane> = picture.colors.iter().chain(alpha).collect();
    (0..picture.size().area()).flat_map(|i| planes.iter().map(move |plane| plane.data()[i])).collect()
}

/// A pixel on the grid of RGBE, eight bits under the largest channel: the encoder cuts off what lies between,
/// which darkens.
fn rounded_for_rgbe(pixel: [f32; 3]) -> Rgb<f32> {
    let pixel = pixel.map(|value| value.max(0.0).clamp(0.0, 1e37));
    let largest = pixel.into_iter().fold(0.0, f32::max);
    if largest < 1e-37 {
        return Rgb([0.0; 3]);
    }
    let step = (largest.log2().floor() + 1.0).exp2() / 256.0;
    // Rounded up to the next power of two, it needs the next exponent.
    let step = if (largest / step).round() >= 256.0 { 2.0 * step } else { step };
    Rgb(pixel.map(|value| (value / step).round() * step))
}
