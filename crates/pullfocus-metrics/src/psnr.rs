//! Peak signal-to-noise ratio.

use crate::display::by_rows;
use crate::error::Result;
use pullfocus_core::Plane;

/// The squared difference of each pixel, mean of the three channels.
///
/// # Errors
/// [`crate::Error::Core`] where the sizes differ, [`crate::Error::Empty`].
pub fn squared_error(reference: &[Plane; 3], test: &[Plane; 3]) -> Result<Plane> {
    let size = crate::common_size(reference, test)?;
    by_rows(size, |y, row| {
        for (a, b) in reference.iter().zip(test) {
            for (out, (&a, &b)) in row.iter_mut().zip(a.row(y).iter().zip(b.row(y))) {
                let difference = crate::clipped(a) - crate::clipped(b);
                *out += difference * difference * (1.0 / 3.0);
            }
        }
    })
}

/// PSNR in dB of a mean squared error of values with the peak 1: `-10 log10(mse)`; infinite for 0.
pub fn psnr_of(mean_squared_error: f64) -> f64 {
    -10.0 * mean_squared_error.log10()
}

/// PSNR in dB over all pixels and the three channels together; infinite for equal pictures.
///
/// # Errors
/// [`crate::Error::Core`] where the sizes differ, [`crate::Error::Empty`].
pub fn psnr(reference: &[Plane; 3], test: &[Plane; 3]) -> Result<f64> {
    let error = squared_error(reference, test)?;
    let sum: f64 = error.data().iter().map(|&value| f64::from(value)).sum();
    Ok(psnr_of(sum / error.size().area() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;

    fn flat(value: [f32; 3]) -> [Plane; 3] {
        value.map(|v| Plane::filled(Size::new(5, 3), v).unwrap())
    }

    #[test]
    fn a_tenth_off_is_twenty_decibels() {
        let error = psnr(&flat([0.5; 3]), &flat([0.6; 3])).unwrap();
        // f32 rounding of 0.1 squared.
        assert!((error - 20.0).abs() < 1e-5, "{error}");
        let one_channel = psnr(&flat([0.5; 3]), &flat([0.5, 0.6, 0.5])).unwrap();
        assert!((one_channel - (20.0 + 10.0 * 3f64.log10())).abs() < 1e-5, "{one_channel}");
        assert_eq!(psnr(&flat([0.5; 3]), &flat([0.5; 3])).unwrap(), f64::INFINITY);
        assert_eq!(psnr(&flat([0.0; 3]), &flat([f32::INFINITY; 3])).unwrap(), 0.0);
    }

    #[test]
    fn sizes_must_agree() {
        let other = [0.5; 3].map(|v| Plane::filled(Size::new(3, 5), v).unwrap());
        let said = psnr(&flat([0.5; 3]), &other).unwrap_err().to_string();
        assert!(said.contains("3 x 5") && said.contains("5 x 3"), "{said}");
    }
}
