//! What people ask of a focused lens: how deep it is sharp, where the hyperfocal distance lies, what its marks say.
//!
//! All of it follows from the circle of confusion ([`Camera::circle_of_confusion`]) and the thin lens,
//! `1 / f = 1 / s + 1 / s'` (Gauss). Distances are metres from the lens (its entrance pupil, which in a thin lens is the lens
//! itself) unless a name says sensor.

pub mod distance;
pub mod stops;

use crate::camera::{Camera, Lens};
use crate::frame::Frame;

/// Nearest and farthest distance, in metres from the lens, at which the circle of confusion is at most `circle_px`
/// pixels of the display window across. The farthest is infinite where infinity is still that sharp; a pinhole is
/// sharp from 0 on.
///
/// The circle is `a - b / z` ([`crate::CocFormula`]), so the ends are `b / (a + c)` and `b / (a - c)`.
/// A `circle_px` below 0 counts as 0, at which both ends are the focus distance.
pub fn limits(camera: &Camera, frame: &Frame, circle_px: f64) -> [f64; 2] {
    let circle = circle_px.max(0.0);
    let coc = camera.circle_of_confusion(frame);
    let (a, b) = (coc.at_infinity, coc.metre_pixels);
    let near = if b > 0.0 { b / (a + circle) } else { 0.0 };
    let far = if a > circle { b / (a - circle) } else { f64::INFINITY };
    [near, far]
}

/// The nearest focus distance, in metres from the lens, at which a point infinitely far away still has a circle of at
/// most `circle_px` pixels: `f + f^2 / (N c)` for a lens with a focal length. Infinite where `circle_px` is 0.
pub fn hyperfocal_m(camera: &Camera, frame: &Frame, circle_px: f64) -> f64 {
    let coc = camera.circle_of_confusion(frame);
    let nearest = match camera.lens() {
        Lens::Physical { focal_length_mm, .. } => focal_length_mm * 1e-3,
        Lens::Ideal { .. } => 0.0,
    };
    // The same lens focused at infinity.
    let metre_pixels = coc.metre_pixels * (1.0 - nearest / camera.focus_distance_m());
    if metre_pixels > 0.0 { nearest + metre_pixels / circle_px.max(0.0) } else { nearest }
}

/// Distance from a thin lens to its image, in metres, when it is focused at `focus_distance_m` metres: `s f / (s - f)`.
/// None for a lens without a focal length, and at or within the focal length, where there is no image.
pub fn image_distance_m(lens: &Lens, focus_distance_m: f64) -> Option<f64> {
    let f = focal_length_m(lens)?;
    (focus_distance_m > f).then(|| f / (1.0 - f / focus_distance_m))
}

/// A distance as lenses have it engraved and people measure it, in metres from the sensor plane, of one in metres from
/// the lens that is focused there: `s + s f / (s - f)`.
///
/// A lens without a focal length has no sensor behind it: its distances stay. Infinite at and within the focal length.
pub fn to_sensor_plane(lens: &Lens, from_lens_m: f64) -> f64 {
    match lens {
        Lens::Ideal { .. } => from_lens_m,
        Lens::Physical { .. } => from_lens_m + image_distance_m(lens, from_lens_m).unwrap_or(f64::INFINITY),
    }
}

/// The way back from [`to_sensor_plane`]: metres from the lens, of metres from the sensor plane.
///
/// Two lens positions focus there; this is the one nearer to the sensor, which lenses have: the distance is twice the
/// focal length or more. None below four focal lengths, the least that a thin lens has between a thing and its image.
pub fn from_sensor_plane(lens: &Lens, from_sensor_m: f64) -> Option<f64> {
    let Some(f) = focal_length_m(lens) else { return Some(from_sensor_m) };
    // s^2 - d s + d f = 0.
    let root = (1.0 - 4.0 * f / from_sensor_m).sqrt();
    (from_sensor_m > 0.0 && !root.is_nan()).then_some(from_sensor_m * (0.5 + 0.5 * root))
}

