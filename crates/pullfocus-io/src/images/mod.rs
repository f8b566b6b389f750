//! Pictures and depth in PNG, JPEG, TIFF, Radiance HDR and PFM.
//!
//! | format | read | written | meaning of the numbers |
//! |---|---|---|---|
//! | PNG | 1 to 16 bit, grey, RGB, palette, alpha | 8, 16 bit | sRGB, straight alpha |
//! | JPEG | grey, RGB, CMYK | 8 bit | sRGB, no alpha |
//! | TIFF | 8, 16, 32 bit; half, float, double; strips, tiles, planar | 8, 16 bit, float | integers sRGB, floats linear; alpha straight or associated, as the file says |
//! | HDR | RGBE | RGBE | linear, no alpha |
//! | PFM | `PF`, `Pf`, both byte orders | `PF`, `Pf` | linear, no alpha |
//!
//! [`read_picture`] gives colour as everything inside has it: **linear light, premultiplied**, three planes
//! (grey is repeated). [`read_depth`] gives the **raw numbers** of the first channel: integers as 0..1 (a 16-bit
//! depth in millimetres has a unit of 65.535 m), floats as they are, without any sRGB curve. The formats are told
//! apart by their first bytes, not by their names. Files by the camera's orientation tag (EXIF, TIFF) are turned
//! upright, depth too. Colour profiles are not applied: integer colour is taken for sRGB. Where a profile disagrees,
//! [`read_image`] notes it and hands the profile on, and [`save_with_profile`] lays it beside the same numbers again.
//! Of a file with several pictures, the first is read.

mod codec;
mod encode;
mod jpeg_end;
mod orient;
mod pfm;
mod profile;
mod samples;
mod tiff_file;

pub use encode::{Bits, Encoding, save, save_srgb, save_with_profile, write_image, write_png};
pub use profile::Profile;

use crate::error::{FileError, FileResult};
use crate::limits::Limits;
use pullfocus_core::{Picture, Plane, Size};
use samples::Samples;
use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

/// What a file is, by its first bytes or by its name's ending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// OpenEXR, which [`crate::Document`] reads.
    OpenExr,
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// Tagged Image File Format, BigTIFF included.
    Tiff,
    /// Radiance HDR (`.hdr`, `.pic`).
    Hdr,
    /// Portable float map.
    Pfm,
}

impl Format {
    /// The format of a file that starts with these bytes (16 are enough).
    pub fn of_bytes(start: &[u8]) -> Option<Self> {
        const STARTS: [(&[u8], Format); 11] = [
            (b"\x76\x2f\x31\x01", Format::OpenExr),
            (b"\x89PNG\r\n\x1a\n", Format::Png),
            (b"\xff\xd8\xff", Format::Jpeg),
            (b"II*\0", Format::Tiff),
            (b"MM\0*", Format::Tiff),
            (b"II+\0", Format::Tiff),
            (b"MM\0+", Format::Tiff),
            (b"#?RADIANCE", Format::Hdr),
            (b"#?RGBE", Format::Hdr),
            (b"PF", Format::Pfm),
            (b"Pf", Format::Pfm),
        ];
        STARTS.iter().find(|(bytes, _)| start.starts_with(bytes)).map(|&(_, format)| format)
    }

    /// The format that a file of this name is to have: `exr`, `png`, `jpg`, `jpeg`, `tif`, `tiff`, `hdr`, `pic`,
    /// `pfm`, in capitals or not.
    pub fn of_name(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match ending.as_str() {
            "exr" => Self::OpenExr,
            "png" => Self::Png,
            "jpg" | "jpeg" => Self::Jpeg,
            "tif" | "tiff" => Self::Tiff,
            "hdr" | "pic" => Self::Hdr,
            "pfm" => Self::Pfm,
            _ => return None,
        })
    }

    /// What the file `path` is.
    ///
    /// # Errors
    /// [`FileError::Io`] if it cannot be read, [`FileError::Unsupported`] if it is none of these formats.
    pub fn detect(path: &Path) -> FileResult<Self> {
        let mut start = Vec::with_capacity(16);
        let file = open(path)?;
        file.take(16).read_to_end(&mut start).map_err(|error| FileError::io(path, "read", error))?;
        Self::of_bytes(&start).ok_or_else(|| {
            if start.is_empty() {
                FileError::damaged(path, "the file is empty")
            } else {
                FileError::unsupported(
                    path,
                    "not a picture of a known format",
                    "give OpenEXR, PNG, JPEG, TIFF, HDR or PFM",
                )
            }
        })
    }
}

/// A depth map as its file holds it.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthMap {
    /// The first channel: integers as 0..1, floats as they are.
    pub plane: Plane,
    /// How the file stores it.
    pub stored: Stored,
}

/// How a file stores its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stored {
    /// Whole numbers of this many bits, read as 0..1. Eight bits are coarse for depth.
    Integer(u8),
    /// Floating point.
    Float,
}

/// A picture, and what its file holds beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// As [`read_picture`] gives it.
    pub picture: Picture,
    /// How the file stores its numbers.
    pub stored: Stored,
    /// The file's colour profile, where it is not sRGB's.
    pub profile: Option<Profile>,
    /// What the user should know, as clauses about "it", the file.
    pub notes: Vec<String>,
}

