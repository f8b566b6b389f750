//! From pictures in memory to what is on the screen.

mod cube;
mod display;
mod texture;

pub use display::{Area, Display, Kind, Paint, Side, Transform};
pub use texture::{Texture, distances, from_picture, from_srgb, full_precision};
