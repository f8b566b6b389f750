//! The tensor filter in f64: sites by a quadtree that is cut from above, or by skip level, and each one's two Gaussians as plain sums.

use super::spreading::lattice_gaussian;
use crate::grid::Grid;
use pullfocus_core::Tensor;
use pullfocus_core::tensor::{EVEN, EVEN_FADE, FADE, PATTERN, Sites};
use std::f64::consts::PI;

/// One site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Where it lies; whole numbers are middles of pixels.
    pub at: [f64; 2],
    /// How far away the next ones are, in pixels.
    pub distance: f64,
    /// Variance of its blur along the width, in square pixels.
    pub variance: f64,
    /// How much of it is there, the rest being left to its four parts.
    pub share: f64,
}

/// A picture's circles of confusion and how they are blurred.
#[derive(Debug, Clone, Copy)]
pub struct TensorFilter<'a> {
    /// The settings; the steps are sums of Gaussians whatever they say.
    pub settings: Tensor,
    /// Diameters in pixels of width, of either sign.
    pub diameter: &'a Grid,
    /// Pixels of height for one of width.
    pub vertical_scale: f64,
}

impl TensorFilter<'_> {
    /// The circle of a pixel along the narrower axis.
    fn circle(&self, x: usize, y: usize) -> f64 {
        self.diameter.data[y * self.diameter.width + x].abs() * self.vertical_scale.min(1.0)
    }

    /// The variances of both steps along an axis.
    fn steps(&self, site: &Site, axis: usize) -> [f64; 2] {
        let variance = site.variance * if axis == 0 { 1.0 } else { self.vertical_scale.powi(2) };
        let k = -PATTERN.ln() / (2.0 * PI * PI);
        // g (v - g) = k d^2 v.
        let root = (variance * variance / 4.0 - k * site.distance.powi(2) * variance).max(0.0).sqrt();
        let gathered = if site.distance > 1.0 { variance / 2.0 - root } else { 0.0 };
        [gathered, variance - gathered]
    }

    /// Every site, those beyond the borders too.
    pub fn sites(&self) -> Vec<Site> {
        let inside = match self.settings.sites {
            Sites::Quadtree => {
                let longer = self.diameter.width.max(self.diameter.height);
                let mut leaves = vec![];
                self.cut(longer.next_power_of_two(), [0, 0], 1.0, &mut leaves);
                leaves
            }
            Sites::Skip => self.by_skip_level(),
        };
        inside.iter().flat_map(|site| self.continued(site)).collect()
    }

    fn cut(&self, side: usize, [left, top]: [usize; 2], rest: f64, leaves: &mut Vec<Site>) {
        let (right, below) = ((left + side).min(self.diameter.width), (top + side).min(self.diameter.height));
        if left >= right || top >= below || rest == 0.0 {
            return;
        }
        let ends = |from: [usize; 2], to: [usize; 2]| {
            let circles = (from[1]..to[1]).flat_map(|y| (from[0]..to[0]).map(move |x| self.circle(x, y)));
            circles.fold((f64::INFINITY, 0.0f64), |(least, most), c| (least.min(c), most.max(c)))
        };
        // A site gathers from the nodes around its own too.
        let around = [left, top].map(|at| at.saturating_sub(side));
        let ending = [(right + side).min(self.diameter.width), (below + side).min(self.diameter.height)];
        let (least, most) = ends(around, ending);
        let narrow = (self.settings.spacing * least / 4.0 / side as f64 - 1.0) / f64::from(FADE);
        let even = (f64::from(EVEN) * least - most) / (f64::from(EVEN_FADE) * least);
        let leaf = if side == 1 {
            1.0
        } else if least > 0.0 {
            narrow.clamp(0.0, 1.0) * even.clamp(0.0, 1.0)
        } else {
            0.0
        };
        if leaf < 1.0 {
            let half = side / 2;
            for corner in [[left, top], [left + half, top], [left, top + half], [left + half, top + half]] {
                self.cut(half, corner, rest * (1.0 - leaf), leaves);
            }
        }
        if leaf == 0.0 {
            return;
        }
        let (least, most) = ends([left, top], [right, below]);
        let variance = (least * least + most * most) / 32.0 / self.vertical_scale.min(1.0).powi(2);
        let middle = (side as f64 - 1.0) / 2.0;
        let at = [left as f64 + middle, top as f64 + middle];
        leaves.push(Site { at, distance: side as f64, variance, share: rest * leaf });
    }

    fn by_skip_level(&self) -> Vec<Site> {
        let (width, height) = (self.diameter.width, self.diameter.height);
        let mut sites = vec![];
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let skip = ((self.settings.spacing * self.circle(x, y) / 4.0) as usize).max(1);
            if x.is_multiple_of(skip) && y.is_multiple_of(skip) {
                let variance = self.diameter.data[y * width + x].powi(2) / 16.0;
                sites.push(Site { at: [x as f64, y as f64], distance: skip as f64, variance, share: 1.0 });
            }
        }
        sites
    }

    /// A site and those in line with it beyond the borders that it has none before.
    fn continued(&self, site: &Site) -> Vec<Site> {
        let ends = [self.diameter.width as f64, self.diameter.height as f64];
        let along = |axis: usize| {
            let (at, distance) = (site.at[axis], site.distance);
            let [g, h] = self.steps(site, axis);
            let more = (4.0 * g.min(h).sqrt() / distance).ceil().min(8.0) as i32;
            // The edges of the stretch that the site stands for; a skip level's begins at the site.
            let first = if self.settings.sites == Sites::Skip { at } else { at - (distance - 1.0) / 2.0 };
            let before = if first < distance { more } else { 0 };
            let after = if first + distance >= ends[axis] { more } else { 0 };
            (-before..=after).map(move |n| at + f64::from(n) * distance).collect::<Vec<f64>>()
        };
        let (xs, ys) = (along(0), along(1));
        ys.iter().flat_map(|&y| xs.iter().map(move |&x| Site { at: [x, y], ..*site })).collect()
    }

    /// What each site gathers, spread again. Sums, not divided by anything.
    pub fn apply(&self, values: &Grid) -> Grid {
        let (width, height) = (values.width, values.height);
        let mut sums = Grid::filled(width, height, 0.0);
        for site in self.sites() {
            let axis = |axis: usize, step: usize| {
                let length = if axis == 0 { width } else { height };
                // What a pixel spreads is what naive spreading makes of it.
                let lattice = step == 1 && site.at[axis].fract() == 0.0;
                gaussian(site.at[axis], self.steps(&site, axis)[step], lattice, length)
            };
            let (across, down) = (axis(0, 0), axis(1, 0));
            let mut average = 0.0;
            for (line, of_row) in values.data.chunks(width).zip(&down) {
                average += of_row * line.iter().zip(&across).map(|(v, w)| v * w).sum::<f64>();
            }
            let (across, down) = (axis(0, 1), axis(1, 1));
            let weight = average * site.share * site.distance.powi(2);
            for (line, of_row) in sums.data.chunks_mut(width).zip(&down) {
                line.iter_mut().zip(&across).for_each(|(sum, w)| *sum += weight * of_row * w);
            }
        }
        sums
    }
}

