//! Structural similarity.

use crate::error::{Error, Result};
use pullfocus_core::Plane;
use rayon::prelude::*;

/// Half of the window's width.
const RADIUS: usize = 5;
const WIDTH: usize = 2 * RADIUS + 1;

/// The window of the paper along one axis: a Gaussian with standard deviation 1.5, eleven wide, sum 1.
fn window() -> [f32; WIDTH] {
    let gauss: [f64; WIDTH] = std::array::from_fn(|i| (-(i as f64 - RADIUS as f64).powi(2) / 4.5).exp());
    let sum: f64 = gauss.iter().sum();
    gauss.map(|weight| (weight / sum) as f32)
}

/// Luma of an sRGB pixel with the weights of Rec. 709, whose primaries sRGB has.
fn luma(picture: &[Plane; 3], y: usize, x: usize) -> f32 {
    let [r, g, b] = [0, 1, 2].map(|c| crate::clipped(picture[c].row(y)[x]));
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Mean SSIM on luma (-1 to 1; 1 for equal pictures).
///
/// Wang, Bovik, Sheikh, Simoncelli, "Image Quality Assessment: From Error Visibility to Structural
/// Similarity", 2004, equation 13: an 11 x 11 Gaussian window with standard deviation 1.5, K1 = 0.01,
/// K2 = 0.03, peak 1, mean over the windows that lie wholly inside the picture. Luma is
/// `0.2126 R + 0.7152 G + 0.0722 B` of the sRGB-encoded values; programs that take Rec. 601's weights differ in
/// the third digit on coloured pictures.
///
/// # Errors
/// [`Error::TooSmall`] for pictures below 11 x 11, [`Error::Core`] where the sizes differ, [`Error::Empty`].
pub fn ssim(reference: &[Plane; 3], test: &[Plane; 3]) -> Result<f64> {
    let size = crate::common_size(reference, test)?;
    if size.width < WIDTH || size.height < WIDTH {
        return Err(Error::TooSmall { size });
    }
    let weights = window();
    let inner = size.width - 2 * RADIUS;
    // Five moments of every row, filtered along it: a, b, a^2, b^2, ab. Taken about the middle grey, which
    // changes no variance and keeps f32 from cancelling.
    let moments = |y: usize| -> Vec<[f32; 5]> {
        let pixels: Vec<[f32; 5]> = (0..size.width)
            .map(|x| {
                let (a, b) = (luma(reference, y, x) - 0.5, luma(test, y, x) - 0.5);
                [a, b, a * a, b * b, a * b]
            })
            .collect();
        (0..inner).map(|x| weigh(&weights, |k| pixels[x + k])).collect()
    };
    // Bands of rows, so that memory stays small and each row is filtered about once.
    const BAND: usize = 64;
    let rows = size.height - 2 * RADIUS;
    let bands: Vec<f64> = (0..rows.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let first = band * BAND;
            let count = BAND.min(rows - first);
            let filtered: Vec<Vec<[f32; 5]>> = (first..first + count + 2 * RADIUS).map(moments).collect();
            let below = |y: usize, x: usize| weigh(&weights, |k| filtered[y + k][x]);
            let rows = (0..count).flat_map(|y| (0..inner).map(move |x| (y, x)));
            rows.map(|(y, x)| similarity(below(y, x))).sum()
        })
        .collect();
    Ok(bands.iter().sum::<f64>() / (rows * inner) as f64)
}

fn weigh(weights: &[f32; WIDTH], at: impl Fn(usize) -> [f32; 5]) -> [f32; 5] {
    let mut sum = [0.0; 5];
    for (k, weight) in weights.iter().enumerate() {
        for (sum, value) in sum.iter_mut().zip(at(k)) {
            *sum += weight * value;
        }
    }
    sum
}

/// Equation 13 of one window, from means about 0.5.
fn similarity([a, b, aa, bb, ab]: [f32; 5]) -> f64 {
    const C1: f64 = 0.01 * 0.01;
    const C2: f64 = 0.03 * 0.03;
    let [a, b, aa, bb, ab] = [a, b, aa, bb, ab].map(f64::from);
    let (variance, covariance) = ((aa - a * a) + (bb - b * b), ab - a * b);
    let (mean_a, mean_b) = (a + 0.5, b + 0.5);
    (2.0 * mean_a * mean_b + C1) * (2.0 * covariance + C2)
        / ((mean_a * mean_a + mean_b * mean_b + C1) * (variance + C2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;

    #[test]
    fn flat_pictures_have_the_closed_form() {
        let flat = |v: f32| [0; 3].map(|_| Plane::filled(Size::new(20, 13), v).unwrap());
        let expected = (2.0 * 0.25 * 0.75 + 1e-4) / (0.25f64.powi(2) + 0.75f64.powi(2) + 1e-4);
        // f32 weights sum to 1 within 1e-7; divided by C2 = 9e-4 that is 1e-4 of the variance term.
        assert!((ssim(&flat(0.25), &flat(0.75)).unwrap() - expected).abs() < 2e-4);
        let lower = [0; 3].map(|_| Plane::filled(Size::new(20, 12), 0.2).unwrap());
        assert!(ssim(&flat(0.2), &lower).is_err());
    }

    #[test]
    fn a_picture_below_the_window_is_refused() {
        let small = [0; 3].map(|_| Plane::filled(Size::new(10, 40), 0.5).unwrap());
        assert_eq!(ssim(&small, &small), Err(Error::TooSmall { size: Size::new(10, 40) }));
    }
}
