//! A plane: one channel of a picture, row by row.

use crate::error::{Error, Result};
use crate::size::Size;

/// One channel of f32 values, rows from top to bottom without padding.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plane {
    size: Size,
    data: Vec<f32>,
}

impl Plane {
    /// Takes `data` as a plane of `size`.
    ///
    /// # Errors
    /// [`Error::Length`] if `data` is not `size.area()` long.
    pub fn new(size: Size, data: Vec<f32>) -> Result<Self> {
        if data.len() == size.area() {
            Ok(Self { size, data })
        } else {
            Err(Error::Length { size, expected: size.area(), found: data.len() })
        }
    }

    /// A plane with the same value everywhere.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] where the memory cannot be had.
    pub fn filled(size: Size, value: f32) -> Result<Self> {
        let mut plane = Self::default();
        plane.reset(size, value)?;
        Ok(plane)
    }

    /// A plane whose value at (x, y) is `f(x, y)`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] where the memory cannot be had.
    pub fn from_fn(size: Size, mut f: impl FnMut(usize, usize) -> f32) -> Result<Self> {
        let mut plane = Self::filled(size, 0.0)?;
        for y in 0..size.height {
            for (x, value) in plane.row_mut(y).iter_mut().enumerate() {
                *value = f(x, y);
            }
        }
        Ok(plane)
    }

    /// Gives the plane this size and value, keeping its memory where it is large enough.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] where the memory cannot be had; the plane is then empty.
    pub fn reset(&mut self, size: Size, value: f32) -> Result<()> {
        self.data.clear();
        self.size = Size::default();
        self.data.try_reserve_exact(size.area()).map_err(|_| Error::OutOfMemory {
            what: "a plane",
            size,
            bytes: size.area() as u64 * 4,
        })?;
        self.data.resize(size.area(), value);
        self.size = size;
        Ok(())
    }

    /// Gives the plane this size, with values left from before or zero; for buffers that are written whole.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] where the memory cannot be had; the plane is then empty.
    pub fn resize(&mut self, size: Size) -> Result<()> {
        if self.data.len() == size.area() {
            self.size = size;
            return Ok(());
        }
        self.reset(size, 0.0)
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// All values, row by row.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All values, row by row.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// The values, without the size.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// Row `y`. Panics if there is none.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.size.width..][..self.size.width]
    }

    /// Row `y`. Panics if there is none.
    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.data[y * self.size.width..][..self.size.width]
    }

    /// The value at column `x` of row `y`. Panics if there is none.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.row(y)[x]
    }

    /// Refuses a plane of another size.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`], naming `what`.
    pub fn expect_size(&self, what: &'static str, expected: Size) -> Result<()> {
        if self.size == expected {
            Ok(())
        } else {
            Err(Error::SizeMismatch { what, found: self.size, expected })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn length_must_be_the_area() {
        let size = Size::new(3, 2);
        assert!(Plane::new(size, vec![0.0; 6]).is_ok());
        assert_eq!(Plane::new(size, vec![0.0; 5]), Err(Error::Length { size, expected: 6, found: 5 }));
    }

    #[test]
    fn an_impossible_size_is_an_error_not_an_abort() {
        let size = Size::new(usize::MAX / 8, 2);
        assert!(matches!(Plane::filled(size, 0.0), Err(Error::OutOfMemory { .. })));
    }

    #[test]
    fn rows_follow_each_other() {
        let plane = Plane::from_fn(Size::new(3, 2), |x, y| (10 * y + x) as f32).unwrap();
        assert_eq!(plane.row(1), &[10.0, 11.0, 12.0]);
        assert_eq!(plane.at(2, 1), 12.0);
    }
}
