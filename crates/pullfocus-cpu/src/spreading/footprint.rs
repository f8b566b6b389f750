//! The shape that one pixel is spread over, row by row.

use super::Spread;
use crate::rows::for_each_row;
use pullfocus_core::psf::{apothem, discrete_gaussian, gaussian_reach, sides, variance};
use pullfocus_core::{Cancel, Plane, Psf, Result};

/// What makes footprints of diameters.
pub enum Footprints {
    Gaussian(Gaussians),
    Aperture(Apertures),
}

/// The memory of one footprint.
#[derive(Default)]
pub struct Scratch {
    across: Vec<f32>,
    down: Vec<f32>,
    weights: Vec<f32>,
}

impl Footprints {
    pub fn new(spread: &Spread<'_>, cancel: &Cancel) -> Result<Self> {
        Ok(match spread.psf {
            Psf::Gaussian => Self::Gaussian(Gaussians::new(spread)),
            Psf::Disc => Self::Aperture(Apertures::new(spread, 0.5, Vec::new(), cancel)?),
            Psf::Blades { count, rotation_degrees } => {
                let sides = sides(count, rotation_degrees);
                Self::Aperture(Apertures::new(spread, apothem(count) as f32, sides, cancel)?)
            }
        })
    }

    /// Rows that a footprint of `diameter` pixels reaches to either side, at most.
    #[inline(always)]
    pub fn rows(&self, diameter: f32) -> usize {
        match self {
            Self::Gaussian(gaussians) => gaussians.rows(diameter),
            Self::Aperture(apertures) => apertures.rows(diameter),
        }
    }

    /// Begins a footprint of `diameter` pixels.
    #[inline(always)]
    pub fn begin(&self, diameter: f32, scratch: &mut Scratch) {
        if let Self::Gaussian(gaussians) = self {
            gaussians.axis(variance(f64::from(diameter)) as f32, gaussians.most[0], &mut scratch.across);
            let scaled = diameter * gaussians.vertical;
            gaussians.axis(variance(f64::from(scaled)) as f32, gaussians.most[1], &mut scratch.down);
        }
    }

    /// Row `dy` pixels below the middle of the pixel (x, y)'s footprint: the first weight's distance from the middle, the weights, their common
    /// factor. None where the footprint has no such row.
    #[inline(always)]
    pub fn row<'s>(
        &self,
        (x, y): (usize, usize),
        diameter: f32,
        dy: isize,
        scratch: &'s mut Scratch,
    ) -> Option<(isize, &'s [f32], f32)> {
        match self {
            Self::Gaussian(_) => {
                let middle = scratch.down.len() / 2;
                let factor = *scratch.down.get(middle.checked_add_signed(dy)?)?;
                Some((-((scratch.across.len() / 2) as isize), &scratch.across, factor))
            }
            Self::Aperture(apertures) => {
                let first = apertures.row(diameter, dy, &mut scratch.weights)?;
                Some((first, &scratch.weights, apertures.factor.at(x, y)))
            }
        }
    }
}

/// Gaussians on the lattice. Between two variances of the table they are mixed, which keeps the variance exactly (that of a
/// mixture is the mean of both) and errs by 5e-4 of the peak at most: sixteen variances an octave.
pub struct Gaussians {
    /// Half of each, from the middle; each as long as the next, so that two can be mixed.
    tables: Vec<Vec<f32>>,
    vertical: f32,
    /// What can fall into the picture, along each axis.
    most: [usize; 2],
}

/// The variance of the table's second entry; the first is 0. Between them only the neighbours' shares change.
const FIRST: f32 = 1.0 / 64.0;
/// Bits of an f32 below those that count entries: sixteen an octave.
const BELOW: u32 = 19;

