//! Pictures as they are seen: to sRGB, and colours for a map of differences.

use crate::error::{Error, Result};
use crate::magma::MAGMA;
use pullfocus_core::{Picture, Plane, Size, srgb};
use rayon::prelude::*;

/// Makes a plane of `size` row by row on the caller's thread pool; `fill(y, row)` writes every value.
pub(crate) fn by_rows(size: Size, fill: impl Fn(usize, &mut [f32]) + Sync) -> Result<Plane> {
    let mut plane = Plane::filled(size, 0.0)?;
    let rows = plane.data_mut().par_chunks_mut(size.width.max(1));
    rows.enumerate().for_each(|(y, row)| fill(y, row));
    Ok(plane)
}

/// The linear picture as a screen shows it: sRGB-encoded R, G, B, clipped to 0..1 (NaN becomes 0).
///
/// Colour is premultiplied, so a picture with alpha is seen over black. One colour plane is shown as grey.
///
/// # Errors
/// [`Error::Planes`] for a picture that is neither grey nor RGB, [`Error::Core`] where planes differ in size.
pub fn display(picture: &Picture) -> Result<[Plane; 3]> {
    picture.check()?;
    let encoded = |plane: &Plane| {
        by_rows(plane.size(), |y, row| {
            for (out, &light) in row.iter_mut().zip(plane.row(y)) {
                *out = srgb::encode(crate::clipped(light)).min(1.0);
            }
        })
    };
    match picture.colors.as_slice() {
        [grey] => {
            let grey = encoded(grey)?;
            Ok([grey.clone(), grey.clone(), grey])
        }
        [red, green, blue] => Ok([encoded(red)?, encoded(green)?, encoded(blue)?]),
        other => Err(Error::Planes { found: other.len() }),
    }
}

/// The map of differences in colour: black for 0 through purple and orange to light yellow for 1; sRGB.
///
/// The colour map is magma, as in FLIP's paper.
///
/// # Errors
/// [`Error::Core`] where memory cannot be had.
pub fn magma(map: &Plane) -> Result<[Plane; 3]> {
    let channel = |c: usize| {
        by_rows(map.size(), |y, row| {
            for (out, &value) in row.iter_mut().zip(map.row(y)) {
                let step = (crate::clipped(value) * 255.0 + 0.5) as usize;
                *out = f32::from(MAGMA[step.min(255)][c]) / 255.0;
            }
        })
    };
    Ok([channel(0)?, channel(1)?, channel(2)?])
}

/// The mean of `map` where `mask` lies: each pixel weighs as much as its mask, 0 to 1 (NaN is 0).
///
/// `None` where the mask is empty. For a band around depth edges, or a region of interest; on
/// [`crate::squared_error`] it gives the mean that [`crate::psnr_of`] takes.
///
/// # Errors
/// [`Error::Core`] where the sizes differ.
pub fn masked_mean(map: &Plane, mask: &Plane) -> Result<Option<f64>> {
    mask.expect_size("the mask", map.size())?;
    let (mut sum, mut weight) = (0.0, 0.0);
    for (&value, &mask) in map.data().iter().zip(mask.data()) {
        let part = f64::from(crate::clipped(mask));
        if part > 0.0 {
            sum += part * f64::from(value);
            weight += part;
        }
    }
    Ok((weight > 0.0).then(|| sum / weight))
}

/// How many values of these planes are NaN or infinite.
pub fn not_finite<'a>(planes: impl IntoIterator<Item = &'a Plane>) -> usize {
    planes.into_iter().map(|plane| plane.data().iter().filter(|value| !value.is_finite()).count()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(values: &[f32]) -> Plane {
        Plane::new(Size::new(values.len(), 1), values.to_vec()).unwrap()
    }

    #[test]
    fn a_picture_is_clipped_and_encoded_as_a_screen_shows_it() {
        let light = plane(&[-1.0, 0.0, 0.214_041_14, 1.0, 7.0, f32::INFINITY, f32::NAN]);
        let [red, _, blue] = display(&Picture::opaque(vec![light.clone()])).unwrap();
        assert_eq!(red, blue);
        assert_eq!([red.at(0, 0), red.at(1, 0), red.at(6, 0)], [0.0; 3]);
        // 0.214... is linear light of sRGB 0.5.
        assert!((red.at(2, 0) - 0.5).abs() < 1e-6);
        assert!((3..6).all(|x| (red.at(x, 0) - 1.0).abs() < 1e-6 && red.at(x, 0) <= 1.0));
        assert_eq!(not_finite([&light]), 2);
        let two = Picture::opaque(vec![light.clone(), light]);
        assert_eq!(display(&two), Err(Error::Planes { found: 2 }));
    }

    #[test]
    fn the_map_runs_from_black_to_light_yellow() {
        let [red, green, blue] = magma(&plane(&[0.0, 1.0, f32::NAN, 2.0])).unwrap();
        let at = |x| [red.at(x, 0), green.at(x, 0), blue.at(x, 0)].map(|v| (v * 255.0).round() as u8);
        assert_eq!((at(0), at(1)), ([0, 0, 4], [252, 253, 191]));
        assert_eq!((at(2), at(3)), (at(0), at(1)));
    }

    #[test]
    fn a_mask_weighs() {
        let map = plane(&[0.1, 0.5, 0.9, f32::NAN]);
        let mean = masked_mean(&map, &plane(&[1.0, 0.0, 0.5, 0.0])).unwrap().unwrap();
        // Rounding of the f32 inputs only.
        assert!((mean - (0.1 + 0.45) / 1.5).abs() < 1e-7);
        assert_eq!(masked_mean(&map, &plane(&[0.0; 4])).unwrap(), None);
        assert!(masked_mean(&map, &plane(&[0.0; 3])).is_err());
    }
}
