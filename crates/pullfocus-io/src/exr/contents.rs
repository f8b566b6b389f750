//! What is in a file, for people and for machines.

use crate::exr::camera::FoundCamera;
use crate::exr::container::{Part, RawAttribute};
use crate::exr::names::Catalogue;
use crate::exr::selection::SampleType;
use crate::exr::text::{printable, shown, texts};
use exr::compression::Compression;
use exr::meta::BlockDescription;
use exr::meta::attribute::{LevelMode, LineOrder};
use pullfocus_core::Window;
use serde::Serialize;

/// What is in a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// The file's path.
    pub file: String,
    /// The views, the default one first; empty for a file with one eye.
    pub views: Vec<String>,
    /// The parts, in the file's order.
    pub parts: Vec<PartContents>,
    /// The layer that is blurred when none is chosen, as [`crate::Selection::layers`] would name it.
    pub beauty: Option<String>,
    /// The depth channel that is taken when none is chosen.
    pub depth_channel: Option<String>,
    /// Channels that may hold depth, with their values; empty unless pixels were read.
    pub depth: Vec<DepthContents>,
    /// What the attributes say about the camera.
    pub camera: FoundCamera,
}

/// One part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PartContents {
    /// Its name; files of one part often have none.
    pub name: Option<String>,
    /// Its view.
    pub view: Option<String>,
    /// "scan lines", "tiles", "deep scan lines" or "deep tiles".
    pub kind: &'static str,
    /// Width and height of a tile.
    pub tile_size: Option<[usize; 2]>,
    /// "one level", "mip map" or "rip map".
    pub levels: &'static str,
    /// The compression's name as OpenEXR has it: "ZIP".
    pub compression: &'static str,
    /// Whether the compression loses something for one of the channels.
    pub lossy: bool,
    /// "increasing", "decreasing" or "random".
    pub line_order: &'static str,
    /// What the camera sees.
    pub display_window: WindowContents,
    /// The pixels that are stored.
    pub data_window: WindowContents,
    /// Width over height of a pixel.
    pub pixel_aspect: f32,
    /// Layers with their channels.
    pub layers: Vec<LayerContents>,
    /// All attributes beside those above, in the file's order.
    pub attributes: Vec<AttributeContents>,
}

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct WindowContents {
    /// First column.
    pub x: i32,
    /// First row.
    pub y: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A layer of a part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayerContents {
    /// Its name; empty for channels without one.
    pub name: String,
    /// Its view, where channel names carry one.
    pub view: Option<String>,
    /// Its channels.
    pub channels: Vec<ChannelContents>,
}

/// A channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChannelContents {
    /// The full name.
    pub name: String,
    /// How its values are stored.
    pub sample_type: SampleType,
    /// Every how manyth pixel is stored across and down; [1, 1] is all of them.
    pub sampling: [usize; 2],
}

/// An attribute.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AttributeContents {
    /// Its name.
    pub name: String,
    /// Its type's name: "float".
    pub kind: String,
    /// Its value in words, cut short where it is long.
    pub value: String,
}

/// The values of a channel that may hold depth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DepthContents {
    /// The channel, as [`crate::Selection::depth_channel`] would name it.
    pub channel: String,
    /// Smallest value of pixels where something is there.
    pub min: Option<f32>,
    /// Largest value of pixels where something is there.
    pub max: Option<f32>,
    /// The value in the middle of them.
    pub median: Option<f32>,
    /// The part of pixels that hold 0, 65504, 1e9 and more, infinity or NaN: nothing there.
    pub nothing: f64,
    /// What the numbers probably mean, and the argument that says so.
    pub convention: String,
}

impl From<Window> for WindowContents {
    fn from(window: Window) -> Self {
        Self { x: window.x, y: window.y, width: window.size.width, height: window.size.height }
    }
}

pub(crate) fn compression_name(compression: Compression) -> &'static str {
    match compression {
        Compression::Uncompressed => "none",
        Compression::RLE => "RLE",
        Compression::ZIP1 => "ZIPS",
        Compression::ZIP16 => "ZIP",
        Compression::PIZ => "PIZ",
        Compression::PXR24 => "PXR24",
        Compression::B44 => "B44",
        Compression::B44A => "B44A",
        Compression::DWAA(_) => "DWAA",
        Compression::DWAB(_) => "DWAB",
        Compression::HTJ2K32 => "HTJ2K32",
        Compression::HTJ2K256 => "HTJ2K256",
    }
}

