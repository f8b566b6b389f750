//! Spreading and gathering in f64: every pixel's point spread function as a formula, summed in plain loops.

use crate::grid::Grid;
use pullfocus_core::Psf;
use std::f64::consts::{PI, TAU};

/// What a pixel is spread over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A chosen PSF.
    Psf(Psf),
    /// The square of square spreading.
    Square,
}

/// A picture's circles of confusion and what is spread over them.
#[derive(Debug, Clone, Copy)]
pub struct Spreading<'a> {
    /// The shape.
    pub shape: Shape,
    /// Diameters in pixels of width, of either sign.
    pub diameter: &'a Grid,
    /// Pixels of height for one of width.
    pub vertical_scale: f64,
}

/// `exp(-t) I_n(t)` as the integral of `exp(t (cos a - 1)) cos(n a)` over a half turn. The sum over even steps converges
/// faster than any power of their number.
pub(super) fn lattice_gaussian(t: f64, n: usize) -> f64 {
    let steps = 2 * n + 60 + (12.0 * t.sqrt()) as usize;
    let sum: f64 = (0..steps)
        .map(|i| (i as f64 + 0.5) * PI / steps as f64)
        .map(|a| (t * (a.cos() - 1.0)).exp() * (n as f64 * a).cos())
        .sum();
    sum / steps as f64
}

/// One axis of the Gaussian with variance `t`, cut at four deviations and a pixel: weights from the middle on.
fn axis(t: f64) -> Vec<f64> {
    let reach = (4.0 * t.sqrt()).ceil() as usize + 1;
    let half: Vec<f64> = (0..=reach).map(|n| lattice_gaussian(t, n)).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    half.iter().map(|weight| weight / sum).collect()
}

/// One axis of a box with a pixel's share at either end: the side whose variance is `t`, by bisection.
fn box_axis(t: f64) -> Vec<f64> {
    let of_side = |side: f64| {
        let whole = (0.5 * (side + 1.0)).floor();
        let part = 0.5 * (side - (2.0 * whole - 1.0));
        let mut half = vec![1.0 / side; whole as usize];
        half.push(part / side);
        half
    };
    let variance = |half: &[f64]| half.iter().enumerate().map(|(n, w)| 2.0 * (n * n) as f64 * w).sum::<f64>();
    let (mut low, mut high) = (1.0, 4.0 + 4.0 * t.sqrt());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if variance(&of_side(middle)) < t { low = middle } else { high = middle }
    }
    of_side(low)
}

/// The PSF of a pixel whose circle is `diameter` pixels: distance across and down, and weight. The weights' sum is 1.
pub fn footprint(shape: Shape, diameter: f64, vertical_scale: f64) -> Vec<(isize, isize, f64)> {
    let diameter = diameter.abs();
    if matches!(shape, Shape::Psf(Psf::Gaussian) | Shape::Square) {
        let axis = if shape == Shape::Square { box_axis } else { axis };
        let variance = |scale: f64| (diameter * scale).powi(2) / 16.0;
        let (across, down) = (axis(variance(1.0)), axis(variance(vertical_scale)));
        let both = |half: &[f64]| 1 - half.len() as isize..half.len() as isize;
        return both(&down)
            .flat_map(|y| both(&across).map(move |x| (x, y)))
            .map(|(x, y)| (x, y, across[x.unsigned_abs()] * down[y.unsigned_abs()]))
            .collect();
    }
    // How far a point lies beyond the rim, in pixels of width.
    let beyond = |x: f64, y: f64| match shape {
        Shape::Psf(Psf::Blades { count, rotation_degrees }) => {
            let step = TAU / f64::from(count);
            // Corners at R, with the disc's variance: R^2 (2 + cos(2 pi / n)) / 12 = c^2 / 16.
            let corners = diameter * (0.75 / (2.0 + step.cos())).sqrt();
            let side = |i: u32| {
                let angle = rotation_degrees.to_radians() + (f64::from(i) + 0.5) * step;
                x * angle.cos() + y * angle.sin() - corners * (0.5 * step).cos()
            };
            (0..count).map(side).fold(f64::NEG_INFINITY, f64::max)
        }
        _ => x.hypot(y) - 0.5 * diameter,
    };
    // The rim falls over a pixel of that axis whose pixels are finer.
    let rim = (1.0 / vertical_scale).min(1.0);
    let (wide, high) = (diameter as isize + 3, (diameter * vertical_scale) as isize + 3);
    let weights: Vec<_> = (-high..=high)
        .flat_map(|y| (-wide..=wide).map(move |x| (x, y)))
        .map(|(x, y)| (x, y, (0.5 - beyond(x as f64, y as f64 / vertical_scale) / rim).clamp(0.0, 1.0)))
        .filter(|(_, _, weight)| *weight > 0.0)
        .collect();
    let sum: f64 = weights.iter().map(|(_, _, weight)| weight).sum();
    weights.into_iter().map(|(x, y, weight)| (x, y, weight / sum)).collect()
}

