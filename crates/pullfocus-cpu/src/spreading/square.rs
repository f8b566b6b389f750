//! Square spreading in constant time (Kosloff, Tao, Barsky 2009, "Depth of Field Postprocessing for Layered Scenes Using
//! Constant-Time Rectangle Spreading").
//!
//! Only the corners of each pixel's square are written, as differences, and one running sum along the rows and one down the
//! columns fill all squares at once. A side of a fractional number of pixels is a box whose outermost pixels count in part
//! ([`extended_box`]), so each corner is four cells and nothing jumps where a circle grows.
//!
//! Sums are f64: a light of 65504 that a running sum has passed leaves some 1e-11 behind in place of f32's hundredths, which
//! would be streaks to the picture's end.
//!
//! The rows are cut into bands. A band adds up the corners that fall into it in the order of the picture's pixels and sums
//! its own rows; what the bands above it come to is added afterwards. To find its corners it skips stretches of a row whose
//! least and largest squares have none there.

use super::{Spread, at_least};
use crate::rows::for_each_row;
use crate::wide;
use pullfocus_core::psf::{extended_box, variance};
use pullfocus_core::{Cancel, Error, Plane, Result};
use rayon::prelude::*;

/// Rows in one piece of work.
const BAND: usize = 16;
/// Pixels of a row that are skipped together.
const STRETCH: usize = 64;
/// Channels that are summed together.
const TOGETHER: usize = 4;

/// Running sums, kept from call to call.
#[derive(Debug, Default)]
pub struct Sums(Vec<f64>);

/// See [`super::add_up`].
pub fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    sums: &mut Sums,
    cancel: &Cancel,
) -> Result<()> {
    let boxes = Boxes::new(spread, cancel)?;
    // Groups as even as can be; the last channel is the weight.
    let per_group = outputs.len().div_ceil(outputs.len().div_ceil(TOGETHER));
    for (group, outputs) in outputs.chunks_mut(per_group).enumerate() {
        let inputs = inputs.get(group * per_group..).unwrap_or_default();
        let call = Call { inputs, spread, boxes: &boxes, cancel };
        match outputs {
            [_] => call.run::<1>(outputs, sums)?,
            [_, _] => call.run::<2>(outputs, sums)?,
            [_, _, _] => call.run::<3>(outputs, sums)?,
            _ => call.run::<4>(outputs, sums)?,
        }
    }
    Ok(())
}

/// Each pixel's box along both axes, and what each stretch of a row has at least and at most.
struct Boxes {
    /// Half a side: whole pixels on either side, the middle included, and the outermost one's part.
    across: Plane,
    /// The same down the columns, where pixels are not square.
    down: Option<Plane>,
    /// Least and largest whole number of `down` in each stretch.
    stretches: Vec<[u32; 2]>,
    per_row: usize,
}

impl Boxes {
    fn new(spread: &Spread<'_>, cancel: &Cancel) -> Result<Self> {
        let size = spread.size();
        let halves = |scale: f32| {
            let mut halves = Plane::filled(size, 0.0)?;
            for_each_row(&mut halves, cancel, |y, row| {
                for (x, half) in row.iter_mut().enumerate() {
                    let (whole, part) = extended_box(variance(f64::from(spread.diameter(x, y) * scale)));
                    *half = (f64::from(whole) + part) as f32;
                }
            })?;
            Ok(halves)
        };
        let across = halves(1.0)?;
        let down = if spread.vertical_scale == 1.0 { None } else { Some(halves(spread.vertical_scale)?) };
        let ends = |halves: &[f32]| {
            let whole = |most: f32, pick: fn(f32, f32) -> f32| halves.iter().copied().fold(most, pick) as u32;
            [whole(f32::INFINITY, f32::min), whole(0.0, f32::max)]
        };
        let halves = down.as_ref().unwrap_or(&across);
        let stretches = (0..size.height).flat_map(|y| halves.row(y).chunks(STRETCH).map(ends)).collect();
        Ok(Self { across, down, stretches, per_row: size.width.div_ceil(STRETCH) })
    }
}

/// Where a running sum changes along one axis, and by how much: at -k by f, at -k + 1 by 1 - f, and back.
#[inline(always)]
fn steps(at: usize, half: f32) -> [(isize, f64); 4] {
    let whole = half as isize;
    let part = f64::from(half - whole as f32);
    let at = at as isize;
    [(at - whole, part), (at - whole + 1, 1.0 - part), (at + whole, part - 1.0), (at + whole + 1, -part)]
}

/// The sum of a box' weights.
#[inline(always)]
fn side(half: f32) -> f64 {
    // Whole pixels k make 2 k - 1, and the outermost two their part each.
    2.0 * f64::from(half) - 1.0
}

#[derive(Clone, Copy)]
struct Call<'a> {
    inputs: &'a [&'a Plane],
    spread: &'a Spread<'a>,
    boxes: &'a Boxes,
    cancel: &'a Cancel,
}

