//! One stripe of the picture, drawn as differences and summed.

use super::{Call, Drawn, Level, reserve};
use crate::spreading::at_least;
use crate::wide;
use pullfocus_core::Result;
use pullfocus_core::spans::{Entry, HALF, PHASES, ROWS};
use std::ops::Range;

/// Columns that are drawn row by row before the next ones are.
const BLOCK: usize = 32;

/// What one stripe adds to each level.
#[derive(Debug, Default)]
pub struct Stripe {
    parts: Vec<Part>,
    /// Differences of the level in work: all channels of a cell side by side.
    ends: Vec<f64>,
}

/// A stripe's cells on one level.
#[derive(Debug, Default)]
struct Part {
    /// The first row, which may lie in the level's edge, and how many there are; none where the stripe has no pixel for this level.
    first: isize,
    rows: usize,
    columns: usize,
    /// Channel after channel, row after row; columns with the level's edges.
    cells: Vec<f32>,
}

impl Stripe {
    /// This stripe's row `y` of a level, if it has one.
    pub fn row(&self, level: usize, channel: usize, y: isize) -> Option<&[f32]> {
        let part = self.parts.get(level)?;
        let row = usize::try_from(y - part.first).ok().filter(|row| *row < part.rows)?;
        Some(&part.cells[(channel * part.rows + row) * part.columns..][..part.columns])
    }

    /// Draws the picture's rows.
    pub fn draw(&mut self, call: &Call<'_>, rows: Range<usize>, levels: &[Level]) -> Result<()> {
        let size = call.spread.size();
        // Of each level, the largest circle in cells; less than none where there is no pixel for it.
        let mut largest = vec![-1.0f32; levels.len()];
        for y in rows.clone() {
            for x in 0..size.width {
                let Drawn { level, rows } = call.drawn(call.spread.diameter(x, y));
                largest[level] = largest[level].max(rows);
            }
        }
        self.parts.resize_with(levels.len(), Part::default);
        for (l, (level, part)) in levels.iter().zip(&mut self.parts).enumerate() {
            (part.first, part.rows) = (0, 0);
            if largest[l] < 0.0 {
                continue;
            }
            let reach = if largest[l] == 0.0 { 0 } else { call.tables.reach(largest[l]) } as isize;
            let edge = level.edge as isize;
            let first = ((rows.start >> l) as isize - reach).max(-edge);
            let last = (((rows.end - 1) >> l) as isize + reach + 1).min((level.height - 1) as isize + edge);
            (part.first, part.rows) = (first, (last + 1 - first) as usize);
            part.columns = level.columns();
            reserve(&mut part.cells, call.channels * part.rows * part.columns, size)?;
            // Channels come in pairs; two more columns take what ends at the right border.
            reserve(
                &mut self.ends,
                call.channels.next_multiple_of(2) * part.rows * (part.columns + 2),
                size,
            )?;
            let mut result = Ok(());
            let ends = &mut self.ends[..];
            let rows = rows.clone();
            wide::run(Drawing { call, l, edge: level.edge, rows, part, ends, result: &mut result });
            result?;
        }
        Ok(())
    }
}

struct Drawing<'a, 'c> {
    call: &'a Call<'c>,
    l: usize,
    edge: usize,
    rows: Range<usize>,
    part: &'a mut Part,
    ends: &'a mut [f64],
    result: &'a mut Result<()>,
}

impl wide::Work for Drawing<'_, '_> {
    #[inline(always)]
    fn run(mut self) {
        *self.result = match self.call.channels {
            // Pairs: an odd one has an empty one beside it, and half as much is compiled.
            1 | 2 => self.channels::<2>(),
            3 | 4 => self.channels::<4>(),
            5 | 6 => self.channels::<6>(),
            _ => self.channels::<8>(),
        };
    }
}

/// Rows whose ends are found at a time.
const LANES: usize = 8;
type Lanes<T> = [T; LANES];

#[inline(always)]
fn lanes<T: Copy + Default>(f: impl Fn(usize) -> T) -> Lanes<T> {
    let mut made = [T::default(); LANES];
    for (i, made) in made.iter_mut().enumerate() {
        *made = f(i);
    }
    made
}

/// The ends of a point's spans.
struct Ends {
    /// The first of the two cells of each row's left and right end.
    cells: [[i32; ROWS]; 2],
    /// What either of them gets.
    first: [[f64; ROWS]; 2],
    second: [[f64; ROWS]; 2],
}

impl Drawing<'_, '_> {
    #[inline(always)]
    fn channels<const C: usize>(&mut self) -> Result<()> {
        let spread = self.call.spread;
        let width = spread.size().width;
        let mut ends = Ends { cells: [[0; ROWS]; 2], first: [[0.0; ROWS]; 2], second: [[0.0; ROWS]; 2] };
        for block in (0..width).step_by(BLOCK) {
            self.call.cancel.check()?;
            for y in self.rows.clone() {
                for x in block..(block + BLOCK).min(width) {
                    let Drawn { level, rows } = self.call.drawn(spread.diameter(x, y));
                    if level != self.l {
                        continue;
                    }
                    let value = self.value::<C>(x, y);
                    if rows == 0.0 {
                        self.keep(x, y, value);
                    } else {
                        self.point(x, y, rows, value, &mut ends);
                    }
                }
            }
        }
        self.sum::<C>();
        Ok(())
    }

