//! The shape of the aperture: what a point of light out of focus looks like.
//!
//! Behind focus it is seen as it is described here; in front of focus the lens turns it by half a turn.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A triangle is the least iris.
pub const LEAST_BLADES: u32 = 3;
/// Beyond this an iris is a disc.
pub const MOST_BLADES: u32 = 32;
/// The largest squeeze, and the inverse of the least.
pub const MOST_SQUEEZE: f64 = 4.0;
/// Most pixels along a side of a mask.
pub const MOST_MASK_SIDE: usize = 4096;

/// An aperture. All shapes but pictures have the variance of a uniform disc along the picture's height.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Aperture {
    /// What lets light through.
    pub shape: ApertureShape,
    /// By how many degrees the shape is turned, clockwise in the picture. At 0 a corner of the iris points to the right.
    pub rotation_degrees: f64,
    /// How far the blades are bent outwards: 0 for straight sides, 1 for a disc. Each side is an arc through two corners whose
    /// curvature is this part of the circle's.
    pub roundness: f64,
    /// How many times a point's image is as high as it is wide, 1/4 to 4: 2 for an anamorphic lens of squeeze 2. The height is
    /// that of the circle of confusion (the lens's own focal length), the width is divided by this.
    pub squeeze: f64,
}

impl Default for Aperture {
    fn default() -> Self {
        Self { shape: ApertureShape::Disc, rotation_degrees: 0.0, roundness: 0.0, squeeze: 1.0 }
    }
}

/// What lets light through.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ApertureShape {
    /// A round hole.
    #[default]
    Disc,
    /// An iris of so many blades, [`LEAST_BLADES`] to [`MOST_BLADES`].
    Blades(u32),
    /// A picture of the aperture; the longer side of its frame is the circle's diameter.
    Image(Mask),
}

/// A picture of an aperture: how much light each of its pixels lets through.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Mask {
    width: usize,
    height: usize,
    data: Arc<[f32]>,
}

impl Mask {
    /// A mask of `width` x `height` pixels, rows from the top.
    ///
    /// # Errors
    /// [`Error::Setting`] for no pixel or too many, for values that are negative or no numbers, and where no light passes.
    pub fn new(width: usize, height: usize, data: Vec<f32>) -> Result<Self> {
        let mask = Self { width, height, data: data.into() };
        mask.check()?;
        Ok(mask)
    }

    fn check(&self) -> Result<()> {
        let refuse = |value: f64, reason| Err(Error::Setting { name: "aperture's picture", value, reason });
        let longer = self.width.max(self.height);
        if self.width == 0 || self.height == 0 || longer > MOST_MASK_SIDE {
            return refuse(longer as f64, "must have 1 to 4096 pixels along each side");
        }
        if self.data.len() != self.width * self.height {
            return refuse(self.data.len() as f64, "must hold a value for each of its pixels");
        }
        if let Some(odd) = self.data.iter().find(|value| !(value.is_finite() && **value >= 0.0)) {
            return refuse(f64::from(*odd), "must hold finite values of 0 and above");
        }
        if self.data.iter().all(|value| *value == 0.0) {
            return refuse(0.0, "must let some light through");
        }
        Ok(())
    }

    /// Pixels across.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels down.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Rows from the top.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// The value between pixels, 0 outside; pixel centres lie at halves.
    fn sample(&self, x: f64, y: f64) -> f64 {
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let (fx, fy) = (x - 0.5 - left, y - 0.5 - top);
        let at = |dx: f64, dy: f64| {
            let (x, y) = (left + dx, top + dy);
            let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
            if inside { f64::from(self.data[y as usize * self.width + x as usize]) } else { 0.0 }
        };
        let row = |dy| at(0.0, dy) * (1.0 - fx) + at(1.0, dy) * fx;
        row(0.0) * (1.0 - fy) + row(1.0) * fy
    }

    /// The mask turned clockwise about its middle: a square of its own diagonal, beyond whose circle nothing is kept that was not
    /// there before. No turn leaves every pixel as it is.
    #[must_use]
    pub fn turned(&self, degrees: f64) -> Self {
        let turn = degrees.rem_euclid(360.0);
        if turn == 0.0 {
            return self.clone();
        }
        let (sin, cos) = turn.to_radians().sin_cos();
        // Wide enough for the corners of the frame.
        let side = (self.width as f64).hypot(self.height as f64).ceil() as usize;
        let middle = 0.5 * side as f64;
        let value = |i: usize| {
            let (x, y) = ((i % side) as f64 + 0.5 - middle, (i / side) as f64 + 0.5 - middle);
            let (u, v) = (x * cos + y * sin, y * cos - x * sin);
            self.sample(u + 0.5 * self.width as f64, v + 0.5 * self.height as f64) as f32
        };
        let data: Vec<f32> = (0..side * side).map(value).collect();
        let turned = Self { width: side, height: side, data: data.into() };
        // A mask of a pixel or two may have lost all of it.
        if turned.check().is_ok() { turned } else { self.clone() }
    }

