//! Writing a plain OpenEXR file: one part, scan lines, ZIP.

use crate::error::{FileError, FileResult};
use crate::exr::container::{MAGIC, RawAttribute, guarded};
use crate::exr::pixels::{row_layout, store};
use crate::exr::selection::SampleType;
use crate::exr::write::{Writer, encode};
use exr::block::chunk::TileCoordinates;
use exr::meta::MetaData;
use pullfocus_core::{Frame, Plane, Window};
use rayon::prelude::*;
use std::io::{Seek, Write};

/// The value of an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValue {
    /// Text.
    Text(String),
    /// A 32-bit number.
    Float(f32),
    /// A whole number.
    Int(i32),
    /// Several texts, such as the names of views.
    Texts(Vec<String>),
}

/// Bit of the version field: names may be longer than 31 bytes.
const LONG_NAMES: u32 = 0x400;

/// Writes planes as the channels of one OpenEXR part. The same input gives the same bytes.
///
/// The planes have the size of the frame's data window. Halves saturate at 65504. An attribute with the name
/// of one that the frame gives (`dataWindow` and the like) is left out.
///
/// # Errors
/// [`FileError::Core`] for planes of another size, [`FileError::Argument`] for names that cannot be written
/// (empty, given twice, above 255 bytes) and an empty frame, [`FileError::Io`].
pub fn write_exr(
    out: impl Write + Seek,
    frame: &Frame,
    planes: &[(&str, &Plane, SampleType)],
    attributes: &[(&str, AttributeValue)],
) -> FileResult<()> {
    let mut planes = planes.to_vec();
    planes.sort_by_key(|&(name, ..)| name);
    for (index, &(name, plane, _)) in planes.iter().enumerate() {
        check_name(name)?;
        plane.expect_size("a plane to write", frame.data.size)?;
        if index > 0 && planes[index - 1].0 == name {
            return Err(argument(name, "the channel is given twice"));
        }
    }
    if planes.is_empty() || frame.data.size.area() == 0 || frame.display.size.area() == 0 {
        return Err(argument("the picture to write", "it has no pixels"));
    }
    let header = header(frame, &planes, attributes)?;
    let long = planes.iter().any(|p| p.0.len() > 31) || header.iter().any(|a| a.name.len() > 31);
    let version = 2 | if long { LONG_NAMES } else { 0 };

    let mut bytes = MAGIC.to_vec();
    bytes.extend(version.to_le_bytes());
    header.iter().for_each(|attribute| attribute.write(&mut bytes));
    bytes.push(0);
    let meta = guarded(|| MetaData::read_from_buffered(bytes.as_slice(), true))
        .map_err(|reason| argument("the picture to write", &reason))?;
    let parsed = &meta.headers[0];

    let mut writer = Writer::new(out, version, std::iter::once((&*header, parsed.chunk_count)))?;
    let blocks: Vec<TileCoordinates> =
        parsed.blocks_increasing_y_order().map(|block| block.location).collect();
    let lines = parsed.compression.scan_lines_per_block();
    let Window { size, .. } = frame.data;
    for (batch_index, batch) in blocks.chunks(256).enumerate() {
        let bodies = batch
            .par_iter()
            .map(|&at| {
                let first = at.tile_index.y() * lines;
                let rows = lines.min(size.height - first);
                let mut pixels = vec![0; rows * size.width * parsed.channels.bytes_per_pixel];
                let mut halves = Vec::new();
                for (channel, &(_, plane, sample_type)) in planes.iter().enumerate() {
                    let (start, row_bytes) = row_layout(parsed, channel, size.width);
                    for row in 0..rows {
                        let from = row * row_bytes + start;
                        let to = &mut pixels[from..from + size.width * sample_type.bytes()];
                        store(sample_type, plane.row(first + row), to, &mut halves);
                    }
                }
                encode(parsed, at, pixels)
            })
            .collect::<FileResult<Vec<_>>>()?;
        for (n, body) in bodies.iter().enumerate() {
            writer.put(0, batch_index * 256 + n, &[body])?;
        }
    }
    writer.finish()
}

fn argument(what: &str, reason: &str) -> FileError {
    FileError::Argument { what: what.to_owned(), reason: reason.to_owned() }
}

fn check_name(name: &str) -> FileResult<()> {
    if name.is_empty() || name.len() > 255 || name.contains('\0') {
        return Err(argument(&format!("the name '{name}'"), "names have 1 to 255 bytes, none of them zero"));
    }
    Ok(())
}

fn header(
    frame: &Frame,
    planes: &[(&str, &Plane, SampleType)],
    attributes: &[(&str, AttributeValue)],
) -> FileResult<Vec<RawAttribute>> {
    let mut channels = Vec::new();
    for &(name, _, sample_type) in planes {
        channels.extend(name.as_bytes());
        channels.push(0);
        let code: u32 = match sample_type {
            SampleType::Uint => 0,
            SampleType::Half => 1,
            SampleType::Float => 2,
        };
        // Type, linear flag with three reserved bytes, sampling across and down.
        for value in [code, 0, 1, 1] {
            channels.extend(value.to_le_bytes());
        }
    }
    channels.push(0);
    let mut all = vec![
        RawAttribute::new("channels", "chlist", channels),
        RawAttribute::new("compression", "compression", vec![3]),
        RawAttribute::new("dataWindow", "box2i", box2i(frame.data)?),
        RawAttribute::new("displayWindow", "box2i", box2i(frame.display)?),
        RawAttribute::new("lineOrder", "lineOrder", vec![0]),
        RawAttribute::new("pixelAspectRatio", "float", frame.pixel_aspect.to_le_bytes().to_vec()),
        RawAttribute::new(
            "screenWindowCenter",
            "v2f",
            frame.screen_window_center.iter().flat_map(|v| v.to_le_bytes()).collect(),
        ),
        RawAttribute::new("screenWindowWidth", "float", frame.screen_window_width.to_le_bytes().to_vec()),
    ];
    for (name, value) in attributes {
        check_name(name)?;
        if all.iter().any(|attribute| attribute.name == *name) {
            continue;
        }
        // Names are held one char a byte.
        let name = crate::exr::text::latin1(name.as_bytes());
        let (kind, bytes) = match value {
            AttributeValue::Text(text) => ("string", text.as_bytes().to_vec()),
            AttributeValue::Float(value) => ("float", value.to_le_bytes().to_vec()),
            AttributeValue::Int(value) => ("int", value.to_le_bytes().to_vec()),
            AttributeValue::Texts(texts) => {
                let counted =
                    |text: &String| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
                ("stringvector", texts.iter().flat_map(counted).collect())
            }
        };
        all.push(RawAttribute::new(&name, kind, bytes));
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(all)
}

fn box2i(window: Window) -> FileResult<Vec<u8>> {
    let last = |start: i32, size: usize| {
        i32::try_from(i64::from(start) + size as i64 - 1)
            .map_err(|_| argument("the picture to write", "it lies beyond what OpenEXR can address"))
    };
    let values =
        [window.x, window.y, last(window.x, window.size.width)?, last(window.y, window.size.height)?];
    Ok(values.iter().flat_map(|value| value.to_le_bytes()).collect())
}
