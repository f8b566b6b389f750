//! The vocabulary of pullfocus.
//!
//! The data's way is one sentence, and each noun in it is a module here:
//!
//! > [`picture`] + [`depth`] + [`camera`] → [`coc`] (circle of confusion) → [`layers`] → [`method`]
//! > ([`diffusion`], or spreading with a [`psf`]) → composite
//!
//! This crate holds types, formulas and settings. It does no input or output, starts no threads and
//! knows no GPU; `pullfocus-cpu` (and a GPU twin beside it) do the work, and both take the same
//! settings. Units are stated at every field: distances in metres, focal length and sensor in
//! millimetres, circles of confusion as a **signed diameter in pixels, positive behind focus**.

pub mod aperture;
pub mod bokeh;
pub mod camera;
pub mod cancel;
pub mod coc;
pub mod depth;
pub mod diffusion;
pub mod error;
pub mod focus;
pub mod frame;
pub mod layers;
pub mod method;
pub mod picture;
pub mod plane;
pub mod psf;
pub mod pull;
pub mod pyramid;
pub mod report;
pub mod response;
pub mod scene;
pub mod scheme;
pub mod sensor;
pub mod settings;
pub mod size;
pub mod spans;
pub mod split;
pub mod srgb;
pub mod tensor;

pub use aperture::{Aperture, ApertureShape};
pub use bokeh::Bokeh;
pub use camera::{Camera, Lens};
pub use cancel::Cancel;
pub use coc::{CocFormula, CocSettings};
pub use depth::{DepthDecoding, DepthKind};
pub use diffusion::{Diffusion, Integrator, Solver};
pub use error::{Error, Result};
pub use frame::{Frame, Window};
pub use layers::{Layering, Show};
pub use method::{Method, Mipmap, Psf, Quality};
pub use picture::Picture;
pub use plane::Plane;
pub use report::Report;
pub use scene::{Distance, Element, Scene};
pub use settings::{Preset, Settings, Storage};
pub use size::Size;
pub use tensor::Tensor;
