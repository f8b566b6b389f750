//! Planes that stay allocated from frame to frame.

use pullfocus_core::{Plane, Result, Size};

/// Spare planes.
#[derive(Debug, Default)]
pub struct PlanePool(Vec<Plane>);

impl PlanePool {
    /// A plane of this size whose values are to be overwritten.
    pub fn take(&mut self, size: Size) -> Result<Plane> {
        let fitting = self.0.iter().position(|plane| plane.size() == size);
        let mut plane = match fitting {
            Some(i) => self.0.swap_remove(i),
            None => self.0.pop().unwrap_or_default(),
        };
        plane.resize(size)?;
        Ok(plane)
    }

    /// A copy of `plane`.
    pub fn copy(&mut self, plane: &Plane) -> Result<Plane> {
        let mut copy = self.take(plane.size())?;
        copy.data_mut().copy_from_slice(plane.data());
        Ok(copy)
    }

    /// Gives planes back.
    pub fn give(&mut self, planes: impl IntoIterator<Item = Plane>) {
        self.0.extend(planes);
    }
}
