//! The tensor filter's steps pixel by pixel: sites are fewer where their Gaussians are larger, so the cost stays.

use super::sites::{Site, Sites};
use super::{CHUNK, Call, zeros};
use crate::wide;
use pullfocus_core::psf::{discrete_gaussian, gaussian_reach};
use pullfocus_core::{Plane, Result};
use rayon::prelude::*;

/// Rows of the result in one piece of work.
const BAND: usize = 16;
/// From this variance on, in square pixels, a sampled Gaussian has its sum and variance to 1e-4.
const SAMPLED: f64 = 0.5;

/// One axis of a site's Gaussian: the first pixel and the weights, whose sum is 1.
#[derive(Default)]
struct Axis {
    first: isize,
    weights: Vec<f32>,
}

impl Axis {
    /// For the cell `at` of 2^`cell` pixels. What is spread from pixels is the lattice's Gaussian, as in naive spreading; what is gathered is a sampled
    /// one, which lets less of the finest waves through.
    #[inline(always)]
    fn set(&mut self, at: i32, cell: usize, variance: f64, spreads: bool) {
        let reach = gaussian_reach(variance);
        self.weights.clear();
        if cell == 0 && (spreads || variance < SAMPLED) {
            let half = discrete_gaussian(variance, reach);
            let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
            self.first = at as isize - reach as isize;
            self.weights.extend((0..2 * reach + 1).map(|i| (half[i.abs_diff(reach)] / sum) as f32));
            return;
        }
        // The middle of a cell of several pixels lies between two.
        let (left, from_left) = if cell == 0 {
            (at as isize, 0.0)
        } else {
            (((at as isize) << cell) + (1 << (cell - 1)) - 1, 0.5)
        };
        let count = if cell == 0 { 2 * reach + 1 } else { 2 * reach };
        self.first = left - reach as isize + if cell == 0 { 0 } else { 1 };
        let weight = |i: usize| {
            let distance = (self.first - left) as f64 + i as f64 - from_left;
            (-0.5 * distance * distance / variance).exp()
        };
        let sum: f64 = (0..count).map(weight).sum();
        self.weights.extend((0..count).map(|i| (weight(i) / sum) as f32));
    }

    /// The part within `0..length`: the first pixel and the weights.
    #[inline(always)]
    fn within(&self, length: usize) -> (usize, &[f32]) {
        let skipped = (-self.first).max(0) as usize;
        let end = (length as isize - self.first).clamp(0, self.weights.len() as isize) as usize;
        if skipped < end { (self.first.max(0) as usize, &self.weights[skipped..end]) } else { (0, &[]) }
    }
}

/// Fills each group's averages.
pub fn gather(call: &Call<'_>, sites: &mut Sites) -> Result<()> {
    let size = call.size();
    for group in &mut sites.groups {
        let length = group.sites.len() * call.channels;
        zeros(&mut group.values, length, "the tensor filter's averages", size)?;
        let values = group.values.par_chunks_mut(CHUNK * call.channels);
        let (cell, pieces) = (group.cell, group.sites.par_chunks(CHUNK));
        pieces.zip(values).try_for_each(|(sites, values)| {
            let mut result = Ok(());
            wide::run(Piece { call, sites, cell, values, result: &mut result });
            result
        })?;
    }
    Ok(())
}

struct Piece<'a> {
    call: &'a Call<'a>,
    sites: &'a [Site],
    cell: usize,
    values: &'a mut [f32],
    result: &'a mut Result<()>,
}

impl wide::Work for Piece<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { call, sites, cell, values, result } = self;
        let size = call.size();
        let mut axes = [Axis::default(), Axis::default()];
        for (site, values) in sites.iter().zip(values.chunks_mut(call.channels)) {
            if call.cancel.is_cancelled() {
                *result = call.cancel.check();
                return;
            }
            let variances = site.gathers(call.spread.vertical_scale);
            axes[0].set(site.x, cell, variances[0], false);
            axes[1].set(site.y, cell, variances[1], false);
            let (left, across) = axes[0].within(size.width);
            let (top, down) = axes[1].within(size.height);
            for (channel, value) in values.iter_mut().enumerate() {
                for (y, weight) in (top..).zip(down) {
                    let row = match call.inputs.get(channel) {
                        Some(input) => {
                            super::super::brute::dot(&input.row(y)[left..][..across.len()], across)
                        }
                        None if call.spread.gamma.is_none() => across.iter().sum(),
                        None => (left..).zip(across).map(|(x, w)| w * call.value(channel, x, y)).sum(),
                    };
                    *value += weight * row;
                }
            }
        }
    }
}

/// Writes the sums of what the sites spread.
pub fn spread(call: &Call<'_>, sites: &Sites, outputs: &mut [&mut Plane]) -> Result<()> {
    let size = call.size();
    // How many pixels each group's Gaussians reach, down the columns.
    let reach = |sites: &[Site]| {
        let widest = sites.iter().map(|site| site.spreads(call.spread.vertical_scale)[1]).fold(0.0, f64::max);
        gaussian_reach(widest) as isize
    };
    let reaches: Vec<isize> = sites.groups.iter().map(|group| reach(&group.sites)).collect();
    let mut bands: Vec<Vec<&mut [f32]>> = (0..size.height.div_ceil(BAND)).map(|_| Vec::new()).collect();
    for output in outputs.iter_mut() {
        for (band, rows) in bands.iter_mut().zip(output.data_mut().chunks_mut(size.width * BAND)) {
            band.push(rows);
        }
    }
    bands.into_par_iter().enumerate().try_for_each(|(band, outputs)| {
        let rows = band * BAND..((band + 1) * BAND).min(size.height);
        let mut result = Ok(());
        wide::run(Band { call, sites, reaches: &reaches, rows, outputs, result: &mut result });
        result
    })
}

struct Band<'a, 'b> {
    call: &'a Call<'a>,
    sites: &'a Sites,
    reaches: &'a [isize],
    rows: std::ops::Range<usize>,
    outputs: Vec<&'b mut [f32]>,
    result: &'a mut Result<()>,
}

impl wide::Work for Band<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Self { call, sites, reaches, rows, mut outputs, result } = self;
        let width = call.size().width;
        let (mut over, mut along) = (Axis::default(), Axis::default());
        outputs.iter_mut().for_each(|rows| rows.fill(0.0));
        for (group, reach) in sites.groups.iter().zip(reaches) {
            let cells =
                (rows.start as isize - reach) >> group.cell..((rows.end as isize + reach) >> group.cell) + 1;
            let range = group.rows(cells);
            let values = &group.values[range.start * call.channels..range.end * call.channels];
            for (site, values) in group.sites[range].iter().zip(values.chunks(call.channels)) {
                if call.cancel.is_cancelled() {
                    *result = call.cancel.check();
                    return;
                }
                let variances = site.spreads(call.spread.vertical_scale);
                along.set(site.y, group.cell, variances[1], true);
                let (top, down) = along.within(rows.end);
                let skipped = rows.start.saturating_sub(top);
                if skipped >= down.len() {
                    continue;
                }
                over.set(site.x, group.cell, variances[0], true);
                let (left, across) = over.within(width);
                for (y, weight) in (top + skipped..).zip(&down[skipped..]) {
                    let at = (y - rows.start) * width + left;
                    for (output, value) in outputs.iter_mut().zip(values) {
                        let scaled = value * weight * site.weight();
                        let line = output[at..][..across.len()].iter_mut();
                        line.zip(across).for_each(|(sum, weight)| *sum += scaled * weight);
                    }
                }
            }
        }
    }
}
