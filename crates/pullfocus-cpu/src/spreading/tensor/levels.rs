//! The tensor filter's steps on the levels of a pyramid: the picture reduced, and averages enlarged.
//!
//! Reducing is the transpose of enlarging ([`pullfocus_core::pyramid`]): the same weights, whose sum over a coarse cell's
//! pixels is 1, so that a level holds averages and has what enlarging has of the variance. What a site takes from its level, or puts
//! there, is a small Gaussian of the rest.

use super::sites::{Group, Site, Sites};
use super::{CHUNK, Call, Splats, zeros};
use crate::spreading::splats::middle;
use crate::wide;
use pullfocus_core::pyramid::{EDGE, cell_variance, enlarging, level_of};
use pullfocus_core::{Cancel, Plane, Quality, Result};
use rayon::prelude::*;

/// Rows of cells in one piece of work.
const BAND: usize = 64;
/// Cells that reducing and enlarging reach beyond the picture, and one more level's before them.
const LEAST_EDGE: usize = 8;

/// The pyramid, kept from call to call; first of the picture, then of what is spread.
#[derive(Debug, Default)]
pub struct Levels(Vec<Level>);

/// Cells of the picture and some more all around, row after row, within a row channel after channel.
#[derive(Debug, Default)]
struct Level {
    /// Cells of the picture.
    size: [usize; 2],
    /// Cells before the picture's first, along both axes.
    before: [usize; 2],
    /// All cells of a channel's row, and all rows.
    extent: [usize; 2],
    channels: usize,
    data: Vec<f32>,
}

impl Level {
    fn row_length(&self) -> usize {
        self.extent[0] * self.channels
    }

    fn clear(&mut self, call: &Call<'_>) -> Result<()> {
        let length = self.row_length() * self.extent[1];
        zeros(&mut self.data, length, "a level of the pyramid", call.size())
    }

    /// Where row `y`, counted from the picture's first, begins.
    #[inline(always)]
    fn row(&self, y: isize) -> usize {
        (y + self.before[1] as isize) as usize * self.row_length()
    }

    /// A channel's cells in row `y`, from the picture's first less [`EDGE`] on.
    #[inline(always)]
    fn line(&self, channel: usize, y: isize, before: usize) -> &[f32] {
        let at = self.row(y) + channel * self.extent[0];
        &self.data[at + self.before[0] - before..at + self.extent[0]]
    }
}

impl Levels {
    /// Makes as many levels as the sites use, with room for what lies beyond the picture.
    pub fn fit(&mut self, call: &Call<'_>, sites: &Sites) -> Result<()> {
        // Sites gather less than they spread, on no coarser level.
        let count = sites.groups.iter().map(|group| group.level + 1).max().unwrap_or(1);
        self.0.resize_with(count, Level::default);
        let size = [call.size().width, call.size().height];
        for (l, level) in self.0.iter_mut().enumerate() {
            level.size = size.map(|length| ((length - 1) >> l) + 1);
            level.channels = call.channels;
        }
        let mut ends: Vec<[[isize; 2]; 2]> =
            self.0.iter().map(|level| level.size.map(|length| [0, length as isize - 1])).collect();
        for group in &sites.groups {
            call.cancel.check()?;
            let cells = size.map(|length| ((length - 1) >> group.cell) as i32);
            for site in &group.sites {
                let at = [site.x, site.y];
                if (0..=cells[0]).contains(&at[0]) && (0..=cells[1]).contains(&at[1]) {
                    continue;
                }
                let gathering = gathering_levels(site, call).map(|(level, _)| level);
                for level in gathering.into_iter().chain([group.level]) {
                    let Some(ends) = ends.get_mut(level) else { continue };
                    for (ends, at) in ends.iter_mut().zip(at) {
                        let at = middle(group.cell, level, at);
                        *ends = [ends[0].min(at), ends[1].max(at)];
                    }
                }
            }
        }
        for (level, ends) in self.0.iter_mut().zip(ends) {
            for (axis, [first, last]) in ends.into_iter().enumerate() {
                let Splats { reach, stride, .. } = call.splats[axis];
                level.before[axis] = (first.unsigned_abs() + reach).max(LEAST_EDGE);
                let end = (last as usize + 1 + stride.max(2 * reach + 1)).max(level.size[axis] + LEAST_EDGE);
                level.extent[axis] = level.before[axis] + end;
            }
        }
        Ok(())
    }

