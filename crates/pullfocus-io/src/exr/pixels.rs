//! Blocks of pixels: decoding them into planes.

use crate::align::overlap;
use crate::error::{FileError, FileResult};
use crate::exr::container::{Container, Extent, guarded};
use crate::exr::names::Channel;
use crate::exr::selection::SampleType;
use exr::compression::Compression;
use exr::meta::attribute::IntegerBounds;
use exr::meta::header::Header;
use half::f16;
use half::slice::HalfFloatSliceExt;
use pullfocus_core::{Cancel, Plane, Size, Window};
use rayon::prelude::*;

/// Decoded bytes that are in memory at a time; one block per thread where blocks are larger.
const BATCH_BYTES: usize = 64 << 20;

/// A plane to be filled from a channel.
pub(crate) struct Target<'a> {
    part: usize,
    channel: usize,
    sample_type: SampleType,
    window: Window,
    plane: &'a mut Plane,
}

impl<'a> Target<'a> {
    pub fn new(channel: &Channel, window: Window, plane: &'a mut Plane) -> Self {
        let Channel { part, index, sample_type, .. } = *channel;
        Self { part, channel: index, sample_type, window, plane }
    }
}

/// A decoded block: samples in the machine's byte order, row by row, in each row channel by channel.
pub(crate) struct Block {
    /// Where it lies in its level.
    pub section: IntegerBounds,
    pub bytes: Vec<u8>,
}

/// The bytes of one channel in one row of a block `width` wide: where they begin in the row, and the row's.
pub(crate) fn row_layout(header: &Header, channel: usize, width: usize) -> (usize, usize) {
    let before =
        header.channels.list[..channel].iter().map(|c| c.sample_type.bytes_per_sample()).sum::<usize>();
    (before * width, header.channels.bytes_per_pixel * width)
}

/// Cuts the list into runs that fit into memory together.
pub(crate) fn batches<'a>(
    container: &'a Container,
    extents: &'a [Extent],
) -> impl Iterator<Item = &'a [Extent]> {
    let mut rest = extents;
    std::iter::from_fn(move || {
        let mut bytes = 0usize;
        let least = rayon::current_num_threads();
        let count = rest
            .iter()
            .enumerate()
            .take_while(|(n, extent)| {
                let part = &container.parts[extent.part];
                let area = part.section(extent.index).map_or(0, |section| section.size.area());
                bytes = bytes.saturating_add(area.saturating_mul(part.header.channels.bytes_per_pixel));
                *n < least || bytes <= BATCH_BYTES
            })
            .count();
        let (batch, after) = rest.split_at(count);
        rest = after;
        (!batch.is_empty()).then_some(batch)
    })
}

/// Decodes the pixels of one flat chunk.
pub(crate) fn decode(container: &Container, extent: Extent, compressed: Vec<u8>) -> FileResult<Block> {
    let part = &container.parts[extent.part];
    let section = part.section(extent.index)?;
    let header = &part.header;
    let expected = section.size.area() * header.channels.bytes_per_pixel;
    check_dwa(header.compression, &compressed, expected).map_err(|reason| container.damaged(reason))?;
    let bytes =
        guarded(|| header.compression.decompress_image_section_from_le(header, compressed, section, false))
            .map_err(|reason| {
            if reason.starts_with("not supported") {
                let name = crate::exr::contents::compression_name(header.compression);
                FileError::unsupported(
                    &container.path,
                    format!("{name} compression is not supported here ({reason})"),
                    "save the file with ZIP or PIZ compression",
                )
            } else {
                container.damaged(format!("a block of pixels cannot be decoded ({reason})"))
            }
        })?;
    if bytes.len() != expected {
        return Err(container.damaged("a block of pixels has the wrong size"));
    }
    Ok(Block { section, bytes })
}

/// A DWA block begins with the sizes of what it unpacks to, for which the decoder takes memory at once.
/// Refuses sizes that the block's pixels cannot need.
fn check_dwa(compression: Compression, compressed: &[u8], expected: usize) -> Result<(), String> {
    if !matches!(compression, Compression::DWAA(_) | Compression::DWAB(_)) || compressed.len() == expected {
        return Ok(());
    }
    // Version, then: bytes unknown, packed, AC packed, DC packed, RLE packed, RLE unpacked, RLE raw, AC values,
    // DC values. Tiles are padded to 8 x 8, and packing may lengthen: sixteen times is beyond them all.
    let most = (expected as u64).saturating_mul(16).saturating_add(1 << 16);
    let sizes = compressed.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default()));
    match sizes.skip(1).take(9).find(|&size| size > most) {
        Some(size) => Err(format!("a DWA block claims {size} bytes for {expected} bytes of pixels")),
        None => Ok(()),
    }
}

