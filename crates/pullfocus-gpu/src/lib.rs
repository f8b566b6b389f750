//! The GPU pipeline: image + depth + camera → circle of confusion → layers → diffusion → composite.

mod host;

pub use host::{AdapterInfo, AdapterKind, Choice, Host, adapters};