/// Reads a picture as [`read_picture`] does, and what its file holds beside it.
///
/// # Errors
/// [`FileError`]: what is wrong with the file, and what to do.
pub fn read_image(path: &Path, limits: &Limits) -> FileResult<Image> {
    read(path, limits)?.into_image()
}

/// Reads a picture as linear light, premultiplied, in three planes, R, G, B, and perhaps alpha.
///
/// Straight alpha is multiplied in. Alpha that is already associated in a TIFF of integers is taken to be
/// multiplied into the sRGB-encoded numbers, as image editors do.
///
/// # Errors
/// [`FileError`]: what is wrong with the file, and what to do.
pub fn read_picture(path: &Path, limits: &Limits) -> FileResult<Picture> {
    read(path, limits)?.to_picture()
}

/// Reads a depth map: the grey or the first channel, raw.
///
/// # Errors
/// [`FileError`]: what is wrong with the file, and what to do.
pub fn read_depth(path: &Path, limits: &Limits) -> FileResult<DepthMap> {
    let samples = read(path, limits)?;
    for note in &samples.notes {
        tracing::info!("{}: {note}", path.display());
    }
    samples.to_depth()
}

fn open(path: &Path) -> FileResult<File> {
    let file = File::open(path).map_err(|error| FileError::io(path, "open", error))?;
    match file.metadata() {
        // Reading a folder gives an error of its own, but not a clear one.
        Ok(meta) if meta.is_dir() => Err(FileError::unsupported(
            path,
            "this is a folder",
            "give a file, or a pattern like shot.####.exr",
        )),
        _ => Ok(file),
    }
}

fn read(path: &Path, limits: &Limits) -> FileResult<Samples> {
    let format = Format::detect(path)?;
    let mut file = open(path)?;
    let length = file
        .seek(std::io::SeekFrom::End(0))
        .and_then(|length| file.rewind().map(|()| length))
        .map_err(|error| FileError::io(path, "read", error))?;
    let source = Source { path, length, limits, format };
    let reader = BufReader::with_capacity(1 << 16, file);
    match format {
        Format::Pfm => pfm::read(&source, reader),
        Format::Tiff => tiff_file::read(&source, reader),
        Format::Jpeg => codec::read(&source, jpeg_end::check(&source, reader)?),
        Format::Png | Format::Hdr => codec::read(&source, reader),
        Format::OpenExr => Err(FileError::unsupported(
            path,
            "this is an OpenEXR file",
            "it is read as a document with channels, not as a plain picture",
        )),
    }
}

/// A file to be read, for its limits and messages.
struct Source<'a> {
    path: &'a Path,
    /// Bytes in the file.
    length: u64,
    limits: &'a Limits,
    format: Format,
}

impl Source<'_> {
    fn damaged(&self, reason: impl Into<String>) -> FileError {
        FileError::damaged(self.path, reason)
    }

    /// Memory for decoded samples, or an error where there is not so much.
    fn zeros<T: Clone + Default>(&self, size: Size, len: usize) -> FileResult<Vec<T>> {
        let mut data = Vec::new();
        data.try_reserve_exact(len).map_err(|_| pullfocus_core::Error::OutOfMemory {
            what: "the decoded picture",
            size,
            bytes: (len as u64).saturating_mul(size_of::<T>() as u64),
        })?;
        data.resize(len, T::default());
        Ok(data)
    }

    /// Refuses a size that the limits forbid, or that a file of this length cannot hold, before any of it
    /// is allocated. `bytes` is what the decoded samples of one pixel take.
    fn check_size(&self, width: u64, height: u64, channels: u64, bytes: u64) -> FileResult<Size> {
        if width == 0 || height == 0 {
            return Err(self.damaged(format!("its size is {width} x {height}")));
        }
        let pixels = width.saturating_mul(height);
        FileError::check_limit(self.path, "the number of pixels", pixels, self.limits.max_pixels)?;
        // The decoded samples and the planes made of them are in memory together.
        let planes = pixels.saturating_mul(4 * channels.clamp(3, 4));
        let decoded = pixels.saturating_mul(bytes);
        let wanted = planes.saturating_add(decoded);
        FileError::check_limit(self.path, "the memory for its pixels", wanted, self.limits.max_plane_bytes)?;
        if decoded / self.most_expansion() > self.length {
            return Err(self.damaged(format!(
                "its header says {width} x {height} pixels, more than its {} bytes can hold",
                self.length
            )));
        }
        let fit = |value: u64| usize::try_from(value).unwrap_or(usize::MAX);
        Ok(Size::new(fit(width), fit(height)))
    }

    /// How many decoded bytes one byte of the file can become, generously.
    fn most_expansion(&self) -> u64 {
        match self.format {
            // Deflate: 1032 at most; PNG may hold 1-bit pixels that become bytes, or palettes that become RGBA.
            Format::Png => 1032 * 32,
            // A bit and a half for each block of 64 values, per channel.
            Format::Jpeg => 4096,
            // RLE: 127 in two bytes; four bytes become twelve. Old RLE repeats more.
            Format::Hdr => 1 << 16,
            // LZW and fax.
            Format::Tiff => 1 << 16,
            Format::Pfm | Format::OpenExr => 1,
        }
    }
}
