//! Which method blurs a layer, and the shape that the spreading methods give to a point of light.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// How a layer is blurred by its circles of confusion. Fills are diffusion's, whatever the method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The heat equation (first paper); its settings are [`crate::Settings::diffusion`].
    #[default]
    Diffusion,
    /// Every pixel is spread over its circle of confusion, one after the other (third paper, 3.1; Potmesil, Chakravarty
    /// 1982). The cost grows with the circle's area.
    Naive,
    /// Every pixel of the result is an average over its own circle of confusion (third paper, 3.2): the transpose of
    /// [`Method::Naive`]. The cost grows with the circle's area.
    Gather,
    /// Every pixel is spread over a square with the disc's variance, by its corners (Kosloff, Tao, Barsky 2009). The cost is the
    /// same for every circle.
    Square,
    /// Every pixel is spread over a Gaussian with the disc's variance, as a small one on the level of a pyramid (third paper,
    /// section 5). The cost is the same for every circle.
    Pyramid,
    /// Sites that lie farther apart the larger the blur: each gathers an average and spreads it as a Gaussian (third paper, section
    /// 6); its settings are [`crate::Settings::tensor`].
    Tensor,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 6] =
        [Self::Diffusion, Self::Naive, Self::Gather, Self::Square, Self::Pyramid, Self::Tensor];

    /// Whether [`Psf`] is this method's to choose.
    pub fn has_psf(self) -> bool {
        matches!(self, Self::Naive | Self::Gather)
    }

    /// Refuses what only a device without the spreading methods has to refuse: anything but diffusion.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub fn expect_diffusion(self) -> Result<()> {
        if self == Self::Diffusion {
            return Ok(());
        }
        Err(Error::Unsupported {
            what: "a method other than diffusion",
            reason: "this device has diffusion only; take the device cpu, or the method diffusion",
        })
    }
}

/// How finely [`Method::Pyramid`] draws (third paper, 5.1: finer levels have more control, coarser ones are faster).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// Gaussians of 13 x 13 cells or less.
    #[default]
    Standard,
    /// One level finer: up to 27 x 27 cells, at some four times the cost.
    Fine,
}

/// The point spread function of [`Method::Naive`] and [`Method::Gather`]: the shape of a point of light whose circle of
/// confusion has the diameter c. Each has the variance of a uniform disc of diameter c along each axis, c^2 / 16.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Psf {
    /// A Gaussian of standard deviation c / 4 ([`crate::psf::discrete_gaussian`]), cut at four deviations and a pixel.
    #[default]
    Gaussian,
    /// A uniform disc of diameter c; its rim falls to 0 over one pixel.
    Disc,
    /// A uniform regular polygon, the image of an iris, with the same rim.
    Blades {
        /// Number of corners, [`LEAST_BLADES`] to [`MOST_BLADES`].
        count: u32,
        /// The first corner's direction in degrees from the right, clockwise in the picture.
        rotation_degrees: f64,
    },
}

/// A triangle is the least polygon.
pub const LEAST_BLADES: u32 = 3;
/// Beyond this a polygon is a disc.
pub const MOST_BLADES: u32 = 32;

impl Psf {
    /// Refuses values outside their ranges, and shapes that `method` does not have.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Unsupported`].
    pub fn check(self, method: Method) -> Result<()> {
        if self != Self::Gaussian && !method.has_psf() {
            return Err(Error::Unsupported {
                what: "a psf other than Gaussian",
                reason: "only the methods naive and gather have a choice of psf; pyramid and tensor are Gaussian, square a square",
            });
        }
        let Self::Blades { count, rotation_degrees } = self else { return Ok(()) };
        if !(LEAST_BLADES..=MOST_BLADES).contains(&count) {
            let value = f64::from(count);
            return Err(Error::Setting { name: "blades", value, reason: "must lie between 3 and 32" });
        }
        if !rotation_degrees.is_finite() {
            let name = "rotation of the blades";
            return Err(Error::Setting { name, value: rotation_degrees, reason: "must be a number" });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_psf_needs_a_method_that_has_one() {
        for method in Method::ALL {
            assert_eq!(Psf::Gaussian.check(method), Ok(()));
            assert_eq!(Psf::Disc.check(method).is_ok(), method.has_psf(), "{method:?}");
        }
        for (count, fits) in [(2, false), (3, true), (32, true), (33, false)] {
            let blades = Psf::Blades { count, rotation_degrees: 10.0 };
            assert_eq!(blades.check(Method::Naive).is_ok(), fits, "{count}");
        }
        let odd = Psf::Blades { count: 5, rotation_degrees: f64::NAN };
        assert!(matches!(odd.check(Method::Gather), Err(Error::Setting { .. })));
    }

    #[test]
    fn a_device_with_diffusion_only_says_so() {
        for method in Method::ALL {
            assert_eq!(method.expect_diffusion().is_ok(), method == Method::Diffusion);
        }
    }
}
