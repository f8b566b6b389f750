//! An OpenEXR file as a container: header bytes, offset tables, chunks.
//!
//! Pixels are decoded and encoded by the `exr` crate. The container itself is handled here, because
//! everything that is not blurred has to come out as it went in: attributes in their order and their own
//! bytes (the crate keeps them in hash maps, so that their order would change from run to run), chunks of
//! untouched parts without a detour through the codecs (which for lossy ones loses again), and deep parts,
//! which the crate does not read. Layout: "OpenEXR File Layout" of the OpenEXR project.

use crate::error::{FileError, FileResult, RAISE_THE_LIMIT};
use crate::exr::text::{latin1, printable, shown};
use crate::limits::Limits;
use exr::block::chunk::TileCoordinates;
use exr::math::Vec2;
use exr::meta::attribute::IntegerBounds;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use pullfocus_core::{Size, Window};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
pub(crate) const MULTI_PART: u32 = 0x1000;

/// One attribute as it stands in the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RawAttribute {
    pub name: String,
    pub kind: String,
    pub bytes: Vec<u8>,
}

/// One part (OpenEXR calls its header so, too): what it holds, and where its chunks are.
#[derive(Debug)]
pub(crate) struct Part {
    pub attributes: Vec<RawAttribute>,
    pub header: Header,
    /// Chunks in the order of the offset table.
    pub chunks: Vec<TileCoordinates>,
    offsets: Vec<u64>,
}

/// Where the bytes come from. Files stay open, so that a picture may be written over its own input.
#[derive(Debug)]
enum Source {
    Bytes(Vec<u8>),
    File { file: Mutex<File>, modified: Option<SystemTime> },
}

/// The file.
#[derive(Debug)]
pub(crate) struct Container {
    pub path: PathBuf,
    pub version: u32,
    pub parts: Vec<Part>,
    pub limits: Limits,
    source: Source,
    length: u64,
}

/// A chunk's place in the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Extent {
    pub offset: u64,
    /// At most so many bytes: up to the next chunk or the end of the file.
    pub room: u64,
    pub part: usize,
    /// Index in the part's offset table.
    pub index: usize,
}

impl RawAttribute {
    pub fn new(name: &str, kind: &str, bytes: Vec<u8>) -> Self {
        Self { name: name.to_owned(), kind: kind.to_owned(), bytes }
    }

    pub fn write(&self, out: &mut Vec<u8>) {
        for text in [&self.name, &self.kind] {
            // Names are Latin-1 in here: one char is one byte of the file.
            out.extend(text.chars().map(|c| c as u8));
            out.push(0);
        }
        out.extend((self.bytes.len() as u32).to_le_bytes());
        out.extend(&self.bytes);
    }
}

impl Part {
    pub fn attribute(&self, name: &str) -> Option<&RawAttribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    pub fn text(&self, name: &str) -> Option<String> {
        self.attribute(name).filter(|a| a.kind == "string").map(|a| shown(&a.bytes))
    }

    pub fn window(&self) -> Window {
        window(self.header.data_window())
    }

    /// The pixels of a chunk, relative to its level's first pixel.
    pub fn section(&self, chunk: usize) -> FileResult<IntegerBounds> {
        section(&self.header, self.chunks[chunk])
            .ok_or_else(|| FileError::damaged("", "a chunk lies outside the data window"))
    }

    /// Whether a chunk belongs to the largest level.
    pub fn is_full_size(&self, chunk: usize) -> bool {
        self.chunks[chunk].is_largest_resolution_level()
    }
}

pub(crate) fn section(header: &Header, at: TileCoordinates) -> Option<IntegerBounds> {
    header.get_absolute_block_pixel_coordinates(at).ok()
}

pub(crate) fn window(bounds: IntegerBounds) -> Window {
    Window {
        x: bounds.position.x(),
        y: bounds.position.y(),
        size: Size::new(bounds.size.width(), bounds.size.height()),
    }
}

