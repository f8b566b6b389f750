//! The lens: two ways to give it, one formula for the circle of confusion.

use crate::coc::CocFormula;
use crate::error::{Error, Result};
use crate::frame::Frame;
use serde::{Deserialize, Serialize};

/// A thin lens in one of the two ways in which people know theirs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lens {
    /// As on a camera: the lens moves to focus, so the field of view narrows a little at close range
    /// (second paper, equation 1.1).
    Physical {
        /// Focal length in millimetres.
        focal_length_mm: f64,
        /// f-stop (f-number): focal length over the aperture's diameter.
        f_stop: f64,
        /// Width of the sensor (film back, horizontal aperture) in millimetres, for the display window.
        sensor_width_mm: f64,
    },
    /// As in a renderer: the field of view stays at every focus distance.
    Ideal {
        /// Horizontal field of view of the display window in degrees.
        fov_x_degrees: f64,
        /// Diameter of the aperture in metres.
        aperture_diameter_m: f64,
    },
}

/// A lens and where it is focused.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    lens: Lens,
    focus_distance_m: f64,
}

fn positive(name: &'static str, value: f64) -> Result<f64> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(Error::Camera { name, value, reason: "must be a number above 0" })
    }
}

impl Camera {
    /// A lens focused at `focus_distance_m` metres from it; infinity is allowed.
    ///
    /// # Errors
    /// [`Error::Camera`] for values that no lens has: not above 0, a field of view of 180 degrees or more,
    /// a focus distance within the focal length.
    pub fn new(lens: Lens, focus_distance_m: f64) -> Result<Self> {
        if focus_distance_m.is_nan() || focus_distance_m <= 0.0 {
            return Err(Error::Camera {
                name: "focus distance",
                value: focus_distance_m,
                reason: "must be above 0 metres (infinity is allowed)",
            });
        }
        match lens {
            Lens::Physical { focal_length_mm, f_stop, sensor_width_mm } => {
                positive("focal length (mm)", focal_length_mm)?;
                positive("sensor width (mm)", sensor_width_mm)?;
                f_stop_ok(f_stop)?;
                if focus_distance_m <= focal_length_mm * 1e-3 {
                    return Err(Error::Camera {
                        name: "focus distance",
                        value: focus_distance_m,
                        reason: "lies within the focal length, where a lens cannot focus; give metres, beyond the focal length",
                    });
                }
            }
            Lens::Ideal { fov_x_degrees, aperture_diameter_m } => {
                positive("field of view (degrees)", fov_x_degrees)?;
                if fov_x_degrees >= 180.0 {
                    return Err(Error::Camera {
                        name: "field of view",
                        value: fov_x_degrees,
                        reason: "must be below 180 degrees",
                    });
                }
                if !(aperture_diameter_m.is_finite() && aperture_diameter_m >= 0.0) {
                    return Err(Error::Camera {
                        name: "aperture diameter (m)",
                        value: aperture_diameter_m,
                        reason: "must be 0 (a pinhole) or above",
                    });
                }
            }
        }
        Ok(Self { lens, focus_distance_m })
    }

    /// The lens.
    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// Distance from the lens to the plane in focus, in metres; may be infinite.
    pub fn focus_distance_m(&self) -> f64 {
        self.focus_distance_m
    }

    /// The same lens focused elsewhere.
    ///
    /// # Errors
    /// As [`Camera::new`].
    pub fn focused_at(&self, focus_distance_m: f64) -> Result<Self> {
        Self::new(self.lens, focus_distance_m)
    }

    /// Tangent of half the horizontal field of view of the pinhole picture. A physical lens is taken at its
    /// focal length, as renderers take it.
    pub fn half_width_tangent(&self) -> f64 {
        match self.lens {
            Lens::Physical { focal_length_mm, sensor_width_mm, .. } => {
                0.5 * sensor_width_mm / focal_length_mm
            }
            Lens::Ideal { fov_x_degrees, .. } => (0.5 * fov_x_degrees).to_radians().tan(),
        }
    }

    /// The circle of confusion of this camera in pixels of `frame`'s display window.
    ///
    /// Physical: `c = (f / N) (z - s) / z * f / (s - f) * width_px / sensor_width`.
    /// Ideal: `c = A (z - s) / (z s) * width_px / (2 tan(fov_x / 2))`.
    /// Both are `at_infinity - metre_pixels / z`, which is how limits are taken exactly.
    pub fn circle_of_confusion(&self, frame: &Frame) -> CocFormula {
        let s = self.focus_distance_m;
        let (at_infinity, metre_pixels) = match self.lens {
            Lens::Physical { focal_length_mm, f_stop, sensor_width_mm } => {
                let f = focal_length_mm * 1e-3;
                let scale = f / f_stop * f * frame.display_width() / (sensor_width_mm * 1e-3);
                (scale / (s - f), scale / (1.0 - f / s))
            }
            Lens::Ideal { aperture_diameter_m, .. } => {
                let scale = aperture_diameter_m * frame.display_width() / (2.0 * self.half_width_tangent());
                (scale / s, scale)
            }
        };
        CocFormula { at_infinity, metre_pixels }
    }
}

