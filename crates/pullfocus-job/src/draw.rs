//! Small 8-bit sRGB pictures: views of linear planes and circles of confusion, labels, contact sheets.

use font8x8::UnicodeFonts;
use pullfocus_core::{Picture, Plane, Size, srgb};

/// An 8-bit sRGB picture, RGB interleaved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Canvas {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// RGB, row by row.
    pub data: Vec<u8>,
}

/// Linear light as an encoded 0..1 sRGB value; clips, and takes NaN as 0.
pub fn to_srgb(linear: f32) -> f32 {
    srgb::encode(if linear.is_nan() { 0.0 } else { linear.clamp(0.0, 1.0) })
}

fn byte(encoded: f32) -> u8 {
    // In range after to_srgb or a clamp.
    (encoded * 255.0 + 0.5) as u8
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(width: usize, height: usize, color: [u8; 3]) -> Self {
        Self { width, height, data: color.repeat(width * height) }
    }

    /// A canvas whose pixels are `f(index)`, counted row by row.
    pub fn from_fn(size: Size, mut f: impl FnMut(usize) -> [u8; 3]) -> Self {
        let data = (0..size.area()).flat_map(&mut f).collect();
        Self { width: size.width, height: size.height, data }
    }

    /// The first three colour planes as sRGB (one plane as grey), clipped to 0..1; premultiplied colour lies on
    /// black.
    pub fn from_picture(picture: &Picture) -> Self {
        let last = picture.colors.len().saturating_sub(1);
        let planes = [0, 1.min(last), 2.min(last)].map(|i| picture.colors.get(if last < 2 { 0 } else { i }));
        Self::from_fn(picture.size(), |i| {
            planes.map(|plane| {
                byte(to_srgb(plane.and_then(|plane| plane.data().get(i)).copied().unwrap_or(0.0)))
            })
        })
    }

    /// Planes that are sRGB already, 0 to 1.
    pub fn from_srgb(planes: &[Plane; 3]) -> Self {
        Self::from_fn(planes[0].size(), |i| {
            planes.each_ref().map(|plane| byte(plane.data()[i].clamp(0.0, 1.0)))
        })
    }

    /// The view of a signed circle of confusion: front red, in focus green, behind blue, full at `range` pixels.
    pub fn from_coc(coc: &Plane, range: f32) -> Self {
        Self::from_fn(coc.size(), |i| coc_color(coc.data()[i], range))
    }

    /// A grey view of depth, near is bright, after 1/z so that infinity is black.
    pub fn from_inverse_depth(inverse: &Plane) -> Self {
        let most = inverse.data().iter().copied().fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        Self::from_fn(inverse.size(), |i| [byte((inverse.data()[i] / most).clamp(0.0, 1.0).sqrt()); 3])
    }

    /// Lays another canvas over this one, its upper left corner at (x, y); what reaches beyond is left out.
    pub fn put(&mut self, other: &Self, x: usize, y: usize) {
        let width = other.width.min(self.width.saturating_sub(x));
        for row in 0..other.height.min(self.height.saturating_sub(y)) {
            let from = 3 * row * other.width;
            let to = 3 * ((y + row) * self.width + x);
            self.data[to..to + 3 * width].copy_from_slice(&other.data[from..from + 3 * width]);
        }
    }

    /// Writes text with its upper left corner at (x, y), letters 8 pixels wide and high times `scale`.
    pub fn text(&mut self, text: &str, x: usize, y: usize, scale: usize, color: [u8; 3]) {
        for (place, letter) in text.chars().enumerate() {
            let Some(glyph) = font8x8::BASIC_FONTS.get(letter) else { continue };
            for row in 0..8 * scale {
                for column in 0..8 * scale {
                    let (px, py) = (x + 8 * scale * place + column, y + row);
                    let set = glyph[row / scale] >> (column / scale) & 1 == 1;
                    if set && px < self.width && py < self.height {
                        let at = 3 * (py * self.width + px);
                        self.data[at..at + 3].copy_from_slice(&color);
                    }
                }
            }
        }
    }
}

/// The colour of one signed diameter in pixels.
///
/// Green up to about a pixel, which is what a viewer takes for sharp, then red or blue that grows with the
/// square root of the diameter, so that small blurs are told apart too.
pub fn coc_color(c: f32, range: f32) -> [u8; 3] {
    if c.is_nan() {
        return [0; 3];
    }
    let size = c.abs();
    let sharp = (-size * size).exp();
    let strength = (size / range.max(f32::MIN_POSITIVE)).clamp(0.0, 1.0).sqrt();
    let side = byte(((1.0 - sharp) * (0.25 + 0.75 * strength)).clamp(0.0, 1.0));
    let green = byte(0.85 * sharp);
    // A little grey in the sides keeps them readable on dark screens.
    let wash = byte(0.25 * (1.0 - sharp) * strength);
    if c < 0.0 { [side, green.max(wash), wash] } else { [wash, green.max(wash), side] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_is_red_focus_green_behind_blue() {
        let most = |color: [u8; 3]| (0..3).max_by_key(|&i| color[i]).unwrap();
        assert_eq!(most(coc_color(-20.0, 20.0)), 0);
        assert_eq!(most(coc_color(0.0, 20.0)), 1);
        assert_eq!(most(coc_color(20.0, 20.0)), 2);
        assert_eq!(most(coc_color(-3.0, 20.0)), 0);
        assert!(coc_color(-20.0, 20.0)[0] > coc_color(-3.0, 20.0)[0]);
        assert_eq!(coc_color(f32::NAN, 20.0), [0; 3]);
        assert_eq!(most(coc_color(f32::INFINITY, 0.0)), 2);
    }

    #[test]
    fn srgb_is_the_standards() {
        // IEC 61966-2-1: 0.5 encodes to 0.7354; 8 bits resolve 0.004.
        assert!((to_srgb(0.5) - 0.735_36).abs() < 1e-4);
        assert_eq!([-1.0, 7.0, f32::NAN].map(|linear| byte(to_srgb(linear))), [0, 255, 0]);
    }

    #[test]
    fn text_and_pictures_stay_inside() {
        let mut canvas = Canvas::new(20, 10, [9, 9, 9]);
        canvas.text("f/2.8 and on", 3, 4, 2, [255; 3]);
        assert!(canvas.data.contains(&255) && canvas.data.len() == 600);
        canvas.put(&Canvas::new(50, 50, [1, 2, 3]), 18, 9);
        assert_eq!(&canvas.data[597..], [1, 2, 3]);
        canvas.put(&Canvas::new(5, 5, [1, 2, 3]), 40, 40);
    }

    #[test]
    fn a_grey_picture_is_grey() {
        let picture = Picture::opaque(vec![Plane::filled(Size::new(2, 1), 1.0).unwrap()]);
        assert_eq!(Canvas::from_picture(&picture).data, [255; 6]);
    }
}
