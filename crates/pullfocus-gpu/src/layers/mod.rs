//! Layers: the picture taken apart by its circle of confusion, blurred, and put together again.

mod background;
mod fill;
mod foreground;
mod over;

pub use background::blur_over_background;
pub use foreground::blur_element_over;
