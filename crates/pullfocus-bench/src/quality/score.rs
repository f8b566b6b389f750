//! How far a picture is from its reference.

use crate::data::{DevScene, Reference};
use crate::panels::Crop;
use anyhow::Result;
use pullfocus::{Distance, Picture, Plane};
use pullfocus_metrics::{display, flip, masked_mean, not_finite, psnr_of, squared_error};

/// PSNR in dB (higher is better) and FLIP (lower is better), over the picture and over the band around depth edges.
#[derive(Debug, Clone, Copy)]
pub struct Score {
    /// Over the whole picture.
    pub psnr: f64,
    /// Over the whole picture.
    pub flip: f64,
    /// In the band; NaN-free: as over the picture where there is no edge.
    pub band_psnr: f64,
    /// In the band.
    pub band_flip: f64,
}

/// A reference, ready to be compared with.
pub struct Truth {
    display: [Plane; 3],
    everywhere: Plane,
    /// 1 in the band around depth edges.
    pub band: Plane,
}

/// Neighbours are a depth edge where one is this much farther than the other.
const EDGE: f32 = 1.1;

impl Truth {
    /// Prepares a reference: its band is as wide as its largest circle of confusion, its middle on the depth edges.
    pub fn new(scene: &DevScene, reference: &Reference) -> Result<Self> {
        let Distance::Depth { plane, .. } = &scene.input.distance else {
            anyhow::bail!("{} has no depth", scene.name)
        };
        let reach = (0.5 * reference.largest_circle).ceil().max(1.0) as usize;
        Ok(Self {
            display: display(&reference.picture)?,
            everywhere: Plane::filled(plane.size(), 1.0)?,
            band: grown(&depth_edges(plane)?, reach)?,
        })
    }

    /// The part of the picture that the band takes.
    pub fn band_part(&self) -> f64 {
        self.band.data().iter().map(|v| f64::from(*v)).sum::<f64>() / self.band.data().len().max(1) as f64
    }

    /// Scores a linear picture.
    pub fn score(&self, picture: &Picture) -> Result<Score> {
        let odd = not_finite(picture.planes());
        anyhow::ensure!(odd == 0, "{odd} values of the picture are no numbers");
        let shown = display(picture)?;
        let error = squared_error(&self.display, &shown)?;
        let map = flip(&self.display, &shown)?;
        let mean = |map: &Plane, mask: &Plane| masked_mean(map, mask);
        let over = mean(&error, &self.everywhere)?.unwrap_or_default();
        let in_band = mean(&error, &self.band)?.unwrap_or(over);
        Ok(Score {
            psnr: psnr_of(over),
            flip: map.mean,
            band_psnr: psnr_of(in_band),
            band_flip: mean(&map.map, &self.band)?.unwrap_or(map.mean),
        })
    }

    /// The part of `width` by `height` pixels where a picture's FLIP is highest.
    pub fn worst_place(&self, picture: &Picture, width: usize, height: usize) -> Result<Crop> {
        let map = flip(&self.display, &display(picture)?)?.map;
        let size = map.size();
        let (width, height) = (width.min(size.width), height.min(size.height));
        // Sums over columns up to each row, so that a place costs one row of subtractions.
        let mut sums = vec![0.0f64; (size.width + 1) * (size.height + 1)];
        let row = size.width + 1;
        for y in 0..size.height {
            for x in 0..size.width {
                let i = (y + 1) * row + x + 1;
                sums[i] = f64::from(map.at(x, y)) + sums[i - 1] + sums[i - row] - sums[i - row - 1];
            }
        }
        let total = |x: usize, y: usize| {
            let (top, bottom) = (y * row, (y + height) * row);
            sums[bottom + x + width] - sums[bottom + x] - sums[top + x + width] + sums[top + x]
        };
        let places = (0..=size.height - height)
            .step_by(4)
            .flat_map(|y| (0..=size.width - width).step_by(4).map(move |x| (x, y)));
        let best = places.max_by(|a, b| total(a.0, a.1).total_cmp(&total(b.0, b.1))).unwrap_or_default();
        Ok([best.0, best.1, width, height])
    }
}

