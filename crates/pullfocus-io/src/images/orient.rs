//! Turning pictures upright.

use crate::error::FileResult;
use pullfocus_core::{Plane, Size};

/// The plane as it is meant to be seen, for EXIF's and TIFF's orientation 1 to 8 (others count as 1).
pub(super) fn oriented(plane: Plane, orientation: u8) -> FileResult<Plane> {
    let Size { width, height } = plane.size();
    // Which stored pixel is seen at (x, y).
    let from: fn(usize, usize, usize, usize) -> (usize, usize) = match orientation {
        2 => |x, y, right, _| (right - x, y),
        3 => |x, y, right, bottom| (right - x, bottom - y),
        4 => |x, y, _, bottom| (x, bottom - y),
        5 => |x, y, _, _| (y, x),
        6 => |x, y, _, bottom| (y, bottom - x),
        7 => |x, y, right, bottom| (right - y, bottom - x),
        8 => |x, y, right, _| (right - y, x),
        _ => return Ok(plane),
    };
    let size = if orientation >= 5 { Size::new(height, width) } else { Size::new(width, height) };
    let (right, bottom) = (width.saturating_sub(1), height.saturating_sub(1));
    Ok(Plane::from_fn(size, |x, y| {
        let (x, y) = from(x, y, right, bottom);
        plane.at(x, y)
    })?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A letter F, stored as each orientation stores it: TIFF 6.0, page 36.
    #[test]
    fn every_orientation_shows_the_same_letter() {
        let upright = ["##", "#.", "##", "#.", "#."];
        let stored: [&[&str]; 8] = [
            &["##", "#.", "##", "#.", "#."],
            &["##", ".#", "##", ".#", ".#"],
            &[".#", ".#", "##", ".#", "##"],
            &["#.", "#.", "##", "#.", "##"],
            &["#####", "#.#.."],
            &["#.#..", "#####"],
            &["..#.#", "#####"],
            &["#####", "..#.#"],
        ];
        let plane = |rows: &[&str]| {
            Plane::from_fn(Size::new(rows[0].len(), rows.len()), |x, y| f32::from(rows[y].as_bytes()[x]))
                .unwrap()
        };
        for (i, rows) in stored.iter().enumerate() {
            assert_eq!(oriented(plane(rows), i as u8 + 1).unwrap(), plane(&upright), "orientation {}", i + 1);
        }
        assert_eq!(oriented(plane(&upright), 0).unwrap(), plane(&upright));
    }
}
