//! What can go wrong in a comparison.

use pullfocus_core::Size;

/// A result whose error is [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Why two pictures cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The pictures differ in size, or memory cannot be had.
    #[error(transparent)]
    Core(#[from] pullfocus_core::Error),
    /// There is no pixel to compare.
    #[error("the pictures to compare are empty; give pictures of at least one pixel")]
    Empty,
    /// A picture that is neither grey nor RGB.
    #[error(
        "a picture of {found} colour planes cannot be shown; choose one (grey) or three (R, G, B) of them"
    )]
    Planes {
        /// The number of colour planes.
        found: usize,
    },
    /// SSIM's window does not fit.
    #[error(
        "SSIM looks through a window of 11 x 11 pixels, and the picture is only {size}; use PSNR or FLIP"
    )]
    TooSmall {
        /// The pictures' size.
        size: Size,
    },
    /// FLIP's viewing distance makes no sense.
    #[error("{value} pixels per degree is no viewing distance; give 1 to 1000 (67 is a usual desk)")]
    PixelsPerDegree {
        /// The value given.
        value: f32,
    },
}
