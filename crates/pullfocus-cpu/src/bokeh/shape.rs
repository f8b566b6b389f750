//! The outline of a sprite, cut into slices: where each begins and ends, and how much its ends slope.

use crate::wide;
use pullfocus_core::aperture::Outline;

/// One side of an outline; see [`pullfocus_core::aperture::Side`].
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rim {
    direction: [f64; 2],
    apothem: f64,
    centre: [f64; 2],
    /// Infinite for a straight side.
    radius: f64,
}

/// A second disc that cuts the aperture, in diameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    pub centre: [f64; 2],
    pub radius: f64,
}

impl Cut {
    /// Where the line `y` runs inside.
    #[inline(always)]
    pub fn ends(&self, y: f64) -> [f64; 2] {
        chord(self.centre, self.radius, y)
    }
}

/// A convex outline, in diameters of the circle of confusion.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    sides: Vec<Rim>,
    /// The farthest that it reaches from the middle.
    pub reach: f64,
    whole: Extent,
}

/// Where an outline has its top and its bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    pub top: f64,
    pub bottom: f64,
    /// Where no line is found, for rounding: the column of the tip.
    tips: [f64; 2],
    cut: Option<Cut>,
}

/// A part of a sprite between two lines: its height in pixels, and of either end the mean place and half of how far it
/// slopes, in pixels from the middle.
#[derive(Debug, Clone, Copy)]
pub struct Slice {
    pub height: f64,
    pub low: [f64; 2],
    pub high: [f64; 2],
}

/// The slices of a row, and its first and last line, which the next row shares.
#[derive(Debug)]
pub struct Slices {
    list: [Slice; 2 * AT_TIPS],
    count: usize,
    known: [(f64, [f64; 2]); 2],
}

impl Slices {
    pub fn new() -> Self {
        let none = Slice { height: 0.0, low: [0.0; 2], high: [0.0; 2] };
        Self { list: [none; 2 * AT_TIPS], count: 0, known: [(f64::NAN, [0.0; 2]); 2] }
    }

    /// All of a row's.
    #[inline(always)]
    pub fn all(&self) -> &[Slice] {
        &self.list[..self.count]
    }

    /// The line `y`, which may be known from the row before.
    #[inline(always)]
    fn line(&self, shape: &Shape, extent: &Extent, y: f64) -> [f64; 2] {
        let [first, last] = self.known;
        if y == last.0 {
            last.1
        } else if y == first.0 {
            first.1
        } else {
            shape.line(extent, y)
        }
    }
}

/// Slices of a row beside a tip, where ends slope most.
const AT_TIPS: usize = 4;
/// Steps by which tips are found: 1e-9 of a diameter.
const STEPS: usize = 30;
/// From this many rows on a sum of slices is the area, to f32's precision.
const EXACT_FROM: f64 = 256.0;

#[inline(always)]
fn chord([cx, cy]: [f64; 2], radius: f64, y: f64) -> [f64; 2] {
    let square = radius * radius - (y - cy) * (y - cy);
    if square < 0.0 {
        return [f64::INFINITY, f64::NEG_INFINITY];
    }
    let half = square.sqrt();
    [cx - half, cx + half]
}

/// The part that a disc about the middle shares with another of its size.
fn lens(cut: Cut) -> Extent {
    let ([x, y], radius) = (cut.centre, cut.radius);
    // Both rims meet half way, to either side.
    let away = x.hypot(y);
    let half = (radius * radius - 0.25 * away * away).max(0.0).sqrt() / away;
    let meet = |sign: f64| [0.5 * x - sign * half * y, 0.5 * y + sign * half * x];
    let within = |[px, py]: [f64; 2], [cx, cy]: [f64; 2]| (px - cx).hypot(py - cy) <= radius;
    let tip = |sign: f64| {
        let (own, other) = ([0.0, sign * radius], [x, y + sign * radius]);
        if within(own, cut.centre) {
            return own;
        }
        if within(other, [0.0; 2]) {
            return other;
        }
        let (a, b) = (meet(1.0), meet(-1.0));
        if (a[1] - b[1]) * sign > 0.0 { a } else { b }
    };
    let ([above, top], [below, bottom]) = (tip(-1.0), tip(1.0));
    Extent { top, bottom, tips: [above, below], cut: Some(cut) }
}

impl Shape {
    pub fn new(outline: &Outline) -> Self {
        let side = |side: &pullfocus_core::aperture::Side| Rim {
            direction: side.direction,
            apothem: side.apothem,
            centre: if side.radius.is_finite() { side.centre() } else { [0.0; 2] },
            radius: side.radius,
        };
        let sides = outline.sides.iter().map(side).collect();
        let none = Extent { top: 0.0, bottom: 0.0, tips: [0.0; 2], cut: None };
        let mut shape = Self { sides, reach: outline.reach(), whole: none };
        shape.whole = shape.found(None);
        shape
    }

