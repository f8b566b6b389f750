//! Gathering by repeated integration (Heckbert 1986, "Filtering by Repeated Integration"): a plane is summed up three times along
//! each axis, and differences of the sums are its averages under three boxes each, a Gaussian but for 3 % of its peak.
//!
//! Sums of the third order grow as the sixth power of the picture's side, beyond what f64 can take a difference of. They are whole
//! numbers here, of 128 bits, that wrap around: a difference that fits is exact whatever its terms have lost above.
//!
//! Beyond the last pixel a sum of the third order goes on as a parabola of what it and the lower orders have come to, so
//! these are kept as two more columns and two more rows.

use super::sites::{Site, Sites};
use super::{CHUNK, Call, zeros};
use pullfocus_core::Result;
use pullfocus_core::tensor::three_boxes;
use rayon::prelude::*;

/// Sums of one plane, kept from plane to plane.
#[derive(Debug, Default)]
pub struct Integral {
    sums: Vec<i128>,
    /// Columns, with the two of lower order.
    columns: usize,
    rows: usize,
}

/// A power of two by its exponent.
fn power(exponent: i32) -> f64 {
    2f64.powi(exponent)
}

impl Integral {
    /// Fills each group's averages, plane after plane.
    pub fn gather(&mut self, call: &Call<'_>, sites: &mut Sites) -> Result<()> {
        let size = call.size();
        let mut widest = [1usize; 2];
        for group in &mut sites.groups {
            let length = group.sites.len() * call.channels;
            zeros(&mut group.values, length, "the tensor filter's averages", size)?;
            for site in &group.sites {
                for (widest, variance) in widest.iter_mut().zip(site.gathers(call.spread.vertical_scale)) {
                    *widest = (*widest).max(three_boxes(variance, group.cell > 0).0 + 2);
                }
            }
        }
        // Bits of what a box of boxes multiplies a value by.
        let growth = 3.0 * widest.map(|n| (n as f64).log2()).iter().sum::<f64>();
        for channel in 0..call.channels {
            let largest = (0..size.height).into_par_iter().map(|y| {
                (0..size.width)
                    .map(|x| call.value(channel, x, y).abs())
                    .filter(|v| v.is_finite())
                    .fold(0.0, f32::max)
            });
            let largest = f64::from(largest.reduce(|| 0.0, f32::max)).max(f64::MIN_POSITIVE);
            // The largest value, times all that, stays below 2^125.
            let exponent = (125.0 - growth - largest.log2()).floor().clamp(-100.0, 1000.0) as i32;
            self.sum_up(call, channel, power(exponent))?;
            for group in &mut sites.groups {
                let values = group.values.par_chunks_mut(CHUNK * call.channels);
                let between = group.cell > 0;
                let (cell, pieces) = (group.cell, group.sites.par_chunks(CHUNK));
                pieces.zip(values).try_for_each(|(sites, values)| {
                    call.cancel.check()?;
                    for (site, values) in sites.iter().zip(values.chunks_mut(call.channels)) {
                        values[channel] = (self.average(site, cell, between, call) * power(-exponent)) as f32;
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// Sums up a channel, in parts of 1 / `scale`.
    fn sum_up(&mut self, call: &Call<'_>, channel: usize, scale: f64) -> Result<()> {
        let size = call.size();
        (self.columns, self.rows) = (size.width + 2, size.height + 2);
        let columns = self.columns;
        zeros(&mut self.sums, columns * self.rows, "sums of the third order", size)?;
        let rows = self.sums.par_chunks_mut(columns).take(size.height).enumerate();
        rows.try_for_each(|(y, row)| {
            if y % 16 == 0 {
                call.cancel.check()?;
            }
            let mut orders = [0i128; 3];
            for (x, sum) in row[..size.width].iter_mut().enumerate() {
                // What is no number counts as 0.
                let value = (f64::from(call.value(channel, x, y)) * scale) as i128;
                orders[0] = orders[0].wrapping_add(value);
                orders[1] = orders[1].wrapping_add(orders[0]);
                orders[2] = orders[2].wrapping_add(orders[1]);
                *sum = orders[2];
            }
            row[size.width] = orders[0];
            row[size.width + 1] = orders[1];
            Ok(())
        })?;
        let (mut first, mut second) = (vec![0i128; columns], vec![0i128; columns]);
        let mut third = vec![0i128; columns];
        for (y, row) in self.sums.chunks_mut(columns).take(size.height).enumerate() {
            if y % 16 == 0 {
                call.cancel.check()?;
            }
            for (((value, a), b), c) in row.iter_mut().zip(&mut first).zip(&mut second).zip(&mut third) {
                *a = a.wrapping_add(*value);
                *b = b.wrapping_add(*a);
                *c = c.wrapping_add(*b);
                *value = *c;
            }
        }
        let end = size.height * columns;
        self.sums[end..end + columns].copy_from_slice(&first);
        self.sums[end + columns..].copy_from_slice(&second);
        Ok(())
    }

    /// Where a sum of the third order is kept that lies at `at` of `length` pixels: places and factors.
    fn at(at: isize, length: usize) -> [(usize, i128); 3] {
        let beyond = at - (length as isize - 1);
        if at < 0 {
            [(0, 0); 3]
        } else if beyond <= 0 {
            [(at as usize, 1), (0, 0), (0, 0)]
        } else {
            let n = beyond as i128;
            [(length - 1, 1), (length, n * (n + 1) / 2), (length + 1, n)]
        }
    }

    /// The sum under three boxes of `n` and `m` pixels around a cell.
    fn boxes(&self, [x, y]: [Range; 2]) -> i128 {
        let (width, height) = (self.columns - 2, self.rows - 2);
        let mut sum = 0i128;
        for (i, down) in FACTORS.into_iter().enumerate() {
            for (row, of_row) in Self::at(y.last - i as isize * y.n, height) {
                if of_row == 0 {
                    continue;
                }
                let line = &self.sums[row * self.columns..][..self.columns];
                let mut across = 0i128;
                for (k, factor) in FACTORS.into_iter().enumerate() {
                    for (column, of_column) in Self::at(x.last - k as isize * x.n, width) {
                        if of_column != 0 {
                            across = across
                                .wrapping_add(line[column].wrapping_mul(of_column).wrapping_mul(factor));
                        }
                    }
                }
                sum = sum.wrapping_add(across.wrapping_mul(of_row).wrapping_mul(down));
            }
        }
        sum
    }

    /// A site's average, in the parts in which the channel was summed up.
    fn average(&self, site: &Site, cell: usize, between: bool, call: &Call<'_>) -> f64 {
        let variances = site.gathers(call.spread.vertical_scale);
        let axis = |at: i32, variance: f64| {
            let (n, share) = three_boxes(variance, between);
            [(n, 1.0 - share), (n + 2, share)].map(|(n, share)| {
                let n = n as isize;
                // The pixel itself, or the one before the middle of a cell; three boxes of n reach 3 (n - 1) / 2 beyond the middle.
                let last = match cell {
                    0 => at as isize + 3 * (n - 1) / 2,
                    _ => ((at as isize) << cell) + (1 << (cell - 1)) - 1 + (3 * n - 2) / 2,
                };
                (Range { last, n }, share / (n * n * n) as f64)
            })
        };
        let mut sum = 0.0;
        for (y, of_y) in axis(site.y, variances[1]) {
            for (x, of_x) in axis(site.x, variances[0]) {
                if of_x * of_y > 0.0 {
                    sum += of_x * of_y * self.boxes([x, y]) as f64;
                }
            }
        }
        sum
    }
}

/// What three differences of a distance n are made of.
const FACTORS: [i128; 4] = [1, -3, 3, -1];

/// Three boxes of `n` pixels along an axis: the last pixel that they reach.
#[derive(Clone, Copy)]
struct Range {
    last: isize,
    n: isize,
}