/// Fills planes from channels of flat parts without sub-sampled channels.
pub(crate) fn read_planes(container: &Container, targets: &mut [Target], cancel: &Cancel) -> FileResult<()> {
    let wanted: Vec<bool> =
        (0..container.parts.len()).map(|part| targets.iter().any(|t| t.part == part)).collect();
    container.check_unchanged()?;
    let extents =
        container.extents(|part, index| wanted[part] && container.parts[part].is_full_size(index))?;
    for batch in batches(container, &extents) {
        cancel.check()?;
        let compressed =
            batch.iter().map(|&extent| container.read_flat(extent)).collect::<FileResult<Vec<_>>>()?;
        let blocks = batch
            .par_iter()
            .zip(compressed)
            .map(|(&extent, bytes)| {
                cancel.check()?;
                decode(container, extent, bytes)
            })
            .collect::<FileResult<Vec<Block>>>()?;
        cancel.check()?;
        targets.par_iter_mut().for_each(|target| {
            for (extent, block) in batch.iter().zip(&blocks) {
                if extent.part == target.part {
                    fill(container, target, block);
                }
            }
        });
    }
    Ok(())
}

/// The window of a block of the largest level.
pub(crate) fn block_window(part: Window, section: IntegerBounds) -> Window {
    Window {
        x: part.x.saturating_add(section.position.x()),
        y: part.y.saturating_add(section.position.y()),
        size: Size::new(section.size.width(), section.size.height()),
    }
}

fn fill(container: &Container, target: &mut Target, block: &Block) {
    let part = &container.parts[target.part];
    let width = block.section.size.width();
    let (start, row_bytes) = row_layout(&part.header, target.channel, width);
    let sample = target.sample_type.bytes();
    let window = block_window(part.window(), block.section);
    let Some([(from_x, to_x, count), (from_y, to_y, rows)]) = overlap(window, target.window) else { return };
    let mut halves = Vec::new();
    for row in 0..rows {
        let from = (from_y + row) * row_bytes + start + from_x * sample;
        let bytes = &block.bytes[from..from + count * sample];
        let values = &mut target.plane.row_mut(to_y + row)[to_x..to_x + count];
        load(target.sample_type, bytes, values, &mut halves);
    }
}

/// Samples to f32. Integers above 2^24 are rounded.
fn load(sample_type: SampleType, bytes: &[u8], values: &mut [f32], halves: &mut Vec<f16>) {
    let fours = bytes.chunks_exact(4).map(|b| <[u8; 4]>::try_from(b).unwrap_or_default());
    match sample_type {
        SampleType::Half => {
            halves.clear();
            halves.extend(bytes.chunks_exact(2).map(|b| f16::from_ne_bytes([b[0], b[1]])));
            halves.convert_to_f32_slice(values);
        }
        SampleType::Float => {
            values.iter_mut().zip(fours).for_each(|(value, b)| *value = f32::from_ne_bytes(b));
        }
        SampleType::Uint => {
            values.iter_mut().zip(fours).for_each(|(value, b)| *value = u32::from_ne_bytes(b) as f32);
        }
    }
}

/// f32 to samples. Halves saturate at 65504 and integers at their ends, where NaN becomes 0.
pub(crate) fn store(sample_type: SampleType, values: &[f32], bytes: &mut [u8], halves: &mut Vec<f16>) {
    match sample_type {
        SampleType::Half => {
            halves.clear();
            halves.resize(values.len(), f16::ZERO);
            halves.convert_from_f32_slice(values);
            for (half, b) in halves.iter().zip(bytes.chunks_exact_mut(2)) {
                let half = if half.is_infinite() { f16::MAX.copysign(*half) } else { *half };
                b.copy_from_slice(&half.to_ne_bytes());
            }
        }
        SampleType::Float => {
            let pairs = values.iter().zip(bytes.chunks_exact_mut(4));
            pairs.for_each(|(value, b)| b.copy_from_slice(&value.to_ne_bytes()));
        }
        SampleType::Uint => {
            let pairs = values.iter().zip(bytes.chunks_exact_mut(4));
            pairs.for_each(|(value, b)| b.copy_from_slice(&(value.round() as u32).to_ne_bytes()));
        }
    }
}
