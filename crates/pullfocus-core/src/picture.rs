//! Colour: any number of linear, premultiplied planes and perhaps alpha.

use crate::error::Result;
use crate::plane::Plane;
use crate::size::Size;

/// Colours beyond this are cut to it. No light is so bright (the sun itself is some 1e5 times a sunlit wall), but markers in files are:
/// their squares, and sums of those over any line of any picture, stay finite in f32, and what stands beside them keeps its last digits
/// in sums of 64 bits.
pub const LARGEST: f32 = 1e9;

/// Colour planes of one size that all go through the same lens.
///
/// Values are linear light, premultiplied by alpha, of any range; alpha 0 beside colour other than 0 is
/// legal (emission). Usually three planes, R, G, B; light groups and other passes that share the lens are
/// further planes. Alpha is blurred as one more colour: it is *not* the coverage of a layer.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Picture {
    /// The colour planes.
    pub colors: Vec<Plane>,
    /// Alpha, 0 to 1, where the picture has one.
    pub alpha: Option<Plane>,
}

impl Picture {
    /// A picture without alpha.
    pub fn opaque(colors: Vec<Plane>) -> Self {
        Self { colors, alpha: None }
    }

    /// Width and height; zero for a picture without planes.
    pub fn size(&self) -> Size {
        self.planes().next().map_or(Size::default(), Plane::size)
    }

    /// The colour planes, then alpha.
    pub fn planes(&self) -> impl Iterator<Item = &Plane> {
        self.colors.iter().chain(&self.alpha)
    }

    /// The colour planes, then alpha.
    pub fn planes_mut(&mut self) -> impl Iterator<Item = &mut Plane> {
        self.colors.iter_mut().chain(&mut self.alpha)
    }

    /// Refuses planes that differ in size.
    ///
    /// # Errors
    /// [`crate::Error::SizeMismatch`] with the first plane that differs from the first one.
    pub fn check(&self) -> Result<()> {
        let size = self.size();
        for plane in &self.colors {
            plane.expect_size("a colour plane", size)?;
        }
        self.alpha.as_ref().map_or(Ok(()), |alpha| alpha.expect_size("the alpha plane", size))
    }
}
