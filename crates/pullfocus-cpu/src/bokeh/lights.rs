//! Bright light: what is taken out of a picture, and to which layers it belongs.

use super::BAND;
use super::stencils::Stencils;
use crate::wide;
use pullfocus_core::bokeh::{Curve, LEAST_CLEAR, brightness, trust};
use pullfocus_core::layers::general::LEADING;
use pullfocus_core::{Bokeh, Cancel, Error, Plane, Result, Size};
use rayon::prelude::*;

/// The light that was taken out of a picture, in the order of its rows. Memory kept from frame to frame; some bytes for each
/// highlight, so never more than a picture's own planes and two.
#[derive(Debug, Default)]
pub struct Lights {
    pub(super) size: Size,
    /// Colour planes.
    pub(super) planes: usize,
    /// Where each row's lights begin; one more than there are rows.
    pub(super) rows: Vec<usize>,
    /// The largest diameter in each row.
    pub(super) reaches: Vec<f32>,
    pub(super) columns: Vec<u32>,
    /// Signed diameters.
    pub(super) circles: Vec<f32>,
    pub(super) colors: Vec<f32>,
    /// What colours are multiplied with.
    pub(super) factors: Vec<f32>,
    /// How much of each light belongs to each layer: as many values as there are lights, for one layer after the other.
    pub(super) shares: Vec<f32>,
    /// Each row's, while they are taken out.
    found: Vec<Row>,
    /// Of the sizes that there have been.
    pub(super) stencils: Stencils,
}

#[derive(Debug, Default)]
struct Row {
    brightness: Vec<f32>,
    found: Vec<Found>,
}

/// A highlight: its column, the circle of its sprite, and which part of the pixel's light it is.
#[derive(Debug)]
struct Found {
    x: u32,
    circle: f32,
    share: f32,
}

/// A picture in which highlights are looked for.
struct Bright<'a> {
    colors: &'a [&'a Plane],
    circle: &'a Plane,
    curve: Curve,
}

struct Finding<'a> {
    picture: &'a Bright<'a>,
    y: usize,
    row: &'a mut Row,
}

impl wide::Work for Finding<'_> {
    #[inline(always)]
    fn run(self) {
        self.picture.row(self.y, self.row);
    }
}

impl Bright<'_> {
    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> f32 {
        brightness(self.colors.iter().map(|plane| plane.at(x, y)))
    }

    /// Finds the highlights of row `y`.
    #[inline(always)]
    fn row(&self, y: usize, row: &mut Row) {
        row.found.clear();
        row.brightness.clear();
        row.brightness.resize(self.circle.size().width, 0.0);
        for plane in self.colors.iter().take(LEADING) {
            for (most, value) in row.brightness.iter_mut().zip(plane.row(y)) {
                *most = brightness([*most, *value].into_iter());
            }
        }
        for (x, &brightness) in row.brightness.iter().enumerate() {
            // Any circle: most pixels are not bright enough for the largest.
            if self.curve.share(brightness, f32::INFINITY) > 0.0 {
                let circle = self.circle_of(x, y);
                let share = self.curve.share(brightness, circle);
                if share > 0.0 {
                    row.found.push(Found { x: x as u32, circle, share });
                }
            }
        }
    }

    /// The circle of confusion of the light at a pixel; see [`trust`].
    fn circle_of(&self, x: usize, y: usize) -> f32 {
        let Size { width, height } = self.circle.size();
        let around = || {
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            rows.flat_map(move |y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)))
        };
        let own = self.circle.at(x, y);
        if around().all(|(x, y)| self.circle.at(x, y) == own) {
            return own;
        }
        let most = around().map(|(x, y)| self.at(x, y)).fold(0.0, f32::max);
        let (mut sum, mut weights) = (0.0, 0.0);
        for (x, y) in around() {
            let weight = trust(self.at(x, y) / most);
            sum += weight * self.circle.at(x, y);
            weights += weight;
        }
        sum / weights
    }
}

/// `count` values, or an error.
pub(super) fn make<T: Clone + Default>(values: &mut Vec<T>, count: usize, size: Size) -> Result<()> {
    values.clear();
    values.try_reserve_exact(count).map_err(|_| Error::OutOfMemory {
        what: "highlights",
        size,
        bytes: (count * size_of::<T>()) as u64,
    })?;
    values.resize(count, T::default());
    Ok(())
}