    /// Reduces the picture, and fills each group's averages.
    pub fn gather(&mut self, call: &Call<'_>, sites: &mut Sites) -> Result<()> {
        for level in &mut self.0 {
            level.clear(call)?;
        }
        let Some(finest) = self.0.first_mut() else { return Ok(()) };
        finest.take(call)?;
        for l in 1..self.0.len() {
            let (fine, coarse) = self.0.split_at_mut(l);
            coarse[0].reduce(&fine[l - 1], call.cancel)?;
        }
        for group in &mut sites.groups {
            let length = group.sites.len() * call.channels;
            zeros(&mut group.values, length, "the tensor filter's averages", call.size())?;
            let Group { cell, sites, values, .. } = group;
            let pieces = sites.par_chunks(CHUNK).zip(values.par_chunks_mut(CHUNK * call.channels));
            pieces.try_for_each(|(sites, values)| {
                call.cancel.check()?;
                wide::run(Gather { call, sites, cell: *cell, levels: &self.0, values });
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Writes the sums of what the sites spread.
    pub fn spread(&mut self, call: &Call<'_>, sites: &Sites, outputs: &mut [&mut Plane]) -> Result<()> {
        for (l, level) in self.0.iter_mut().enumerate() {
            level.clear(call)?;
            let row = level.row_length();
            let (first, size) = (level.before[1] as isize, level.size);
            let bands = level.data.par_chunks_mut(row * BAND).enumerate();
            bands.try_for_each(|(band, rows)| {
                call.cancel.check()?;
                let start = (band * BAND) as isize - first;
                // Nothing further out comes back.
                let end = (start + (rows.len() / row) as isize).min((size[1] + EDGE) as isize);
                if start.max(-(EDGE as isize)) < end {
                    let frame = Frame { before: level.before[0], columns: level.extent[0] };
                    wide::run(Draw { call, sites, on: l, start, end, rows, frame });
                }
                Ok(())
            })?;
        }
        for l in (1..self.0.len()).rev() {
            let (fine, coarse) = self.0.split_at_mut(l);
            fine[l - 1].add_enlarged(&coarse[0], call.cancel)?;
        }
        let Some(finest) = self.0.first() else { return Ok(()) };
        for (channel, output) in outputs.iter_mut().enumerate() {
            crate::rows::for_each_row(output, call.cancel, |y, row| {
                row.copy_from_slice(&finest.line(channel, y as isize, 0)[..row.len()]);
            })?;
        }
        Ok(())
    }
}

impl Level {
    /// Takes the picture and its weight.
    fn take(&mut self, call: &Call<'_>) -> Result<()> {
        let (row, before, columns) = (self.row_length(), self.before, self.extent[0]);
        let [width, height] = self.size;
        let rows = self.data[before[1] * row..].par_chunks_mut(row).take(height).enumerate();
        rows.try_for_each(|(y, row)| {
            if y % BAND == 0 {
                call.cancel.check()?;
            }
            for (channel, line) in row.chunks_mut(columns).enumerate() {
                let line = &mut line[before[0]..][..width];
                match call.inputs.get(channel) {
                    Some(input) => line.copy_from_slice(input.row(y)),
                    None => line.iter_mut().enumerate().for_each(|(x, v)| *v = call.value(channel, x, y)),
                }
            }
            Ok(())
        })
    }

    /// The rows that reducing and enlarging fill.
    fn edged(&mut self) -> (usize, impl IndexedParallelIterator<Item = (isize, &mut [f32])>) {
        let row = self.row_length();
        let first = self.before[1] - EDGE;
        let rows = self.data[first * row..].par_chunks_mut(row).take(self.size[1] + 2 * EDGE);
        (self.extent[0], rows.enumerate().map(|(i, row)| (i as isize - EDGE as isize, row)))
    }

    /// Becomes a finer level, reduced by two.
    fn reduce(&mut self, fine: &Self, cancel: &Cancel) -> Result<()> {
        let (before, width) = (self.before[0], self.size[0] + 2 * EDGE);
        let (columns, rows) = self.edged();
        rows.try_for_each(|(y, row)| {
            if y % BAND as isize == 0 {
                cancel.check()?;
            }
            for (channel, line) in row.chunks_mut(columns).enumerate() {
                // Of cell -EDGE, the first of six cells lies 2 EDGE + 2 cells before the picture.
                let lines = std::array::from_fn(|i| fine.line(channel, 2 * y - 2 + i as isize, 2 * EDGE + 2));
                wide::run(Reducing { row: &mut line[before - EDGE..][..width], lines });
            }
            Ok(())
        })
    }

    /// Adds a coarser level, enlarged by two.
    fn add_enlarged(&mut self, coarse: &Self, cancel: &Cancel) -> Result<()> {
        let (before, width) = (self.before[0], self.size[0] + 2 * EDGE);
        let (columns, rows) = self.edged();
        rows.try_for_each(|(y, row)| {
            if y % BAND as isize == 0 {
                cancel.check()?;
            }
            let cell = y.div_euclid(2);
            for (channel, line) in row.chunks_mut(columns).enumerate() {
                // The edge is even: the first cell is the even one of coarse cell -EDGE / 2, which takes from the one before.
                let lines = [cell - 1, cell, cell + 1].map(|y| coarse.line(channel, y, EDGE / 2 + 1));
                wide::run(Enlarging {
                    row: &mut line[before - EDGE..][..width],
                    lines,
                    weights: enlarging(y),
                });
            }
            Ok(())
        })
    }
}

/// The transpose of [`enlarging`].
const REDUCING: [f32; 6] = [1.0 / 32.0, 5.0 / 32.0, 10.0 / 32.0, 10.0 / 32.0, 5.0 / 32.0, 1.0 / 32.0];

struct Reducing<'a> {
    row: &'a mut [f32],
    lines: [&'a [f32]; 6],
}

impl wide::Work for Reducing<'_> {
    #[inline(always)]
    fn run(self) {
        let [a, b, c, d, e, f] = self.lines.map(|line| &line[..2 * self.row.len() + 4]);
        let [far, next, near, ..] = REDUCING;
        let mixed: Vec<f32> =
            (0..a.len()).map(|i| near * (c[i] + d[i]) + next * (b[i] + e[i]) + far * (a[i] + f[i])).collect();
        for (value, w) in self.row.iter_mut().zip(mixed.windows(6).step_by(2)) {
            *value = near * (w[2] + w[3]) + next * (w[1] + w[4]) + far * (w[0] + w[5]);
        }
    }
}

struct Enlarging<'a> {
    row: &'a mut [f32],
    lines: [&'a [f32]; 3],
    weights: [f32; 3],
}

impl wide::Work for Enlarging<'_> {
    #[inline(always)]
    fn run(self) {
        let [a, b, c] = self.lines.map(|line| &line[..self.row.len().div_ceil(2) + 2]);
        let [wa, wb, wc] = self.weights;
        let mixed: Vec<f32> = (0..a.len()).map(|i| wa * a[i] + wb * b[i] + wc * c[i]).collect();
        let (even, odd) = (enlarging(0), enlarging(1));
        for (pair, cells) in self.row.chunks_mut(2).zip(mixed.windows(3)) {
            for (value, weights) in pair.iter_mut().zip([even, odd]) {
                *value += weights[0] * cells[0] + weights[1] * cells[1] + weights[2] * cells[2];
            }
        }
    }
}

/// The levels on which a site gathers, and the share of each.
#[inline(always)]
fn gathering_levels(site: &Site, call: &Call<'_>) -> [(usize, f32); 2] {
    let [across, down] = site.gathers(call.spread.vertical_scale);
    let (level, next) = level_of(across.min(down), Quality::Standard);
    [(level, 1.0 - next), (level + 1, next)]
}

/// One site's weights on a level.
struct Weights {
    across: Vec<f32>,
    down: Vec<f32>,
}

impl Weights {
    fn new(call: &Call<'_>) -> Self {
        let [across, down] = call.splats;
        Self { across: vec![0.0; across.stride], down: vec![0.0; down.stride] }
    }

    /// For what a site gathers, in the middle of a cell of 2^`cell` pixels.
    #[inline(always)]
    fn gathering(
        &mut self,
        site: &Site,
        [across, down]: [f64; 2],
        cell: usize,
        level: usize,
        call: &Call<'_>,
    ) {
        let rest = |variance| cell_variance(variance, level) as f32;
        call.splats[0].of_cell((cell, site.x), level, rest(across), false, &mut self.across);
        call.splats[1].of_cell((cell, site.y), level, rest(down), false, &mut self.down);
    }

    /// For what it spreads.
    #[inline(always)]
    fn spreading(&mut self, site: &Site, cell: usize, level: usize, call: &Call<'_>) {
        let rest = |variance| cell_variance(variance, level) as f32;
        let [across, down] = site.spreads(call.spread.vertical_scale);
        call.splats[0].of_cell((cell, site.x), level, rest(across), true, &mut self.across);
        call.splats[1].of_cell((cell, site.y), level, rest(down), true, &mut self.down);
    }
}

struct Gather<'a> {
    call: &'a Call<'a>,
    sites: &'a [Site],
    /// Cells of the sites have 2^this pixels.
    cell: usize,
    levels: &'a [Level],
    values: &'a mut [f32],
}

impl wide::Work for Gather<'_> {
    #[inline(always)]
    fn run(self) {
        match self.call.splats[0].stride {
            16 => self.run_with::<16>(),
            _ => self.run_with::<0>(),
        }
    }
}