fn f_stop_ok(f_stop: f64) -> Result<()> {
    // An infinite f-stop is a pinhole, and a legal wish.
    if f_stop > 0.0 {
        Ok(())
    } else {
        Err(Error::Camera { name: "f-stop", value: f_stop, reason: "must be above 0" })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::size::Size;

    fn frame() -> Frame {
        Frame::full(Size::new(1920, 1080))
    }

    fn physical(f: f64, n: f64, s: f64) -> Camera {
        Camera::new(Lens::Physical { focal_length_mm: f, f_stop: n, sensor_width_mm: 36.0 }, s).unwrap()
    }

    /// The printed formula, for comparison with the limit form.
    fn printed(f_mm: f64, n: f64, s: f64, z: f64, width: f64) -> f64 {
        let f = f_mm * 1e-3;
        f / n * (z - s) / z * f / (s - f) * width / 0.036
    }

    #[test]
    fn the_physical_lens_follows_the_printed_formula() {
        let camera = physical(50.0, 2.8, 4.0);
        let coc = camera.circle_of_confusion(&frame());
        for z in [0.3, 1.0, 3.9, 4.0, 4.1, 20.0, 1e6] {
            let expected = printed(50.0, 2.8, 4.0, z, 1920.0);
            // Two f64 expressions of one formula: rounding only.
            assert!((coc.diameter(z) - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{z}");
        }
        assert!(coc.diameter(10.0) > 0.0 && coc.diameter(1.0) < 0.0, "positive behind focus");
    }

    #[test]
    fn the_two_forms_tie_at_the_focused_field_of_view() {
        let (f_mm, n, s) = (67.0, 2.0, 6.0);
        let f: f64 = f_mm * 1e-3;
        let image_distance = s * f / (s - f);
        let fov = 2.0 * (0.5 * 0.036 / image_distance).atan();
        let ideal =
            Camera::new(Lens::Ideal { fov_x_degrees: fov.to_degrees(), aperture_diameter_m: f / n }, s)
                .unwrap();
        let a = physical(f_mm, n, s).circle_of_confusion(&frame());
        let b = ideal.circle_of_confusion(&frame());
        for z in [0.5, 2.0, 6.0, 50.0, f64::INFINITY] {
            assert!((a.diameter(z) - b.diameter(z)).abs() < 1e-9, "{z}");
        }
        // As if focused at infinity, the two differ by s / (s - f).
        let at_infinity = 2.0 * (0.5f64 * 0.036 / f).atan();
        let wide = Camera::new(
            Lens::Ideal { fov_x_degrees: at_infinity.to_degrees(), aperture_diameter_m: f / n },
            s,
        )
        .unwrap()
        .circle_of_confusion(&frame());
        let ratio = a.diameter(2.0) / wide.diameter(2.0);
        assert!((ratio - s / (s - f)).abs() < 1e-9);
    }

    #[test]
    fn infinity_is_a_limit_not_a_nan() {
        let far = physical(50.0, 2.0, 1e9).circle_of_confusion(&frame());
        let infinite = physical(50.0, 2.0, f64::INFINITY).circle_of_confusion(&frame());
        assert_eq!(infinite.diameter(f64::INFINITY), 0.0);
        assert!((far.diameter(3.0) - infinite.diameter(3.0)).abs() < 1e-6);
        let focused = physical(50.0, 2.0, 3.0).circle_of_confusion(&frame());
        assert!((focused.diameter(f64::INFINITY) - focused.diameter(1e12)).abs() < 1e-6);
    }

    #[test]
    fn impossible_lenses_are_refused() {
        let lens = Lens::Physical { focal_length_mm: 50.0, f_stop: 2.0, sensor_width_mm: 36.0 };
        for s in [0.05, 0.01, 0.0, -1.0, f64::NAN] {
            assert!(matches!(Camera::new(lens, s), Err(Error::Camera { .. })), "{s}");
        }
        let ideal = |fov, a| Camera::new(Lens::Ideal { fov_x_degrees: fov, aperture_diameter_m: a }, 1.0);
        assert!(ideal(180.0, 0.01).is_err() && ideal(40.0, -0.01).is_err() && ideal(40.0, 0.0).is_ok());
    }
}
