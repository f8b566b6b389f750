//! Where the cells of each level lie in one buffer.

use pullfocus_core::Size;
use pullfocus_core::spans::level_of;

/// The most levels there are room for: circles of 48 2^19 rows.
pub const MOST_LEVELS: usize = 20;
/// Cells around a coarse level's picture that enlarging takes from; the finest has none.
const EDGE: usize = 2;

/// The levels of a picture, one after the other, the finest first.
#[derive(Debug, Clone)]
pub struct Places {
    /// First cell, columns, rows, width of the edge.
    all: [[u32; 4]; MOST_LEVELS],
    levels: usize,
    cells: u64,
}

impl Places {
    /// Levels for circles up to `most_rows` pixels of height.
    pub fn new(size: Size, most_rows: f32) -> Self {
        let levels = (1 + level_of(most_rows)).min(MOST_LEVELS);
        let mut all = [[0; 4]; MOST_LEVELS];
        let mut cells = 0;
        for (l, place) in all[..levels].iter_mut().enumerate() {
            let edge = if l == 0 { 0 } else { EDGE };
            let [columns, rows] = [size.width, size.height].map(|n| ((n - 1) >> l) + 1 + 2 * edge);
            *place = [cells as u32, columns as u32, rows as u32, edge as u32];
            cells += (columns * rows) as u64;
        }
        Self { all, levels, cells }
    }

    /// As the shaders have them; zeros from the last level on.
    pub fn all(&self) -> [[u32; 4]; MOST_LEVELS] {
        self.all
    }

    /// How many levels there are, 1 or more.
    pub fn levels(&self) -> usize {
        self.levels
    }

    /// Cells of all levels.
    pub fn cells(&self) -> u64 {
        self.cells
    }

    /// Cells of all levels but the finest.
    pub fn coarse_cells(&self) -> u64 {
        let [_, columns, rows, _] = self.all[0];
        self.cells - u64::from(columns) * u64::from(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_follow_each_other() {
        let places = Places::new(Size::new(100, 37), 200.0);
        assert_eq!(places.levels(), 4);
        let all = places.all();
        assert_eq!(all[0], [0, 100, 37, 0]);
        assert_eq!(all[1], [3700, 54, 23, 2]);
        assert_eq!(all[2], [3700 + 54 * 23, 29, 14, 2]);
        assert_eq!(all[3], [3700 + 54 * 23 + 29 * 14, 17, 9, 2]);
        assert_eq!(places.cells(), 3700 + 54 * 23 + 29 * 14 + 17 * 9);
        assert_eq!(places.coarse_cells(), places.cells() - 3700);
        assert_eq!(Places::new(Size::new(1, 1), 4.0).levels(), 1);
    }
}
