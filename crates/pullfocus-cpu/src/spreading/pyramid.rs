//! Pyramid spreading (third paper, section 5): each pixel's Gaussian goes as a small one to the level of a pyramid whose cells
//! suit its size, so that the cost does not depend on the blur; then the levels are enlarged into each other.
//!
//! # Changes from the paper
//! - Both levels between which a size lies get the **exact** Gaussian, so that mixing them only cross-fades two
//!   drawings of one PSF, and only around the size where the level changes. The rest of the way one level does.
//! - What a level gets has, with what enlarging adds, exactly the wanted variance, its centre where the pixel is, and the
//!   weight 1 ([`pullfocus_core::pyramid`]). The printed constants make a weight that swings with the place in the cell.
//! - Enlarging is the subdivision of quartic B-splines: six weights an axis, smooth enough to leave no grid.
//!
//! # Practice
//! The picture is cut into stripes of rows. A stripe adds its pixels to sums of its own, which hold the cells that it reaches;
//! these are added to the levels in the order of the stripes. There is no lock, every pixel is drawn once, and the bytes do not
//! depend on the threads.

use super::splats::Splats;
use super::{Spread, at_least};
use crate::rows::for_each_row;
use crate::wide;
use pullfocus_core::psf::variance;
use pullfocus_core::pyramid::{EDGE, cell_variance, enlarging, level_with};
use pullfocus_core::{Cancel, Error, Plane, Quality, Result, Size};
use rayon::prelude::*;

/// Stripes that a picture is cut into, if none is thinner or thicker than [`STRIPE`] says: enough for the threads of one machine.
const STRIPES: usize = 64;
/// Least and most rows of a stripe. A stripe's sums reach seven cells beyond it on each side, so a thinner one has more of them to add
/// up than pixels to draw.
const STRIPE: [usize; 2] = [8, 64];
/// Stripes in memory for each thread, so that one that has less to do takes the next.
const FOR_A_THREAD: usize = 4;

/// Rows of the picture in one piece of work.
fn stripe_rows(height: usize) -> usize {
    (height / STRIPES).clamp(STRIPE[0], STRIPE[1])
}

/// Levels, stripes and tables, kept from call to call.
#[derive(Debug, Default)]
pub struct Pyramid {
    levels: Vec<Level>,
    stripes: Vec<Stripe>,
    splats: Option<([Splats; 2], Quality, f32)>,
}

/// One level: cells of the picture and [`EDGE`] more all around, channel after channel.
#[derive(Debug, Default)]
struct Level {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

/// What one stripe adds to each level.
#[derive(Debug, Default)]
struct Stripe {
    /// The first row of cells on each level, which may lie above the picture, and how many there are; none on levels that it
    /// has no pixels for.
    rows: Vec<(isize, usize)>,
    /// Cells of each level, channel after channel, row after row.
    data: Vec<Vec<f32>>,
}

fn reserve(data: &mut Vec<f32>, length: usize, size: Size) -> Result<()> {
    data.clear();
    data.try_reserve_exact(length).map_err(|_| Error::OutOfMemory {
        what: "a level of the pyramid",
        size,
        bytes: 4 * length as u64,
    })?;
    data.resize(length, 0.0);
    Ok(())
}

/// See [`super::add_up`].
pub fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    pyramid: &mut Pyramid,
    cancel: &Cancel,
) -> Result<()> {
    let size = spread.size();
    let Pyramid { levels, stripes, splats } = pyramid;
    let scale = spread.vertical_scale;
    if !matches!(splats, Some((_, quality, of)) if (*quality, *of) == (spread.quality, scale)) {
        let ratio = |own: f32, other: f32| (own / own.min(other)).powi(2);
        let axes = [ratio(1.0, scale), ratio(scale, 1.0)];
        *splats = Some((axes.map(|ratio| Splats::new(spread.quality, ratio)), spread.quality, scale));
    }
    let Some((splats, ..)) = splats else { return Ok(()) };
    let call = Call { inputs, spread, splats, channels: outputs.len(), cancel };

    let reach = |y: usize| (0..size.width).map(|x| spread.diameter(x, y)).fold(0.0, f32::max);
    let widest: Vec<f32> = (0..size.height).into_par_iter().map(reach).collect();
    let widest = call.choose(widest.into_iter().fold(0.0, f32::max));
    let count = 1 + widest.0 + usize::from(widest.1 > 0.0);
    levels.resize_with(count, Level::default);
    for (l, level) in levels.iter_mut().enumerate() {
        (level.width, level.height) = (((size.width - 1) >> l) + 1, ((size.height - 1) >> l) + 1);
        let cells = call.channels * level.rows() * level.columns();
        reserve(&mut level.data, cells, size)?;
    }

    // Some stripes at a time: their order alone decides the sums.
    let thick = stripe_rows(size.height);
    let all: Vec<usize> = (0..size.height.div_ceil(thick)).collect();
    let together = (FOR_A_THREAD * rayon::current_num_threads()).min(all.len());
    stripes.resize_with(together, Stripe::default);
    for group in all.chunks(together) {
        stripes.par_iter_mut().zip(group).try_for_each(|(stripe, &index)| {
            let rows = index * thick..((index + 1) * thick).min(size.height);
            stripe.fit(&call, rows.clone(), levels)?;
            let mut result = Ok(());
            wide::run(Drawing { call, rows, stripe, levels: &levels[..], result: &mut result });
            result
        })?;
        for (l, level) in levels.iter_mut().enumerate() {
            level.add(l, &stripes[..group.len()], &call)?;
        }
    }

    for l in (1..count).rev() {
        cancel.check()?;
        let (fine, coarse) = levels.split_at_mut(l);
        fine[l - 1].add_enlarged(&coarse[0], cancel)?;
    }
    let Some(finest) = levels.first() else { return Ok(()) };
    for (channel, output) in outputs.iter_mut().enumerate() {
        for_each_row(output, cancel, |y, row| {
            row.copy_from_slice(&finest.row(channel, y as isize)[EDGE..EDGE + size.width]);
        })?;
    }
    Ok(())
}