fn focal_length_m(lens: &Lens) -> Option<f64> {
    match lens {
        Lens::Physical { focal_length_mm, .. } => Some(focal_length_mm * 1e-3),
        Lens::Ideal { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::size::Size;

    fn frame() -> Frame {
        Frame::full(Size::new(3600, 2400))
    }

    /// 50 mm at f/2.8 on full frame: a pixel of `frame` is a hundredth of a millimetre.
    fn lens() -> Lens {
        Lens::Physical { focal_length_mm: 50.0, f_stop: 2.8, sensor_width_mm: 36.0 }
    }

    fn both(focus: f64) -> [Camera; 2] {
        let ideal = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
        [lens(), ideal].map(|lens| Camera::new(lens, focus).unwrap())
    }

    #[test]
    fn at_the_limits_the_circle_is_as_large_as_asked() {
        for focus in [0.3, 2.0, 40.0] {
            for camera in both(focus) {
                for circle in [0.5, 3.0, 20.0] {
                    let coc = camera.circle_of_confusion(&frame());
                    let [near, far] = limits(&camera, &frame(), circle);
                    // Two f64 ways around one formula.
                    assert!((coc.diameter(near) + circle).abs() < 1e-9 * circle, "{camera:?} {near}");
                    if far.is_finite() {
                        assert!((coc.diameter(far) - circle).abs() < 1e-9 * circle, "{camera:?} {far}");
                    } else {
                        assert!(coc.at_infinity <= circle);
                    }
                }
            }
        }
    }

    #[test]
    fn known_depth_of_field() {
        // The textbook's forms: H = f^2 / (N c) + f; near = s (H - f) / (H + s - 2 f), far = s (H - f) / (H - s).
        let (f, c, s) = (0.05f64, 3e-5, 3.0);
        let hyperfocal = f * f / (2.8 * c) + f;
        let camera = Camera::new(lens(), s).unwrap();
        let [near, far] = limits(&camera, &frame(), 3.0);
        // Rounding only.
        assert!((hyperfocal_m(&camera, &frame(), 3.0) - hyperfocal).abs() < 1e-9);
        assert!((near - s * (hyperfocal - f) / (hyperfocal + s - 2.0 * f)).abs() < 1e-9);
        assert!((far - s * (hyperfocal - f) / (hyperfocal - s)).abs() < 1e-9);
    }

    #[test]
    fn focused_at_the_hyperfocal_distance_infinity_is_just_sharp() {
        for camera in both(2.0) {
            let hyperfocal = hyperfocal_m(&camera, &frame(), 2.0);
            let focused = camera.focused_at(hyperfocal).unwrap();
            // Rounding only; it must not depend on where the camera is focused.
            assert!((focused.circle_of_confusion(&frame()).at_infinity - 2.0).abs() < 1e-9);
            assert!((hyperfocal_m(&focused, &frame(), 2.0) / hyperfocal - 1.0).abs() < 1e-12);
            let infinite = camera.focused_at(f64::INFINITY).unwrap();
            assert!((hyperfocal_m(&infinite, &frame(), 2.0) / hyperfocal - 1.0).abs() < 1e-12);
            assert_eq!(limits(&infinite, &frame(), 2.0)[1], f64::INFINITY);
            assert_eq!(hyperfocal_m(&camera, &frame(), 0.0), f64::INFINITY);
            // Focused there, sharpness begins at half of it (from the lens, but for the focal length).
            assert!((limits(&focused, &frame(), 2.0)[0] / hyperfocal - 0.5).abs() < 0.01);
        }
    }

    #[test]
    fn ends_and_pinholes() {
        for camera in both(2.0) {
            for none in [0.0, -1.0, f64::NAN] {
                let [near, far] = limits(&camera, &frame(), none);
                assert!((near - 2.0).abs() < 1e-12 && (far - 2.0).abs() < 1e-12);
            }
            let infinite = camera.focused_at(f64::INFINITY).unwrap();
            assert_eq!(limits(&infinite, &frame(), 0.0), [f64::INFINITY; 2]);
        }
        let pinholes = [
            Lens::Physical { focal_length_mm: 50.0, f_stop: f64::INFINITY, sensor_width_mm: 36.0 },
            Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.0 },
        ];
        for pinhole in pinholes {
            let camera = Camera::new(pinhole, 2.0).unwrap();
            assert_eq!(limits(&camera, &frame(), 0.0), [0.0, f64::INFINITY]);
            assert!(hyperfocal_m(&camera, &frame(), 1.0) <= 0.05);
        }
    }

    #[test]
    fn marks_on_a_lens_count_from_the_sensor() {
        let lens = lens();
        // At twice the focal length a thin lens draws life-size: four focal lengths from thing to image.
        assert!((image_distance_m(&lens, 0.1).unwrap() - 0.1).abs() < 1e-12);
        assert!((to_sensor_plane(&lens, 0.1) - 0.2).abs() < 1e-12);
        assert!(from_sensor_plane(&lens, 0.1999).is_none() && from_sensor_plane(&lens, -3.0).is_none());
        assert!(from_sensor_plane(&lens, f64::NAN).is_none());
        for s in [0.1001, 0.4, 3.0, 1e6, f64::INFINITY] {
            let back = from_sensor_plane(&lens, to_sensor_plane(&lens, s)).unwrap();
            // Near four focal lengths the two lens positions meet, and a root of rounding is lost.
            assert!(s.is_infinite() && back.is_infinite() || (back / s - 1.0).abs() < 1e-8, "{s} {back}");
        }
        assert_eq!(image_distance_m(&lens, f64::INFINITY), Some(0.05));
        assert_eq!((image_distance_m(&lens, 0.05), to_sensor_plane(&lens, 0.04)), (None, f64::INFINITY));
        let ideal = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
        assert_eq!(image_distance_m(&ideal, 2.0), None);
        assert_eq!((to_sensor_plane(&ideal, 2.0), from_sensor_plane(&ideal, 2.0)), (2.0, Some(2.0)));
    }
}
