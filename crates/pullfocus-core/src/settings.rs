//! Everything that a user can choose about a blur, beside the camera.

use crate::aperture::{Aperture, ApertureShape};
use crate::bokeh::Bokeh;
use crate::coc::CocSettings;
use crate::diffusion::{Diffusion, Integrator};
use crate::error::Result;
use crate::layers::{Layering, Show};
use crate::method::{Method, Mipmap, Psf, Quality};
use crate::tensor::Tensor;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// The settings of a render; the same for every backend. The default is general layers by diffusion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Settings {
    /// What is done to the circle of confusion beside the lens.
    pub coc: CocSettings,
    /// Which layers the picture is taken apart into.
    pub layering: Layering,
    /// Whether all of these layers are laid down, or one alone.
    pub show: Show,
    /// Which method blurs a layer.
    pub method: Method,
    /// The shape of a point of light, where the method has a choice.
    pub psf: Psf,
    /// The lens's aperture, where a method has its shape.
    pub aperture: Aperture,
    /// Bright lights out of focus spread in the aperture's shape, whatever the method; none if not given.
    pub bokeh: Option<Bokeh>,
    /// How finely the pyramid draws.
    pub quality: Quality,
    /// What the pyramid does between two levels.
    pub mipmap: Mipmap,
    /// How the tensor filter blurs a layer.
    pub tensor: Tensor,
    /// How diffusion blurs a layer.
    pub diffusion: Diffusion,
    /// Mend anti-aliased depth before it is used.
    pub repair_depth: bool,
}

/// How a GPU keeps planes in its memory. The CPU's are f32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Storage {
    /// f32.
    #[default]
    Full,
    /// f16: half the bytes; sums and systems are still f32. Circles of confusion and planes that stand alone stay f32.
    Half,
}

/// Settings by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The first paper's two layers and one backward-Euler step: fast, for choosing focus and f-stop.
    Preview,
    /// General layers, spread over the aperture: the picture to keep, on every device.
    #[default]
    Final,
}

impl Settings {
    /// The shape that the method spreads. A picture is no span: with [`Method::Aperture`] highlights have it, where there are any, and
    /// the rest a disc, as high.
    pub fn spread_aperture(&self) -> Cow<'_, Aperture> {
        match self.aperture.shape {
            ApertureShape::Image(_) if self.bokeh.is_some() && self.method == Method::Aperture => {
                Cow::Owned(Aperture { squeeze: self.aperture.squeeze, ..Aperture::DISC })
            }
            _ => Cow::Borrowed(&self.aperture),
        }
    }

    /// The settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        match preset {
            Preset::Final => Self { method: Method::Aperture, ..Self::default() },
            Preset::Preview => Self {
                layering: Layering::PAPER,
                diffusion: Diffusion {
                    integrator: Integrator::BackwardEuler { steps: 1 },
                    ..Diffusion::default()
                },
                ..Self::default()
            },
        }
    }

    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`crate::Error::Setting`]; [`crate::Error::Unsupported`] for a PSF that the method does not have.
    pub fn check(&self) -> Result<()> {
        self.coc.check()?;
        self.layering.check()?;
        self.psf.check(self.method)?;
        self.aperture.check()?;
        self.tensor.check()?;
        self.bokeh.as_ref().map_or(Ok(()), Bokeh::check)?;
        self.diffusion.check()
    }
}
