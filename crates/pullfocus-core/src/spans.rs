//! Formulas of the aperture method: a point's image as spans of rows, on a level of a pyramid that leaves few rows.
//!
//! # Theory
//! Along a row a shape without holes is a span: light begins at its left end and ends at its right one. A running sum along the
//! rows makes spans of their ends, so that a point costs two writes a row, however wide it is. That it costs the same however
//! high it is, large ones are drawn on a level whose cells are 2^l pixels, where they have half to all of [`MOST_ROWS`] rows, and
//! enlarged by the subdivision of quadratic B-splines, weights (1, 3, 3, 1) / 4 along each axis.
//!
//! Each enlargement adds 3/4 of a squared fine cell to the variance, and light put together in the middle of cells has
//! a twelfth of a squared cell less than light spread over them; a large shape is drawn smaller by what is too much
//! ([`drawn_diameter`]).

/// The most rows of cells that a circle's diameter spans.
pub const MOST_ROWS: usize = 48;

/// The level on which a circle whose diameter is `rows` pixels high is drawn.
#[inline(always)]
pub fn level_of(rows: f32) -> usize {
    // The least l with rows <= MOST_ROWS 2^l: from the exponent of the quotient, rounded up.
    let ratio = rows / MOST_ROWS as f32;
    if ratio <= 1.0 {
        return 0;
    }
    let bits = ratio.to_bits();
    ((bits >> 23) as usize - 127) + usize::from(bits & 0x007f_ffff != 0)
}

/// The diameter that is drawn on `level` for one of `diameter`, all in pixels: its variance and what drawing adds are
/// the wanted one.
#[inline(always)]
pub fn drawn_diameter(diameter: f32, level: usize) -> f32 {
    (diameter * diameter - 16.0 * added_variance(level)).max(0.0).sqrt()
}

/// What drawing on `level` adds to the variance along each axis, in square pixels, compared with drawing on level 0.
#[inline(always)]
pub fn added_variance(level: usize) -> f32 {
    (((1u64 << (2 * level)) - 1) as f32) / 6.0
}

/// The weights with which the cells at `at / 2` (rounded down) and the next one on the fine cell's own side make the fine cell.
pub const ENLARGING: [f32; 2] = [0.75, 0.25];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_has_half_to_all_of_the_rows() {
        for i in 1..40_000 {
            let rows = 0.1 * i as f32;
            let level = level_of(rows);
            let cells = rows / (1u32 << level) as f32;
            assert!(cells <= MOST_ROWS as f32, "{rows}");
            assert!(level == 0 || cells > 0.5 * MOST_ROWS as f32, "{rows}");
        }
    }

    #[test]
    fn what_is_drawn_has_the_wanted_variance() {
        // Enlarging: 3/4 (1 + 4 + ... + 4^(l-1)); cells: (4^l - 1) / 12 less.
        for level in 0..10usize {
            let enlarging: f64 = (0..level).map(|k| 0.75 * 4f64.powi(k as i32)).sum();
            let cells = (4f64.powi(level as i32) - 1.0) / 12.0;
            assert!(
                (f64::from(added_variance(level)) / (enlarging - cells).max(1e-30) - 1.0).abs() < 1e-6
                    || level == 0
            );
            let diameter = MOST_ROWS as f32 * 0.6 * (1u32 << level) as f32;
            let drawn = drawn_diameter(diameter, level);
            // f32.
            assert!(
                (drawn * drawn / 16.0 + added_variance(level)) / (diameter * diameter / 16.0) - 1.0 < 1e-5
            );
        }
        assert_eq!(drawn_diameter(7.5, 0), 7.5);
    }
}
