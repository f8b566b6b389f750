//! Writing a document again, with some channels replaced.

use crate::align::overlap;
use crate::error::{FileError, FileResult, OUTPUT};
use crate::exr::container::{
    Container, Extent, MAGIC, MULTI_PART, RawAttribute, coordinates, guarded, section,
};
use crate::exr::document::Document;
use crate::exr::pixels::{Block, batches, block_window, decode, row_layout, store};
use crate::exr::selection::{ChannelSource, Channels, SampleType};
use crate::output::{Existing, PendingFile};
use exr::block::chunk::TileCoordinates;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{LineOrder, TileDescription};
use exr::meta::compute_level_size;
use exr::meta::header::Header;
use half::f16;
use pullfocus_core::{Picture, Plane, Window};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

/// Lays down header, chunks and, at the end, the tables of where the chunks are.
pub(crate) struct Writer<W> {
    out: W,
    start: u64,
    at: u64,
    tables_at: u64,
    tables: Vec<Vec<u64>>,
    multi_part: bool,
}

impl<W: Write + Seek> Writer<W> {
    /// Writes the header of parts with so many chunks each.
    pub fn new<'a>(
        mut out: W,
        version: u32,
        parts: impl Iterator<Item = (&'a [RawAttribute], usize)>,
    ) -> FileResult<Self> {
        let start = out.stream_position().map_err(failed)?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(version.to_le_bytes());
        let mut tables = Vec::new();
        for (attributes, chunks) in parts {
            attributes.iter().for_each(|attribute| attribute.write(&mut bytes));
            bytes.push(0);
            tables.push(vec![0; chunks]);
        }
        let multi_part = version & MULTI_PART != 0;
        if multi_part {
            bytes.push(0);
        }
        let tables_at = bytes.len() as u64;
        bytes.resize(bytes.len() + tables.iter().map(|table| table.len() * 8).sum::<usize>(), 0);
        out.write_all(&bytes).map_err(failed)?;
        Ok(Self { out, start, at: bytes.len() as u64, tables_at, tables, multi_part })
    }

    /// Appends a chunk; `body` is everything behind its part number.
    pub fn put(&mut self, part: usize, index: usize, body: &[&[u8]]) -> FileResult<()> {
        self.tables[part][index] = self.at;
        if self.multi_part {
            self.bytes(&(part as i32).to_le_bytes())?;
        }
        body.iter().try_for_each(|bytes| self.bytes(bytes))
    }

    fn bytes(&mut self, bytes: &[u8]) -> FileResult<()> {
        self.at += bytes.len() as u64;
        self.out.write_all(bytes).map_err(failed)
    }

    /// Writes the tables and leaves the stream at the file's end.
    pub fn finish(mut self) -> FileResult<()> {
        let tables: Vec<u8> = self.tables.iter().flatten().flat_map(|offset| offset.to_le_bytes()).collect();
        self.out.seek(SeekFrom::Start(self.start + self.tables_at)).map_err(failed)?;
        self.out.write_all(&tables).map_err(failed)?;
        self.out.seek(SeekFrom::Start(self.start + self.at)).map_err(failed)?;
        self.out.flush().map_err(failed)
    }
}

fn failed(error: std::io::Error) -> FileError {
    FileError::io(OUTPUT, "write", error)
}

/// Compresses one block; the body of its chunk.
pub(crate) fn encode(header: &Header, at: TileCoordinates, pixels: Vec<u8>) -> FileResult<Vec<u8>> {
    let section = section(header, at).ok_or_else(|| unwritable("its place"))?;
    let compressed = guarded(|| header.compression.compress_image_section_to_le(header, pixels, section))
        .map_err(|reason| unwritable(&reason))?;
    let mut body = Vec::with_capacity(compressed.len() + 20);
    for value in coordinates(header, at) {
        body.extend(value.to_le_bytes());
    }
    let size = i32::try_from(compressed.len()).map_err(|_| unwritable("its size"))?;
    body.extend(size.to_le_bytes());
    body.extend(compressed);
    Ok(body)
}

fn unwritable(reason: &str) -> FileError {
    FileError::unsupported(
        OUTPUT,
        format!("a block of pixels cannot be encoded ({reason})"),
        "try another format",
    )
}

/// A plane that replaces a channel.
#[derive(Clone, Copy)]
struct Replacement<'a> {
    channel: usize,
    sample_type: SampleType,
    plane: &'a Plane,
    window: Window,
}

/// How a part is written.
struct OutPart<'a> {
    header: Cow<'a, Header>,
    attributes: Cow<'a, [RawAttribute]>,
    replaced: Vec<Replacement<'a>>,
}