/// Runs a step of the `exr` crate; where it panics on damaged bytes, that is an error like any other.
pub(crate) fn guarded<T>(step: impl FnOnce() -> exr::error::Result<T>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(printable(&error.to_string())),
        Err(_) => Err("its values contradict each other".to_owned()),
    }
}

impl Source {
    fn read(&self, offset: u64, bytes: &mut [u8]) -> std::io::Result<()> {
        match self {
            Self::Bytes(all) => {
                let start = usize::try_from(offset).unwrap_or(usize::MAX);
                let found = all.get(start..).and_then(|rest| rest.get(..bytes.len()));
                bytes.copy_from_slice(found.ok_or(std::io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
            Self::File { file, .. } => {
                let mut file = file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                file.seek(SeekFrom::Start(offset))?;
                file.read_exact(bytes)
            }
        }
    }
}

impl Container {
    pub fn open(path: &Path, limits: &Limits) -> FileResult<Self> {
        let file = File::open(path).map_err(|error| FileError::io(path, "open", error))?;
        let data = file.metadata().map_err(|error| FileError::io(path, "read", error))?;
        if !data.is_file() {
            return Err(FileError::unsupported(path, "this is not a file", "give the path of an EXR file"));
        }
        let source = Source::File { file: Mutex::new(file), modified: data.modified().ok() };
        Self::read(path.to_owned(), source, data.len(), limits)
    }

    pub fn from_bytes(path: PathBuf, bytes: Vec<u8>, limits: &Limits) -> FileResult<Self> {
        let length = bytes.len() as u64;
        Self::read(path, Source::Bytes(bytes), length, limits)
    }

    pub fn damaged(&self, reason: impl Into<String>) -> FileError {
        FileError::damaged(&self.path, reason)
    }

    fn read(path: PathBuf, source: Source, length: u64, limits: &Limits) -> FileResult<Self> {
        let damaged = |reason: String| FileError::damaged(&path, reason);
        let mut bytes = Vec::new();
        let mut have = length.min(1 << 16);
        // Headers end where they end: read more until that is reached.
        let (version, parts_attributes, header_end) = loop {
            bytes.resize(have as usize, 0);
            source.read(0, &mut bytes).map_err(|error| FileError::io(&path, "read", error))?;
            match parse_headers(&bytes, limits) {
                Ok(parsed) => break parsed,
                Err(Parse::More) if have == length => {
                    return Err(damaged("the file ends within its header".to_owned()));
                }
                Err(Parse::More) => {
                    FileError::check_limit(
                        &path,
                        "the number of bytes in the header",
                        have + 1,
                        limits.max_header_bytes,
                    )?;
                    have = (have * 4).min(length).min(limits.max_header_bytes.max(1));
                }
                Err(Parse::Damaged(reason)) => return Err(damaged(reason)),
                Err(Parse::NotExr) => {
                    return Err(FileError::unsupported(
                        &path,
                        "this is not an OpenEXR file",
                        "check its name, or give PNG, JPEG, TIFF, HDR and PFM pictures under their own extensions",
                    ));
                }
            }
        };
        check_headers(&path, &parts_attributes, limits)?;
        let meta = guarded(|| MetaData::read_from_buffered(&bytes[..header_end], false))
            .map_err(|reason| damaged(format!("the header cannot be read ({reason})")))?;
        if meta.headers.len() != parts_attributes.len() {
            return Err(damaged("the header's parts cannot be told apart".to_owned()));
        }
        let mut parts: Vec<Part> = Vec::new();
        let mut total = 0u64;
        for (header, attributes) in meta.headers.into_iter().zip(parts_attributes) {
            check_header(&header)
                .map_err(|reason| damaged(format!("the header cannot be used ({reason})")))?;
            let stated = attributes.iter().find(|a| a.name == "chunkCount" && a.kind == "int");
            if stated.is_some_and(|a| a.bytes != (header.chunk_count as u32).to_le_bytes()) {
                return Err(damaged("the number of blocks does not fit the data window".to_owned()));
            }
            total = total.saturating_add(header.chunk_count as u64);
            parts.push(Part { attributes, header, chunks: Vec::new(), offsets: Vec::new() });
        }
        FileError::check_limit(&path, "the number of scan-line blocks and tiles", total, limits.max_chunks)?;
        let tables_end = header_end as u64 + total * 8;
        if tables_end > length {
            return Err(damaged("the file ends within its table of blocks".to_owned()));
        }
        let mut tables = vec![0; (total * 8) as usize];
        source.read(header_end as u64, &mut tables).map_err(|error| FileError::io(&path, "read", error))?;
        let mut offsets =
            tables.chunks_exact(8).map(|entry| u64::from_le_bytes(entry.try_into().unwrap_or_default()));
        for part in &mut parts {
            part.offsets = offsets.by_ref().take(part.header.chunk_count).collect();
            let header = &part.header;
            part.chunks =
                guarded(|| Ok(header.blocks_increasing_y_order().map(|block| block.location).collect()))
                    .map_err(|reason| FileError::damaged(&path, reason))?;
            if part.chunks.len() != part.offsets.len()
                || part.chunks.iter().any(|&at| section(header, at).is_none())
            {
                return Err(FileError::damaged(&path, "the table of blocks does not fit the data window"));
            }
        }
        Ok(Self { path, version, parts, limits: *limits, source, length })
    }

    /// All chunks of the parts for which `wanted` holds, in the order in which they lie in the file.
    ///
    /// # Errors
    /// [`FileError::Damaged`] if one of them is missing.
    pub fn extents(&self, wanted: impl Fn(usize, usize) -> bool) -> FileResult<Vec<Extent>> {
        let mut all: Vec<Extent> = Vec::new();
        for (part, p) in self.parts.iter().enumerate() {
            for (index, &offset) in p.offsets.iter().enumerate() {
                all.push(Extent { offset, room: 0, part, index });
            }
        }
        all.sort_unstable();
        let mut end = self.length;
        for extent in all.iter_mut().rev() {
            extent.room = end.saturating_sub(extent.offset);
            // Several unwritten chunks share the offset 0, and a damaged table anything: room 0 is refused.
            end = extent.offset.min(end);
        }
        all.retain(|extent| wanted(extent.part, extent.index));
        let missing = all.iter().filter(|extent| extent.offset < 8 || extent.room < 8).count();
        if missing > 0 {
            return Err(self.damaged(format!(
                "{missing} of {} blocks of pixels are missing (is it still being rendered, or was the copy cut short?)",
                all.len()
            )));
        }
        Ok(all)
    }

    /// A chunk of a deep part as it stands, without its part number.
    pub fn read_deep(&self, extent: Extent) -> FileResult<Vec<u8>> {
        let (start, bytes) = self.read_chunk(extent, u64::MAX)?;
        let part = &self.parts[extent.part];
        let at = if matches!(part.header.blocks, BlockDescription::Tiles(_)) { 16 } else { 4 };
        let rest = &bytes[start..];
        let size = |from: usize| {
            rest.get(from..from + 8).map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default()))
        };
        let length = size(at)
            .zip(size(at + 8))
            .and_then(|(table, samples)| table.checked_add(samples)?.checked_add(at as u64 + 24))
            .and_then(|length| usize::try_from(length).ok());
        match length.and_then(|length| rest.get(..length)) {
            Some(chunk) => Ok(chunk.to_vec()),
            None => Err(self.damaged("a deep block is cut short")),
        }
    }

    /// The compressed pixels of a flat chunk.
    pub fn read_flat(&self, extent: Extent) -> FileResult<Vec<u8>> {
        let part = &self.parts[extent.part];
        let area = part.section(extent.index)?.size.area() as u64;
        let most = area.saturating_mul(part.header.channels.bytes_per_pixel as u64);
        FileError::check_limit(
            &self.path,
            "the number of bytes in one block of pixels",
            most,
            self.limits.max_chunk_bytes,
        )?;
        // 4 (part) + 16 (tile) + 4 (size) bytes lie before the pixels; sub-sampled channels only take less.
        let (start, mut bytes) = self.read_chunk(extent, most + 24)?;
        let at = if matches!(part.header.blocks, BlockDescription::Tiles(_)) { 16 } else { 4 };
        let from = start + at;
        let size = bytes
            .get(from..from + 4)
            .map(|b| i32::from_le_bytes(b.try_into().unwrap_or_default()))
            .and_then(|size| usize::try_from(size).ok())
            .filter(|&size| bytes.len() - from - 4 >= size);
        let Some(size) = size else {
            return Err(self.damaged("a block of pixels is cut short"));
        };
        bytes.drain(..from + 4);
        bytes.truncate(size);
        Ok(bytes)
    }

    /// The bytes of a chunk and where its coordinates begin; these are checked.
    fn read_chunk(&self, extent: Extent, most: u64) -> FileResult<(usize, Vec<u8>)> {
        let mut bytes = vec![0; extent.room.min(most) as usize];
        self.source
            .read(extent.offset, &mut bytes)
            .map_err(|error| FileError::io(&self.path, "read", error))?;
        let part = &self.parts[extent.part];
        let mut expected = Vec::new();
        if self.version & MULTI_PART != 0 {
            expected.push(extent.part as i32);
        }
        let start = expected.len() * 4;
        expected.extend(coordinates(&part.header, part.chunks[extent.index]));
        let found = bytes.chunks_exact(4).map(|b| i32::from_le_bytes(b.try_into().unwrap_or_default()));
        if bytes.len() < expected.len() * 4 || !expected.iter().copied().eq(found.take(expected.len())) {
            return Err(self.damaged("a block of pixels is not where the file's table says"));
        }
        Ok((start, bytes))
    }

    /// Refuses to go on if the file on disk is not the one that was opened.
    pub fn check_unchanged(&self) -> FileResult<()> {
        if let Source::File { file, modified } = &self.source {
            let file = file.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let data = file.metadata().map_err(|error| FileError::io(&self.path, "read", error))?;
            if data.len() != self.length || data.modified().ok() != *modified {
                return Err(FileError::Mismatch {
                    file: self.path.clone(),
                    reason: "the file was changed while it was in use; run again once it is finished"
                        .to_owned(),
                });
            }
        }
        Ok(())
    }
}

/// What stands before a chunk's size: its row, or its tile and level.
pub(crate) fn coordinates(header: &Header, at: TileCoordinates) -> Vec<i32> {
    let Vec2(x, y) = at.tile_index;
    match header.blocks {
        BlockDescription::Tiles(_) => {
            let Vec2(level_x, level_y) = at.level_index;
            vec![x as i32, y as i32, level_x as i32, level_y as i32]
        }
        BlockDescription::ScanLines => {
            let row = y * header.compression.scan_lines_per_block();
            vec![header.own_attributes.layer_position.y().saturating_add(row as i32)]
        }
    }
}

enum Parse {
    More,
    NotExr,
    Damaged(String),
}

type Headers = (u32, Vec<Vec<RawAttribute>>, usize);

fn parse_headers(bytes: &[u8], limits: &Limits) -> Result<Headers, Parse> {
    let mut at = 0;
    if bytes.len() < 8 || bytes[..4] != MAGIC {
        return Err(Parse::NotExr);
    }
    let version = u32::from_le_bytes(bytes[4..8].try_into().unwrap_or_default());
    at += 8;
    let mut parts = Vec::new();
    loop {
        let attributes = parse_header(bytes, &mut at)?;
        if attributes.is_empty() {
            // An empty header ends the list of a file with several parts.
            if version & MULTI_PART == 0 || parts.is_empty() {
                return Err(Parse::Damaged("the header is empty".to_owned()));
            }
            return Ok((version, parts, at));
        }
        parts.push(attributes);
        if version & MULTI_PART == 0 {
            return Ok((version, parts, at));
        }
        if parts.len() > limits.max_parts {
            return Err(Parse::Damaged(format!(
                "it has more than {} parts; {RAISE_THE_LIMIT}",
                limits.max_parts
            )));
        }
    }
}

fn parse_header(bytes: &[u8], at: &mut usize) -> Result<Vec<RawAttribute>, Parse> {
    let mut attributes = Vec::new();
    loop {
        let name = parse_name(bytes, at)?;
        if name.is_empty() {
            return Ok(attributes);
        }
        let kind = parse_name(bytes, at)?;
        let size = bytes.get(*at..*at + 4).ok_or(Parse::More)?;
        let size = i32::from_le_bytes(size.try_into().unwrap_or_default());
        let Ok(size) = usize::try_from(size) else {
            return Err(Parse::Damaged(format!("the attribute '{}' has a negative size", printable(&name))));
        };
        *at += 4;
        let value = at.checked_add(size).and_then(|end| bytes.get(*at..end)).ok_or(Parse::More)?;
        *at += size;
        attributes.push(RawAttribute { name, kind, bytes: value.to_vec() });
    }
}

/// A text that ends with a zero; names have at most 255 bytes.
fn parse_name(bytes: &[u8], at: &mut usize) -> Result<String, Parse> {
    let rest = bytes.get(*at..).ok_or(Parse::More)?;
    let shown = &rest[..rest.len().min(256)];
    match shown.iter().position(|&byte| byte == 0) {
        Some(length) => {
            *at += length + 1;
            Ok(latin1(&rest[..length]))
        }
        None if rest.len() < 256 => Err(Parse::More),
        None => Err(Parse::Damaged("an attribute's name does not end".to_owned())),
    }
}

/// What must hold before pixels are looked for. The crate's own check also refuses sub-sampled channels, which
/// are carried along here.
fn check_header(header: &Header) -> Result<(), String> {
    for window in [header.data_window(), header.shared_attributes.display_window] {
        guarded(|| window.validate(None))?;
    }
    let channels = &header.channels.list;
    if channels.is_empty() {
        return Err("it has no channels".to_owned());
    }
    if channels.iter().any(|channel| channel.sampling.x() == 0 || channel.sampling.y() == 0) {
        return Err("a channel's sampling is 0".to_owned());
    }
    if channels.windows(2).any(|pair| pair[0].name >= pair[1].name) {
        return Err("its channels are not in alphabetical order, each once".to_owned());
    }
    Ok(())
}

/// What must hold before the `exr` crate computes with a header's values.
fn check_headers(path: &Path, parts: &[Vec<RawAttribute>], limits: &Limits) -> FileResult<()> {
    let mut channels = 0;
    for attributes in parts {
        for attribute in attributes {
            match (attribute.name.as_str(), attribute.kind.as_str()) {
                ("dataWindow", "box2i") => {
                    let b: Vec<i64> = attribute
                        .bytes
                        .chunks_exact(4)
                        .map(|b| i64::from(i32::from_le_bytes(b.try_into().unwrap_or_default())))
                        .collect();
                    if b.len() != 4 || b[2] < b[0] || b[3] < b[1] {
                        return Err(FileError::damaged(path, "the data window is empty"));
                    }
                    let area = ((b[2] - b[0] + 1) as u64).saturating_mul((b[3] - b[1] + 1) as u64);
                    FileError::check_limit(path, "the number of pixels", area, limits.max_pixels)?;
                }
                ("channels", "chlist") => {
                    // A name, its zero, and 16 bytes each.
                    let mut rest = attribute.bytes.as_slice();
                    while let Some(length) = rest.iter().position(|&byte| byte == 0).filter(|&n| n > 0) {
                        channels += 1;
                        rest = rest.get(length + 17..).unwrap_or_default();
                    }
                }
                _ => {}
            }
        }
    }
    FileError::check_limit(path, "the number of channels", channels, limits.max_channels as u64)
}