impl Level {
    fn rows(&self) -> usize {
        self.height + 2 * EDGE
    }

    fn columns(&self) -> usize {
        self.width + 2 * EDGE
    }

    /// Row `y` of cells, with the edges; it may lie in the edge itself.
    fn row(&self, channel: usize, y: isize) -> &[f32] {
        let columns = self.columns();
        let row = channel * self.rows() + (y + EDGE as isize) as usize;
        &self.data[row * columns..][..columns]
    }

    /// Adds what each stripe has for this level, in their order.
    fn add(&mut self, level: usize, stripes: &[Stripe], call: &Call<'_>) -> Result<()> {
        let (rows, columns, width) = (self.rows(), self.columns(), self.width);
        let reach = call.splats[0].reach;
        // Both begin at the cell that lies the larger of the two edges before the picture, or later.
        let skipped = reach.saturating_sub(EDGE);
        self.data.par_chunks_mut(columns).enumerate().try_for_each(|(i, row)| {
            if i % 64 == 0 {
                call.cancel.check()?;
            }
            let (channel, y) = (i / rows, (i % rows) as isize - EDGE as isize);
            for stripe in stripes {
                let (first, count) = stripe.rows[level];
                if !(first..first + count as isize).contains(&y) {
                    continue;
                }
                let stride = call.columns(width);
                let at = (channel * count + (y - first) as usize) * stride + skipped;
                row.iter_mut().zip(&stripe.data[level][at..]).for_each(|(sum, value)| *sum += value);
            }
            Ok(())
        })
    }

    /// Adds a coarser level, enlarged by two.
    fn add_enlarged(&mut self, coarse: &Self, cancel: &Cancel) -> Result<()> {
        let (rows, columns) = (self.rows(), self.columns());
        self.data.par_chunks_mut(columns).enumerate().try_for_each(|(i, row)| {
            if i % 64 == 0 {
                cancel.check()?;
            }
            let (channel, y) = (i / rows, (i % rows) as isize - EDGE as isize);
            let [above, middle, below] = enlarging(y);
            let cell = y.div_euclid(2);
            let lines = [cell - 1, cell, cell + 1].map(|y| coarse.row(channel, y));
            wide::run(Enlarging { row, lines, weights: [above, middle, below] });
            Ok(())
        })
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
        let [a, b, c] = self.lines;
        let [wa, wb, wc] = self.weights;
        let mixed: Vec<f32> = a.iter().zip(b).zip(c).map(|((a, b), c)| wa * a + wb * b + wc * c).collect();
        // The edge is even, so cells of the row come in pairs: the first lies in cell -EDGE / 2.
        let first = EDGE - EDGE / 2;
        let (even, odd) = (enlarging(0), enlarging(1));
        for (pair, cells) in self.row.chunks_mut(2).zip(mixed[first - 1..].windows(3)) {
            for (value, weights) in pair.iter_mut().zip([even, odd]) {
                *value += weights[0] * cells[0] + weights[1] * cells[1] + weights[2] * cells[2];
            }
        }
    }
}

#[derive(Clone, Copy)]
struct Call<'a> {
    inputs: &'a [&'a Plane],
    spread: &'a Spread<'a>,
    splats: &'a [Splats; 2],
    channels: usize,
    cancel: &'a Cancel,
}

impl Call<'_> {
    /// Columns of a stripe's cells on a level of this width.
    #[inline(always)]
    fn columns(&self, width: usize) -> usize {
        width - 1 + self.splats[0].stride.max(2 * self.splats[0].reach + 1)
    }

    /// The level of a diameter, and the next one's share.
    #[inline(always)]
    fn choose(&self, diameter: f32) -> (usize, f32) {
        let narrower = diameter * self.spread.vertical_scale.min(1.0);
        level_with(variance(f64::from(narrower)), self.spread.quality, self.spread.mipmap)
    }
}

