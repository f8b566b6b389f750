//! The commands, one module each.

pub mod bench;
pub mod camera;
pub mod coc;
pub mod compare;
pub mod demo;
pub mod devices;
pub mod inspect;
pub mod render;
pub mod view;