    /// Where the line `y` runs inside the outline and the cut; the second end before the first where it does not.
    #[inline(always)]
    fn ends(&self, y: f64, cut: Option<Cut>) -> [f64; 2] {
        if let ([side], None) = (&self.sides[..], cut) {
            // A disc.
            return chord([0.0; 2], side.radius, y);
        }
        let [mut low, mut high] = cut.map_or([f64::NEG_INFINITY, f64::INFINITY], |cut| cut.ends(y));
        for side in &self.sides {
            if side.radius.is_finite() {
                let [from, to] = chord(side.centre, side.radius, y);
                (low, high) = (low.max(from), high.min(to));
                continue;
            }
            let [across, down] = side.direction;
            let rest = side.apothem - down * y;
            if across > 1e-12 {
                high = high.min(rest / across);
            } else if across < -1e-12 {
                low = low.max(rest / across);
            } else if rest < 0.0 {
                return [f64::INFINITY, f64::NEG_INFINITY];
            }
        }
        [low, high]
    }

    /// Whether it is round: turned over, the same.
    #[inline(always)]
    pub fn is_disc(&self) -> bool {
        self.sides.len() == 1
    }

    /// The outline cut by a disc of its own reach whose centre lies at `displacement`, at most that reach away.
    pub fn cut(&self, displacement: [f64; 2]) -> Extent {
        if displacement == [0.0; 2] {
            return self.whole;
        }
        let cut = Cut { centre: displacement, radius: self.reach };
        if self.is_disc() { lens(cut) } else { self.found(Some(cut)) }
    }

    fn found(&self, cut: Option<Cut>) -> Extent {
        // Half way to the second disc's centre lies inside every outline.
        let inside = cut.map_or(0.0, |cut| 0.5 * cut.centre[1]);
        let tip = |mut outside: f64| {
            let mut inside = inside;
            for _ in 0..STEPS {
                let middle = 0.5 * (inside + outside);
                let [low, high] = self.ends(middle, cut);
                if low <= high { inside = middle } else { outside = middle }
            }
            let [low, high] = self.ends(inside, cut);
            (inside, 0.5 * (low + high))
        };
        let (high, low) = match cut {
            None => (-self.reach, self.reach),
            Some(cut) => {
                let ends = (cut.centre[1] - cut.radius, cut.centre[1] + cut.radius);
                (ends.0.max(self.whole.top), ends.1.min(self.whole.bottom))
            }
        };
        let ((top, above), (bottom, below)) = (tip(high - 1e-9), tip(low + 1e-9));
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        Extent { top, bottom, tips: [finite(above), finite(below)], cut }
    }

    /// Where the line `y` of an extent runs, which is its tip where rounding finds nothing.
    #[inline(always)]
    fn line(&self, extent: &Extent, y: f64) -> [f64; 2] {
        let [low, high] = self.ends(y, extent.cut);
        let tip = extent.tips[usize::from(y > 0.5 * (extent.top + extent.bottom))];
        if low <= high { [low, high] } else { [tip; 2] }
    }

    /// Replaces `slices` by those of the row whose middle lies `row` pixels below the sprite's. `unit` is a diameter in pixels across
    /// and down.
    #[inline(always)]
    pub fn row(&self, extent: &Extent, unit: [f64; 2], row: f64, slices: &mut Slices) {
        slices.count = 0;
        let line = 1.0 / unit[1];
        let from = ((row - 0.5) * line).max(extent.top);
        let to = ((row + 0.5) * line).min(extent.bottom);
        let middle = 0.5 * (extent.top + extent.bottom);
        // One half's part, and where the middle is in the row the other's, each from its own tip.
        let parts = [[from, to.min(middle)], [to, from.max(middle)]];
        for (half, [first, last]) in parts.into_iter().enumerate() {
            if (last - first) * (1.0 - 2.0 * half as f64) > 0.0 {
                self.part(extent, unit, [first, last], half, slices);
            }
        }
    }