    /// Sums of all pixels above and to the left of each corner of the lattice: `(width + 1) x (height + 1)` values. A pixel's share in any
    /// rectangle follows from these.
    pub fn summed(&self) -> Vec<f64> {
        let columns = self.width + 1;
        let mut sums = vec![0.0; columns * (self.height + 1)];
        for y in 0..self.height {
            let mut row = 0.0;
            for x in 0..self.width {
                row += f64::from(self.data[y * self.width + x]);
                sums[(y + 1) * columns + x + 1] = sums[y * columns + x + 1] + row;
            }
        }
        sums
    }
}

impl Aperture {
    /// A round aperture.
    pub const DISC: Self =
        Self { shape: ApertureShape::Disc, rotation_degrees: 0.0, roundness: 0.0, squeeze: 1.0 };

    /// An iris of straight blades.
    pub fn blades(count: u32, rotation_degrees: f64) -> Self {
        Self { shape: ApertureShape::Blades(count), rotation_degrees, ..Self::DISC }
    }

    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        let refuse = |name, value, reason| Err(Error::Setting { name, value, reason });
        match &self.shape {
            ApertureShape::Blades(count) if !(LEAST_BLADES..=MOST_BLADES).contains(count) => {
                return refuse("blades", f64::from(*count), "must lie between 3 and 32");
            }
            ApertureShape::Image(mask) => mask.check()?,
            _ => {}
        }
        if !self.rotation_degrees.is_finite() {
            return refuse("aperture's rotation", self.rotation_degrees, "must be a number of degrees");
        }
        if !(0.0..=1.0).contains(&self.roundness) {
            return refuse("aperture's roundness", self.roundness, "must lie between 0 and 1");
        }
        if !(1.0 / MOST_SQUEEZE..=MOST_SQUEEZE).contains(&self.squeeze) {
            return refuse("aperture's squeeze", self.squeeze, "must lie between 0.25 and 4");
        }
        Ok(())
    }

    /// The rim, for a method that has nothing else.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for pictures.
    pub fn expect_outline(&self) -> Result<Outline> {
        self.outline().ok_or(Error::Unsupported {
            what: "an aperture given as a picture",
            reason: "the method aperture draws discs and blades; take the method naive, or bokeh highlights",
        })
    }

    /// The rim, for shapes that have one: all but pictures.
    pub fn outline(&self) -> Option<Outline> {
        let count = match self.shape {
            ApertureShape::Disc => return Some(Outline { sides: vec![Side::round(0.5)] }),
            ApertureShape::Blades(count) => count,
            ApertureShape::Image(_) => return None,
        };
        let half = PI / f64::from(count);
        // Corners at 1 to begin with; bent less than this a side is straight beyond f64's sight in any picture.
        let radius = if self.roundness < 1e-4 { f64::INFINITY } else { 1.0 / self.roundness };
        let apothem = if radius.is_finite() {
            radius + half.cos() - (radius * radius - half.sin().powi(2)).max(0.0).sqrt()
        } else {
            half.cos()
        };
        let unit = Side { direction: [1.0, 0.0], apothem, radius };
        // Distance of the rim at an angle from the side's middle, and the variance along an axis: the integral of its fourth power
        // over four times that of its square, by Simpson's rule.
        let steps = 64;
        let (mut squares, mut fourths) = (0.0, 0.0);
        for i in 0..=steps {
            let angle = half * f64::from(i) / f64::from(steps);
            let weight = if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
            let square = unit.along(angle).powi(2);
            squares += weight * square;
            fourths += weight * square * square;
        }
        let corners = (1.0 / 16.0 / (fourths / (4.0 * squares))).sqrt();
        let turn = self.rotation_degrees.rem_euclid(360.0).to_radians();
        let side = |i: u32| {
            let angle = turn + (f64::from(i) + 0.5) * TAU / f64::from(count);
            Side {
                direction: [angle.cos(), angle.sin()],
                apothem: apothem * corners,
                radius: radius * corners,
            }
        };
        Some(Outline { sides: (0..count).map(side).collect() })
    }
}

