//! An aperture as spans of rows, for every size that one level draws.

use pullfocus_core::aperture::Outline;
use pullfocus_core::spans::MOST_ROWS;

/// Rows above and below the middle's own.
pub const HALF: usize = MOST_ROWS * 3 / 4 + 1;
/// Rows of a table's entry, in whole vectors.
pub const ROWS: usize = (2 * HALF + 2).next_multiple_of(8);
/// Entries for each row of diameter; between two, spans are mixed, which keeps their light exactly.
const STEPS: usize = 4;
/// Places of the middle within a cell that are told apart.
pub const PHASES: usize = 16;
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
    per_phase: usize,
    /// Diameters in cells of height that have their shape within one cell.
    pub least: f32,
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
        let per_phase = STEPS * MOST_ROWS + 2;
        let entry = |i: usize| {
            let (phase, size) = (i / per_phase, i % per_phase);
            Entry::new(&integrals, size.max(1) as f64 / STEPS as f64, phase as f64 / PHASES as f64, across)
        };
        let entries = (0..PHASES * per_phase).map(entry).collect();
        let least = (0.5 / (integrals.reach * across.max(1.0))) as f32;
        Self { entries, per_phase, least }
    }

    /// The two sizes between which a diameter of `rows` cells lies, and the way to the second.
    #[inline(always)]
    pub fn at(&self, phase: usize, rows: f32) -> ([&Entry; 2], f32) {
        let at = rows.clamp(0.0, MOST_ROWS as f32) * STEPS as f32;
        let size = at as usize;
        let first = phase * self.per_phase + size;
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
