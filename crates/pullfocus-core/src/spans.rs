//! Formulas of the aperture method: a point's image as spans of rows, on a level of a pyramid that leaves few rows.
//!
//! # Theory
//! Along a row a shape without holes is a span: light begins at its left end and ends at its right one. A running sum along the
//! rows makes spans of their ends, so that a point costs two writes a row, however wide it is. That it costs the same however
//! high it is, large ones are drawn on a level whose cells are 2^l pixels, where they have half to all of [`MOST_ROWS`] rows, and
//! enlarged by the subdivision of quadratic B-splines, weights (1, 3, 3, 1) / 4 along each axis.
//!
//! Each enlargement adds 3/4 of a squared fine cell to the variance, and light put together in the middle of cells has
//! a twelfth of a squared cell less than light spread over them; a large shape is drawn smaller by what is too much
//! ([`drawn_diameter`]).
//!
//! Where spans begin and end is the same for all points of one size at one place within a cell: [`Spans`] has it in tables.

use crate::aperture::{Aperture, Outline};
use crate::error::Result;

/// The most rows of cells that a circle's diameter spans.
pub const MOST_ROWS: usize = 48;

/// The level on which a circle whose diameter is `rows` pixels high is drawn.
#[inline(always)]
pub fn level_of(rows: f32) -> usize {
    // The least l with rows <= MOST_ROWS 2^l: from the exponent of the quotient, rounded up.
    let ratio = rows / MOST_ROWS as f32;
    if ratio <= 1.0 {
        return 0;
    }
    let bits = ratio.to_bits();
    ((bits >> 23) as usize - 127) + usize::from(bits & 0x007f_ffff != 0)
}

/// The diameter that is drawn on `level` for one of `diameter`, all in pixels: its variance and what drawing adds are
/// the wanted one.
#[inline(always)]
pub fn drawn_diameter(diameter: f32, level: usize) -> f32 {
    (diameter * diameter - 16.0 * added_variance(level)).max(0.0).sqrt()
}

/// What drawing on `level` adds to the variance along each axis, in square pixels, compared with drawing on level 0.
#[inline(always)]
pub fn added_variance(level: usize) -> f32 {
    (((1u64 << (2 * level)) - 1) as f32) / 6.0
}

/// The weights with which the cells at `at / 2` (rounded down) and the next one on the fine cell's own side make the fine cell.
pub const ENLARGING: [f32; 2] = [0.75, 0.25];

/// Rows above and below the middle's own.
pub const HALF: usize = MOST_ROWS * 3 / 4 + 1;
/// Rows of a table's entry, in whole vectors.
pub const ROWS: usize = (2 * HALF + 2).next_multiple_of(8);
/// Entries for each row of diameter; between two, spans are mixed, which keeps their light exactly.
pub const STEPS: usize = 4;
/// Places of the middle within a cell that are told apart.
pub const PHASES: usize = 16;
/// Entries of one phase: all sizes up to [`MOST_ROWS`], and one beyond the last.
pub const SIZES: usize = STEPS * MOST_ROWS + 2;
/// Points of the outline's integrals for each diameter.
const POINTS: usize = 2048;

/// One size at one phase: what of each row is covered, and where the covered part begins and ends, times that; in cells.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The part of each row's height that is covered; [`HALF`] is the middle's own row.
    pub covered: [f32; ROWS],
    /// Mean of the left end over the covered part, times that part.
    pub left: [f32; ROWS],
    /// The same of the right end.
    pub right: [f32; ROWS],
    /// All rows' light: the area in cells.
    pub area: f32,
    /// The first row that has any light, and the one after the last.
    pub rows: [usize; 2],
}

/// Every size up to [`MOST_ROWS`] at every phase.
#[derive(Debug)]
pub struct Spans {
    entries: Vec<Entry>,
    /// Diameters in cells of height that have their shape within one cell.
    pub least: f32,
    /// The most columns that a circle one row high reaches to either side of its middle.
    pub wide: f32,
}

/// Integrals from the top of the outline down: of 1, of the left end, of the right end.
struct Integrals {
    sums: Vec<[f64; 3]>,
    reach: f64,
}

impl Integrals {
    fn new(outline: &Outline) -> Self {
        let reach = outline.reach();
        let count = (2.0 * reach * POINTS as f64).ceil() as usize;
        let step = 2.0 * reach / count as f64;
        let mut sums = vec![[0.0; 3]; count + 1];
        for i in 0..count {
            // The middle of a step stands for it.
            let span = outline.span(-reach + (i as f64 + 0.5) * step);
            let value = span.map_or([0.0; 3], |[left, right]| [1.0, left, right]);
            sums[i + 1] = std::array::from_fn(|k| sums[i][k] + step * value[k]);
        }
        Self { sums, reach }
    }

    fn until(&self, y: f64) -> [f64; 3] {
        let last = self.sums.len() - 1;
        let at = ((y + self.reach) / (2.0 * self.reach)).clamp(0.0, 1.0) * last as f64;
        let (i, part) = ((at as usize).min(last - 1), at - (at as usize).min(last - 1) as f64);
        std::array::from_fn(|k| self.sums[i][k] + (self.sums[i + 1][k] - self.sums[i][k]) * part)
    }
}

