//! The circle of confusion: **signed diameter in pixels, positive behind focus**. Defined here and nowhere else.
//!
//! Diameters are counted in pixels of width; where pixels are not square, heights follow from
//! [`crate::Frame::vertical_scale`].

use crate::error::{Error, Result};
use crate::frame::Frame;
use serde::{Deserialize, Serialize};

/// The circle of confusion as a function of planar depth z: `at_infinity - metre_pixels / z`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CocFormula {
    /// Diameter of a point infinitely far away, in pixels; 0 where the lens is focused at infinity.
    pub at_infinity: f64,
    /// Pixels times metres: what one dioptre (1/m) towards the camera changes the diameter by.
    pub metre_pixels: f64,
}

impl CocFormula {
    /// Signed diameter in pixels at planar depth `z` metres; infinity is allowed.
    pub fn diameter(&self, z: f64) -> f64 {
        self.at_infinity - self.metre_pixels / z
    }
}

/// What a user may do to the circle of confusion beside the lens.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct CocSettings {
    /// Largest diameter in pixels, in front and behind; none by default (the cost does not depend on it).
    pub max_px: Option<f64>,
    /// Largest diameter as a part of the display window's width, 0 or above: the same look in a half-size proxy.
    pub max_width: Option<f64>,
    /// Factor on diameters in front of the plane in focus.
    pub front: f64,
    /// Factor on diameters behind it.
    pub back: f64,
    /// Nearest and farthest distance in metres of a range that stays sharp. Beyond each end the circle
    /// starts from zero, so nothing jumps.
    pub protect_m: Option<[f64; 2]>,
}

impl Default for CocSettings {
    fn default() -> Self {
        Self { max_px: None, max_width: None, front: 1.0, back: 1.0, protect_m: None }
    }
}

impl CocSettings {
    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        let at_least_0 = |name, value: f64| {
            if value.is_finite() && value >= 0.0 {
                Ok(())
            } else {
                Err(Error::Setting { name, value, reason: "must be 0 or above" })
            }
        };
        at_least_0("front", self.front)?;
        at_least_0("back", self.back)?;
        at_least_0("maximum circle of confusion", self.max_px.unwrap_or(0.0))?;
        at_least_0("maximum circle of confusion", self.max_width.unwrap_or(0.0))?;
        match self.protect_m {
            Some([near, far]) if !(near > 0.0 && near <= far) => Err(Error::Setting {
                name: "protected range",
                value: near,
                reason: "must start above 0 metres and end where it starts or beyond",
            }),
            _ => Ok(()),
        }
    }
}

/// Diameters beyond this many widths of the picture are cut to it: by then the blur is flat over all of it,
/// and numbers stay far from overflow.
pub const LARGEST_IN_WIDTHS: f64 = 4.0;

/// The lens's formula with a user's settings on top, ready for pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CocCurve {
    /// The lens's formula.
    pub formula: CocFormula,
    /// Factor on diameters in front.
    pub front: f64,
    /// Factor on diameters behind.
    pub back: f64,
    /// Largest absolute diameter in pixels.
    pub max: f64,
    /// Diameters of the near and the far end of the range that stays sharp.
    pub protect: Option<[f64; 2]>,
}

impl CocCurve {
    /// The curve of a camera's `formula` ([`crate::Camera::circle_of_confusion`]) over `frame`.
    ///
    /// # Errors
    /// [`Error::Setting`] from [`CocSettings::check`].
    pub fn new(formula: CocFormula, frame: &Frame, settings: &CocSettings) -> Result<Self> {
        let protect = settings.protect_m.map(|range| range.map(|z| formula.diameter(z)));
        Ok(Self { formula, protect, ..Self::limits(frame, settings)? })
    }

    /// The settings' factors and limits alone, for diameters that a file already holds
    /// ([`CocCurve::adjust`]); a protected range in metres means nothing there.
    ///
    /// # Errors
    /// [`Error::Setting`] from [`CocSettings::check`].
    pub fn limits(frame: &Frame, settings: &CocSettings) -> Result<Self> {
        settings.check()?;
        let width = frame.display_width();
        let max = (LARGEST_IN_WIDTHS * width)
            .min(settings.max_px.unwrap_or(f64::INFINITY))
            .min(settings.max_width.map_or(f64::INFINITY, |part| part * width));
        Ok(Self {
            formula: CocFormula { at_infinity: 0.0, metre_pixels: 0.0 },
            front: settings.front,
            back: settings.back,
            max,
            protect: None,
        })
    }

