//! Depth to circles of confusion, a frame at a time.

use crate::rows::for_each_row;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::depth::{HALF_MAX, NOTHING_FROM};
use pullfocus_core::{
    Camera, Cancel, CocSettings, DepthDecoding, DepthKind, Distance, Error, Frame, Plane, Result,
};

/// What makes circles of confusion of such a distance.
///
/// # Errors
/// [`Error::NoCamera`] where depth is given without one; [`Error::Setting`].
pub fn curve(
    frame: &Frame,
    distance: &Distance,
    camera: Option<&Camera>,
    settings: &CocSettings,
) -> Result<CocCurve> {
    match distance {
        Distance::Coc(_) => CocCurve::limits(frame, settings),
        Distance::Depth { decoding, .. } => {
            decoding.check()?;
            let camera = camera.ok_or(Error::NoCamera)?;
            CocCurve::new(camera.circle_of_confusion(frame), frame, settings)
        }
    }
}

/// Writes the signed diameter in pixels (positive behind focus) of every pixel of `distance` into `coc`; `curve` is [`curve`]'s,
/// or its lens alone.
///
/// # Errors
/// [`Error::NoCamera`]; [`Error::Cancelled`].
pub fn circle_of_confusion(
    frame: &Frame,
    distance: &Distance,
    camera: Option<&Camera>,
    curve: &CocCurve,
    cancel: &Cancel,
    coc: &mut Plane,
) -> Result<()> {
    match distance {
        Distance::Coc(plane) => {
            coc.resize(plane.size())?;
            for_each_row(coc, cancel, |y, out| {
                for (out, &value) in out.iter_mut().zip(plane.row(y)) {
                    *out = curve.adjust(f64::from(value));
                }
            })
        }
        Distance::Depth { plane, decoding } => {
            let camera = camera.ok_or(Error::NoCamera)?;
            coc.resize(plane.size())?;
            if decoding.kind == DepthKind::Planar && decoding.far_clip_m.is_none() {
                return planar(plane, decoding, curve, cancel, coc);
            }
            let half_width = camera.half_width_tangent();
            for_each_row(coc, cancel, |y, out| {
                for (x, (out, &value)) in out.iter_mut().zip(plane.row(y)).enumerate() {
                    *out = curve.diameter(decoding.metres_at(frame, half_width, value, x, y));
                }
            })
        }
    }
}

/// The common case without branches, so that it runs at the memory's speed; the same numbers as
/// [`DepthDecoding::to_metres`] (a test holds the two together).
fn planar(
    plane: &Plane,
    decoding: &DepthDecoding,
    curve: &CocCurve,
    cancel: &Cancel,
    coc: &mut Plane,
) -> Result<()> {
    let unit = decoding.unit_m;
    for_each_row(coc, cancel, |y, out| {
        for (out, &value) in out.iter_mut().zip(plane.row(y)) {
            let size = value.abs();
            // NaN fails every comparison and so is nothing there, too.
            let there = size > 0.0 && size < NOTHING_FROM && size != HALF_MAX;
            let metres = (f64::from(size) * unit).max(1e-6);
            *out = curve.diameter(if there { metres } else { f64::INFINITY });
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::{Lens, Size};

    #[test]
    fn the_fast_way_is_the_stated_way() {
        let values = [
            0.0,
            -0.0,
            1.0,
            2.5,
            -3.0,
            1e-30,
            65503.0,
            HALF_MAX,
            9e8,
            NOTHING_FROM,
            1e30,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        let size = Size::new(values.len(), 1);
        let frame = Frame::full(size);
        let lens = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
        let camera = Camera::new(lens, 2.0).unwrap();
        let settings = CocSettings::default();
        let decoding = DepthDecoding { unit_m: 0.5, ..DepthDecoding::default() };
        let distance = Distance::Depth { plane: Plane::new(size, values.to_vec()).unwrap(), decoding };
        let mut coc = Plane::default();
        let curve = curve(&frame, &distance, Some(&camera), &settings).unwrap();
        circle_of_confusion(&frame, &distance, Some(&camera), &curve, &Cancel::new(), &mut coc).unwrap();
        for (x, &value) in values.iter().enumerate() {
            let expected = curve.diameter(decoding.to_metres(value, || [0.0, 0.0]));
            assert_eq!(coc.at(x, 0), expected, "{value}");
        }
    }

    #[test]
    fn depth_without_a_camera_is_refused() {
        let size = Size::new(2, 2);
        let depth = Plane::filled(size, 1.0).unwrap();
        let distance = Distance::Depth { plane: depth, decoding: DepthDecoding::default() };
        let result = curve(&Frame::full(size), &distance, None, &CocSettings::default());
        assert_eq!(result, Err(Error::NoCamera));
    }
}
