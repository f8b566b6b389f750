//! The GPU pipeline: image + depth + camera → circle of confusion → layers → diffusion → composite, as compute passes.

mod context;
mod diffusion;
mod host;
mod layers;
mod memory;
mod planes;
mod recorder;
mod shader;
mod timer;
mod transfer;
mod work;

pub use context::Context;
pub use diffusion::Tuning;
pub use host::{AdapterInfo, AdapterKind, Choice, Host, adapters};
pub use planes::Storage;
pub use timer::Timer;