    /// The slices between two lines of one half, the first one nearer to the tip.
    #[inline(always)]
    fn part(&self, extent: &Extent, unit: [f64; 2], [from, to]: [f64; 2], half: usize, slices: &mut Slices) {
        let tip = [extent.top, extent.bottom][half];
        // Around a tip ends move as the root of the way from it.
        let near = (from - tip).abs() * unit[1] < 1.0;
        let count = if near { AT_TIPS } else { 1 };
        let roots = if near { [from, to].map(|y| (y - tip).abs().sqrt()) } else { [0.0; 2] };
        let toward = (to - from).signum();
        let begin = slices.line(self, extent, from);
        let (mut first, mut start) = (from, begin);
        for i in 1..=count {
            let root = roots[0] + (roots[1] - roots[0]) * i as f64 * (1.0 / AT_TIPS as f64);
            let last = if i == count { to } else { tip + toward * root * root };
            let (between, end) = (self.line(extent, 0.5 * (first + last)), slices.line(self, extent, last));
            let mut sides = [[0.0; 2]; 2];
            for (side, ((start, between), end)) in
                sides.iter_mut().zip(start.into_iter().zip(between).zip(end))
            {
                *side = [
                    (start + 4.0 * between + end) * (1.0 / 6.0) * unit[0],
                    0.5 * (end - start).abs() * unit[0],
                ];
            }
            let [low, high] = sides;
            if let Some(slice) = slices.list.get_mut(slices.count) {
                *slice = Slice { height: (last - first).abs() * unit[1], low, high };
                slices.count += 1;
            }
            (first, start) = (last, end);
        }
        slices.known = [(from, begin), (to, start)];
    }

    /// The sum of all slices of the whole outline, in pixels.
    pub fn area(&self, unit: [f64; 2]) -> f64 {
        if unit[1] > EXACT_FROM {
            return self.area([EXACT_FROM; 2]) * (unit[0] / EXACT_FROM) * (unit[1] / EXACT_FROM);
        }
        let reach = (self.reach * unit[1] + 0.5) as i32;
        let mut area = 0.0;
        wide::run(Area { shape: self, unit, rows: -reach..=reach, area: &mut area });
        area
    }
}

/// The sum of all slices of some rows.
struct Area<'a> {
    shape: &'a Shape,
    unit: [f64; 2],
    rows: std::ops::RangeInclusive<i32>,
    area: &'a mut f64,
}

impl wide::Work for Area<'_> {
    #[inline(always)]
    fn run(self) {
        let mut slices = Slices::new();
        for row in self.rows {
            self.shape.row(&self.shape.whole, self.unit, f64::from(row), &mut slices);
            for slice in slices.all() {
                *self.area += slice.height * (slice.high[0] - slice.low[0]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Aperture;
    use std::f64::consts::PI;

    #[test]
    fn slices_have_the_area_of_the_outline() {
        let disc = Shape::new(&Aperture::DISC.outline().unwrap());
        for (diameter, tolerance) in [(1.3, 5e-3), (4.0, 2e-3), (50.0, 1e-4), (255.0, 1e-5), (4000.0, 1e-5)] {
            let exact = PI / 4.0 * diameter * diameter;
            let found = disc.area([diameter; 2]);
            // Simpson's rule over four slices beside each tip.
            assert!((found / exact - 1.0).abs() < tolerance, "{diameter}: {}", found / exact - 1.0);
        }
        let square = Shape::new(&Aperture::blades(4, 45.0).outline().unwrap());
        let side = 12f64.sqrt() / 4.0 * 100.0;
        assert!((square.area([100.0; 2]) / (side * side) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn areas_grow_evenly() {
        for aperture in [Aperture::DISC, Aperture::blades(5, 10.0)] {
            let shape = Shape::new(&aperture.outline().unwrap());
            let per_square = |i: i32| {
                let diameter = 1.0 + 0.01 * f64::from(i);
                shape.area([diameter; 2]) / (diameter * diameter)
            };
            for i in 0..2000 {
                let step = (per_square(i + 1) / per_square(i) - 1.0).abs();
                assert!(step < 3e-3, "{i}: {step}");
            }
        }
    }

    #[test]
    fn a_cut_disc_is_a_lens() {
        let disc = Shape::new(&Aperture::DISC.outline().unwrap());
        for [x, y] in [[0.5, 0.0], [0.0, -0.5], [0.3, 0.4], [0.1, 0.1]] {
            let extent = disc.cut([x, y]);
            let mut area = 0.0;
            let mut slices = Slices::new();
            for row in -60..=60 {
                disc.row(&extent, [100.0; 2], f64::from(row), &mut slices);
                area += slices
                    .all()
                    .iter()
                    .map(|slice| slice.height * (slice.high[0] - slice.low[0]))
                    .sum::<f64>();
            }
            // Two circles of radius 1/2, d apart.
            let d = f64::hypot(x, y);
            let exact = 0.5 * d.acos() - 0.5 * d * (1.0 - d * d).sqrt();
            assert!((area / 1e4 / exact - 1.0).abs() < 1e-3, "{x} {y}: {} {exact}", area / 1e4);
        }
    }
}
