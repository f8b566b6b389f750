//! How a picture is taken apart by its circle of confusion before it is blurred.

pub mod fill;
pub mod general;

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which layers are made out of one picture with depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Layering {
    /// One layer, diffused, and nothing else (first paper, section 3).
    Single,
    /// The midground over background layers, so that far things blur behind sharp ones (first paper, 3.1).
    Background {
        /// Number of background layers, on a logarithmic scale of thresholds; the paper's choice is 1.
        layers: u32,
        /// Diameter in widths of the display window from which on a pixel wholly belongs to the (first)
        /// background layer; the matte ramps from 0 at diameter 0.
        threshold: f64,
    },
    /// Layers through the whole depth, near ones included, each filled where nearer ones hide it.
    General {
        /// Number of layers, at least 1.
        layers: u32,
    },
}

/// The most layers that can be asked for: each costs as much as several single-layer blurs.
pub const MOST_LAYERS: u32 = 16;

impl Default for Layering {
    fn default() -> Self {
        Self::General { layers: 5 }
    }
}

impl Layering {
    /// The first paper's one background layer; diameters from 1 % of the width on are background.
    pub const PAPER: Self = Self::Background { layers: 1, threshold: 0.01 };

    /// Diameters in pixels between which the matte of background layer `layer` ramps from 0 to 1: thresholds double from
    /// one layer to the next, and each ramp begins where the one before it ends.
    pub fn background_ramp(layer: u32, threshold_px: f32) -> [f32; 2] {
        let high = threshold_px * (1u64 << layer) as f32;
        [if layer == 0 { 0.0 } else { 0.5 * high }, high]
    }

    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        let (Self::General { layers } | Self::Background { layers, .. }) = *self else { return Ok(()) };
        if !(1..=MOST_LAYERS).contains(&layers) {
            return Err(Error::Setting {
                name: "layers",
                value: f64::from(layers),
                reason: "must lie between 1 and 16",
            });
        }
        match *self {
            Self::Background { threshold, .. } if !(threshold > 0.0 && threshold <= 1.0) => {
                Err(Error::Setting {
                    name: "threshold",
                    value: threshold,
                    reason: "must lie above 0 and at most at 1 (it is a part of the picture's width)",
                })
            }
            _ => Ok(()),
        }
    }
}

/// Which of the layers that make up the result are laid down.
///
/// They are counted from the farthest, number 0, to the nearest: of [`Layering::Background`] the last of the background layers
/// is the farthest, and the midground lies over all of them; a foreground that was given on its own is the last. A number
/// beyond the last is an empty picture. Layers laid over each other, each by its matte, are the result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Show {
    /// All of them.
    #[default]
    Result,
    /// This one alone over nothing, premultiplied, with the highlights that are laid down after it.
    Layer(u32),
    /// How much this one covers of what is behind it, 0 to 1, in every plane; the farthest covers everything.
    Matte(u32),
}

impl Show {
    /// The number of the layer that is shown alone, if not all are.
    pub fn alone(self) -> Option<u32> {
        match self {
            Self::Result => None,
            Self::Layer(number) | Self::Matte(number) => Some(number),
        }
    }

    /// Whether a matte is shown.
    pub fn is_matte(self) -> bool {
        matches!(self, Self::Matte(_))
    }
}
