//! Where a frame's pixels lie in what is looked at: the display window, as other programs show it, whatever part of it (or beyond it)
//! a renderer wrote.

use pullfocus_core::{Frame, Window};
use pullfocus_io::Limits;

/// The window that is looked at: the display window. The data window, where that is empty, of a size that nobody means, or without a
/// pixel of the data.
pub fn looked_at(frame: &Frame) -> Window {
    let Frame { display, data, .. } = frame;
    let area = display.size.width.saturating_mul(display.size.height) as u64;
    let meets = |a: i32, a_length: usize, b: i32, b_length: usize| {
        let [a, b] = [a, b].map(i128::from);
        a < b + b_length as i128 && b < a + a_length as i128
    };
    let is_sane = area > 0
        && area <= Limits::default().max_pixels
        && meets(display.x, display.size.width, data.x, data.size.width)
        && meets(display.y, display.size.height, data.y, data.size.height);
    if is_sane { *display } else { *data }
}

/// The same, counted in pixels from the first of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// Its upper left corner.
    pub origin: [f32; 2],
    /// Its width and height.
    pub size: [f32; 2],
}

impl Framing {
    /// Of a frame.
    pub fn of(frame: &Frame) -> Self {
        let window = looked_at(frame);
        let from = |at: i32, data: i32| (i64::from(at) - i64::from(data)) as f32;
        Self {
            origin: [from(window.x, frame.data.x), from(window.y, frame.data.y)],
            size: [window.size.width as f32, window.size.height as f32],
        }
    }

    /// The pixel in its middle, counted from its own corner.
    pub fn middle(&self) -> [f32; 2] {
        self.size.map(|length| 0.5 * length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;

    #[test]
    fn the_display_window_is_looked_at_unless_it_is_absurd() {
        let window = |x, y, width, height| Window { x, y, size: Size::new(width, height) };
        let data = window(30, 10, 20, 20);
        let of = |display| Frame { display, data, ..Frame::full(data.size) };
        let crop = of(window(5, 7, 100, 50));
        assert_eq!(looked_at(&crop), crop.display);
        assert_eq!(Framing::of(&crop), Framing { origin: [-25.0, -3.0], size: [100.0, 50.0] });
        // Overscan.
        assert_eq!(looked_at(&of(window(35, 15, 8, 8))), window(35, 15, 8, 8));
        for absurd in [
            window(0, 0, 0, 0),
            window(50, 10, 20, 20),
            window(30, -40, 20, 50),
            window(i32::MIN, i32::MIN, 9, 9),
            window(i32::MIN, i32::MIN, usize::MAX, usize::MAX),
        ] {
            let frame = of(absurd);
            assert_eq!(looked_at(&frame), data, "{absurd:?}");
            assert_eq!(Framing::of(&frame).origin, [0.0, 0.0]);
        }
        for (aspect, wanted) in [(2.0, 2.0), (f32::NAN, 1.0), (0.0, 1.0), (-1.0, 1.0), (1e9, 1.0)] {
            assert_eq!(Frame { pixel_aspect: aspect, ..crop }.vertical_scale(), wanted);
        }
    }
}
