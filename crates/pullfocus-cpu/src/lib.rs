//! The CPU pipeline: image + depth + camera → circle of confusion → layers → method → composite.
//!
//! Work runs on the rayon pool in which it is called: inside `ThreadPool::install` that is the caller's own.
//! Results are the same bytes for any number of threads.

pub mod bokeh;
mod coc;
mod depth_repair;
pub mod diffusion;
mod layers;
mod pipeline;
mod pool;
mod rows;
pub mod spreading;
mod wide;
mod work;

pub use pipeline::Renderer;