impl Document {
    /// Writes the whole document with the planes of `picture` in place of the channels that they came from,
    /// in the channels' own sample types (half saturates at 65504). Everything else comes out as it went in.
    ///
    /// `out` should be buffered, and may already hold something before its current position.
    ///
    /// # Errors
    /// [`FileError::Core`] if the picture's planes are not as many and as large as those that were selected,
    /// errors of reading the input again and of writing, cancellation.
    pub fn write_to(&self, out: impl Write + Seek, channels: &Channels, picture: &Picture) -> FileResult<()> {
        let sources: Vec<&ChannelSource> = channels.all().collect();
        let planes: Vec<&Plane> = picture.planes().collect();
        if sources.len() != planes.len() || channels.alpha.is_some() != picture.alpha.is_some() {
            return Err(FileError::Argument {
                what: "the picture to write".to_owned(),
                reason: format!("it has {} planes and must have {}", planes.len(), sources.len()),
            });
        }
        for plane in &planes {
            plane.expect_size("a plane to write", channels.window.size)?;
        }
        let container = &self.container;
        container.check_unchanged()?;
        let parts: Vec<OutPart> = (0..container.parts.len())
            .map(|part| {
                let replaced = sources.iter().zip(&planes).filter(|(source, _)| source.part == part);
                out_part(
                    container,
                    part,
                    replaced
                        .map(|(source, &plane)| Replacement {
                            channel: source.channel,
                            sample_type: source.sample_type,
                            plane,
                            window: channels.window,
                        })
                        .collect(),
                )
            })
            .collect();
        let headers = parts.iter().map(|part| (&*part.attributes, part.header.chunk_count));
        let mut writer = Writer::new(out, container.version, headers)?;
        let extents = container.extents(|_, _| true)?;
        for batch in batches(container, &extents) {
            self.cancel.check()?;
            let read = |&extent: &Extent| {
                if container.parts[extent.part].header.deep {
                    container.read_deep(extent)
                } else {
                    container.read_flat(extent)
                }
            };
            let bytes = batch.iter().map(read).collect::<FileResult<Vec<_>>>()?;
            let chunks = batch
                .par_iter()
                .zip(bytes)
                .map(|(&extent, bytes)| {
                    self.cancel.check()?;
                    rewrite(container, &parts[extent.part], extent, bytes)
                })
                .collect::<FileResult<Vec<_>>>()?;
            for (extent, bodies) in batch.iter().zip(chunks) {
                for (index, body) in bodies {
                    writer.put(extent.part, index, &[&body])?;
                }
            }
        }
        container.check_unchanged()?;
        writer.finish()
    }

    /// [`Document::write_to`] a file, by way of a temporary one beside it: `path` holds the whole picture or
    /// is left as it was. A file that is there is replaced, the document's own too.
    ///
    /// # Errors
    /// As [`Document::write_to`] and [`PendingFile`], with `path` in the message.
    pub fn write(&self, path: impl AsRef<Path>, channels: &Channels, picture: &Picture) -> FileResult<()> {
        let path = path.as_ref();
        let mut out = PendingFile::create(path, Existing::Replace)?;
        self.write_to(&mut out, channels, picture).map_err(|error| error.of_output(path))?;
        out.commit()?;
        Ok(())
    }
}

/// How a part is written: as it was, unless its channels change and its compression loses something.
fn out_part<'a>(container: &'a Container, part: usize, replaced: Vec<Replacement<'a>>) -> OutPart<'a> {
    let source = &container.parts[part];
    let keep = matches!(
        source.header.compression,
        Compression::Uncompressed
            | Compression::RLE
            | Compression::ZIP1
            | Compression::ZIP16
            | Compression::PIZ
    );
    let (mut header, mut attributes) = (Cow::Borrowed(&source.header), Cow::Borrowed(&*source.attributes));
    if !replaced.is_empty() && !keep {
        let zip = source.header.clone();
        let (blocks, order) = (zip.blocks, zip.line_order);
        let zip = zip.with_encoding(Compression::ZIP16, blocks, order);
        for attribute in attributes.to_mut() {
            match attribute.name.as_str() {
                "compression" => attribute.bytes = vec![3],
                "chunkCount" => attribute.bytes = (zip.chunk_count as i32).to_le_bytes().to_vec(),
                _ => {}
            }
        }
        header = Cow::Owned(zip);
    }
    OutPart { header, attributes, replaced }
}