impl Gather<'_> {
    /// With `STRIDE` weights across, known at compile time; 0 for any number.
    #[inline(always)]
    fn run_with<const STRIDE: usize>(self) {
        let Self { call, sites, cell, levels, values } = self;
        let mut weights = Weights::new(call);
        for (site, values) in sites.iter().zip(values.chunks_mut(call.channels)) {
            let variances = site.gathers(call.spread.vertical_scale);
            for (l, share) in gathering_levels(site, call) {
                let Some(level) = levels.get(l).filter(|_| share > 0.0) else { continue };
                if variances == [0.0; 2] {
                    // Every pixel is a site, and gathers itself.
                    let first =
                        level.row(site.y as isize) + (site.x as isize + level.before[0] as isize) as usize;
                    let pixel = level.data[first..].iter().step_by(level.extent[0]);
                    values.iter_mut().zip(pixel).for_each(|(value, pixel)| *value = *pixel);
                    continue;
                }
                weights.gathering(site, variances, cell, l, call);
                level.average::<STRIDE>(
                    call,
                    [site.x, site.y].map(|at| middle(cell, l, at)),
                    &weights,
                    share,
                    values,
                );
            }
        }
    }
}

impl Level {
    /// Adds a `share` of the average around a cell.
    #[inline(always)]
    fn average<const STRIDE: usize>(
        &self,
        call: &Call<'_>,
        [x, y]: [isize; 2],
        weights: &Weights,
        share: f32,
        values: &mut [f32],
    ) {
        let [over, along] = [0, 1].map(|axis| call.splats[axis].reach as isize);
        let first = self.row(y - along) + (x - over + self.before[0] as isize) as usize;
        let down = &weights.down[..(2 * along + 1) as usize];
        for (channel, value) in values.iter_mut().enumerate() {
            let rows = self.data[first + channel * self.extent[0]..].chunks(self.row_length()).zip(down);
            if STRIDE > 0 {
                let mut sums = [0.0f32; STRIDE];
                for (row, weight) in rows {
                    let row: &[f32; STRIDE] = row.first_chunk().expect("a row holds a site's cells");
                    for i in 0..STRIDE {
                        sums[i] += weight * row[i];
                    }
                }
                let mut eighths = [0.0f32; 8];
                for (i, (sum, weight)) in sums.iter().zip(&weights.across).enumerate() {
                    eighths[i % 8] += sum * weight;
                }
                *value += share * eighths.iter().sum::<f32>();
            } else {
                let of = |row: &[f32]| row.iter().zip(&weights.across).map(|(v, w)| v * w).sum::<f32>();
                *value += share * rows.map(|(row, weight)| weight * of(row)).sum::<f32>();
            }
        }
    }
}