impl Lights {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.columns.len()
    }

    /// Takes the highlights out of `colors`, whose circles of confusion are `circle`. Whatever was in here is gone.
    pub fn take_out(
        &mut self,
        colors: &mut [&mut Plane],
        circle: &Plane,
        bokeh: &Bokeh,
        display_width: f32,
        cancel: &Cancel,
    ) -> Result<()> {
        let size = circle.size();
        (self.size, self.planes) = (size, colors.len());
        self.found.resize_with(size.height, Row::default);
        {
            let colors: Vec<&Plane> = colors.iter().map(|plane| &**plane).collect();
            let picture = Bright { colors: &colors, circle, curve: bokeh.curve(display_width) };
            self.found.par_iter_mut().enumerate().with_min_len(BAND).try_for_each(|(y, row)| {
                cancel.check()?;
                wide::run(Finding { picture: &picture, y, row });
                Ok(())
            })?;
        }
        cancel.check()?;
        make(&mut self.rows, size.height + 1, size)?;
        self.reaches.clear();
        for (y, Row { found, .. }) in self.found.iter().enumerate() {
            self.rows[y + 1] = self.rows[y] + found.len();
            self.reaches.push(found.iter().fold(0.0, |reach, light| f32::max(reach, light.circle.abs())));
        }
        let count = self.rows[size.height];
        make(&mut self.columns, count, size)?;
        make(&mut self.circles, count, size)?;
        make(&mut self.colors, count * self.planes, size)?;
        let mut at = 0;
        for (y, Row { found, .. }) in self.found.iter().enumerate() {
            cancel.check()?;
            for light in found {
                let x = light.x as usize;
                self.columns[at] = light.x;
                self.circles[at] = light.circle;
                for (color, plane) in self.colors[at * self.planes..].iter_mut().zip(colors.iter_mut()) {
                    let value = &mut plane.row_mut(y)[x];
                    *color = *value * light.share;
                    *value -= *color;
                }
                at += 1;
            }
        }
        Ok(())
    }

    /// Finds how much of each light belongs to which layer, by the coverages of layers that are not blurred yet, from far to near: as
    /// much as is seen of it. The farthest has what the others leave.
    pub fn share_out(&mut self, coverages: &[&Plane], cancel: &Cancel) -> Result<()> {
        let count = self.count() * coverages.len();
        make(&mut self.shares, count, self.size)?;
        self.through_layers(coverages, cancel, |share, coverage, clear| {
            *share = coverage * clear;
            clear * (1.0 - coverage)
        })
    }

    /// Makes up for what nearer layers will take away, by coverages that are blurred by now: of a surface that lies in two
    /// layers each has a part, and the nearer one lies over the farther one's. No layer has more than the whole light.
    pub fn make_up(&mut self, coverages: &[&Plane], cancel: &Cancel) -> Result<()> {
        self.through_layers(coverages, cancel, |share, coverage, clear| {
            *share = (*share / clear.max(LEAST_CLEAR)).min(1.0);
            clear * (1.0 - coverage)
        })
    }

    /// Calls `each(share, coverage, what the nearer layers leave)` for every light's layers from near to far; the result is what
    /// this one leaves, too. The farthest covers all.
    fn through_layers(
        &mut self,
        coverages: &[&Plane],
        cancel: &Cancel,
        each: impl Fn(&mut f32, f32, f32) -> f32,
    ) -> Result<()> {
        let count = self.count();
        if count == 0 {
            return Ok(());
        }
        let mut layers: Vec<&mut [f32]> = self.shares.chunks_exact_mut(count).collect();
        for y in 0..self.size.height {
            cancel.check()?;
            for light in self.rows[y]..self.rows[y + 1] {
                let mut clear = 1.0;
                for (i, layer) in layers.iter_mut().enumerate().rev() {
                    let x = self.columns[light] as usize;
                    let coverage = if i == 0 { 1.0 } else { coverages[i].at(x, y).clamp(0.0, 1.0) };
                    clear = each(&mut layer[light], coverage, clear);
                }
            }
        }
        Ok(())
    }
}
