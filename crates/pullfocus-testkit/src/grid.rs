//! A picture plane in f64.

use pullfocus_core::{Plane, Size};

/// One channel of f64 values, rows from top to bottom.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// All values, row by row.
    pub data: Vec<f64>,
}

impl Grid {
    /// A grid whose value at (x, y) is `f(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut f: impl FnMut(usize, usize) -> f64) -> Self {
        let data = (0..width * height).map(|i| f(i % width, i / width)).collect();
        Self { width, height, data }
    }

    /// The same value everywhere.
    pub fn filled(width: usize, height: usize, value: f64) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }

    /// A plane's values, exactly.
    pub fn from_plane(plane: &Plane) -> Self {
        let Size { width, height } = plane.size();
        Self { width, height, data: plane.data().iter().map(|&v| f64::from(v)).collect() }
    }

    /// The values rounded to f32.
    pub fn to_plane(&self) -> Plane {
        Plane::new(Size::new(self.width, self.height), self.data.iter().map(|&v| v as f32).collect())
            .expect("a grid's data is its width times its height")
    }

    /// The value at column `x` of row `y`.
    pub fn at(&self, x: usize, y: usize) -> f64 {
        self.data[y * self.width + x]
    }

    /// Row `y`.
    pub fn row(&self, y: usize) -> Vec<f64> {
        self.data[y * self.width..][..self.width].to_vec()
    }

    /// Column `x`.
    pub fn column(&self, x: usize) -> Vec<f64> {
        (0..self.height).map(|y| self.at(x, y)).collect()
    }

    /// Each value through `f`.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { data: self.data.iter().map(|&v| f(v)).collect(), ..*self }
    }

    /// Each value and its partner in `other` through `f`.
    pub fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        assert_eq!((self.width, self.height), (other.width, other.height), "grids of different sizes");
        Self { data: self.data.iter().zip(&other.data).map(|(&a, &b)| f(a, b)).collect(), ..*self }
    }

    /// Each row through `f`, which also gets its number.
    pub fn by_rows(&self, f: impl Fn(usize, &[f64]) -> Vec<f64>) -> Self {
        Self { data: (0..self.height).flat_map(|y| f(y, &self.row(y))).collect(), ..*self }
    }

    /// Each column through `f`, which also gets its number.
    pub fn by_columns(&self, f: impl Fn(usize, &[f64]) -> Vec<f64>) -> Self {
        self.transposed().by_rows(f).transposed()
    }

    /// Columns as rows.
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.height, self.width, |x, y| self.at(y, x))
    }

    /// Sum of all values.
    pub fn sum(&self) -> f64 {
        self.data.iter().sum()
    }

    /// Largest absolute value.
    pub fn largest(&self) -> f64 {
        self.data.iter().fold(0.0, |most, v| most.max(v.abs()))
    }

    /// Largest absolute difference to `plane`; infinite where one of the two is not a number.
    pub fn distance_to(&self, plane: &Plane) -> f64 {
        assert_eq!(plane.size(), Size::new(self.width, self.height), "a plane of another size");
        self.data
            .iter()
            .zip(plane.data())
            .map(|(&a, &b)| (a - f64::from(b)).abs())
            .fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { most.max(d) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_go_there_and_back() {
        let plane = Plane::from_fn(Size::new(3, 2), |x, y| (x as f32) * 0.1 + y as f32).unwrap();
        let grid = Grid::from_plane(&plane);
        assert_eq!(grid.to_plane(), plane);
        assert_eq!(grid.distance_to(&plane), 0.0);
        assert_eq!(grid.transposed().column(1), grid.row(1));
    }

    #[test]
    fn a_nan_is_far_away() {
        let plane = Plane::filled(Size::new(2, 1), f32::NAN).unwrap();
        assert_eq!(Grid::filled(2, 1, 0.0).distance_to(&plane), f64::INFINITY);
    }
}
