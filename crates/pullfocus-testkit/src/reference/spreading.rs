//! Spreading and gathering in f64: every pixel's point spread function as a formula, summed in plain loops.

use crate::grid::Grid;
use pullfocus_core::aperture::Mask;
use pullfocus_core::{Aperture, ApertureShape};
use std::f64::consts::{PI, TAU};

/// What a pixel is spread over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape<'a> {
    /// The lattice's Gaussian.
    Gaussian,
    /// The square of square spreading.
    Square,
    /// The aperture, its rim falling over a pixel.
    Aperture(&'a Aperture),
    /// What of each pixel lies inside the rim of the aperture, which is no picture: the mean of 16 x 16 points.
    Covered(&'a Aperture),
}

/// A picture's circles of confusion and what is spread over them.
#[derive(Debug, Clone, Copy)]
pub struct Spreading<'a> {
    /// The shape.
    pub shape: Shape<'a>,
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

/// How far (x, y) lies beyond the rim of an iris whose corners lie at 1; sides are arcs through two corners.
pub(super) fn beyond_iris(count: u32, roundness: f64, rotation: f64, x: f64, y: f64) -> f64 {
    let step = TAU / f64::from(count);
    let side = |i: u32| {
        let angle = rotation + (f64::from(i) + 0.5) * step;
        // Along the side's direction, and along the side.
        let (u, v) = (x * angle.cos() + y * angle.sin(), y * angle.cos() - x * angle.sin());
        let chord = (0.5 * step).cos();
        if roundness == 0.0 {
            return u - chord;
        }
        // The arc's centre lies behind its chord, by Pythagoras over half the chord.
        let radius = 1.0 / roundness;
        let back = (radius * radius - (0.5 * step).sin().powi(2)).sqrt();
        (u - chord + back).hypot(v) - radius
    };
    (0..count).map(side).fold(f64::NEG_INFINITY, f64::max)
}

/// Where the corners lie, in diameters, so that an iris has the variance of the disc: summed over rings of rays.
pub(super) fn corners(count: u32, roundness: f64) -> f64 {
    let rays = 4000;
    let (mut squares, mut fourths) = (0.0, 0.0);
    for i in 0..rays {
        let angle = (f64::from(i) + 0.5) * TAU / f64::from(rays);
        let (mut low, mut high) = (0.0, 1.1);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            let within = beyond_iris(count, roundness, 0.0, middle * angle.cos(), middle * angle.sin()) < 0.0;
            if within { low = middle } else { high = middle }
        }
        squares += f64::powi(low, 2);
        fourths += f64::powi(low, 4);
    }
    (0.25 * squares / fourths).sqrt()
}

/// What of a mask lies on the pixel at (x, y): every one of the mask's pixels by the area that both share.
pub(super) fn on_pixel(mask: &Mask, unit: [f64; 2], x: isize, y: isize) -> f64 {
    // Both ends of the pixel in the mask.
    let ends = |at: isize, unit: f64, count: usize| {
        [-0.5, 0.5].map(|half| 0.5 * count as f64 + (at as f64 + half) * unit)
    };
    let (across, down) = (ends(x, unit[0], mask.width()), ends(y, unit[1], mask.height()));
    let shared = |i: usize, [low, high]: [f64; 2]| (high.min(i as f64 + 1.0) - low.max(i as f64)).max(0.0);
    let of = |i: usize| shared(i % mask.width(), across) * shared(i / mask.width(), down);
    mask.data().iter().enumerate().map(|(i, value)| f64::from(*value) * of(i)).sum()
}

/// The PSF of a pixel whose circle is `diameter` pixels: distance across and down, and weight. The weights' sum is 1.
pub fn footprint(shape: Shape<'_>, diameter: f64, vertical_scale: f64) -> Vec<(isize, isize, f64)> {
    Kernel::new(shape).footprint(diameter, vertical_scale)
}

/// A shape, and what of it does not depend on the diameter.
struct Kernel<'a> {
    shape: Shape<'a>,
    /// See [`corners`]; 0 for what has none.
    corners: f64,
    /// A picture, turned.
    mask: Option<Mask>,
}

impl<'a> Kernel<'a> {
    fn new(shape: Shape<'a>) -> Self {
        let (Shape::Aperture(aperture) | Shape::Covered(aperture)) = shape else {
            return Self { shape, corners: 0.0, mask: None };
        };
        let (corners, mask) = match &aperture.shape {
            ApertureShape::Disc => (0.0, None),
            ApertureShape::Blades(count) => (corners(*count, aperture.roundness), None),
            ApertureShape::Image(mask) => (0.0, Some(mask.turned(aperture.rotation_degrees))),
        };
        Self { shape, corners, mask }
    }

