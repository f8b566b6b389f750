//! Brute-force blurs by spreading each pixel over its circle of confusion: slow, and what fast methods are compared with.
//!
//! Diameters are rounded to 1/32 of a pixel or 1/256 of themselves, whichever is more, so that each kernel is
//! made once.

use pullfocus_core::{Plane, Size};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The shape that a pixel is spread to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A uniform disc with an edge of one pixel.
    Disc,
    /// A Gaussian with the disc's variance: standard deviation a quarter of the diameter.
    Gaussian,
}

/// A normalised kernel of `2 * reach + 1` pixels squared.
#[derive(Debug, Clone)]
struct Kernel {
    reach: usize,
    weights: Vec<f32>,
}

impl Kernel {
    fn new(shape: Shape, diameter: f64) -> Self {
        let (reach, weight): (usize, Box<dyn Fn(f64) -> f64>) = match shape {
            Shape::Disc => {
                let radius = 0.5 * diameter;
                // Half a pixel of soft edge; below a pixel this is the pixel itself.
                ((radius + 0.5).floor() as usize, Box::new(move |r| (radius + 0.5 - r).clamp(0.0, 1.0)))
            }
            Shape::Gaussian => {
                let sigma = (0.25 * diameter).max(1e-3);
                ((3.0 * sigma).ceil() as usize, Box::new(move |r| (-0.5 * (r / sigma).powi(2)).exp()))
            }
        };
        let side = 2 * reach + 1;
        let mut weights: Vec<f32> = (0..side * side)
            .map(|i| {
                let (x, y) = ((i % side) as f64 - reach as f64, (i / side) as f64 - reach as f64);
                weight(x.hypot(y)) as f32
            })
            .collect();
        let total: f32 = weights.iter().sum();
        if total > 0.0 {
            weights.iter_mut().for_each(|w| *w /= total);
        } else {
            weights = vec![1.0];
            return Self { reach: 0, weights };
        }
        Self { reach, weights }
    }
}

/// Kernels by rounded diameter, and each pixel's kernel.
struct Kernels {
    kernels: Vec<Kernel>,
    of_pixel: Vec<u32>,
}

/// A number that is equal for diameters that share a kernel: 32 per pixel up to 8 px, then 1/256 of themselves.
fn step(diameter: f32) -> u32 {
    let d = f64::from(diameter.abs());
    if d < 8.0 { (d * 32.0).round() as u32 } else { (256.0 + 256.0 * (d / 8.0).ln()).round() as u32 }
}

fn of_step(step: u32) -> f64 {
    let s = f64::from(step);
    if s < 256.0 { s / 32.0 } else { 8.0 * ((s - 256.0) / 256.0).exp() }
}

impl Kernels {
    fn new(shape: Shape, diameter: &Plane) -> Self {
        let mut places: BTreeMap<u32, u32> = diameter.data().iter().map(|&c| (step(c), 0)).collect();
        let mut kernels = Vec::with_capacity(places.len());
        for (&step, place) in &mut places {
            *place = kernels.len() as u32;
            kernels.push(Kernel::new(shape, of_step(step)));
        }
        let of_pixel = diameter.data().iter().map(|&c| places[&step(c)]).collect();
        Self { kernels, of_pixel }
    }

    fn reach(&self) -> usize {
        self.kernels.iter().map(|k| k.reach).max().unwrap_or(0)
    }
}

/// Rows of destination that are worked on together.
const BAND: usize = 8;

/// Runs `add(source pixel, destination's index in the band, kernel row)` for all that reaches rows `from..to`.
fn reaching(
    size: Size,
    kernels: &Kernels,
    rows: std::ops::Range<usize>,
    mut add: impl FnMut(usize, usize, &[f32]),
) {
    let most = kernels.reach();
    for sy in rows.start.saturating_sub(most)..(rows.end + most).min(size.height) {
        for sx in 0..size.width {
            let source = sy * size.width + sx;
            let kernel = &kernels.kernels[kernels.of_pixel[source] as usize];
            let (r, side) = (kernel.reach, 2 * kernel.reach + 1);
            let columns = sx.saturating_sub(r)..(sx + r + 1).min(size.width);
            for dy in sy.saturating_sub(r).max(rows.start)..(sy + r + 1).min(rows.end) {
                let first = (dy + r - sy) * side + columns.start + r - sx;
                let weights = &kernel.weights[first..first + columns.len()];
                add(source, (dy - rows.start) * size.width + columns.start, weights);
            }
        }
    }
}

/// Runs `band(rows, output slices of these rows)` for all bands in parallel.
fn by_bands(
    size: Size,
    planes: usize,
    band: impl Fn(std::ops::Range<usize>) -> Vec<Vec<f32>> + Sync,
) -> Vec<Plane> {
    let bands: Vec<Vec<Vec<f32>>> = (0..size.height.div_ceil(BAND))
        .into_par_iter()
        .map(|b| band(b * BAND..((b + 1) * BAND).min(size.height)))
        .collect();
    (0..planes)
        .map(|p| {
            let data = bands.iter().flat_map(|band| band[p].iter().copied()).collect();
            Plane::new(size, data).expect("bands cover the picture")
        })
        .collect()
}

