//! How much two pictures differ: PSNR, SSIM and FLIP.
//!
//! All measures take sRGB-encoded planes, red, green and blue, clipped to 0..1, as a viewer would see the
//! pictures: [`display`] makes them from a linear [`pullfocus_core::Picture`]. The reference comes first.
//!
//! ```
//! use pullfocus_core::{Picture, Plane, Size};
//! # fn main() -> Result<(), pullfocus_metrics::Error> {
//! let size = Size::new(64, 48);
//! let grey = |light: f32| Plane::filled(size, light);
//! let reference = pullfocus_metrics::display(&Picture::opaque(vec![grey(0.20)?]))?;
//! let test = pullfocus_metrics::display(&Picture::opaque(vec![grey(0.21)?]))?;
//! assert!(pullfocus_metrics::psnr(&reference, &test)? > 30.0);
//! assert!(pullfocus_metrics::flip(&reference, &test)?.mean < 0.1);
//! # Ok(())
//! # }
//! ```
//!
//! # Values that are no numbers
//! Every measure reads a value below 0 as 0, above 1 (infinity too) as 1, and **NaN as 0**, in both pictures
//! alike, so that one bad pixel does not hide the figure of all others. That could also hide the bad pixel:
//! [`not_finite`] counts them, and whoever shows a figure should ask.
//!
//! # Any number of threads
//! Work is shared out over the caller's rayon pool by rows and summed in the order of the rows, in f64:
//! figures have the same bits for any number of threads.

mod display;
mod error;
mod flip;
mod magma;
mod psnr;
mod ssim;

pub use display::{display, magma, masked_mean, not_finite};
pub use error::{Error, Result};
pub use flip::{DEFAULT_PIXELS_PER_DEGREE, FlipMap, flip, flip_at};
pub use psnr::{psnr, psnr_of, squared_error};
pub use ssim::ssim;

use pullfocus_core::{Plane, Size};

/// The value that all measures read: 0 to 1, NaN as 0.
#[inline]
fn clipped(value: f32) -> f32 {
    // `max` returns the other operand for NaN, where `clamp` would keep it.
    value.max(0.0).clamp(0.0, 1.0)
}

/// The common size of two pictures.
fn common_size(reference: &[Plane; 3], test: &[Plane; 3]) -> Result<Size> {
    let size = reference[0].size();
    for plane in reference {
        plane.expect_size("a plane of the reference", size)?;
    }
    for plane in test {
        plane.expect_size("the picture to compare", size)?;
    }
    if size.area() == 0 { Err(Error::Empty) } else { Ok(size) }
}