/// How a level's rows lie.
#[derive(Clone, Copy)]
struct Frame {
    before: usize,
    columns: usize,
}

/// Some rows of a level, and all that sites spread into them.
struct Draw<'a> {
    call: &'a Call<'a>,
    sites: &'a Sites,
    on: usize,
    start: isize,
    end: isize,
    rows: &'a mut [f32],
    frame: Frame,
}

impl wide::Work for Draw<'_> {
    #[inline(always)]
    fn run(self) {
        match self.call.splats[0].stride {
            16 => self.run_with::<16>(),
            _ => self.run_with::<0>(),
        }
    }
}

impl Draw<'_> {
    #[inline(always)]
    fn run_with<const STRIDE: usize>(self) {
        let Self { call, sites, on, start, end, rows, frame } = self;
        let reaches = [0, 1].map(|axis| call.splats[axis].reach as isize);
        let mut weights = Weights::new(call);
        for group in sites.groups.iter().filter(|group| group.level == on) {
            // Rows of the sites' cells; one more, since a middle can lie between two cells.
            let of = |row: isize| if on < group.cell { row >> 1 } else { row << (on - group.cell) };
            let range = group.rows(of(start - reaches[1])..of(end + reaches[1]) + 1);
            let values = &group.values[range.start * call.channels..range.end * call.channels];
            for (site, values) in group.sites[range].iter().zip(values.chunks(call.channels)) {
                let [x, y] = [site.x, site.y].map(|at| middle(group.cell, on, at));
                let top = y - reaches[1];
                let (first, last) = (top.max(start), (top + 2 * reaches[1] + 1).min(end));
                if first >= last {
                    continue;
                }
                let left = (x - reaches[0] + frame.before as isize) as usize;
                weights.spreading(site, group.cell, on, call);
                let (weight, row_length) = (site.weight(), frame.columns * call.channels);
                let down = &weights.down[(first - top) as usize..(last - top) as usize];
                let from = (first - start) as usize * row_length + left;
                for (channel, value) in values.iter().enumerate() {
                    let value = value * weight;
                    let lines = rows[from + channel * frame.columns..].chunks_mut(row_length);
                    for (line, weight) in lines.zip(down) {
                        let scaled = value * weight;
                        if STRIDE > 0 {
                            let line: &mut [f32; STRIDE] =
                                line.first_chunk_mut().expect("a row holds a site's cells");
                            let across: &[f32; STRIDE] =
                                weights.across.first_chunk().expect("as many weights");
                            for i in 0..STRIDE {
                                line[i] += scaled * across[i];
                            }
                        } else {
                            line.iter_mut()
                                .zip(&weights.across)
                                .for_each(|(cell, weight)| *cell += scaled * weight);
                        }
                    }
                }
            }
        }
    }
}
