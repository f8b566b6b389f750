//! The shape that one pixel is spread over, row by row.

use super::Spread;
use crate::rows::for_each_row;
use pullfocus_core::aperture::{Mask, Outline, Side};
use pullfocus_core::psf::{discrete_gaussian, gaussian_reach, variance};
use pullfocus_core::{Aperture, ApertureShape, Cancel, Plane, Psf, Result};

/// What makes footprints of diameters.
pub enum Footprints {
    Gaussian(Gaussians),
    Aperture(Apertures),
    Picture(Pictures),
}

/// The memory of one footprint.
#[derive(Default)]
pub struct Scratch {
    across: Vec<f32>,
    down: Vec<f32>,
    weights: Vec<f32>,
}

/// One pixel, and which way round its footprint is.
#[derive(Clone, Copy)]
pub struct Point {
    pub x: usize,
    pub y: usize,
    /// Diameter in pixels of width.
    pub diameter: f32,
    /// In front of focus: turned by half a turn.
    pub in_front: bool,
}

impl Point {
    /// The point of pixel (x, y).
    #[inline(always)]
    pub fn of(spread: &Spread<'_>, x: usize, y: usize) -> Self {
        Self { x, y, diameter: spread.diameter(x, y), in_front: spread.circle.at(x, y) < 0.0 }
    }
}

impl Footprints {
    pub fn new(spread: &Spread<'_>, cancel: &Cancel) -> Result<Self> {
        Ok(match (spread.psf, &spread.aperture.shape, spread.aperture.outline()) {
            (Psf::Gaussian, ..) => Self::Gaussian(Gaussians::new(spread)),
            (Psf::Aperture, ApertureShape::Image(mask), _) => {
                Self::Picture(Pictures::new(spread.aperture, spread.vertical_scale, mask))
            }
            (Psf::Aperture, _, outline) => {
                let outline = outline.unwrap_or(Outline { sides: Vec::new() });
                Self::Aperture(Apertures::new(spread, &outline, cancel)?)
            }
        })
    }

