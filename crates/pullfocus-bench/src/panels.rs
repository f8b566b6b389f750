//! Pictures put side by side for documents.

use anyhow::{Result, ensure};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use pullfocus::{Picture, Plane};

/// 8-bit sRGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    rgb: Vec<u8>,
}

/// A rectangle: left, top, width, height.
pub type Crop = [usize; 4];

impl Panel {
    /// A linear picture as a screen shows it.
    pub fn of(picture: &Picture) -> Result<Self> {
        let planes = pullfocus_metrics::display(picture)?;
        Ok(Self::of_display(&planes))
    }

    /// Planes that are sRGB already, 0 to 1.
    pub fn of_display(planes: &[Plane; 3]) -> Self {
        let size = planes[0].size();
        let mut rgb = Vec::with_capacity(3 * size.area());
        for ((r, g), b) in planes[0].data().iter().zip(planes[1].data()).zip(planes[2].data()) {
            rgb.extend([r, g, b].map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8));
        }
        Self { width: size.width, height: size.height, rgb }
    }

    /// Circles of confusion: black for 0, white for `most` pixels (first paper, figure 4).
    pub fn of_circles(circles: &Plane, most: f32) -> Self {
        let grey = circles.data().iter().flat_map(|c| [((c.abs() / most).min(1.0) * 255.0 + 0.5) as u8; 3]);
        Self { width: circles.size().width, height: circles.size().height, rgb: grey.collect() }
    }

    /// A part of it; what lies outside is left away.
    pub fn crop(&self, [x, y, width, height]: Crop) -> Self {
        let (width, height) =
            (width.min(self.width.saturating_sub(x)), height.min(self.height.saturating_sub(y)));
        let rows =
            (y..y + height).flat_map(|row| self.rgb[3 * (row * self.width + x)..][..3 * width].to_vec());
        Self { width, height, rgb: rows.collect() }
    }

    /// Each pixel as a square of `factor` pixels.
    pub fn enlarged(&self, factor: usize) -> Self {
        let (width, height) = (self.width * factor, self.height * factor);
        let pixels = (0..width * height).flat_map(|i| {
            let from = 3 * ((i / width / factor) * self.width + i % width / factor);
            self.rgb[from..from + 3].to_vec()
        });
        Self { width, height, rgb: pixels.collect() }
    }

    /// Panels in rows of `columns`, white lines between them.
    pub fn grid(panels: &[Self], columns: usize) -> Result<Self> {
        const GAP: usize = 4;
        ensure!(!panels.is_empty() && columns > 0, "a grid needs panels");
        let (w, h) = (panels[0].width, panels[0].height);
        ensure!(panels.iter().all(|p| (p.width, p.height) == (w, h)), "panels of a grid have one size");
        let columns = columns.min(panels.len());
        let rows = panels.len().div_ceil(columns);
        let (width, height) = (columns * (w + GAP) - GAP, rows * (h + GAP) - GAP);
        let mut rgb = vec![255u8; 3 * width * height];
        for (i, panel) in panels.iter().enumerate() {
            let (left, top) = ((i % columns) * (w + GAP), (i / columns) * (h + GAP));
            for row in 0..h {
                let to = 3 * ((top + row) * width + left);
                rgb[to..to + 3 * w].copy_from_slice(&panel.rgb[3 * row * w..][..3 * w]);
            }
        }
        Ok(Self { width, height, rgb })
    }

    /// As a PNG file.
    pub fn to_png(&self) -> Result<Vec<u8>> {
        let mut bytes = vec![];
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive).write_image(
            &self.rgb,
            self.width as u32,
            self.height as u32,
            ExtendedColorType::Rgb8,
        )?;
        Ok(bytes)
    }

    /// As a JPEG file.
    pub fn to_jpeg(&self) -> Result<Vec<u8>> {
        let mut bytes = vec![];
        JpegEncoder::new_with_quality(&mut bytes, 90).write_image(
            &self.rgb,
            self.width as u32,
            self.height as u32,
            ExtendedColorType::Rgb8,
        )?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus::Size;

    fn grey(width: usize, height: usize, value: f32) -> Panel {
        Panel::of_circles(&Plane::filled(Size::new(width, height), value).unwrap(), 1.0)
    }

    #[test]
    fn grids_keep_their_panels_apart() {
        let grid = Panel::grid(&[grey(3, 2, 0.0), grey(3, 2, 0.0), grey(3, 2, 1.0)], 2).unwrap();
        assert_eq!((grid.width, grid.height), (10, 8));
        assert_eq!(grid.crop([0, 0, 3, 2]), grey(3, 2, 0.0));
        assert_eq!(grid.crop([0, 6, 3, 2]), grey(3, 2, 1.0));
        assert_eq!(grid.crop([3, 0, 4, 2]), grey(4, 2, 1.0), "the gap is white");
        assert!(Panel::grid(&[grey(3, 2, 0.0), grey(2, 2, 0.0)], 2).is_err());
    }

    #[test]
    fn crops_stay_inside_and_enlarge() {
        let crop = grey(5, 5, 0.5).crop([3, 4, 10, 10]);
        assert_eq!((crop.width, crop.height), (2, 1));
        assert_eq!(crop.enlarged(3), grey(6, 3, 0.5));
    }

    #[test]
    fn files_can_be_read_back() {
        let panel = grey(20, 10, 0.25);
        let png = image::load_from_memory(&panel.to_png().unwrap()).unwrap().to_rgb8();
        assert_eq!(png.as_raw(), &panel.rgb);
        assert_eq!(image::load_from_memory(&panel.to_jpeg().unwrap()).unwrap().width(), 20);
    }
}
