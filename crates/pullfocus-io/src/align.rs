//! Laying a second file's pixels onto the frame of the first.

use crate::error::{FileError, FileResult};
use pullfocus_core::{Frame, Picture, Plane, Window};
use std::path::Path;

/// Where two windows overlap: the offset in `from` and in `to`, and the size. None where they do not.
pub(crate) fn overlap(from: Window, to: Window) -> Option<[(usize, usize, usize); 2]> {
    let axis = |a: i32, a_size: usize, b: i32, b_size: usize| {
        let (a, b) = (i64::from(a), i64::from(b));
        let start = a.max(b);
        let end = (a + a_size as i64).min(b + b_size as i64);
        (end > start).then(|| ((start - a) as usize, (start - b) as usize, (end - start) as usize))
    };
    Some([
        axis(from.x, from.size.width, to.x, to.size.width)?,
        axis(from.y, from.size.height, to.y, to.size.height)?,
    ])
}

/// The plane's values in another window: cropped where that is smaller, `fill` where it is larger.
///
/// # Errors
/// Memory ([`FileError::Core`]).
pub fn align_plane(plane: Plane, from: Window, to: Window, fill: f32) -> FileResult<Plane> {
    if from == to {
        return Ok(plane);
    }
    let mut aligned = Plane::filled(to.size, fill)?;
    if let Some([(from_x, to_x, width), (from_y, to_y, height)]) = overlap(from, to) {
        for y in 0..height {
            let row = &plane.row(from_y + y)[from_x..][..width];
            aligned.row_mut(to_y + y)[to_x..][..width].copy_from_slice(row);
        }
    }
    Ok(aligned)
}

/// Lays the picture and depth (or circle of confusion) of a second file, a foreground or what is behind it,
/// onto the first file's frame: cropped to its data window, transparent black and `nothing` beyond their own.
/// `nothing` is infinity for depth and 0 for a circle of confusion.
///
/// # Errors
/// [`FileError::Mismatch`] if the display windows differ in size: such files were not rendered together.
pub fn align_element(
    file: &Path,
    (picture, distance, own): (Picture, Option<Plane>, &Frame),
    onto: &Frame,
    nothing: f32,
) -> FileResult<(Picture, Option<Plane>)> {
    if own.display.size != onto.display.size {
        return Err(FileError::Mismatch {
            file: file.to_owned(),
            reason: format!(
                "its frame (display window) is {} but the first file's is {}; render both at the same size",
                own.display.size, onto.display.size
            ),
        });
    }
    // Display windows of one size in different places show the same frame.
    let from = Window {
        x: own.data.x.saturating_sub(own.display.x).saturating_add(onto.display.x),
        y: own.data.y.saturating_sub(own.display.y).saturating_add(onto.display.y),
        size: own.data.size,
    };
    let mut aligned = Picture::default();
    for plane in picture.colors {
        aligned.colors.push(align_plane(plane, from, onto.data, 0.0)?);
    }
    aligned.alpha = picture.alpha.map(|plane| align_plane(plane, from, onto.data, 0.0)).transpose()?;
    let distance = distance.map(|plane| align_plane(plane, from, onto.data, nothing)).transpose()?;
    Ok((aligned, distance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;

    #[test]
    fn a_plane_is_cropped_and_padded() {
        let from = Window { x: -1, y: 2, size: Size::new(3, 2) };
        let to = Window { x: 0, y: 1, size: Size::new(3, 2) };
        let plane = Plane::from_fn(from.size, |x, y| (10 * y + x) as f32).unwrap();
        let aligned = align_plane(plane, from, to, 9.0).unwrap();
        assert_eq!(aligned.data(), &[9.0, 9.0, 9.0, 1.0, 2.0, 9.0]);
    }

    #[test]
    fn windows_that_do_not_meet_leave_nothing() {
        let from = Window { x: i32::MIN, y: 0, size: Size::new(2, 2) };
        let to = Window { x: i32::MAX, y: 0, size: Size::new(2, 1) };
        let plane = Plane::filled(from.size, 1.0).unwrap();
        assert_eq!(align_plane(plane, from, to, 0.5).unwrap().data(), &[0.5, 0.5]);
    }

    #[test]
    fn frames_of_another_size_are_refused() {
        let (a, b) = (Frame::full(Size::new(4, 4)), Frame::full(Size::new(4, 5)));
        let picture = Picture::opaque(vec![Plane::filled(a.data.size, 1.0).unwrap()]);
        let error = align_element(Path::new("fg.exr"), (picture, None, &a), &b, f32::INFINITY).unwrap_err();
        assert!(error.to_string().contains("fg.exr") && error.to_string().contains("4 x 5"), "{error}");
    }
}
