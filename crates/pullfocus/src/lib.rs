//! Lens blur (depth of field) for pictures that were rendered or shot in perfect focus.
//!
//! This crate is the front door: the vocabulary of `pullfocus-core`, and a [`Renderer`] on the [`Device`] that one
//! chooses. The feature `gpu`, on by default, brings in the GPU.

mod device;
mod renderer;

pub use device::{Device, DeviceInfo, DeviceKind, ParseDeviceError, devices};
pub use pullfocus_core::*;
pub use renderer::Renderer;