/// The rim of an aperture before it is squeezed: the points that lie within every side. In diameters of the circle of
/// confusion, x to the right and y down, from the middle.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// One for a disc, else one for each blade.
    pub sides: Vec<Side>,
}

/// A side: a straight line, or an arc that bends around the middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// From the middle towards the side: a unit vector.
    pub direction: [f64; 2],
    /// How far the side's middle lies in that direction.
    pub apothem: f64,
    /// The arc's radius; infinite for a straight side.
    pub radius: f64,
}

impl Side {
    fn round(radius: f64) -> Self {
        Self { direction: [1.0, 0.0], apothem: radius, radius }
    }

    /// The centre of a bent side's arc.
    pub fn centre(&self) -> [f64; 2] {
        self.direction.map(|d| d * (self.apothem - self.radius))
    }

    /// How far a point lies beyond the side; negative within.
    pub fn beyond(&self, x: f64, y: f64) -> f64 {
        if self.radius.is_infinite() {
            return x * self.direction[0] + y * self.direction[1] - self.apothem;
        }
        let [cx, cy] = self.centre();
        (x - cx).hypot(y - cy) - self.radius
    }

    /// Distance of the side from the middle at an angle from its direction.
    fn along(&self, angle: f64) -> f64 {
        if self.radius.is_infinite() {
            return self.apothem / angle.cos();
        }
        let back = self.radius - self.apothem;
        (self.radius.powi(2) - (back * angle.sin()).powi(2)).max(0.0).sqrt() - back * angle.cos()
    }
}

impl Outline {
    /// How far a point lies beyond the rim, in diameters; negative within.
    pub fn beyond(&self, x: f64, y: f64) -> f64 {
        self.sides.iter().fold(f64::NEG_INFINITY, |most, side| most.max(side.beyond(x, y)))
    }

    /// The outline in front of focus: turned by half a turn.
    #[must_use]
    pub fn turned_over(&self) -> Self {
        let over = |side: &Side| Side { direction: side.direction.map(|d| -d), ..*side };
        Self { sides: self.sides.iter().map(over).collect() }
    }

