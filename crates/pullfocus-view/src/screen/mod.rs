//! From pictures in memory to what is on the screen.

mod cube;
mod display;
mod texture;

pub use display::{Display, Kind, Paint, Transform};
pub use texture::{Texture, distances, from_picture, from_srgb, full_precision};