impl Call<'_> {
    fn run<const G: usize>(self, outputs: &mut [&mut Plane], sums: &mut Sums) -> Result<()> {
        let size = self.spread.size();
        let cells = size.area() * G;
        let Sums(sums) = sums;
        sums.clear();
        sums.try_reserve_exact(cells).map_err(|_| Error::OutOfMemory {
            what: "running sums",
            size,
            bytes: (cells * size_of::<f64>()) as u64,
        })?;
        sums.resize(cells, 0.0);
        let row = size.width * G;
        sums.par_chunks_mut(row * BAND).enumerate().try_for_each(|(band, sums)| {
            let mut result = Ok(());
            wide::run(Band::<G> { call: self, first: band * BAND, sums, result: &mut result });
            result
        })?;
        // What all bands above each come to.
        let mut above = vec![0.0f64; row];
        let mut carried = Vec::with_capacity(sums.len() / BAND + row);
        for band in sums.chunks(row * BAND) {
            self.cancel.check()?;
            carried.extend_from_slice(&above);
            above.iter_mut().zip(&band[band.len() - row..]).for_each(|(above, last)| *above += last);
        }
        for (channel, output) in outputs.iter_mut().enumerate() {
            let bands = output.data_mut().par_chunks_mut(size.width * BAND);
            bands.zip(sums.par_chunks(row * BAND)).zip(carried.par_chunks(row)).try_for_each(
                |((output, sums), above)| {
                    self.cancel.check()?;
                    for (output, sums) in output.chunks_mut(size.width).zip(sums.chunks(row)) {
                        let cells = sums.chunks_exact(G).zip(above.chunks_exact(G));
                        for (value, (sum, above)) in output.iter_mut().zip(cells) {
                            *value = (sum[channel] + above[channel]) as f32;
                        }
                    }
                    Ok(())
                },
            )?;
        }
        Ok(())
    }
}

struct Band<'a, const G: usize> {
    call: Call<'a>,
    /// The first of its rows.
    first: usize,
    sums: &'a mut [f64],
    result: &'a mut Result<()>,
}

impl<const G: usize> wide::Work for Band<'_, G> {
    #[inline(always)]
    fn run(self) {
        let Self { call, first, sums, result } = self;
        *result = call.band::<G>(first, sums);
    }
}

impl Call<'_> {
    #[inline(always)]
    fn band<const G: usize>(&self, first: usize, sums: &mut [f64]) -> Result<()> {
        let (width, height) = (self.spread.size().width, self.spread.size().height);
        let (row, count) = (width * G, sums.len() / (width * G));
        let rows = first as isize..(first + count) as isize;
        let touches = |from: isize, to: isize| to.max(0) >= rows.start && from.max(0) < rows.end;
        for y in 0..height {
            self.cancel.check()?;
            let at = y as isize;
            for stretch in 0..self.boxes.per_row {
                let [least, most] =
                    self.boxes.stretches[y * self.boxes.per_row + stretch].map(|k| k as isize);
                if touches(at - most, at - least + 1) || touches(at + least, at + most + 1) {
                    let columns = stretch * STRETCH..((stretch + 1) * STRETCH).min(width);
                    columns.for_each(|x| self.corners::<G>(x, y, &rows, sums));
                }
            }
        }
        for line in sums.chunks_exact_mut(row) {
            let mut sum = [0.0; G];
            for cell in line.chunks_exact_mut(G) {
                for (cell, sum) in cell.iter_mut().zip(&mut sum) {
                    *sum += *cell;
                    *cell = *sum;
                }
            }
        }
        for line in 1..count {
            let (above, this) = sums.split_at_mut(line * row);
            this[..row].iter_mut().zip(&above[(line - 1) * row..]).for_each(|(this, above)| *this += above);
        }
        Ok(())
    }

    /// Adds the corners of the pixel (x, y) that lie in these rows.
    #[inline(always)]
    fn corners<const G: usize>(&self, x: usize, y: usize, rows: &std::ops::Range<isize>, sums: &mut [f64]) {
        let size = self.spread.size();
        let pixel = y * size.width + x;
        let across = self.boxes.across.data()[pixel];
        let down = self.boxes.down.as_ref().map_or(across, |down| down.data()[pixel]);
        let mut columns = None;
        for (at, change) in steps(y, down) {
            let at = at.max(0);
            if !rows.contains(&at) || change == 0.0 {
                continue;
            }
            let (values, columns) = columns.get_or_insert_with(|| {
                let weight = 1.0 / (side(across) * side(down));
                let gamma = self.spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(x, y)));
                let mut values = [f64::from(gamma) * weight; G];
                for (value, input) in values.iter_mut().zip(self.inputs) {
                    *value = f64::from(input.data()[pixel]) * weight;
                }
                (values, steps(x, across))
            });
            let line = &mut sums[(at - rows.start) as usize * size.width * G..][..size.width * G];
            for &mut (column, part) in columns {
                let column = column.max(0) as usize;
                if let Some(cell) = line.get_mut(column * G..(column + 1) * G) {
                    cell.iter_mut().zip(&*values).for_each(|(cell, value)| *cell += change * part * value);
                }
            }
        }
    }
}