    #[inline(always)]
    fn value<const C: usize>(&self, x: usize, y: usize) -> [f64; C] {
        let mut value = [0.0; C];
        for (value, input) in value.iter_mut().zip(self.call.inputs) {
            *value = f64::from(input.at(x, y));
        }
        if self.call.weight {
            value[self.call.channels - 1] =
                f64::from(self.call.spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(x, y))));
        }
        value
    }

    /// Adds a pixel as it is.
    #[inline(always)]
    fn keep<const C: usize>(&mut self, x: usize, y: usize, value: [f64; C]) {
        let Part { first, rows, columns, ref mut cells } = *self.part;
        for (channel, value) in value.into_iter().take(self.call.channels).enumerate() {
            cells[(channel * rows + (y as isize - first) as usize) * columns + x] = value as f32;
        }
    }

    /// Adds the ends of a point's spans.
    #[inline(always)]
    fn point<const C: usize>(&mut self, x: usize, y: usize, size: f32, value: [f64; C], ends: &mut Ends) {
        let Part { first, rows, columns, .. } = *self.part;
        let cell = 1.0 / (1u64 << self.l) as f32;
        let middle = |at: usize| (at as f32 + 0.5) * cell - 0.5;
        let (cx, cy) = (middle(x) + self.edge as f32, middle(y));
        let steps = ((cy + 1.0) * PHASES as f32 + 0.5) as usize;
        let (row, phase) = ((steps / PHASES) as isize - 1, steps % PHASES);
        let in_front = self.call.spread.circle.at(x, y) < 0.0;
        let (entries, mix) = self.call.tables.of(in_front).at(phase, size);
        let area = entries[0].area + (entries[1].area - entries[0].area) * mix;
        let factor = f64::from(cell * cell / area);
        let value = value.map(|value| value * factor);

        // Rows of the table that fall into this part.
        let offset = row - HALF as isize - first;
        let from = (entries[0].rows[0].min(entries[1].rows[0]) as isize).max(-offset);
        let to = (entries[0].rows[1].max(entries[1].rows[1]) as isize).min(rows as isize - offset);
        if from >= to {
            return;
        }
        let (from, to) = (from as usize, to as usize);
        let (low, high) = (from / LANES * LANES, to.next_multiple_of(LANES));
        Self::ends(entries, mix, cx, columns as f32, low..high, ends);
        let stride = columns + 2;
        let cells = self.ends.as_chunks_mut::<C>().0;
        let mut row = (from as isize + offset) as usize * stride;
        for k in from..to {
            for end in 0..2 {
                let at = row + ends.cells[end][k] as usize;
                let Some([left, right]) = cells.get_mut(at..at + 2) else { continue };
                let (first, second) = (ends.first[end][k], ends.second[end][k]);
                for c in 0..C {
                    left[c] += value[c] * first;
                }
                for c in 0..C {
                    right[c] += value[c] * second;
                }
            }
            row += stride;
        }
    }

    /// Where the spans of rows `range` end.
    #[inline(always)]
    fn ends(
        [small, large]: [&Entry; 2],
        mix: f32,
        cx: f32,
        columns: f32,
        range: Range<usize>,
        ends: &mut Ends,
    ) {
        // One loop for each step, over arrays: this is what becomes vectors.
        let mixed = |small: &[f32; ROWS], large: &[f32; ROWS], block: usize| -> Lanes<f32> {
            let (small, large) = (&small.as_chunks::<LANES>().0[block], &large.as_chunks::<LANES>().0[block]);
            lanes(|i| small[i] + (large[i] - small[i]) * mix)
        };
        for block in range.start / LANES..range.end / LANES {
            let covered = mixed(&small.covered, &large.covered, block);
            let inverse = lanes(|i| 1.0 / if covered[i] > 1e-20 { covered[i] } else { 1e-20 });
            let whole: Lanes<f64> = lanes(|i| f64::from(covered[i]));
            let sides = [(&small.left, &large.left, 1.0), (&small.right, &large.right, -1.0)];
            for (end, (small, large, sign)) in sides.into_iter().enumerate() {
                let place = mixed(small, large, block);
                let place = lanes(|i| place[i] * inverse[i] + (cx + 0.5));
                // Cells begin half a cell before their middle; what lies outside begins and ends at the border.
                let place = lanes(|i| if place[i] > 0.0 { place[i] } else { 0.0 });
                let place = lanes(|i| if place[i] < columns { place[i] } else { columns });
                // SAFETY: between 0 and the number of columns.
                let cell: Lanes<i32> = lanes(|i| unsafe { place[i].to_int_unchecked() });
                let second = lanes(|i| covered[i] * (place[i] - cell[i] as f32));
                let second: Lanes<f64> = lanes(|i| sign * f64::from(second[i]));
                ends.cells[end].as_chunks_mut().0[block] = cell;
                ends.first[end].as_chunks_mut().0[block] = lanes(|i| sign * whole[i] - second[i]);
                ends.second[end].as_chunks_mut().0[block] = second;
            }
        }
    }

    /// Running sums along the rows.
    #[inline(always)]
    fn sum<const C: usize>(&mut self) {
        let Part { rows, columns, ref mut cells, .. } = *self.part;
        let stride = columns + 2;
        for y in 0..rows {
            let ends = &self.ends[y * stride * C..][..columns * C];
            let mut sums = [0.0f64; C];
            for (x, ends) in ends.chunks_exact(C).enumerate() {
                sums.iter_mut().zip(ends).for_each(|(sum, end)| *sum += end);
                for (c, sum) in sums.iter().take(self.call.channels).enumerate() {
                    cells[(c * rows + y) * columns + x] += *sum as f32;
                }
            }
        }
    }
}