    /// The same without the settings: what is farther away has the larger signed diameter, so that it says what is in front
    /// of what. With the settings, several depths may share one circle.
    pub fn lens_alone(&self) -> Self {
        Self { front: 1.0, back: 1.0, max: f64::from(f32::MAX), protect: None, ..*self }
    }

    /// Signed diameter in pixels at planar depth `z` metres (above 0, infinity allowed).
    pub fn diameter(&self, z: f64) -> f32 {
        self.shape(self.formula.diameter(z))
    }

    /// What the settings make of the lens's own diameter.
    pub fn shape(&self, c: f64) -> f32 {
        match self.protect {
            Some([near, far]) => self.adjust(c - c.clamp(near, far)),
            None => self.adjust(c),
        }
    }

    /// A diameter that is already in pixels, with front, back and maximum applied. NaN counts as in focus.
    pub fn adjust(&self, c: f64) -> f32 {
        if c.is_nan() {
            return 0.0;
        }
        let c = c * if c < 0.0 { self.front } else { self.back };
        // 0 * infinity: a factor of 0 wins.
        if c.is_nan() { 0.0 } else { c.clamp(-self.max, self.max) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::size::Size;

    /// A lens of 20 mm aperture with a field of view of 40 degrees, focused at 2 m, over 1000 pixels.
    fn curve(settings: &CocSettings) -> CocCurve {
        let metre_pixels = 0.02 * 1000.0 / (2.0 * 20f64.to_radians().tan());
        let formula = CocFormula { at_infinity: metre_pixels / 2.0, metre_pixels };
        CocCurve::new(formula, &Frame::full(Size::new(1000, 500)), settings).unwrap()
    }

    #[test]
    fn settings_act_on_their_own_side() {
        let plain = curve(&CocSettings::default());
        let shaped = curve(&CocSettings { front: 0.5, back: 2.0, ..CocSettings::default() });
        assert_eq!(shaped.diameter(1.0), 0.5 * plain.diameter(1.0));
        assert_eq!(shaped.diameter(8.0), 2.0 * plain.diameter(8.0));
        let cut = curve(&CocSettings { max_px: Some(3.0), ..CocSettings::default() });
        assert_eq!((cut.diameter(0.1), cut.diameter(1e9)), (-3.0, 3.0));
    }

    #[test]
    fn a_protected_range_is_sharp_and_starts_softly() {
        let kept = curve(&CocSettings { protect_m: Some([1.5, 3.0]), ..CocSettings::default() });
        for z in [1.5, 2.0, 2.7, 3.0] {
            assert_eq!(kept.diameter(z), 0.0, "{z}");
        }
        assert!(kept.diameter(3.01) > 0.0 && kept.diameter(3.01) < 0.1);
        assert!(kept.diameter(1.49) < 0.0 && kept.diameter(1.49) > -0.2);
    }

    #[test]
    fn the_lens_alone_tells_depths_apart() {
        let protect_m = Some([1.5, 3.0]);
        let settings =
            CocSettings { max_px: Some(2.0), front: 0.0, back: 0.5, protect_m, ..CocSettings::default() };
        let shaped = curve(&settings);
        let lens = shaped.lens_alone();
        assert_eq!(CocCurve { max: lens.max, ..curve(&CocSettings::default()) }, lens);
        let depths = [1e-6, 0.1, 0.5, 1.4, 1.6, 2.9, 3.1, 50.0, 1e4, f64::INFINITY];
        assert!(depths.windows(2).all(|pair| lens.diameter(pair[0]) < lens.diameter(pair[1])));
        for z in depths {
            // Rounded once more, to f32.
            let error = shaped.shape(f64::from(lens.diameter(z))) - shaped.diameter(z);
            assert!(error.abs() < 1e-5, "{z}: {error}");
        }
    }

    #[test]
    fn every_number_gives_a_number() {
        let curve = curve(&CocSettings { front: 0.0, ..CocSettings::default() });
        for z in [0.0, 1e-300, 1e300, f64::INFINITY] {
            assert!(curve.diameter(z).is_finite(), "{z}");
        }
        for c in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(curve.adjust(c).is_finite(), "{c}");
        }
    }
}