    fn footprint(&self, diameter: f64, vertical_scale: f64) -> Vec<(isize, isize, f64)> {
        let (Shape::Aperture(aperture) | Shape::Covered(aperture)) = self.shape else {
            let axis = if self.shape == Shape::Square { box_axis } else { axis };
            let variance = |scale: f64| (diameter * scale).powi(2) / 16.0;
            let (across, down) = (axis(variance(1.0)), axis(variance(vertical_scale)));
            let both = |half: &[f64]| 1 - half.len() as isize..half.len() as isize;
            return both(&down)
                .flat_map(|y| both(&across).map(move |x| (x, y)))
                .map(|(x, y)| (x, y, across[x.unsigned_abs()] * down[y.unsigned_abs()]))
                .collect();
        };
        // In front of focus all is turned over.
        let sign = if diameter < 0.0 { -1 } else { 1 };
        let diameter = diameter.abs();
        if self.mask.is_some() && diameter < 1e-3 {
            return vec![(0, 0, 1.0)];
        }
        // A triangle's corners lie at 0.71 diameters, those of a turned picture's frame too.
        let squeeze = aperture.squeeze;
        let reach = |scale: f64| (0.75 * diameter * scale) as isize + 3;
        let (wide, high) = (reach(1.0 / squeeze), reach(vertical_scale));
        let weights: Vec<_> = (-high..=high)
            .flat_map(|y| (-wide..=wide).map(move |x| (x, y)))
            .map(|(x, y)| (x, y, self.weight(aperture, diameter, vertical_scale, (sign * x, sign * y))))
            .filter(|(_, _, weight)| *weight > 0.0)
            .collect();
        let sum: f64 = weights.iter().map(|(_, _, weight)| weight).sum();
        weights.into_iter().map(|(x, y, weight)| (x, y, weight / sum)).collect()
    }

    fn weight(&self, aperture: &Aperture, diameter: f64, scale: f64, (x, y): (isize, isize)) -> f64 {
        let squeeze = aperture.squeeze;
        if let (Some(mask), ApertureShape::Image(whole)) = (&self.mask, &aperture.shape) {
            let unit = whole.width().max(whole.height()) as f64 / diameter;
            return on_pixel(mask, [unit * squeeze, unit / scale], x, y);
        }
        // The rim falls over a pixel of that axis whose pixels are finer.
        let rim = (1.0 / scale).min(squeeze).min(1.0);
        let beyond = |x: f64, y: f64| self.beyond(aperture, diameter, x * squeeze, y / scale);
        let (x, y) = (x as f64, y as f64);
        if !matches!(self.shape, Shape::Covered(_)) {
            return (0.5 - beyond(x, y) / rim).clamp(0.0, 1.0);
        }
        // A circle below a hundredth of a pixel would be missed by every point.
        if diameter < 0.01 {
            return if x == 0.0 && y == 0.0 { 1.0 } else { 0.0 };
        }
        const POINTS: usize = 16;
        let place = |i: usize| (i as f64 + 0.5) / POINTS as f64 - 0.5;
        let inside = |i: &usize| beyond(x + place(i % POINTS), y + place(i / POINTS)) < 0.0;
        // Far from the rim one point is as good as all.
        let far = beyond(x, y).abs() > 1.5 * squeeze.max(1.0 / scale).max(1.0);
        if far {
            return if beyond(x, y) < 0.0 { 1.0 } else { 0.0 };
        }
        (0..POINTS * POINTS).filter(inside).count() as f64 / (POINTS * POINTS) as f64
    }

    /// How far a point lies beyond the rim, in pixels before they are squeezed.
    fn beyond(&self, aperture: &Aperture, diameter: f64, x: f64, y: f64) -> f64 {
        let size = self.corners * diameter;
        match aperture.shape {
            ApertureShape::Blades(count) if size > 0.0 => {
                let turn = aperture.rotation_degrees.to_radians();
                size * beyond_iris(count, aperture.roundness, turn, x / size, y / size)
            }
            // Without blur every side passes through the middle, whatever its bend.
            ApertureShape::Blades(_) => x.hypot(y),
            _ => x.hypot(y) - 0.5 * diameter,
        }
    }
}

impl Spreading<'_> {
    /// Calls `f(pixel, other, weight)` for every pixel and every other one that its footprint reaches.
    fn pairs(&self, mut f: impl FnMut(usize, usize, f64)) {
        let Grid { width, height, data } = self.diameter;
        let kernel = Kernel::new(self.shape);
        let mut last = (f64::NAN, Vec::new());
        for (pixel, &diameter) in data.iter().enumerate() {
            if last.0 != diameter {
                last = (diameter, kernel.footprint(diameter, self.vertical_scale));
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

    fn apertures() -> [Aperture; 4] {
        [
            Aperture::DISC,
            Aperture::blades(3, 20.0),
            Aperture::blades(6, 0.0),
            Aperture { roundness: 0.4, ..Aperture::blades(5, 50.0) },
        ]
    }

    fn shapes(apertures: &[Aperture]) -> impl Iterator<Item = Shape<'_>> {
        [Shape::Gaussian, Shape::Square].into_iter().chain(apertures.iter().map(Shape::Aperture))
    }

    #[test]
    fn every_shape_has_the_disc_s_variance_and_is_a_pixel_without_blur() {
        for shape in shapes(&apertures()) {
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
        for shape in shapes(&apertures()) {
            let spreading = Spreading { shape, diameter: &diameter, vertical_scale: 1.2 };
            let product = |a: &Grid, b: &Grid| a.zip(b, |a, b| a * b).sum();
            let (one, other) = (product(&spreading.spread(&a), &b), product(&a, &spreading.gather(&b)));
            // Rounding of f64.
            assert!((one / other - 1.0).abs() < 1e-12, "{shape:?}: {one} {other}");
        }
    }
}
