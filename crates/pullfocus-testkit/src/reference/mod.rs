//! The methods and the papers' layers in f64.

pub mod bokeh;
pub mod diffusion;
pub mod layers;
pub mod line;
pub mod spreading;
pub mod tensor;

pub use diffusion::{diffuse, links};
pub use line::Line;