/// Spreads `planes`, all alike, and divides by the weight that arrives: constants are kept, depth order is not known.
pub fn normalised(shape: Shape, planes: &[&Plane], diameter: &Plane) -> Vec<Plane> {
    let size = diameter.size();
    let kernels = Kernels::new(shape, diameter);
    by_bands(size, planes.len(), |rows| {
        let area = rows.len() * size.width;
        let mut sums = vec![vec![0.0f32; area]; planes.len()];
        let mut weight = vec![0.0f32; area];
        reaching(size, &kernels, rows, |source, at, row| {
            for (plane, sum) in planes.iter().zip(&mut sums) {
                let value = plane.data()[source];
                sum[at..at + row.len()].iter_mut().zip(row).for_each(|(s, w)| *s += w * value);
            }
            weight[at..at + row.len()].iter_mut().zip(row).for_each(|(s, w)| *s += w);
        });
        for sum in &mut sums {
            for (value, w) in sum.iter_mut().zip(&weight) {
                *value = if *w > 0.0 { *value / w } else { 0.0 };
            }
        }
        sums
    })
}

/// Numbers of depth slices of [`by_depth`].
const SLICES: usize = 64;

/// Spreads discs in slices of signed diameter, which order like depth, and fills each pixel from the nearest slice to the
/// farthest until it is full; what stays empty is divided out.
pub fn by_depth(shape: Shape, planes: &[&Plane], diameter: &Plane) -> Vec<Plane> {
    let size = diameter.size();
    let kernels = Kernels::new(shape, diameter);
    let scale = |c: f32| f64::from(c).asinh();
    let low = diameter.data().iter().map(|&c| scale(c)).fold(f64::INFINITY, f64::min);
    let high = diameter.data().iter().map(|&c| scale(c)).fold(f64::NEG_INFINITY, f64::max);
    let per_slice = SLICES as f64 / (high - low).max(1e-9);
    let slice_of: Vec<u8> = diameter
        .data()
        .iter()
        .map(|&c| (((scale(c) - low) * per_slice) as usize).min(SLICES - 1) as u8)
        .collect();
    by_bands(size, planes.len(), |rows| {
        let area = rows.len() * size.width;
        let channels = planes.len() + 1;
        let mut slices = vec![0.0f32; SLICES * channels * area];
        reaching(size, &kernels, rows, |source, at, row| {
            let base = usize::from(slice_of[source]) * channels * area;
            for channel in 0..channels {
                let value = planes.get(channel).map_or(1.0, |plane| plane.data()[source]);
                let to = base + channel * area + at;
                slices[to..to + row.len()].iter_mut().zip(row).for_each(|(s, w)| *s += w * value);
            }
        });
        let mut sums = vec![vec![0.0f32; area]; planes.len()];
        for pixel in 0..area {
            let mut room = 1.0f32;
            for slice in slices.chunks_exact(channels * area) {
                let weight = slice[planes.len() * area + pixel];
                if weight <= 0.0 {
                    continue;
                }
                let taken = weight.min(room);
                for (channel, sum) in sums.iter_mut().enumerate() {
                    sum[pixel] += slice[channel * area + pixel] / weight * taken;
                }
                room -= taken;
                if room <= 0.0 {
                    break;
                }
            }
            let filled = 1.0 - room;
            if filled > 0.0 {
                sums.iter_mut().for_each(|sum| sum[pixel] /= filled);
            }
        }
        sums
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_have_the_disc_s_variance() {
        for shape in [Shape::Disc, Shape::Gaussian] {
            let diameter = 24.0;
            let kernel = Kernel::new(shape, diameter);
            let side = 2 * kernel.reach + 1;
            let across: f64 = kernel
                .weights
                .iter()
                .enumerate()
                .map(|(i, w)| f64::from(*w) * ((i % side) as f64 - kernel.reach as f64).powi(2))
                .sum();
            // The disc's soft edge and the Gaussian's cut at three deviations: a few parts in a hundred.
            assert!((across / (diameter * diameter / 16.0) - 1.0).abs() < 0.04, "{shape:?} {across}");
        }
    }

    #[test]
    fn rounding_of_diameters_is_fine_and_rises() {
        for d in [0.0, 0.02, 1.0, 7.99, 8.0, 8.1, 77.0, 900.0] {
            let back = of_step(step(d));
            assert!((back - f64::from(d)).abs() <= f64::max(1.0 / 64.0, f64::from(d) / 500.0), "{d}: {back}");
        }
        assert!(step(7.999) <= step(8.001));
    }

    #[test]
    fn without_blur_nothing_changes() {
        let size = Size::new(19, 21);
        let plane = Plane::from_fn(size, |x, y| (x * y) as f32).unwrap();
        let zero = Plane::filled(size, 0.0).unwrap();
        for shape in [Shape::Disc, Shape::Gaussian] {
            assert_eq!(normalised(shape, &[&plane], &zero)[0], plane);
            assert_eq!(by_depth(shape, &[&plane], &zero)[0], plane);
        }
    }

    #[test]
    fn a_near_disc_covers_what_is_behind_it_and_not_the_other_way_round() {
        let size = Size::new(60, 40);
        let near = |x: usize| x < 30;
        let color = Plane::from_fn(size, |x, _| if near(x) { 1.0 } else { 0.0 }).unwrap();
        let blurred_near = Plane::from_fn(size, |x, _| if near(x) { -12.0 } else { 0.0 }).unwrap();
        let spread = by_depth(Shape::Disc, &[&color], &blurred_near);
        assert!(spread[0].at(32, 20) > 0.1, "the near side reaches over the edge");
        let blurred_far = Plane::from_fn(size, |x, _| if near(x) { 0.0 } else { 12.0 }).unwrap();
        let kept = by_depth(Shape::Disc, &[&color], &blurred_far);
        assert_eq!((kept[0].at(29, 20), kept[0].at(30, 20)), (1.0, 0.0));
    }
}