/// A Gaussian of `variance` around `at` in each of `length` pixels; the sum over all pixels, those beyond too, is 1.
fn gaussian(at: f64, variance: f64, lattice: bool, length: usize) -> Vec<f64> {
    let distances = (0..length).map(|i| i as f64 - at);
    if variance == 0.0 {
        return distances.map(|d| f64::from(u8::from(d == 0.0))).collect();
    }
    if lattice {
        // Nothing of f64's is left beyond nine deviations and the narrow ones' tail.
        let reach = 9.0 * variance.sqrt() + 20.0;
        let of = |d: f64| if d.abs() > reach { 0.0 } else { lattice_gaussian(variance, d.abs() as usize) };
        return distances.map(of).collect();
    }
    let of = |d: f64| (-d * d / (2.0 * variance)).exp();
    let reach = (9.0 * variance.sqrt()).ceil() + 2.0;
    let sum: f64 = (0..2 * reach as usize).map(|i| of(i as f64 - reach + at.fract())).sum();
    distances.map(|d| of(d) / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_cover_the_picture_once() {
        let diameter = Grid::from_fn(45, 29, |x, y| if x < 20 { 40.0 } else { 0.8 * (x + y) as f64 });
        let filter = TensorFilter { settings: Tensor::default(), diameter: &diameter, vertical_scale: 1.0 };
        let mut covered = Grid::filled(45, 29, 0.0);
        for Site { at, distance, share, .. } in filter.sites() {
            for (i, pixel) in covered.data.iter_mut().enumerate() {
                let [x, y] = [(i % 45) as f64, (i / 45) as f64];
                *pixel +=
                    share * f64::from(u8::from((x - at[0]).abs().max((y - at[1]).abs()) < distance / 2.0));
            }
        }
        // Rounding of f64.
        assert!(covered.data.iter().all(|n| (n - 1.0).abs() < 1e-12));
    }
}
