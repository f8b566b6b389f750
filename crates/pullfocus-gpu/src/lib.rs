//! The GPU pipeline: image + depth + camera → circle of confusion → layers → diffusion → composite, as compute passes.

mod coc;
mod context;
mod diffusion;
mod embed;
mod host;
#[doc(hidden)]
pub mod inside;
mod layers;
mod measure;
mod memory;
mod pipeline;
mod planes;
mod recorder;
mod shader;
mod textures;
mod timer;
mod transfer;
#[cfg(test)]
mod walk;
mod work;

pub use context::Context;
pub use diffusion::Tuning;
pub use embed::{Buffers, Depth, FrameSettings, Inputs, Picture};
pub use host::{AdapterInfo, AdapterKind, Choice, Host, adapters};
pub use measure::Timing;
pub use planes::Storage;
pub use timer::Timer;