    /// Where the line `y`, in diameters, runs inside: its ends from left to right, if it does.
    pub fn span(&self, y: f64) -> Option<[f64; 2]> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for side in &self.sides {
            let [across, down] = side.direction;
            if side.radius.is_finite() {
                let [cx, cy] = side.centre();
                let square = side.radius.powi(2) - (y - cy).powi(2);
                if square < 0.0 {
                    return None;
                }
                low = low.max(cx - square.sqrt());
                high = high.min(cx + square.sqrt());
                continue;
            }
            let rest = side.apothem - down * y;
            if across > 1e-12 {
                high = high.min(rest / across);
            } else if across < -1e-12 {
                low = low.max(rest / across);
            } else if rest < 0.0 {
                return None;
            }
        }
        (low <= high).then_some([low, high])
    }

    /// The farthest that the outline reaches from the middle, in diameters.
    pub fn reach(&self) -> f64 {
        // Corners lie half a side's angle away from each side's middle.
        let half = PI / self.sides.len().max(2) as f64;
        self.sides
            .iter()
            .map(|side| if self.sides.len() == 1 { side.apothem } else { side.along(half) })
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area and moments over a grid of 600 points across, in diameters.
    fn moments(outline: &Outline) -> [f64; 3] {
        let (mut area, mut across, mut down) = (0.0, 0.0, 0.0);
        for i in 0..600 * 600 {
            let [x, y] = [i % 600, i / 600].map(|k| (f64::from(k) - 299.5) / 300.0);
            if outline.beyond(x, y) <= 0.0 {
                area += 1.0 / 90_000.0;
                across += x * x / 90_000.0;
                down += y * y / 90_000.0;
            }
        }
        [area, across / area, down / area]
    }

    #[test]
    fn outlines_have_the_disc_s_variance() {
        for count in [3, 5, 6, 32] {
            for roundness in [0.0, 0.3, 1.0] {
                let aperture = Aperture { roundness, ..Aperture::blades(count, 12.0) };
                let outline = aperture.outline().unwrap();
                let [area, across, down] = moments(&outline);
                // The grid's own roughness.
                for variance in [across, down] {
                    assert!((variance * 16.0 - 1.0).abs() < 6e-3, "{count} {roundness}: {variance}");
                }
                // A disc has the largest area for its variance.
                let disc = PI / 4.0;
                assert!(area < disc * 1.005 && (roundness < 1.0 || area > disc * 0.995), "{count}: {area}");
                let least = outline.sides[0].apothem;
                assert!(outline.reach() >= least && outline.reach() < 2.5 * least);
            }
        }
        assert_eq!(Aperture::DISC.outline().unwrap().reach(), 0.5);
    }

    #[test]
    fn straight_sides_lie_where_the_closed_form_says() {
        for count in [3u32, 5, 6, 32] {
            // R^2 (2 + cos(2 pi / n)) / 12 = 1 / 16.
            let angle = PI / f64::from(count);
            let expected = 0.5 * (3.0 / (2.0 + (2.0 * angle).cos())).sqrt() * angle.cos();
            let found = Aperture::blades(count, 0.0).outline().unwrap().sides[0].apothem;
            // Simpson's rule with 64 steps.
            assert!((found / expected - 1.0).abs() < 1e-6, "{count}: {found} {expected}");
        }
    }

    #[test]
    fn spans_are_where_the_outline_is() {
        for (count, roundness) in [(3, 0.0), (5, 0.4), (8, 1.0)] {
            let aperture = Aperture { roundness, ..Aperture::blades(count, 31.0) };
            let outline = aperture.outline().unwrap();
            for outline in [outline.turned_over(), outline] {
                for i in -60..=60 {
                    let y = f64::from(i) / 80.0;
                    let Some([low, high]) = outline.span(y) else {
                        assert!((-90..=90).all(|i| outline.beyond(f64::from(i) / 90.0, y) > 0.0));
                        continue;
                    };
                    for x in [low, high] {
                        assert!(outline.beyond(x, y).abs() < 1e-9, "{count} {roundness} {y}");
                    }
                    assert!(outline.beyond(0.5 * (low + high), y) <= 1e-12);
                }
            }
        }
    }

    #[test]
    fn in_front_of_focus_all_is_turned_over() {
        let outline = Aperture::blades(5, 20.0).outline().unwrap();
        let over = outline.turned_over();
        for (x, y) in [(0.1, 0.4), (-0.5, 0.2), (0.3, -0.3)] {
            assert!((outline.beyond(x, y) - over.beyond(-x, -y)).abs() < 1e-15);
        }
    }

    #[test]
    fn values_outside_their_ranges_are_refused() {
        let odd = [
            Aperture::blades(2, 0.0),
            Aperture::blades(33, 0.0),
            Aperture::blades(5, f64::NAN),
            Aperture { roundness: 1.5, ..Aperture::DISC },
            Aperture { squeeze: 0.1, ..Aperture::DISC },
            Aperture { squeeze: f64::NAN, ..Aperture::DISC },
        ];
        for aperture in odd {
            assert!(matches!(aperture.check(), Err(Error::Setting { .. })), "{aperture:?}");
        }
        assert!(Aperture { squeeze: 2.0, roundness: 0.5, ..Aperture::blades(32, -400.0) }.check().is_ok());
        for (width, height, data) in [
            (0, 0, vec![]),
            (2, 1, vec![1.0]),
            (1, 1, vec![0.0]),
            (1, 2, vec![1.0, -1.0]),
            (1, 1, vec![f32::NAN]),
        ] {
            assert!(Mask::new(width, height, data).is_err(), "{width} x {height}");
        }
    }

    #[test]
    fn masks_turn_and_sum() {
        let mask = Mask::new(3, 3, vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).unwrap();
        // From the right to below.
        let turned = mask.turned(90.0);
        let side = turned.width();
        let middle = |axis: usize| {
            let of = |i: usize| ([i % side, i / side][axis] as f64 + 0.5) / side as f64 - 0.5;
            turned.data().iter().enumerate().map(|(i, v)| f64::from(*v) * of(i)).sum::<f64>()
        };
        // A fifth of the side: one pixel of five. What interpolating between f32 leaves.
        assert!(middle(0).abs() < 1e-6 && (middle(1) - 0.2).abs() < 1e-6, "{} {}", middle(0), middle(1));
        assert_eq!(mask.turned(360.0), mask);
        assert_eq!(mask.summed()[4 * 4 - 1], 1.0);
        assert_eq!(mask.summed()[2 * 4 + 2], 0.0);
    }
}
