//! The transfer curve of sRGB (IEC 61966-2-1): what integer pictures and screens hold, against linear light.

/// sRGB value of a linear one, both 0 to 1. Nothing is clamped; values below 0 stay on the straight part.
#[inline]
pub fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Linear value of an sRGB one, both 0 to 1. Nothing is clamped; values below 0 stay on the straight part.
#[inline]
pub fn decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_passes_through_its_published_points() {
        // 8 bit 188 is just about half of the light; the end points are exact.
        assert!((decode(188.0 / 255.0) - 0.5029).abs() < 1e-4);
        assert_eq!((encode(0.0), decode(0.0)), (0.0, 0.0));
        assert!((encode(1.0) - 1.0).abs() < 1e-6 && (decode(1.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn every_16_bit_value_survives_the_round_trip() {
        for code in 0..=65535u32 {
            let value = code as f32 / 65535.0;
            assert_eq!((encode(decode(value)) * 65535.0).round() as u32, code);
        }
    }
}
