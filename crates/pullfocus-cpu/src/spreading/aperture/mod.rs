//! The aperture's shape at constant cost: spans of rows on the levels of a pyramid ([`pullfocus_core::spans`]).
//!
//! # Practice
//! A point writes the ends of its spans as differences, each shared by the two cells that it lies between; a running sum along
//! the rows makes light of them. Sums are f64, so that nothing is left of a light beyond its spans. The picture is cut
//! into stripes of rows, each of which adds to sums of its own, in blocks of columns small enough for the nearest caches;
//! stripes are added to the levels in their order. There is no lock, and the bytes do not depend on the threads.
//!
//! A pixel whose circle lies within it is added as it is: without blur every bit stays.

mod draw;
#[cfg(test)]
mod tests;

use super::Spread;
use draw::Stripe;
use pullfocus_core::spans::{ENLARGING, Tables, drawn_diameter, level_of};
use pullfocus_core::{Cancel, Error, Plane, Result, Size};
use rayon::prelude::*;

/// Rows of the picture in one piece of work.
const STRIPE: usize = 64;
/// Cells around a level's picture that enlarging takes from; the finest level has none.
const EDGE: usize = 2;
/// The most planes that are drawn at a time.
const CHANNELS: usize = 8;

/// Levels, stripes and tables, kept from call to call.
#[derive(Debug, Default)]
pub struct Shapes {
    levels: Vec<Level>,
    stripes: Vec<Stripe>,
    tables: Option<Tables>,
}

/// One level: its cells and [`EDGE`] more all around (none on the finest), channel after channel.
#[derive(Debug, Default)]
struct Level {
    width: usize,
    height: usize,
    edge: usize,
    data: Vec<f32>,
}

/// One call's surroundings.
#[derive(Clone, Copy)]
struct Call<'a> {
    inputs: &'a [&'a Plane],
    spread: &'a Spread<'a>,
    tables: &'a Tables,
    /// Whether the last channel is the weight.
    weight: bool,
    channels: usize,
    cancel: &'a Cancel,
}

/// Where a pixel is drawn.
#[derive(Clone, Copy)]
struct Drawn {
    level: usize,
    /// Height of its circle in cells; 0 for a pixel that stays as it is.
    rows: f32,
}

impl Call<'_> {
    #[inline(always)]
    fn drawn(&self, diameter: f32) -> Drawn {
        let scale = self.spread.vertical_scale;
        let level = level_of(diameter * scale);
        let cells = drawn_diameter(diameter, level) * scale / (1u64 << level) as f32;
        Drawn { level, rows: if cells <= self.tables.behind.least { 0.0 } else { cells } }
    }
}

fn reserve<T: Clone + Default>(data: &mut Vec<T>, length: usize, size: Size) -> Result<()> {
    data.clear();
    data.try_reserve_exact(length).map_err(|_| Error::OutOfMemory {
        what: "a level of the aperture's spans",
        size,
        bytes: (size_of::<T>() * length) as u64,
    })?;
    data.resize(length, T::default());
    Ok(())
}

/// See [`super::add_up`].
pub fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    shapes: &mut Shapes,
    cancel: &Cancel,
) -> Result<()> {
    let Shapes { levels, stripes, tables } = shapes;
    let (aperture, scale) = (spread.aperture, spread.vertical_scale);
    if !tables.as_ref().is_some_and(|tables| tables.are_of(aperture, scale)) {
        *tables = Some(Tables::new(aperture, scale)?);
    }
    let Some(tables) = tables else { return Ok(()) };
    for (group, outputs) in outputs.chunks_mut(CHANNELS).enumerate() {
        let rest = &inputs[(group * CHANNELS).min(inputs.len())..];
        let inputs = &rest[..outputs.len().min(rest.len())];
        let (channels, weight) = (outputs.len(), inputs.len() < outputs.len());
        let call = Call { inputs, spread, tables, weight, channels, cancel };
        call.run(levels, stripes, outputs)?;
    }
    Ok(())
}

