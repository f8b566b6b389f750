//! What to take out of a file, and what was taken.

use crate::exr::camera::FoundCamera;
use pullfocus_core::{Frame, Picture, Plane, Window};
use serde::Serialize;

/// How a channel's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SampleType {
    /// 16-bit floating point, up to 65504.
    Half,
    /// 32-bit floating point.
    Float,
    /// 32-bit unsigned integer.
    Uint,
}

impl SampleType {
    /// Bytes of one value.
    pub fn bytes(self) -> usize {
        if self == Self::Half { 2 } else { 4 }
    }
}

/// What to take out of a file. The default takes what a file itself suggests.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Selection {
    /// The view of a multi-view file ("left"); none takes the file's default view.
    pub view: Option<String>,
    /// The part by name or number (from 0); none looks in all parts. Names of channels mean that part's channels unless they say
    /// another one ("part:Z").
    pub part: Option<String>,
    /// Layers to be blurred with the one lens, by name or pattern (`*` and `?`); empty takes the beauty alone.
    /// The unnamed layer (channels `R`, `G`, `B`) is called `rgba`; a channel's full name takes that channel.
    pub layers: Vec<String>,
    /// The depth channel ("Z", "depth.Z", "VRayZDepth.R"; "part:Z" where several parts have one); none looks
    /// for the usual names.
    pub depth_channel: Option<String>,
    /// A channel that holds signed diameters of the circle of confusion in pixels, in place of depth.
    pub coc_channel: Option<String>,
    /// Grow the planes to the display window where the data window is smaller: transparent black, nothing
    /// there. Right for an element with alpha that the renderer cropped; writing crops again.
    pub cover_display: bool,
    /// Leave depth alone, for a second file or a conversion.
    pub without_depth: bool,
    /// Where no layers are named and the file has no colour, take its depth or circle of confusion alone.
    pub color_optional: bool,
}

/// A plane and the name that it has in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedPlane {
    /// The channel's name, with "part:" before it in a file of several parts.
    pub name: String,
    /// Its values as the file holds them.
    pub plane: Plane,
}

/// Depth without a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct SelectedDepth {
    /// Where its pixels lie.
    pub frame: Frame,
    /// Depth as the file holds it.
    pub depth: NamedPlane,
    /// What the file's attributes say about the camera.
    pub camera: FoundCamera,
}

/// Where a plane came from, and where it goes back to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelSource {
    /// Index of the part.
    pub part: usize,
    /// Index of the channel in the part.
    pub channel: usize,
    /// The channel's full name.
    pub name: String,
    /// How the file stores it.
    pub sample_type: SampleType,
}

/// Where the planes of a [`Picture`] came from: one entry per plane, in its order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channels {
    /// The colour planes' sources.
    pub colors: Vec<ChannelSource>,
    /// Alpha's source.
    pub alpha: Option<ChannelSource>,
    /// The window that the planes have.
    pub window: Window,
}

impl Channels {
    /// All sources: colours, then alpha.
    pub fn all(&self) -> impl Iterator<Item = &ChannelSource> {
        self.colors.iter().chain(&self.alpha)
    }
}

/// What one render needs of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Selected {
    /// Where the pixels lie.
    pub frame: Frame,
    /// The chosen colour channels as linear, premultiplied planes. Three planes R, G, B of the beauty come
    /// first; then those of further layers, in the order in which they were asked for. The first layer's
    /// alpha is the picture's; another layer's alpha is a colour plane of its own.
    pub picture: Picture,
    /// Where each plane came from: needed for writing.
    pub channels: Channels,
    /// Depth as the file holds it, of the picture's size; infinity where its part has no pixels.
    pub depth: Option<NamedPlane>,
    /// The circle of confusion that was asked for, of the picture's size; 0 where its part has no pixels.
    pub coc: Option<NamedPlane>,
    /// What the file's attributes say about the camera.
    pub camera: FoundCamera,
    /// The view that was taken, in a file that has views.
    pub view: Option<String>,
}