/// The chunks that one chunk of the input becomes: index in the table and body.
fn rewrite(
    container: &Container,
    out: &OutPart,
    extent: Extent,
    bytes: Vec<u8>,
) -> FileResult<Vec<(usize, Vec<u8>)>> {
    let part = &container.parts[extent.part];
    let at = part.chunks[extent.index];
    if part.header.deep {
        return Ok(vec![(extent.index, bytes)]);
    }
    if out.replaced.is_empty() {
        let mut body = Vec::with_capacity(bytes.len() + 20);
        for value in coordinates(&part.header, at) {
            body.extend(value.to_le_bytes());
        }
        body.extend((bytes.len() as i32).to_le_bytes());
        body.extend(bytes);
        return Ok(vec![(extent.index, body)]);
    }
    let mut block = decode(container, extent, bytes)?;
    for replacement in &out.replaced {
        replace(&part.header, part.window(), at, &mut block, replacement);
    }
    if matches!(part.header.blocks, BlockDescription::Tiles(_)) {
        return Ok(vec![(extent.index, encode(&out.header, at, block.bytes)?)]);
    }
    // Scan lines: the output's blocks may hold fewer lines than the input's, never more.
    let lines = out.header.compression.scan_lines_per_block();
    let row_bytes = block.section.size.width() * part.header.channels.bytes_per_pixel;
    let first = block.section.position.y() as usize / lines;
    let pieces = block.bytes.chunks(row_bytes * lines).enumerate();
    let mut bodies = pieces
        .map(|(n, pixels)| {
            let at = TileCoordinates { tile_index: Vec2(0, first + n), level_index: Vec2(0, 0) };
            Ok((first + n, encode(&out.header, at, pixels.to_vec())?))
        })
        .collect::<FileResult<Vec<_>>>()?;
    if part.header.line_order == LineOrder::Decreasing {
        bodies.reverse();
    }
    Ok(bodies)
}

/// Puts a plane's values into a block.
fn replace(header: &Header, part: Window, at: TileCoordinates, block: &mut Block, by: &Replacement) {
    let width = block.section.size.width();
    let (start, row_bytes) = row_layout(header, by.channel, width);
    let sample = by.sample_type.bytes();
    let mut halves: Vec<f16> = Vec::new();
    if let (BlockDescription::Tiles(tiles), false) = (header.blocks, at.is_largest_resolution_level()) {
        for row in 0..block.section.size.height() {
            for column in 0..width {
                if let Some(value) = smaller(header, tiles, at, part, (block, row, column), by) {
                    let from = row * row_bytes + start + column * sample;
                    store(by.sample_type, &[value], &mut block.bytes[from..from + sample], &mut halves);
                }
            }
        }
        return;
    }
    let window = block_window(part, block.section);
    let Some([(to_x, from_x, count), (to_y, from_y, rows)]) = overlap(window, by.window) else { return };
    for row in 0..rows {
        let from = (to_y + row) * row_bytes + start + to_x * sample;
        let values = &by.plane.row(from_y + row)[from_x..from_x + count];
        store(by.sample_type, values, &mut block.bytes[from..from + count * sample], &mut halves);
    }
}

/// One pixel of a smaller level: the mean of the pixels that it covers in the largest one, None where the
/// plane has none of them.
fn smaller(
    header: &Header,
    tiles: TileDescription,
    at: TileCoordinates,
    part: Window,
    (block, row, column): (&Block, usize, usize),
    by: &Replacement,
) -> Option<f32> {
    let covered = |full: usize, level: usize, position: usize| {
        let size = compute_level_size(tiles.rounding_mode, full, level);
        // Rows and columns of the largest level, whole ones: as many as one pixel is apart from the next.
        (position * full / size, ((position + 1) * full / size).min(full))
    };
    let Vec2(full_width, full_height) = header.layer_size;
    let Vec2(level_x, level_y) = at.level_index;
    let (x0, x1) = covered(full_width, level_x, block.section.position.x() as usize + column);
    let (y0, y1) = covered(full_height, level_y, block.section.position.y() as usize + row);
    let window = Window {
        x: part.x.saturating_add(x0 as i32),
        y: part.y.saturating_add(y0 as i32),
        size: pullfocus_core::Size::new((x1 - x0).max(1), (y1 - y0).max(1)),
    };
    let [(_, from_x, columns), (_, from_y, rows)] = overlap(window, by.window)?;
    let mut sum = 0.0;
    for y in from_y..from_y + rows {
        sum += by.plane.row(y)[from_x..from_x + columns].iter().map(|&v| f64::from(v)).sum::<f64>();
    }
    Some((sum / (columns * rows) as f64) as f32)
}
