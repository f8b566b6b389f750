//! Naive spreading and naive gathering: every pixel's whole footprint, one after the other.
//!
//! The rows of the result are cut into bands, each band is one thread's. To spread, a band visits every pixel whose
//! footprint reaches it; to gather, its own pixels, and with them the rows of the picture. Each sum is added up in
//! the order of the picture's rows, whoever does it.

use super::footprint::{Footprints, Point, Scratch};
use super::{Spread, at_least};
use crate::wide;
use pullfocus_core::{Cancel, Method, Plane, Result};
use rayon::prelude::*;

/// Rows of the result in one piece of work.
const BAND: usize = 8;
/// Pixels between two looks at the caller's flag: some milliseconds of the largest footprints.
const PIXELS: usize = 16;

/// See [`super::add_up`].
pub fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    cancel: &Cancel,
) -> Result<()> {
    let footprints = Footprints::new(spread, cancel)?;
    let (width, height) = (spread.size().width, spread.size().height);
    let reach = |y: usize| (0..width).map(|x| footprints.rows(spread.diameter(x, y))).max().unwrap_or(0);
    let reaches: Vec<usize> = (0..height).into_par_iter().map(reach).collect();
    let mut bands: Vec<Vec<&mut [f32]>> = (0..height.div_ceil(BAND)).map(|_| Vec::new()).collect();
    for output in outputs.iter_mut() {
        for (band, rows) in bands.iter_mut().zip(output.data_mut().chunks_mut(width * BAND)) {
            band.push(rows);
        }
    }
    bands.into_par_iter().enumerate().try_for_each(|(band, outputs)| {
        let first = band * BAND;
        let rows = first..(first + BAND).min(height);
        let mut result = Ok(());
        let result_of = &mut result;
        let (footprints, reaches) = (&footprints, &reaches[..]);
        wide::run(Band { inputs, spread, footprints, reaches, rows, outputs, cancel, result: result_of });
        result
    })
}

struct Band<'a, 'b> {
    inputs: &'a [&'a Plane],
    spread: &'a Spread<'a>,
    footprints: &'a Footprints,
    /// The rows that each row of the picture reaches.
    reaches: &'a [usize],
    rows: std::ops::Range<usize>,
    outputs: Vec<&'b mut [f32]>,
    cancel: &'a Cancel,
    result: &'a mut Result<()>,
}

impl wide::Work for Band<'_, '_> {
    #[inline(always)]
    fn run(mut self) {
        *self.result = match self.spread.method {
            Method::Gather => self.gather(),
            _ => self.spread(),
        };
    }
}

/// The part of a footprint's row that lies in a picture: its first column there, and its weights.
#[inline(always)]
fn within(x: usize, first: isize, weights: &[f32], width: usize) -> Option<(usize, &[f32])> {
    let from = x as isize + first;
    let skipped = (-from).max(0) as usize;
    let end = (from + weights.len() as isize).min(width as isize);
    let from = from.max(0);
    (end > from).then(|| (from as usize, &weights[skipped..skipped + (end - from) as usize]))
}

impl Band<'_, '_> {
    #[inline(always)]
    fn spread(&mut self) -> Result<()> {
        let (width, height) = (self.spread.size().width, self.spread.size().height);
        let mut scratch = Scratch::default();
        self.outputs.iter_mut().for_each(|rows| rows.fill(0.0));
        for sy in 0..height {
            // The nearest row of the band.
            let near = sy.clamp(self.rows.start, self.rows.end - 1);
            if near.abs_diff(sy) > self.reaches[sy] {
                continue;
            }
            for sx in 0..width {
                if sx % PIXELS == 0 {
                    self.cancel.check()?;
                }
                let point = Point::of(self.spread, sx, sy);
                let reach = self.footprints.rows(point.diameter);
                if near.abs_diff(sy) > reach {
                    continue;
                }
                self.footprints.begin(point.diameter, &mut scratch);
                let gamma = self.spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(sx, sy)));
                let from = sy.saturating_sub(reach).max(self.rows.start);
                for dy in from..(sy + reach + 1).min(self.rows.end) {
                    let offset = dy as isize - sy as isize;
                    let row = self.footprints.row(point, offset, &mut scratch);
                    let Some((first, weights, factor)) = row else { continue };
                    let Some((at, weights)) = within(sx, first, weights, width) else { continue };
                    let at = (dy - self.rows.start) * width + at;
                    let add = |sums: &mut [f32], value: f32| {
                        let scaled = value * factor;
                        for (sum, weight) in sums[at..at + weights.len()].iter_mut().zip(weights) {
                            *sum += scaled * weight;
                        }
                    };
                    let Some((last, colors)) = self.outputs.split_last_mut() else { continue };
                    for (sums, input) in colors.iter_mut().zip(self.inputs) {
                        add(sums, input.at(sx, sy));
                    }
                    add(last, gamma);
                }
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn gather(&mut self) -> Result<()> {
        let (width, height) = (self.spread.size().width, self.spread.size().height);
        let mut scratch = Scratch::default();
        let mut sums = vec![0.0f32; self.outputs.len()];
        let mut floored = vec![0.0f32; width];
        for y in self.rows.clone() {
            for x in 0..width {
                if x % PIXELS == 0 {
                    self.cancel.check()?;
                }
                let point = Point::of(self.spread, x, y);
                let reach = self.footprints.rows(point.diameter);
                self.footprints.begin(point.diameter, &mut scratch);
                sums.fill(0.0);
                for sy in y.saturating_sub(reach)..(y + reach + 1).min(height) {
                    let offset = sy as isize - y as isize;
                    let row = self.footprints.row(point, offset, &mut scratch);
                    let Some((first, weights, factor)) = row else { continue };
                    let Some((from, weights)) = within(x, first, weights, width) else { continue };
                    let Some((last, colors)) = sums.split_last_mut() else { continue };
                    for (sum, input) in colors.iter_mut().zip(self.inputs) {
                        *sum += factor * dot(&input.row(sy)[from..from + weights.len()], weights);
                    }
                    *last += factor
                        * match self.spread.gamma {
                            None => weights.iter().sum::<f32>(),
                            Some(gamma) => {
                                let floored = &mut floored[..weights.len()];
                                for (out, gamma) in floored.iter_mut().zip(&gamma.row(sy)[from..]) {
                                    *out = at_least(*gamma);
                                }
                                dot(floored, weights)
                            }
                        };
                }
                let at = (y - self.rows.start) * width + x;
                self.outputs.iter_mut().zip(&sums).for_each(|(rows, sum)| rows[at] = *sum);
            }
        }
        Ok(())
    }
}

/// The sum of products, in eight sums side by side.
#[inline(always)]
pub fn dot(values: &[f32], weights: &[f32]) -> f32 {
    const LANES: usize = 8;
    let mut sums = [0.0f32; LANES];
    let (mut a, mut b) = (values.chunks_exact(LANES), weights.chunks_exact(LANES));
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}
