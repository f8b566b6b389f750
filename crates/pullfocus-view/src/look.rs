//! How the picture is looked at. None of it changes what is rendered.

use crate::color;
use crate::screen::Transform;
use pullfocus_core::Show;
use pullfocus_core::focus::distance::Units;
use serde::{Deserialize, Serialize};

/// What is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum View {
    /// Take A through its lens.
    #[default]
    Result,
    /// Take B through its lens.
    Other,
    /// The picture as it was, all in focus.
    Pinhole,
    /// Distance: near is bright.
    Depth,
    /// Circle of confusion: front red, in focus green, behind blue.
    Coc,
    /// The picture to compare with.
    Reference,
    /// Where take A differs from it (FLIP).
    Difference,
}

impl View {
    /// All of them, in the order of their keys 1 to 7.
    pub const ALL: [Self; 7] =
        [Self::Result, Self::Pinhole, Self::Depth, Self::Coc, Self::Other, Self::Reference, Self::Difference];

    /// Its name, and what it shows.
    pub fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::Result => ("Result", "The picture through the lens (take A)."),
            Self::Other => ("Take B", "The picture through the lens and settings of take B."),
            Self::Pinhole => ("Pinhole", "The picture as it was rendered, all in focus."),
            Self::Depth => ("Depth", "How far away each pixel is: near is bright, nothing there is black."),
            Self::Coc => (
                "Circle of confusion",
                "How blurred each pixel is: red in front of focus, green in focus, blue behind.",
            ),
            Self::Reference => ("Reference", "The picture to compare with; open one below."),
            Self::Difference => (
                "Difference",
                "Where take A differs from the reference, as people see it (FLIP): bright is more.",
            ),
        }
    }
}

/// Where distances are measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum From {
    /// The lens's entrance pupil, where a renderer's camera is.
    #[default]
    EntrancePupil,
    /// The sensor, as the marks on a lens and a tape measure are.
    SensorPlane,
}

/// How the picture is looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct Look {
    /// Left of the wipe, or everywhere.
    pub left: View,
    /// Right of the wipe, if there is one.
    pub right: Option<View>,
    /// Where the wipe is, 0 to 1 of the picture's place in the window.
    pub wipe: f32,
    /// Opacity of the circle of confusion over the picture, 0 to 1.
    pub overlay: f32,
    /// Exposure in stops.
    pub exposure: f32,
    /// From linear light to the screen.
    pub transform: Transform,
    /// Screen points for a picture's pixel; all of the picture if not given.
    pub zoom: Option<f32>,
    /// Pixel in the middle of the window, counted from the display window's corner.
    pub center: [f32; 2],
    /// Distances in metres or feet.
    pub feet: bool,
    /// A layer to look at alone, 0 for the farthest.
    pub layer: Option<u32>,
    /// Its matte in place of its colour.
    pub matte: bool,
    /// Where distances are measured from.
    pub from: From,
    /// Circle of confusion in pixels up to which something counts as in focus.
    pub sharp_px: f64,
    /// How much light the lens lets through, 0 to 1, for T-stops; f-stops are shown if not given.
    pub transmittance: Option<f64>,
    /// Whether the f-stop goes in thirds.
    pub thirds: bool,
    /// Frames a second.
    pub fps: f64,
    /// The view of an OpenColorIO config, where that is the transform.
    pub color: color::Choice,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            left: View::Result,
            right: None,
            wipe: 0.5,
            overlay: 0.0,
            exposure: 0.0,
            transform: Transform::default(),
            zoom: None,
            center: [0.0, 0.0],
            feet: false,
            layer: None,
            matte: false,
            from: From::default(),
            sharp_px: 2.0,
            transmittance: None,
            thirds: true,
            fps: 24.0,
            color: color::Choice::default(),
        }
    }
}

impl Look {
    /// The unit of distances.
    pub fn units(&self) -> Units {
        if self.feet { Units::Feet } else { Units::Metres }
    }

    /// Which layers are shown.
    pub fn show(&self) -> Show {
        match (self.layer, self.matte) {
            (None, _) => Show::Result,
            (Some(layer), false) => Show::Layer(layer),
            (Some(layer), true) => Show::Matte(layer),
        }
    }

    /// Whether take B is looked at and nothing of take A.
    pub fn is_of_b_alone(&self) -> bool {
        self.left == View::Other && matches!(self.right, None | Some(View::Other))
    }

    /// Whether a take is looked at.
    pub fn shows(&self, view: View) -> bool {
        self.left == view || self.right == Some(view)
    }
}
