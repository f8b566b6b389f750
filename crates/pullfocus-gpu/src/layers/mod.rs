//! Layers: the picture taken apart by its circle of confusion, blurred, and put together again.

mod alone;
mod background;
mod census;
mod edges;
mod fill;
mod foreground;
mod general;
mod joint;
mod over;
#[cfg(test)]
mod tests;

pub use alone::{Count, clear, leave};
pub use background::{blur_over_background, one_over_background};
pub use census::{SPLIT_BYTES, split};
pub use foreground::{blur_element_over, show_element};
pub use general::{blur_layers, composite, take_apart};
pub use over::cover_part;

use crate::shader::{Part, part};

/// Constants of core and the scale of layers.
fn scale_parts() -> [Part; 2] {
    [part!("layers/constants"), part!("layers/scale")]
}