/// 1 on both sides of a depth edge.
fn depth_edges(depth: &Plane) -> Result<Plane> {
    let size = depth.size();
    let mut edges = Plane::filled(size, 0.0)?;
    let apart = |a: f32, b: f32| a.max(b) > EDGE * a.min(b);
    for y in 0..size.height {
        for x in 0..size.width {
            let here = depth.at(x, y);
            if x + 1 < size.width && apart(here, depth.at(x + 1, y)) {
                edges.row_mut(y)[x] = 1.0;
                edges.row_mut(y)[x + 1] = 1.0;
            }
            if y + 1 < size.height && apart(here, depth.at(x, y + 1)) {
                edges.row_mut(y)[x] = 1.0;
                edges.row_mut(y + 1)[x] = 1.0;
            }
        }
    }
    Ok(edges)
}

/// 1 where the mask is 1 within `reach` pixels: squares, by rows and then by columns.
fn grown(mask: &Plane, reach: usize) -> Result<Plane> {
    let size = mask.size();
    let near = |n: usize, at: &dyn Fn(usize) -> f32| -> Vec<f32> {
        let mut since = usize::MAX / 2;
        let mut out: Vec<f32> = vec![0.0; n];
        for direction in [false, true] {
            for i in 0..n {
                let i = if direction { n - 1 - i } else { i };
                since = if at(i) > 0.0 { 0 } else { since + 1 };
                if since <= reach {
                    out[i] = 1.0;
                }
            }
            since = usize::MAX / 2;
        }
        out
    };
    let mut rows = Plane::filled(size, 0.0)?;
    for y in 0..size.height {
        let row = near(size.width, &|x| mask.at(x, y));
        rows.row_mut(y).copy_from_slice(&row);
    }
    let mut both = Plane::filled(size, 0.0)?;
    for x in 0..size.width {
        for (y, value) in near(size.height, &|y| rows.at(x, y)).into_iter().enumerate() {
            both.row_mut(y)[x] = value;
        }
    }
    Ok(both)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus::Size;

    #[test]
    fn a_band_lies_around_the_edge_and_nowhere_else() {
        let depth = Plane::from_fn(Size::new(30, 10), |x, _| if x < 15 { 1.0 } else { 2.0 }).unwrap();
        let band = grown(&depth_edges(&depth).unwrap(), 3).unwrap();
        let row: Vec<usize> = (0..30).filter(|&x| band.at(x, 5) > 0.0).collect();
        assert_eq!(row, (11..=18).collect::<Vec<_>>());
    }

    #[test]
    fn a_slope_is_no_edge() {
        let depth = Plane::from_fn(Size::new(30, 10), |x, _| 10.0 + x as f32).unwrap();
        assert!(depth_edges(&depth).unwrap().data().iter().all(|v| *v == 0.0));
    }

    #[test]
    fn the_worst_place_is_found() {
        let size = Size::new(64, 48);
        let grey = Picture::opaque(vec![Plane::filled(size, 0.2).unwrap(); 3]);
        let mut spotted = grey.clone();
        for plane in &mut spotted.colors {
            (30..38).for_each(|y| plane.row_mut(y)[40..48].fill(0.9));
        }
        let truth = Truth {
            display: display(&grey).unwrap(),
            everywhere: Plane::filled(size, 1.0).unwrap(),
            band: Plane::filled(size, 0.0).unwrap(),
        };
        let [x, y, w, h] = truth.worst_place(&spotted, 16, 16).unwrap();
        assert!(x <= 40 && x + w >= 48 && y <= 30 && y + h >= 38, "{x} {y}");
        let score = truth.score(&spotted).unwrap();
        // No edge: the band's figures are the picture's.
        assert!(score.psnr == score.band_psnr && score.flip == score.band_flip && score.flip > 0.0);
    }
}
