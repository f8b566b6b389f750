//! The interactive program of pullfocus: a director of photography chooses focus and f-stop on the picture and pulls focus through a
//! shot.

pub mod clip;
pub mod color;
pub mod document;
pub mod engine;
pub mod export;
pub mod framing;
pub mod histogram;
pub mod loader;
mod locked;
pub mod look;
pub mod opening;
pub mod proxy;
pub mod screen;
pub mod session;
pub mod ui;
pub mod window;