/// The place of a variance in the table, and how far it lies on the way to the next entry.
#[inline(always)]
pub fn place(variance: f32, first: f32) -> (usize, f32) {
    if variance < first {
        return (0, variance / first);
    }
    let bits = variance.to_bits() - first.to_bits();
    let part = (bits & ((1 << BELOW) - 1)) as f32 / (1u32 << BELOW) as f32;
    (1 + (bits >> BELOW) as usize, part)
}

/// The variance of an entry.
pub fn of_place(place: usize, first: f32) -> f32 {
    match place.checked_sub(1) {
        None => 0.0,
        Some(steps) => f32::from_bits(first.to_bits() + ((steps as u32) << BELOW)),
    }
}

impl Gaussians {
    fn new(spread: &Spread<'_>) -> Self {
        let size = spread.size();
        let widest = (0..size.height).flat_map(|y| (0..size.width).map(move |x| (x, y)));
        let widest = widest.map(|(x, y)| spread.diameter(x, y)).fold(0.0, f32::max);
        let largest = widest * spread.vertical_scale.max(1.0);
        let (last, _) = place(variance(f64::from(largest)) as f32, FIRST);
        let longest = size.width.max(size.height) - 1;
        let tables = (0..=last + 1)
            .map(|entry| {
                let t = f64::from(of_place(entry, FIRST));
                // Mixed with the one before and the one after.
                let reach = gaussian_reach(f64::from(of_place(entry + 1, FIRST)));
                let mut half = discrete_gaussian(t, reach);
                let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
                half.iter_mut().for_each(|weight| *weight /= sum);
                half.truncate(longest + 1);
                half.into_iter().map(|weight| weight as f32).collect()
            })
            .collect();
        Self { tables, vertical: spread.vertical_scale, most: [size.width - 1, size.height - 1] }
    }

    #[inline(always)]
    fn rows(&self, diameter: f32) -> usize {
        let (entry, _) = place(variance(f64::from(diameter * self.vertical)) as f32, FIRST);
        (self.tables[entry].len() - 1).min(self.most[1])
    }

    /// Both halves of one axis.
    #[inline(always)]
    fn axis(&self, variance: f32, most: usize, out: &mut Vec<f32>) {
        let (entry, part) = place(variance, FIRST);
        let (low, high) = (&self.tables[entry], &self.tables[entry + 1]);
        let reach = if variance == 0.0 { 0 } else { (low.len() - 1).min(most) };
        out.clear();
        out.resize(2 * reach + 1, 0.0);
        let right = &mut out[reach..];
        for ((weight, &low), &high) in right.iter_mut().zip(low).zip(high) {
            *weight = low + (high - low) * part;
        }
        for n in 1..=reach {
            out[reach - n] = out[reach + n];
        }
    }
}

/// Discs and polygons: 1 inside, falling to 0 over the pixel around the rim. Nothing is rounded to a table.
pub struct Apertures {
    /// Distance from the middle to the rim (disc) or to the sides (polygon), in diameters.
    part: f32,
    /// Directions of a polygon's sides; none for a disc.
    sides: Vec<[f32; 2]>,
    vertical: f32,
    /// How much farther than the sides the corners are: 1 for a disc.
    corner: f32,
    /// Half the width over which the rim falls, in pixels of width; no more than half a pixel along either axis.
    rim: f32,
    /// 1 / sum of weights of each pixel's footprint.
    factor: Plane,
}

/// Where a row begins and ends, and where the part inside the rim does: both ends included, the second may be empty.
struct Ends {
    outer: [isize; 2],
    inner: [isize; 2],
}