impl Call<'_> {
    fn run(
        &self,
        levels: &mut Vec<Level>,
        stripes: &mut Vec<Stripe>,
        outputs: &mut [&mut Plane],
    ) -> Result<()> {
        let size = self.spread.size();
        let reach = |y: usize| (0..size.width).map(|x| self.spread.diameter(x, y)).fold(0.0, f32::max);
        let widest: Vec<f32> = (0..size.height).into_par_iter().map(reach).collect();
        let count = 1 + self.drawn(widest.into_iter().fold(0.0, f32::max)).level;
        levels.resize_with(count, Level::default);
        for (l, level) in levels.iter_mut().enumerate() {
            self.cancel.check()?;
            (level.width, level.height) = (((size.width - 1) >> l) + 1, ((size.height - 1) >> l) + 1);
            level.edge = if l == 0 { 0 } else { EDGE };
            let cells = self.channels * level.rows() * level.columns();
            reserve(&mut level.data, cells, size)?;
        }
        // As many stripes at a time as there are threads: their order alone decides the sums.
        let all: Vec<usize> = (0..size.height.div_ceil(STRIPE)).collect();
        let together = rayon::current_num_threads().min(all.len());
        stripes.resize_with(together, Stripe::default);
        for group in all.chunks(together) {
            stripes.par_iter_mut().zip(group).try_for_each(|(stripe, &index)| {
                stripe.draw(self, index * STRIPE..((index + 1) * STRIPE).min(size.height), levels)
            })?;
            for (l, level) in levels.iter_mut().enumerate() {
                level.add(l, &stripes[..group.len()], self.cancel)?;
            }
        }
        for l in (1..count).rev() {
            let (fine, coarse) = levels.split_at_mut(l);
            fine[l - 1].add_enlarged(&coarse[0], self.cancel)?;
        }
        let Some(finest) = levels.first() else { return Ok(()) };
        for (channel, output) in outputs.iter_mut().enumerate() {
            let cells = &finest.data[channel * size.area()..][..size.area()];
            output.data_mut().par_chunks_mut(1 << 16).zip(cells.par_chunks(1 << 16)).for_each(
                |(row, cells)| {
                    row.copy_from_slice(cells);
                },
            );
        }
        self.cancel.check()
    }
}

impl Level {
    fn rows(&self) -> usize {
        self.height + 2 * self.edge
    }

    fn columns(&self) -> usize {
        self.width + 2 * self.edge
    }

    /// Row `y` of cells, with the edges; it may lie in the edge itself.
    fn row(&self, channel: usize, y: isize) -> &[f32] {
        let columns = self.columns();
        &self.data[(channel * self.rows() + (y + self.edge as isize) as usize) * columns..][..columns]
    }

    /// Adds what each stripe has for this level, in their order.
    fn add(&mut self, level: usize, stripes: &[Stripe], cancel: &Cancel) -> Result<()> {
        let (rows, columns, edge) = (self.rows(), self.columns(), self.edge as isize);
        self.data.par_chunks_mut(columns).enumerate().try_for_each(|(i, row)| {
            if i % 64 == 0 {
                cancel.check()?;
            }
            let (channel, y) = (i / rows, (i % rows) as isize - edge);
            for stripe in stripes {
                if let Some(cells) = stripe.row(level, channel, y) {
                    row.iter_mut().zip(cells).for_each(|(sum, value)| *sum += value);
                }
            }
            Ok(())
        })
    }

    /// Adds a coarser level, enlarged by two.
    fn add_enlarged(&mut self, coarse: &Self, cancel: &Cancel) -> Result<()> {
        let (rows, columns, edge) = (self.rows(), self.columns(), self.edge);
        let [own, other] = ENLARGING;
        self.data.par_chunks_mut(columns).enumerate().try_for_each_init(
            Vec::new,
            |mixed: &mut Vec<f32>, (i, row)| {
                if i % 64 == 0 {
                    cancel.check()?;
                }
                let (channel, y) = (i / rows, (i % rows) as isize - edge as isize);
                // The cell's own side: above for even rows, below for odd ones.
                let cell = y.div_euclid(2);
                let (near, far) = (coarse.row(channel, cell), coarse.row(channel, cell - 1 + 2 * (y & 1)));
                mixed.clear();
                mixed.extend(near.iter().zip(far).map(|(near, far)| own * near + other * far));
                // Edges are even, so cells come in pairs; the first lies in the coarse cell -edge / 2.
                let first = EDGE - edge / 2;
                for (pair, cells) in row.chunks_mut(2).zip(mixed[first - 1..].windows(3)) {
                    for (value, side) in pair.iter_mut().zip([cells[0], cells[2]]) {
                        *value += own * cells[1] + other * side;
                    }
                }
                Ok(())
            },
        )
    }
}
