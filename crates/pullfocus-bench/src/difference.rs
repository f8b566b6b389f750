//! How far one picture is from another, value by value.

use pullfocus::{Picture, Plane};
use pullfocus_testkit::Grid;

/// Values below this are compared as if they were this large: a part of it is an absolute error there.
pub const FLOOR: f64 = 0.05;

/// `|a - b| / max(|b|, FLOOR)` over many values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    /// The largest; infinite where one of the two is no number.
    pub largest: f64,
    sum: f64,
    /// How many values were compared.
    pub count: usize,
    /// How many are above the bound.
    pub above: usize,
    /// How many of those are apart by more than the rounding that is allowed for.
    pub beyond: usize,
}

impl Difference {
    /// Of values and what they should be.
    pub fn of(pairs: impl IntoIterator<Item = (f64, f64)>, bound: f64) -> Self {
        Self::with_rounding(pairs, bound, 0.0)
    }

    /// The same, where `rounding` is allowed between any two values.
    pub fn with_rounding(pairs: impl IntoIterator<Item = (f64, f64)>, bound: f64, rounding: f64) -> Self {
        let mut all = Self::default();
        for (a, b) in pairs {
            let difference = (a - b).abs() / b.abs().max(FLOOR);
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            all.largest = all.largest.max(difference);
            all.sum += difference;
            all.count += 1;
            all.above += usize::from(difference > bound);
            let apart = (a - b).abs();
            all.beyond += usize::from(difference > bound && (apart.is_nan() || apart > rounding));
        }
        all
    }

    /// Of two pictures of the same planes, `rounding` as above.
    pub fn between(a: &Picture, b: &Picture, bound: f64, rounding: f64) -> Self {
        let pairs = a.planes().zip(b.planes()).flat_map(|(a, b)| a.data().iter().zip(b.data()));
        Self::with_rounding(pairs.map(|(&a, &b)| (a.into(), b.into())), bound, rounding)
    }

    /// Of planes from references in f64.
    pub fn from_reference<'a>(
        planes: impl Iterator<Item = &'a Plane>,
        references: &[Grid],
        bound: f64,
    ) -> Self {
        let pairs = planes.zip(references).flat_map(|(a, b)| a.data().iter().zip(&b.data));
        Self::of(pairs.map(|(&a, &b)| (a.into(), b)), bound)
    }

    /// Both together.
    pub fn and(self, other: Self) -> Self {
        Self {
            largest: self.largest.max(other.largest),
            sum: self.sum + other.sum,
            count: self.count + other.count,
            above: self.above + other.above,
            beyond: self.beyond + other.beyond,
        }
    }

    /// The mean; 0 of nothing.
    pub fn mean(&self) -> f64 {
        self.sum / self.count.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_values_are_compared_with_the_floor() {
        let all = Difference::of([(2.1, 2.0), (0.01, 0.0), (0.5, 0.5)], 0.1);
        assert!((all.largest - 0.2).abs() < 1e-12 && (all.mean() - 0.25 / 3.0).abs() < 1e-12, "{all:?}");
        assert_eq!((all.count, all.above), (3, 1));
        let allowed = Difference::with_rounding([(0.01, 0.0), (0.5, 0.0), (f64::NAN, 0.0)], 0.1, 0.02);
        assert_eq!((allowed.above, allowed.beyond), (3, 2), "the first is within the rounding");
        let none = Difference::of([(f64::NAN, 1.0)], 0.1);
        assert_eq!((none.largest, none.above), (f64::INFINITY, 1));
        let both = all.and(none);
        assert_eq!((both.largest, both.count, both.above), (f64::INFINITY, 4, 2));
        assert_eq!(Difference::default().mean(), 0.0);
    }
}
