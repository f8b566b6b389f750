//! Lens blur (depth of field) for pictures that were rendered or shot in perfect focus.
//!
//! This crate is the front door: the vocabulary of `pullfocus-core` and a [`Renderer`].

pub use pullfocus_core::*;
pub use pullfocus_cpu::Renderer;
