//! Where a picture's pixels lie: display window, data window, pixel aspect, screen window.

use crate::size::Size;

/// A rectangle of pixels: its first column and row, and its size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Window {
    /// First column.
    pub x: i32,
    /// First row, counted downwards.
    pub y: i32,
    /// Width and height.
    pub size: Size,
}

/// The geometry of a frame, in OpenEXR's terms.
///
/// Lens formulas use the **display** window's width, whatever part of it (or beyond it, overscan) the data
/// window holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// What the camera's sensor sees.
    pub display: Window,
    /// The pixels that are there; the planes of a picture have its size.
    pub data: Window,
    /// Width over height of one pixel.
    pub pixel_aspect: f32,
    /// Centre of the screen window, in units of the picture plane at distance 1; (0, 0) where the optical
    /// axis meets the display window's centre. The second coordinate is positive upwards.
    pub screen_window_center: [f32; 2],
    /// Width of the display window on the picture plane at distance 1, `2 tan(fov_x / 2)`. Files often leave
    /// it at 1 without meaning it; a field of view given by the user replaces it.
    pub screen_window_width: f32,
}

/// Pixel aspects that are meant. The widest lens squeezes by 2, and half of a field's lines is 2 as well.
pub const ASPECTS: std::ops::RangeInclusive<f32> = 0.1..=10.0;

impl Frame {
    /// A frame whose data fills the display window, with square pixels and the axis in the centre.
    pub fn full(size: Size) -> Self {
        let window = Window { x: 0, y: 0, size };
        Self {
            display: window,
            data: window,
            pixel_aspect: 1.0,
            screen_window_center: [0.0, 0.0],
            screen_window_width: 1.0,
        }
    }

    /// Width of the display window in pixels, at least 1.
    pub fn display_width(&self) -> f64 {
        self.display.size.width.max(1) as f64
    }

    /// Tangents of the angles, across and up, under which the centre of the data window's pixel (x, y) is
    /// seen, for a horizontal field of view whose half angle has the tangent `half_width`.
    pub fn ray_tangents(&self, half_width: f64, x: usize, y: usize) -> [f64; 2] {
        let per_pixel = 2.0 * half_width / self.display_width();
        let column = f64::from(self.data.x) - f64::from(self.display.x) + x as f64 + 0.5;
        let row = f64::from(self.data.y) - f64::from(self.display.y) + y as f64 + 0.5;
        let unit = 2.0 * half_width / f64::from(self.screen_window_width).max(f64::MIN_POSITIVE);
        let across = (column - 0.5 * self.display_width()) * per_pixel;
        let up = (0.5 * self.display.size.height as f64 - row) * per_pixel / f64::from(self.vertical_scale());
        [
            across + f64::from(self.screen_window_center[0]) * unit,
            up + f64::from(self.screen_window_center[1]) * unit,
        ]
    }

    /// How many pixels of height one pixel of width is: a circle of confusion of `c` pixels across is
    /// `c * vertical_scale()` pixels high. 1 where the aspect is none that a camera has ([`ASPECTS`]).
    pub fn vertical_scale(&self) -> f32 {
        if ASPECTS.contains(&self.pixel_aspect) { self.pixel_aspect } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_reach_the_field_of_view_at_the_edges() {
        let frame = Frame::full(Size::new(100, 50));
        let half = (20f64).to_radians().tan();
        let left = frame.ray_tangents(half, 0, 25);
        let right = frame.ray_tangents(half, 99, 25);
        assert!((left[0] + right[0]).abs() < 1e-12);
        // A pixel's centre is half a pixel inside the edge.
        assert!((right[0] - half * 0.99).abs() < 1e-12);
    }

    #[test]
    fn a_crop_sees_what_the_full_frame_saw_there() {
        let full = Frame::full(Size::new(100, 50));
        let crop = Frame { data: Window { x: 30, y: 10, size: Size::new(20, 20) }, ..full };
        assert_eq!(crop.ray_tangents(0.4, 5, 6), full.ray_tangents(0.4, 35, 16));
    }
}
