//! Sequences: which files belong to which frame.
//!
//! A [`Pattern`] is a file name with one place for the frame number: `shot.####.exr`, `shot.@@@@.exr` (as many
//! digits as signs) or `shot.%04d.exr`. [`Frames`] are written `1001-1100x2` or `1,3,5-9`. [`plan`] puts both
//! together with the files that go beside each frame (foreground, behind, depth) and the output's name.

mod frames;
mod pattern;
mod plan;

pub use frames::{Frames, LARGEST_FRAME, MOST_FRAMES};
pub use pattern::{Pattern, number_in};
pub use plan::{FrameFiles, Request, plan};
