//! OpenEXR files.
//!
//! [`Document`] holds an open file and its header; pixels stay in the file. [`Document::select`] decodes the
//! channels that one render needs, [`Document::write_to`] goes through the file a second time, replaces the
//! blurred channels block by block and copies the rest: other parts byte for byte, other channels of the same
//! part value for value, all attributes in their order.
//!
//! **Memory.** Beside the planes that [`Selected`] holds (4 bytes a pixel and plane) both passes need a few
//! blocks of pixels at a time: about 64 MiB, or one block per thread where blocks are larger. A picture of
//! 16384 x 16384 RGBA and Z is 5 GiB of planes and nothing else.
//!
//! **Read**: scan lines and tiles, all levels kept and the largest one used; every compression that the `exr`
//! crate decodes (none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB); half, float and uint; layers,
//! parts, views; any data window. **Written**: in the input's own compression where that is lossless, else
//! ZIP, and only in parts with blurred channels; the rest keeps its compressed bytes. Smaller levels of a
//! blurred channel are box-filtered from the blurred one.
//!
//! Not supported, with an error that says so: deep parts as what is blurred (they are carried along), channels
//! of which only some pixels are stored (luminance/chroma files), HTJ2K compression.

mod camera;
mod choice;
mod container;
mod contents;
mod document;
mod names;
mod pixels;
mod selection;
mod simple;
mod text;
mod write;

pub use camera::{Found, FoundCamera};
pub use contents::{
    AttributeContents, ChannelContents, Contents, DepthContents, LayerContents, PartContents, WindowContents,
};
pub use document::Document;
pub use selection::{ChannelSource, Channels, NamedPlane, SampleType, Selected, SelectedDepth, Selection};
pub use simple::{AttributeValue, write_exr};