impl Spans {
    /// Tables of an outline; `across` is how many cells wide a circle is that is one cell high.
    pub fn new(outline: &Outline, across: f64) -> Self {
        let integrals = Integrals::new(outline);
        let entry = |i: usize| {
            let (phase, size) = (i / SIZES, i % SIZES);
            Entry::new(&integrals, size.max(1) as f64 / STEPS as f64, phase as f64 / PHASES as f64, across)
        };
        let entries = (0..PHASES * SIZES).map(entry).collect();
        let least = (0.5 / (integrals.reach * across.max(1.0))) as f32;
        let wide = (integrals.reach * across) as f32;
        Self { entries, least, wide }
    }

    /// All entries: [`SIZES`] of each of [`PHASES`] phases; the one at i has a diameter of i / [`STEPS`] rows.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The two sizes between which a diameter of `rows` cells lies, and the way to the second.
    #[inline(always)]
    pub fn at(&self, phase: usize, rows: f32) -> ([&Entry; 2], f32) {
        let at = rows.clamp(0.0, MOST_ROWS as f32) * STEPS as f32;
        let size = at as usize;
        let first = phase * SIZES + size;
        ([&self.entries[first], &self.entries[first + 1]], at - size as f32)
    }

    /// Rows that a diameter reaches to either side of its middle's own.
    pub fn reach(&self, rows: f32) -> usize {
        let ([_, larger], _) = self.at(PHASES / 2, rows);
        (larger.rows[1].saturating_sub(HALF)).max(HALF + 1 - larger.rows[0].min(HALF)) + 1
    }
}

impl Entry {
    fn new(integrals: &Integrals, diameter: f64, phase: f64, across: f64) -> Self {
        let mut made = Self {
            covered: [0.0; ROWS],
            left: [0.0; ROWS],
            right: [0.0; ROWS],
            area: 0.0,
            rows: [HALF, HALF + 1],
        };
        let mut area = 0.0;
        for row in 0..ROWS {
            let top = row as f64 - HALF as f64 - phase - 0.5;
            let (above, below) = (integrals.until(top / diameter), integrals.until((top + 1.0) / diameter));
            let [covered, left, right] = std::array::from_fn(|k| (below[k] - above[k]) * diameter);
            if covered < 1e-9 {
                continue;
            }
            let wide = diameter * across;
            made.covered[row] = covered as f32;
            made.left[row] = (left * wide) as f32;
            made.right[row] = (right * wide) as f32;
            area += f64::from(made.right[row]) - f64::from(made.left[row]);
            made.rows = [made.rows[0].min(row), made.rows[1].max(row + 1)];
        }
        made.area = area as f32;
        made
    }
}

/// The tables of one aperture.
#[derive(Debug)]
pub struct Tables {
    /// Behind focus.
    pub behind: Spans,
    /// In front of it, where the aperture is turned by half a turn; none for what looks the same then.
    pub front: Option<Spans>,
    aperture: Aperture,
    vertical_scale: f32,
}

impl Tables {
    /// The tables of `aperture` on pixels of which `vertical_scale` in height are as long as one in width.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for an aperture that is a picture.
    pub fn new(aperture: &Aperture, vertical_scale: f32) -> Result<Self> {
        let outline = aperture.expect_outline()?;
        let across = 1.0 / (f64::from(vertical_scale) * aperture.squeeze);
        let same = outline.sides.len() % 2 == 0 || outline.sides.len() == 1;
        Ok(Self {
            behind: Spans::new(&outline, across),
            front: (!same).then(|| Spans::new(&outline.turned_over(), across)),
            aperture: aperture.clone(),
            vertical_scale,
        })
    }

    /// Whether these are the tables that [`Tables::new`] would make.
    pub fn are_of(&self, aperture: &Aperture, vertical_scale: f32) -> bool {
        self.vertical_scale == vertical_scale && self.aperture == *aperture
    }

    /// The spans of a circle of this sign.
    #[inline(always)]
    pub fn of(&self, in_front: bool) -> &Spans {
        match &self.front {
            Some(front) if in_front => front,
            _ => &self.behind,
        }
    }

    /// Rows that a circle of this height in cells reaches to either side of its middle's own.
    pub fn reach(&self, rows: f32) -> usize {
        self.behind.reach(rows).max(self.front.as_ref().map_or(0, |front| front.reach(rows)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_has_half_to_all_of_the_rows() {
        for i in 1..40_000 {
            let rows = 0.1 * i as f32;
            let level = level_of(rows);
            let cells = rows / (1u32 << level) as f32;
            assert!(cells <= MOST_ROWS as f32, "{rows}");
            assert!(level == 0 || cells > 0.5 * MOST_ROWS as f32, "{rows}");
        }
    }

    #[test]
    fn what_is_drawn_has_the_wanted_variance() {
        // Enlarging: 3/4 (1 + 4 + ... + 4^(l-1)); cells: (4^l - 1) / 12 less.
        for level in 0..10usize {
            let enlarging: f64 = (0..level).map(|k| 0.75 * 4f64.powi(k as i32)).sum();
            let cells = (4f64.powi(level as i32) - 1.0) / 12.0;
            assert!(
                (f64::from(added_variance(level)) / (enlarging - cells).max(1e-30) - 1.0).abs() < 1e-6
                    || level == 0
            );
            let diameter = MOST_ROWS as f32 * 0.6 * (1u32 << level) as f32;
            let drawn = drawn_diameter(diameter, level);
            // f32.
            assert!(
                (drawn * drawn / 16.0 + added_variance(level)) / (diameter * diameter / 16.0) - 1.0 < 1e-5
            );
        }
        assert_eq!(drawn_diameter(7.5, 0), 7.5);
    }
}