impl Stripe {
    /// Makes room for what these rows of the picture reach.
    fn fit(&mut self, call: &Call<'_>, rows: std::ops::Range<usize>, levels: &[Level]) -> Result<()> {
        let size = call.spread.size();
        let mut range = (usize::MAX, 0);
        for y in rows.clone() {
            let ends = (0..size.width).map(|x| call.spread.diameter(x, y));
            let (low, high) = ends.fold((f32::INFINITY, 0.0f32), |(low, high), d| (low.min(d), high.max(d)));
            let (last, share) = call.choose(high);
            range = (range.0.min(call.choose(low).0), range.1.max(last + usize::from(share > 0.0)));
        }
        let reach = call.splats[1].reach;
        self.rows.clear();
        self.data.resize_with(levels.len(), Vec::new);
        for (l, (level, data)) in levels.iter().zip(&mut self.data).enumerate() {
            if !(range.0..=range.1).contains(&l) {
                self.rows.push((0, 0));
                continue;
            }
            let (first, last) = (rows.start >> l, (rows.end - 1) >> l);
            let count = last - first + 1 + 2 * reach;
            self.rows.push((first as isize - reach as isize, count));
            reserve(data, call.channels * count * call.columns(level.width), size)?;
        }
        Ok(())
    }
}

/// One stripe's pixels, drawn.
struct Drawing<'a> {
    call: Call<'a>,
    rows: std::ops::Range<usize>,
    stripe: &'a mut Stripe,
    levels: &'a [Level],
    result: &'a mut Result<()>,
}

impl wide::Work for Drawing<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { call, rows, stripe, levels, result } = self;
        *result = match call.splats[0].stride {
            16 => draw::<16>(&call, rows, stripe, levels),
            32 => draw::<32>(&call, rows, stripe, levels),
            _ => draw::<0>(&call, rows, stripe, levels),
        };
    }
}

/// Weights in one vector of AVX2.
const NARROW: usize = 8;

/// Adds `N` weights, as many as are known at compile time. Both hold at least as many.
#[inline(always)]
fn add<const N: usize>(line: &mut [f32], weights: &[f32], scaled: f32) {
    let line: &mut [f32; N] = line.first_chunk_mut().expect("a row holds a splat");
    let weights: &[f32; N] = weights.first_chunk().expect("as many weights");
    for i in 0..N {
        line[i] += scaled * weights[i];
    }
}

/// With `STRIDE` weights across, known at compile time; 0 for any number.
#[inline(always)]
fn draw<const STRIDE: usize>(
    call: &Call<'_>,
    rows: std::ops::Range<usize>,
    stripe: &mut Stripe,
    levels: &[Level],
) -> Result<()> {
    let spread = call.spread;
    let [across, down] = call.splats;
    let (mut kx, mut ky) = (vec![0.0f32; across.stride], vec![0.0f32; down.stride]);
    let mut values = vec![0.0f32; call.channels];
    let scale = f64::from(spread.vertical_scale);
    for y in rows.clone() {
        call.cancel.check()?;
        for x in 0..spread.size().width {
            let diameter = spread.diameter(x, y);
            let (level, next) = call.choose(diameter);
            for (value, input) in values.iter_mut().zip(call.inputs) {
                *value = input.at(x, y);
            }
            if let Some(weight) = values.last_mut() {
                *weight = spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(x, y)));
            }
            for (l, share) in [(level, 1.0 - next), (level + 1, next)] {
                if share == 0.0 {
                    continue;
                }
                let t = variance(f64::from(diameter));
                let wide = across.weights(l, x, cell_variance(t, l) as f32, &mut kx);
                let high = down.weights(l, y, cell_variance(t * scale * scale, l) as f32, &mut ky);
                let (_, count) = stripe.rows[l];
                let columns = call.columns(levels[l].width);
                // Rows that have nothing are left out; so is half of the columns where the rest holds the splat.
                let first = (y >> l) - (rows.start >> l) + down.reach - high;
                let ky = &ky[down.reach - high..=down.reach + high];
                let narrow = STRIDE > NARROW && 2 * wide < NARROW && across.reach + NARROW < STRIDE + wide;
                for (channel, value) in values.iter().enumerate() {
                    let value = value * share;
                    let at = (channel * count + first) * columns + (x >> l);
                    let cells = &mut stripe.data[l][at..];
                    for (line, weight) in cells.chunks_mut(columns).zip(ky) {
                        let scaled = value * weight;
                        if narrow {
                            let skipped = across.reach - wide;
                            add::<NARROW>(&mut line[skipped..], &kx[skipped..], scaled);
                        } else if STRIDE > 0 {
                            add::<STRIDE>(line, &kx, scaled);
                        } else {
                            line.iter_mut().zip(&kx).for_each(|(cell, weight)| *cell += scaled * weight);
                        }
                    }
                }
            }
        }
    }
    Ok(())
}