impl Spreading<'_> {
    /// Calls `f(pixel, other, weight)` for every pixel and every other one that its footprint reaches.
    fn pairs(&self, mut f: impl FnMut(usize, usize, f64)) {
        let Grid { width, height, data } = self.diameter;
        let mut last = (f64::NAN, Vec::new());
        for (pixel, &diameter) in data.iter().enumerate() {
            if last.0 != diameter {
                last = (diameter, footprint(self.shape, diameter, self.vertical_scale));
            }
            for &(dx, dy, weight) in &last.1 {
                let to = (pixel % width).checked_add_signed(dx).zip((pixel / width).checked_add_signed(dy));
                if let Some((x, y)) = to.filter(|(x, y)| x < width && y < height) {
                    f(pixel, y * width + x, weight);
                }
            }
        }
    }

    /// Each pixel's values go where its footprint reaches (third paper, 3.1). Sums, not divided by anything.
    pub fn spread(&self, values: &Grid) -> Grid {
        let mut sums = Grid::filled(values.width, values.height, 0.0);
        self.pairs(|from, to, weight| sums.data[to] += weight * values.data[from]);
        sums
    }

    /// Each pixel takes what lies under its own footprint (third paper, 3.2). Sums, not divided by anything.
    pub fn gather(&self, values: &Grid) -> Grid {
        let mut sums = Grid::filled(values.width, values.height, 0.0);
        self.pairs(|to, from, weight| sums.data[to] += weight * values.data[from]);
        sums
    }
}

/// What `filter` makes of `values` weighted by `gamma` (1 where none is given), divided by what it makes of the weight.
pub fn normalised(values: &Grid, gamma: Option<&Grid>, filter: impl Fn(&Grid) -> Grid) -> Grid {
    let ones = Grid::filled(values.width, values.height, 1.0);
    let gamma = gamma.unwrap_or(&ones).map(|g| g.max(1e-15));
    filter(&values.zip(&gamma, |v, g| v * g)).zip(&filter(&gamma), |sum, weight| sum / weight)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Shape; 5] = [
        Shape::Psf(Psf::Gaussian),
        Shape::Psf(Psf::Disc),
        Shape::Psf(Psf::Blades { count: 3, rotation_degrees: 20.0 }),
        Shape::Psf(Psf::Blades { count: 6, rotation_degrees: 0.0 }),
        Shape::Square,
    ];

    #[test]
    fn every_shape_has_the_disc_s_variance_and_is_a_pixel_without_blur() {
        for shape in SHAPES {
            for scale in [0.5, 1.0, 1.6] {
                let only = footprint(shape, 0.0, scale);
                // The Gaussian's integral is 0 but for rounding.
                assert_eq!(only.iter().filter(|(.., weight)| weight.abs() > 1e-12).count(), 1, "{shape:?}");
                let variance = |axis: usize| {
                    let moments = footprint(shape, 24.0, scale).into_iter();
                    moments.map(|(x, y, w)| w * ([x, y][axis] as f64).powi(2)).sum::<f64>()
                };
                let (across, down) = (variance(0) / 36.0, variance(1) / (36.0 * scale * scale));
                // The rim's and the pixels' own width; the Gaussian's cut. Where pixels are not square the rim is as narrow
                // as the finer side, and a straight side steps along the coarser.
                let least = if scale == 1.0 { 0.03 } else { 0.08 };
                let error = (across - 1.0).abs().max((down - 1.0).abs());
                assert!(error < least, "{shape:?}, {scale}: {across} {down}");
            }
        }
    }

    #[test]
    fn gathering_is_the_transpose_of_spreading() {
        let diameter = Grid::from_fn(17, 13, |x, y| 0.4 * x as f64 - 0.3 * y as f64);
        let (a, b) =
            (Grid::from_fn(17, 13, |x, y| (x * y) as f64), Grid::from_fn(17, 13, |x, y| (x + 3 * y) as f64));
        for shape in SHAPES {
            let spreading = Spreading { shape, diameter: &diameter, vertical_scale: 1.2 };
            let product = |a: &Grid, b: &Grid| a.zip(b, |a, b| a * b).sum();
            let (one, other) = (product(&spreading.spread(&a), &b), product(&a, &spreading.gather(&b)));
            // Rounding of f64.
            assert!((one / other - 1.0).abs() < 1e-12, "{shape:?}: {one} {other}");
        }
    }
}