    /// Rows that a footprint of `diameter` pixels reaches to either side, at most.
    #[inline(always)]
    pub fn rows(&self, diameter: f32) -> usize {
        match self {
            Self::Gaussian(gaussians) => gaussians.rows(diameter),
            Self::Aperture(apertures) => apertures.rows(diameter),
            Self::Picture(pictures) => pictures.rows(diameter),
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

    /// Row `dy` pixels below the middle of a pixel's footprint: the first weight's distance from the middle, the weights, their
    /// common factor. None where the footprint has no such row.
    #[inline(always)]
    pub fn row<'s>(
        &self,
        point: Point,
        dy: isize,
        scratch: &'s mut Scratch,
    ) -> Option<(isize, &'s [f32], f32)> {
        let Point { x, y, diameter, in_front } = point;
        let weights = &mut scratch.weights;
        let down = if in_front { -dy } else { dy };
        let (first, factor) = match self {
            Self::Gaussian(_) => {
                let middle = scratch.down.len() / 2;
                let factor = *scratch.down.get(middle.checked_add_signed(dy)?)?;
                return Some((-((scratch.across.len() / 2) as isize), &scratch.across, factor));
            }
            Self::Aperture(apertures) => (apertures.row(diameter, down, weights)?, apertures.factor.at(x, y)),
            Self::Picture(pictures) => (pictures.row(diameter, down, weights)?, pictures.factor),
        };
        if !in_front {
            return Some((first, weights, factor));
        }
        weights.reverse();
        Some((1 - first - weights.len() as isize, weights, factor))
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

/// Discs and irises: 1 inside, falling to 0 over the pixel around the rim. Nothing is rounded to a table.
pub struct Apertures {
    sides: Vec<Rim>,
    /// Units of the outline for one pixel across and down, where the circle of confusion is measured in pixels of width.
    unit: [f32; 2],
    /// How far the rim reaches, in diameters.
    reach: f32,
    /// How much more than the outline its corners grow.
    corner: f32,
    /// Half the width over which the rim falls; no more than half a pixel along either axis.
    rim: f32,
    /// 1 / sum of weights of each pixel's footprint.
    factor: Plane,
}

/// One side of the outline; see [`pullfocus_core::aperture::Side`].
struct Rim {
    direction: [f32; 2],
    apothem: f32,
    centre: [f32; 2],
    radius: f32,
}

/// Where a row begins and ends, and where the part inside the rim does: both ends included, the second may be empty.
struct Ends {
    outer: [isize; 2],
    inner: [isize; 2],
}

impl Apertures {
    fn new(spread: &Spread<'_>, outline: &Outline, cancel: &Cancel) -> Result<Self> {
        let unit = [spread.aperture.squeeze as f32, 1.0 / spread.vertical_scale];
        let side = |side: &Side| Rim {
            direction: side.direction.map(|d| d as f32),
            apothem: side.apothem as f32,
            centre: if side.radius.is_finite() { side.centre().map(|c| c as f32) } else { [0.0; 2] },
            radius: side.radius as f32,
        };
        let sides = outline.sides.len() as f32;
        let mut made = Self {
            sides: outline.sides.iter().map(side).collect(),
            unit,
            reach: outline.reach() as f32,
            corner: if sides < 2.0 { 1.0 } else { 1.0 / (std::f32::consts::PI / sides).cos() },
            rim: 0.5 * unit[0].min(unit[1]).min(1.0),
            factor: Plane::default(),
        };
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
        ((self.reach * diameter + self.rim * self.corner) / self.unit[1]) as usize
    }

    /// Where the shape of this diameter, grown by `more`, cuts the line `y`, in units of the outline.
    #[inline(always)]
    fn cut(&self, diameter: f32, more: f32, y: f32) -> [f32; 2] {
        let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
        for side in &self.sides {
            if side.radius.is_finite() {
                let (radius, down) = (side.radius * diameter + more, y - side.centre[1] * diameter);
                // Not a number where the line passes by; no comparison with it holds.
                let half = if radius > 0.0 { (radius * radius - down * down).sqrt() } else { f32::NAN };
                if half.is_nan() {
                    return [f32::NAN; 2];
                }
                let middle = side.centre[0] * diameter;
                (low, high) = (low.max(middle - half), high.min(middle + half));
                continue;
            }
            let [across, down] = side.direction;
            let rest = side.apothem * diameter + more - down * y;
            if across > 1e-6 {
                high = high.min(rest / across);
            } else if across < -1e-6 {
                low = low.max(rest / across);
            } else if rest < 0.0 {
                return [f32::NAN; 2];
            }
        }
        [low, high]
    }

    #[inline(always)]
    fn ends(&self, diameter: f32, dy: isize) -> Option<Ends> {
        let y = dy as f32 * self.unit[1];
        let across = self.unit[0];
        let whole =
            |[low, high]: [f32; 2]| [(low / across).ceil() as isize, (high / across).floor() as isize];
        let outer = self.cut(diameter, self.rim, y);
        if outer[0].is_nan() || outer[0] > outer[1] {
            return None;
        }
        let [from, to] = whole(outer);
        let inner = self.cut(diameter, -self.rim, y);
        let inner = if inner[0] <= inner[1] { whole(inner) } else { [to + 1, to] };
        let first = inner[0].clamp(from, to + 1);
        (from <= to).then_some(Ends { outer: [from, to], inner: [first, inner[1].clamp(first - 1, to)] })
    }

    #[inline(always)]
    fn weight(&self, diameter: f32, x: isize, y: f32) -> f32 {
        let x = x as f32 * self.unit[0];
        let out = self.sides.iter().fold(f32::NEG_INFINITY, |most, side| {
            let beyond = if side.radius.is_finite() {
                let (x, y) = (x - side.centre[0] * diameter, y - side.centre[1] * diameter);
                (x * x + y * y).sqrt() - side.radius * diameter
            } else {
                side.direction[0] * x + side.direction[1] * y - side.apothem * diameter
            };
            most.max(beyond)
        });
        (0.5 - out / (2.0 * self.rim)).clamp(0.0, 1.0)
    }

    /// The weights of row `dy` before they are divided by their sum, and the first one's place.
    #[inline(always)]
    fn row(&self, diameter: f32, dy: isize, weights: &mut Vec<f32>) -> Option<isize> {
        let Ends { outer: [from, to], inner: [first, last] } = self.ends(diameter, dy)?;
        weights.clear();
        weights.resize((to - from + 1) as usize, 1.0);
        let y = dy as f32 * self.unit[1];
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
            let y = dy as f32 * self.unit[1];
            let rim: f32 = (from..first).chain(last + 1..=to).map(|x| self.weight(diameter, x, y)).sum();
            rim + (last + 1 - first) as f32
        };
        (-reach..=reach).map(row).sum()
    }
}

/// An aperture given as a picture: each pixel has what of the picture lies on it, from sums over its corners.
pub struct Pictures {
    /// [`pullfocus_core::aperture::Mask::summed`], `columns` to a row.
    sums: Vec<f64>,
    columns: usize,
    rows: usize,
    /// Pixels of the mask for each pixel across and down, at a diameter of one pixel.
    unit: [f64; 2],
    /// 1 / sum of all weights.
    pub factor: f32,
}

/// Circles below this are the pixel itself, whatever the picture.
const LEAST_PICTURE: f32 = 1e-3;

impl Pictures {
    pub fn new(aperture: &Aperture, vertical_scale: f32, mask: &Mask) -> Self {
        let longer = mask.width().max(mask.height()) as f64;
        let mask = mask.turned(aperture.rotation_degrees);
        let sums = mask.summed();
        let total = sums.last().copied().unwrap_or(1.0);
        Self {
            columns: mask.width() + 1,
            rows: mask.height() + 1,
            unit: [longer * aperture.squeeze, longer / f64::from(vertical_scale)],
            factor: (1.0 / total) as f32,
            sums,
        }
    }

    /// Pixels that reach from the middle to the mask's end along an axis.
    #[inline(always)]
    fn reach(&self, diameter: f32, axis: usize) -> usize {
        let half = 0.5 * ([self.columns, self.rows][axis] - 1) as f64;
        (half * f64::from(diameter) / self.unit[axis] + 0.5).ceil() as usize
    }

    #[inline(always)]
    pub fn rows(&self, diameter: f32) -> usize {
        if diameter < LEAST_PICTURE { 0 } else { self.reach(diameter, 1) }
    }

    #[inline(always)]
    /// The weights of the row `dy` pixels below the middle, and the first one's distance from the middle.
    pub fn row(&self, diameter: f32, dy: isize, weights: &mut Vec<f32>) -> Option<isize> {
        weights.clear();
        if diameter < LEAST_PICTURE {
            weights.push(1.0 / self.factor);
            return (dy == 0).then_some(0);
        }
        let [across, down] = self.unit.map(|unit| unit / f64::from(diameter));
        // A place in the mask as a whole number and the rest.
        let place = |at: f64, count: usize| {
            let at = at.clamp(0.0, (count - 1) as f64);
            let whole = (at as usize).min(count - 2);
            (whole, at - whole as f64)
        };
        let middle = 0.5 * (self.rows - 1) as f64;
        let [above, below] = [-0.5, 0.5].map(|half| place(middle + (dy as f64 + half) * down, self.rows));
        if above == below {
            return None;
        }
        let column = |x: usize| {
            let of = |(row, part): (usize, f64)| {
                let at = row * self.columns + x;
                self.sums[at] + (self.sums[at + self.columns] - self.sums[at]) * part
            };
            of(below) - of(above)
        };
        let until = |x: f64| {
            let (whole, part) = place(0.5 * (self.columns - 1) as f64 + x * across, self.columns);
            let left = column(whole);
            left + (column(whole + 1) - left) * part
        };
        let reach = self.reach(diameter, 0) as isize;
        let mut last = until(-reach as f64 - 0.5);
        weights.extend((-reach..=reach).map(|x| {
            let next = until(x as f64 + 0.5);
            let weight = (next - last).max(0.0) as f32;
            last = next;
            weight
        }));
        Some(-reach)
    }
}