impl Apertures {
    fn new(spread: &Spread<'_>, part: f32, sides: Vec<[f32; 2]>, cancel: &Cancel) -> Result<Self> {
        let vertical = spread.vertical_scale;
        let corner =
            if sides.is_empty() { 1.0 } else { 1.0 / (std::f32::consts::PI / sides.len() as f32).cos() };
        let rim = 0.5 * (1.0 / vertical).min(1.0);
        let mut made = Self { part, sides, vertical, corner, rim, factor: Plane::default() };
        let mut factor = Plane::filled(spread.size(), 1.0)?;
        for_each_row(&mut factor, cancel, |y, row| {
            let (mut last, mut inverse) = (0.0, 1.0);
            for (x, factor) in row.iter_mut().enumerate() {
                let diameter = spread.diameter(x, y);
                if cancel.is_cancelled() {
                    return;
                }
                if diameter != last {
                    (last, inverse) = (diameter, 1.0 / made.sum(diameter));
                }
                *factor = inverse;
            }
        })?;
        cancel.check()?;
        made.factor = factor;
        Ok(made)
    }

    #[inline(always)]
    fn rows(&self, diameter: f32) -> usize {
        ((self.part * diameter + self.rim) * self.corner * self.vertical) as usize
    }

    /// Where the shape grown to `limit` cuts the line `y` (both in pixels of width).
    #[inline(always)]
    fn cut(&self, limit: f32, y: f32) -> [f32; 2] {
        if self.sides.is_empty() {
            // Not a number where the line passes by; no comparison with it holds.
            let half = if limit > 0.0 { (limit * limit - y * y).sqrt() } else { f32::NAN };
            return [-half, half];
        }
        let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
        for [across, down] in &self.sides {
            let rest = limit - down * y;
            if *across > 1e-6 {
                high = high.min(rest / across);
            } else if *across < -1e-6 {
                low = low.max(rest / across);
            } else if rest < 0.0 {
                return [f32::NAN; 2];
            }
        }
        [low, high]
    }

    #[inline(always)]
    fn ends(&self, diameter: f32, dy: isize) -> Option<Ends> {
        let (limit, y) = (self.part * diameter, dy as f32 / self.vertical);
        let whole = |[low, high]: [f32; 2]| [low.ceil() as isize, high.floor() as isize];
        let outer = self.cut(limit + self.rim, y);
        if outer[0].is_nan() || outer[0] > outer[1] {
            return None;
        }
        let [from, to] = whole(outer);
        let inner = self.cut(limit - self.rim, y);
        let inner = if inner[0] <= inner[1] { whole(inner) } else { [to + 1, to] };
        let first = inner[0].clamp(from, to + 1);
        (from <= to).then_some(Ends { outer: [from, to], inner: [first, inner[1].clamp(first - 1, to)] })
    }

    #[inline(always)]
    fn weight(&self, diameter: f32, x: isize, y: f32) -> f32 {
        let x = x as f32;
        let out = if self.sides.is_empty() {
            (x * x + y * y).sqrt()
        } else {
            self.sides.iter().fold(f32::NEG_INFINITY, |most, n| most.max(n[0] * x + n[1] * y))
        };
        ((self.part * diameter - out) / (2.0 * self.rim) + 0.5).clamp(0.0, 1.0)
    }

    /// The weights of row `dy` before they are divided by their sum, and the first one's place.
    #[inline(always)]
    fn row(&self, diameter: f32, dy: isize, weights: &mut Vec<f32>) -> Option<isize> {
        let Ends { outer: [from, to], inner: [first, last] } = self.ends(diameter, dy)?;
        weights.clear();
        weights.resize((to - from + 1) as usize, 1.0);
        let y = dy as f32 / self.vertical;
        for x in (from..first).chain(last + 1..=to) {
            weights[(x - from) as usize] = self.weight(diameter, x, y);
        }
        Some(from)
    }

    fn sum(&self, diameter: f32) -> f32 {
        let reach = self.rows(diameter) as isize;
        let row = |dy| {
            let Some(Ends { outer: [from, to], inner: [first, last] }) = self.ends(diameter, dy) else {
                return 0.0;
            };
            let y = dy as f32 / self.vertical;
            let rim: f32 = (from..first).chain(last + 1..=to).map(|x| self.weight(diameter, x, y)).sum();
            rim + (last + 1 - first) as f32
        };
        (-reach..=reach).map(row).sum()
    }
}
