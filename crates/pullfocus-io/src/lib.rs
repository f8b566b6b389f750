//! Picture files for pullfocus: OpenEXR, PNG, JPEG, TIFF, HDR, PFM and sequences.
//!
//! [`Document`] is an OpenEXR file: [`Document::select`] takes the colour, depth and camera out of it that one
//! render needs, [`Document::write_to`] puts blurred planes back and leaves everything else as it was.
//! Limits ([`Limits`]) are checked before memory is taken for anything whose size a file states.
//!
//! ```no_run
//! use pullfocus_io::{Document, Limits, Selection};
//!
//! let document = Document::open("frame.1001.exr", &Limits::default())?;
//! let mut selected = document.select(&Selection::default())?;
//! for plane in selected.picture.planes_mut() {
//!     // Blur it.
//! }
//! document.write("blurred.1001.exr", &selected.channels, &selected.picture)?;
//! # Ok::<(), pullfocus_io::FileError>(())
//! ```

pub mod align;
pub mod camera_file;
pub mod error;
pub mod exr;
pub mod images;
pub mod limits;
pub mod output;
pub mod sequence;

pub use align::{align_element, align_plane};
pub use error::{FileError, FileResult};
pub use exr::{
    AttributeValue, Channels, Contents, Document, Found, FoundCamera, NamedPlane, SampleType, Selected,
    SelectedDepth, Selection, write_exr,
};
pub use limits::Limits;
