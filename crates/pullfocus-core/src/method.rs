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
    /// Every pixel is spread over the lens's aperture ([`crate::Aperture`]), as spans of rows on the level of a pyramid
    /// ([`crate::spans`]). The cost is the same for every circle.
    Aperture,
}

impl Method {
    /// Every method.
    pub const ALL: [Self; 7] = [
        Self::Diffusion,
        Self::Naive,
        Self::Gather,
        Self::Square,
        Self::Pyramid,
        Self::Tensor,
        Self::Aperture,
    ];

    /// Whether [`Psf`] is this method's to choose.
    pub fn has_psf(self) -> bool {
        matches!(self, Self::Naive | Self::Gather)
    }

    /// Refuses the methods that GPUs do not have: all but diffusion and the aperture.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub fn expect_on_gpu(self) -> Result<()> {
        if matches!(self, Self::Diffusion | Self::Aperture) {
            return Ok(());
        }
        Err(Error::Unsupported {
            what: "this method",
            reason: "GPUs have diffusion and the aperture only; take the device cpu, or one of these",
        })
    }
}

/// How finely [`Method::Pyramid`] draws (third paper, 5.1: finer levels have more control, coarser ones are faster).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quality {
    /// Gaussians of 15 x 15 cells or less.
    #[default]
    Standard,
    /// One level finer: up to 31 x 31 cells, at some four times the cost.
    Fine,
}

/// What [`Method::Pyramid`] does with sizes between two of its levels (third paper, 5.1), in the words of mipmaps, which it runs in
/// reverse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mipmap {
    /// Both levels have a share, which goes over smoothly from one to the next: the paper's first choice.
    #[default]
    Linear,
    /// The finer level alone, with a larger Gaussian: the paper's second choice. Quicker for the fifth of all sizes that otherwise have
    /// two levels; the picture jumps where a growing circle comes to the next level.
    Nearest,
}

/// The point spread function of [`Method::Naive`] and [`Method::Gather`]: the shape of a point of light whose circle of
/// confusion has the diameter c.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Psf {
    /// A Gaussian of standard deviation c / 4, a disc's ([`crate::psf::discrete_gaussian`]), cut at four deviations and a pixel.
    #[default]
    Gaussian,
    /// The aperture ([`crate::Aperture`]), evenly bright; its rim falls to 0 over one pixel.
    Aperture,
}

impl Psf {
    /// Refuses shapes that `method` does not have.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub fn check(self, method: Method) -> Result<()> {
        if self != Self::Gaussian && !method.has_psf() {
            return Err(Error::Unsupported {
                what: "a psf other than Gaussian",
                reason: "only the methods naive and gather have a choice of psf; pyramid and tensor are Gaussian, square a square",
            });
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
            assert_eq!(Psf::Aperture.check(method).is_ok(), method.has_psf(), "{method:?}");
        }
    }

    #[test]
    fn gpus_say_which_methods_they_have() {
        for method in Method::ALL {
            let there = [Method::Diffusion, Method::Aperture].contains(&method);
            assert_eq!(method.expect_on_gpu().is_ok(), there);
        }
    }
}