impl PartContents {
    pub(crate) fn of(part: &Part, index: usize, catalogue: &Catalogue) -> Self {
        let header = &part.header;
        let tiles = match header.blocks {
            BlockDescription::Tiles(tiles) => Some(tiles),
            BlockDescription::ScanLines => None,
        };
        let mut layers: Vec<LayerContents> = Vec::new();
        for channel in catalogue.channels.iter().filter(|channel| channel.part == index) {
            let described = &header.channels.list[channel.index];
            let content = ChannelContents {
                name: channel.name.clone(),
                sample_type: channel.sample_type,
                sampling: [described.sampling.x(), described.sampling.y()],
            };
            match layers.iter_mut().find(|l| l.name == channel.layer && l.view == channel.view) {
                Some(layer) => layer.channels.push(content),
                None => layers.push(LayerContents {
                    name: channel.layer.clone(),
                    view: channel.view.clone(),
                    channels: vec![content],
                }),
            }
        }
        Self {
            name: part.text("name"),
            view: part.text("view"),
            kind: match (tiles.is_some(), header.deep) {
                (false, false) => "scan lines",
                (true, false) => "tiles",
                (false, true) => "deep scan lines",
                (true, true) => "deep tiles",
            },
            tile_size: tiles.map(|tiles| [tiles.tile_size.width(), tiles.tile_size.height()]),
            levels: match tiles.map(|tiles| tiles.level_mode) {
                None | Some(LevelMode::Singular) => "one level",
                Some(LevelMode::MipMap) => "mip map",
                Some(LevelMode::RipMap) => "rip map",
            },
            compression: compression_name(header.compression),
            lossy: header
                .channels
                .list
                .iter()
                .any(|channel| !header.compression.is_lossless_for(channel.sample_type)),
            line_order: match header.line_order {
                LineOrder::Increasing => "increasing",
                LineOrder::Decreasing => "decreasing",
                LineOrder::Unspecified => "random",
            },
            display_window: crate::exr::container::window(header.shared_attributes.display_window).into(),
            data_window: part.window().into(),
            pixel_aspect: header.shared_attributes.pixel_aspect,
            layers,
            attributes: part.attributes.iter().filter(|a| !is_structure(&a.name)).map(describe).collect(),
        }
    }
}

/// Attributes that have a field of their own in [`PartContents`].
fn is_structure(name: &str) -> bool {
    matches!(
        name,
        "channels"
            | "chunkCount"
            | "compression"
            | "dataWindow"
            | "displayWindow"
            | "lineOrder"
            | "name"
            | "pixelAspectRatio"
            | "tiles"
            | "type"
            | "view"
    )
}

fn describe(attribute: &RawAttribute) -> AttributeContents {
    const MOST: usize = 200;
    let b = &attribute.bytes;
    let floats = || {
        b.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap_or_default()).to_string()).collect()
    };
    let ints = || {
        b.chunks_exact(4).map(|b| i32::from_le_bytes(b.try_into().unwrap_or_default()).to_string()).collect()
    };
    let doubles = || {
        b.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap_or_default()).to_string()).collect()
    };
    let values: Vec<String> = match attribute.kind.as_str() {
        "string" => vec![shown(b)],
        "stringvector" => texts(b),
        "float" | "v2f" | "v3f" | "m33f" | "m44f" | "box2f" | "chromaticities" => floats(),
        "int" | "v2i" | "v3i" | "box2i" | "keycode" | "rational" | "timecode" => ints(),
        "double" | "v2d" | "v3d" | "m33d" | "m44d" => doubles(),
        _ => vec![format!("{} bytes", b.len())],
    };
    let mut value = values.join(", ");
    if value.chars().count() > MOST {
        value = value.chars().take(MOST).chain("…".chars()).collect();
    }
    AttributeContents { name: printable(&attribute.name), kind: printable(&attribute.kind), value }
}
