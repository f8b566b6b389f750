//! Sprites as differences along the rows of a band, and their running sums.
//!
//! A sprite writes the two ends of each of its rows, whatever its width. All values are whole multiples of one grid, so sums in
//! f64 are exact: beyond a light of 65504 nothing of it is left, and no order matters.

use super::shape::Slices;

/// Differences of `G` planes over some rows of a picture.
#[derive(Debug, Default)]
pub struct Sums<const G: usize> {
    cells: Vec<[f64; G]>,
    width: usize,
    /// Cells from row to row.
    stride: usize,
    /// The cells of each row that hold anything.
    used: Vec<[usize; 2]>,
}

/// Cells of `bytes` from row to row, at least `width`: a sprite's rows, one below the other, lie in different sets of a cache of 4096 bytes a way.
fn stride(width: usize, bytes: usize) -> usize {
    const WAY: usize = 4096;
    const APART: usize = 320;
    let within = width * bytes % WAY;
    width + ((APART + WAY - within) % WAY).div_ceil(bytes)
}

/// A grid for values: `total` is at least the sum of all absolute values that meet anywhere.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Adding and subtracting this rounds to the grid.
    round: f64,
}

impl Grid {
    pub fn new(total: f64) -> Self {
        // The next power of two, and 50 bits below it; differences of sums stay below 2^51 steps.
        let step = f64::from_bits((total.max(1e-200).to_bits() >> 52) << 52) * 2f64.powi(-49);
        Self { round: 1.5 * 2f64.powi(52) * step }
    }

    #[inline(always)]
    pub fn on<const G: usize>(self, values: &[f64; G], factor: f64) -> [f64; G] {
        values.map(|value| (value * factor + self.round) - self.round)
    }

    /// Zero, as [`Row::covers`] counts.
    #[inline(always)]
    pub fn nothing<const G: usize>(self) -> [f64; G] {
        [self.round; G]
    }
}

impl<const G: usize> Sums<G> {
    /// Empty sums of `rows` rows.
    pub fn reset(&mut self, width: usize, rows: usize) {
        if self.width != width || self.used.len() != rows {
            self.cells.clear();
            self.stride = stride(width, size_of::<[f64; G]>());
            self.cells.resize(self.stride * rows, [0.0; G]);
            self.used.clear();
            self.used.resize(rows, [width, 0]);
            self.width = width;
        }
    }

    /// The row for writing differences.
    #[inline(always)]
    pub fn row(&mut self, row: usize) -> Row<'_, G> {
        Row { cells: &mut self.cells[row * self.stride..][..self.width], used: &mut self.used[row] }
    }

    /// Calls `each(first column, sums)` with what was written to a row, if anything was, and empties it.
    #[inline(always)]
    pub fn take(&mut self, row: usize, each: impl FnOnce(usize, &[[f64; G]])) {
        let [from, to] = std::mem::replace(&mut self.used[row], [self.width, 0]);
        if from >= to {
            return;
        }
        let cells = &mut self.cells[row * self.stride..][from..to];
        let mut sum = [0.0; G];
        for cell in &mut *cells {
            sum.iter_mut().zip(&*cell).for_each(|(sum, cell)| *sum += cell);
            *cell = sum;
        }
        each(from, cells);
        cells.fill([0.0; G]);
    }
}

/// One row's differences.
pub struct Row<'a, const G: usize> {
    cells: &'a mut [[f64; G]],
    used: &'a mut [usize; 2],
}

