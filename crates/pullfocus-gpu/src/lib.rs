//! The GPU pipeline: image + depth + camera → circle of confusion → layers → method → composite, as compute passes
//! through `wgpu`; the same settings and, up to rounding, the same picture as on the CPU.
//!
//! Two ways in:
//!
//! - **Embedded**: [`Context::record`] takes the caller's device, textures and encoder, and never waits. Types by how long
//!   they live: [`Context`] (pipelines), [`Buffers`] (one picture size), [`FrameSettings`] (one frame).
//! - **Hosted**: [`Host`] opens a device and renders scenes of planes in memory.
//!
//! ```no_run
//! use pullfocus_core::{Camera, DepthDecoding, Frame, Lens, Preset, Settings, Size};
//! use pullfocus_gpu::{Buffers, Context, Depth, FrameSettings, Inputs, Picture, Storage};
//!
//! # fn engine(
//! #     device: wgpu::Device, queue: wgpu::Queue, color: wgpu::TextureView, depth: wgpu::TextureView,
//! #     output: wgpu::TextureView,
//! # ) -> pullfocus_core::Result<()> {
//! let size = Size::new(1920, 1080);
//! let context = Context::new(&device, &queue);
//! let mut buffers = Buffers::new(&context, size, Storage::Half)?;
//!
//! // A reversed-Z buffer with an infinite far plane, and the near plane at 0.1 m.
//! let depth = Depth { view: &depth, decoding: Some(DepthDecoding::hardware(0.0, 0.1)) };
//! let base = Picture { color: &color, alpha: false, depth };
//! let inputs = Inputs { base, foreground: None, output: &output, output_format: None };
//! let settings = Settings::preset(Preset::Preview);
//!
//! // Each frame; the focus may be another one every time.
//! let lens = Lens::Physical { focal_length_mm: 50.0, f_stop: 2.0, sensor_width_mm: 36.0 };
//! let camera = Camera::new(lens, 2.5)?;
//! let frame = FrameSettings { frame: Frame::full(size), camera: Some(&camera), settings: &settings };
//! let mut encoder = device.create_command_encoder(&Default::default());
//! context.record(&mut encoder, &mut buffers, &inputs, &frame, None)?;
//! queue.submit([encoder.finish()]);
//! # Ok(())
//! # }
//! ```
//!
//! `docs/methods/gpu.md` in the project has the memory, the passes and what they cost.

#[cfg(test)]
mod barriers;
mod bokeh;
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
mod spreading;
mod textures;
mod timer;
mod transfer;
mod unroll;
#[cfg(test)]
mod walk;
mod work;

pub use context::Context;
pub use diffusion::Tuning;
pub use embed::{Buffers, Depth, FrameSettings, Inputs, Picture};
pub use host::{AdapterInfo, AdapterKind, Choice, Host, adapters};
pub use measure::Timing;
pub use planes::Storage;
pub use timer::{Timer, Times};