impl<const G: usize> Row<'_, G> {
    /// Says which columns, from `from` to before `to`, are written to.
    #[inline(always)]
    pub fn uses(&mut self, from: isize, to: isize) {
        let last = self.cells.len() as isize;
        self.used[0] = self.used[0].min(from.clamp(0, last) as usize);
        self.used[1] = self.used[1].max(to.clamp(0, last) as usize);
    }

    /// From column `x` on, `values` more. What is left of the picture begins with it, what is right of it is not seen.
    #[inline(always)]
    pub fn add(&mut self, x: isize, values: [f64; G]) {
        if let Some(cell) = self.cells.get_mut(x.max(0) as usize) {
            for (cell, value) in cell.iter_mut().zip(values) {
                *cell += value;
            }
        }
    }

    /// In the columns from `x` on, `covers` times `values`. `before` is what the column before has, as [`Grid::nothing`] counts; the last
    /// one's follows.
    #[inline(always)]
    pub fn covers(&mut self, grid: Grid, values: &[f64; G], x: isize, covers: &[f64], before: &mut [f64; G]) {
        let end = x + covers.len() as isize;
        self.uses(x, end);
        let inside = usize::try_from(x).ok().and_then(|x| self.cells.get_mut(x..x + covers.len()));
        if let Some(cells) = inside {
            let mut last = *before;
            for (cell, cover) in cells.iter_mut().zip(covers) {
                // Read whole and written whole: else each plane goes by itself.
                let (cover, mut sum) = (*cover, *cell);
                let now = values.map(|value| value * cover + grid.round);
                for i in 0..G {
                    sum[i] += now[i] - last[i];
                }
                (*cell, last) = (sum, now);
            }
            *before = last;
            return;
        }
        for (x, cover) in (x..end).zip(covers) {
            let now = values.map(|value| value * cover + grid.round);
            self.add(x, minus(now, *before));
            *before = now;
        }
    }

    /// The slices of a row, times `values`, about the column `x`.
    #[inline(always)]
    pub fn slices(&mut self, grid: Grid, values: &[f64; G], x: f64, slices: &Slices) {
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for slice in slices.all() {
            let ([low, low_slope], [high, high_slope]) = (slice.low, slice.high);
            from = if low - low_slope < from { low - low_slope } else { from };
            to = if high + high_slope > to { high + high_slope } else { to };
            for (sign, end) in [(1.0, [x + low, low_slope]), (-1.0, [x + high, high_slope])] {
                self.end(grid, values, slice.height, sign, end);
            }
        }
        self.uses((x + from).floor() as isize, (x + to).floor() as isize + 2);
    }

    /// From around column `place` on, `height` times `values` more: an end that slopes by `slope` to either side. Columns reach from
    /// their number to the next. `sign` is 1 where a slice begins and -1 where it ends.
    #[inline(always)]
    pub fn end(&mut self, grid: Grid, values: &[f64; G], height: f64, sign: f64, [place, slope]: [f64; 2]) {
        let (from, to) = (place - slope, place + slope);
        let first = from.floor();
        let whole = grid.on(values, height * sign);
        let column = first as isize;
        if to < first + 1.0 {
            // The part of the column that lies to the right of the end.
            let part = grid.on(values, height * sign * (first + 1.0 - place));
            self.add(column, part);
            self.add(column + 1, minus(whole, part));
            return;
        }
        let last = to.floor();
        // What is covered of a column when the end lies anywhere between `from` and `to`.
        let until = |u: f64| {
            let inside = u.clamp(0.0, 1.0);
            0.5 * inside * inside + (u - 1.0).max(0.0)
        };
        let per_way = 0.5 / slope;
        let mut before = [0.0; G];
        let count = (last - first) as isize;
        for i in 0..=count {
            let edge = first + 1.0 + i as f64;
            let covered = ((until(edge - from) - until(edge - to)) * per_way).min(1.0);
            let now = grid.on(values, height * sign * covered);
            self.add(column + i, minus(now, before));
            before = now;
        }
        self.add(column + count + 1, minus(whole, before));
    }
}

#[inline(always)]
fn minus<const G: usize>(mut a: [f64; G], b: [f64; G]) -> [f64; G] {
    a.iter_mut().zip(b).for_each(|(a, b)| *a -= b);
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_cover_what_lies_right_of_them_and_leave_nothing() {
        let grid = Grid::new(1e5);
        let mut sums = Sums::<1>::default();
        sums.reset(40, 1);
        for (low, high) in [
            ([7.25, 0.0], [9.5, 0.0]),
            ([3.0, 2.5], [30.7, 4.0]),
            ([5.1, 1e-9], [5.2, 0.2]),
            ([-9.0, 3.0], [60.0, 1.0]),
        ] {
            let mut row = sums.row(0);
            row.uses(-20, 80);
            row.end(grid, &[65504.3], 0.7, 1.0, low);
            row.end(grid, &[65504.3], 0.7, -1.0, high);
            let (mut total, mut last) = (0.0, 0.0);
            sums.take(0, |_, sums| {
                total += sums.iter().map(|[sum]| sum).sum::<f64>();
                last = sums.last().map_or(0.0, |[sum]| *sum);
            });
            let expected = 65504.3 * 0.7 * (high[0].min(40.0) - low[0].max(0.0));
            // The grid is 1e-10.
            assert!((total - expected).abs() < 1e-7, "{low:?} {high:?}: {total} {expected}");
            assert!(high[0] > 40.0 || last == 0.0);
        }
    }
}
