//! Bokeh highlights: bright light out of focus leaves the picture, and comes back as sprites in the aperture's shape.
//!
//! # Theory
//! What a method makes of a light is divided by the weight that arrived, or smoothed; either way a light beside darker things is no
//! disc of even brightness. So the light above a threshold ([`pullfocus_core::bokeh`]) is taken out before layers are made, and
//! each pixel's excess is added again as one sprite that is divided by its own sum and by nothing else. It belongs to the layers
//! that its pixel shows, as much as these are seen there, and is added when its layer has been laid over the farther ones: what is
//! nearer covers it as it covers the layer.
//!
//! # Practice
//! [`shape`] cuts outlines into slices, [`sums`] adds them up by their ends. Rows of the result are cut into bands, each visits the
//! lights that reach it.

mod shape;
mod sums;
#[cfg(test)]
mod tests;

use crate::spreading::footprint::Pictures;
use crate::wide;
use crate::work::Work;
use pullfocus_core::bokeh::{Curve, Field, NODES, brightness, node, nodes, seen, trust};
use pullfocus_core::psf::diameter;
use pullfocus_core::{Aperture, ApertureShape, Bokeh, Cancel, Error, Frame, Plane, Result, Size};
use rayon::prelude::*;
use shape::{Cut, Shape, Slices};
use sums::{Grid, Row, Sums};

/// Rows in one piece of work.
const BAND: usize = 16;
/// Lights between two looks at the caller's flag: a millisecond of the largest.
const LIGHTS: usize = 64;
/// Lights whose factors are found together.
const CHUNK: usize = 1024;

/// Less of a layer left by nearer ones is not made up for.
const LEAST_CLEAR: f32 = 0.02;

/// The light that was taken out of a picture, in the order of its rows. Memory kept from frame to frame; some bytes for each
/// highlight, so never more than a picture's own planes and two.
#[derive(Debug, Default)]
pub struct Lights {
    size: Size,
    /// Colour planes.
    planes: usize,
    /// Where each row's lights begin; one more than there are rows.
    rows: Vec<usize>,
    /// The largest diameter in each row.
    reaches: Vec<f32>,
    columns: Vec<u32>,
    /// Signed diameters.
    circles: Vec<f32>,
    colors: Vec<f32>,
    /// What colours are multiplied with.
    factors: Vec<f32>,
    /// How much of each light belongs to each layer: as many values as there are lights, for one layer after the other.
    shares: Vec<f32>,
}

/// A highlight: its column, the circle of its sprite, and which part of the pixel's light it is.
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

impl Bright<'_> {
    #[inline(always)]
    fn at(&self, x: usize, y: usize) -> f32 {
        brightness(self.colors.iter().map(|plane| plane.at(x, y)))
    }

    /// The highlights of row `y`.
    fn row(&self, y: usize) -> Vec<Found> {
        let mut found = Vec::new();
        for x in 0..self.circle.size().width {
            let brightness = self.at(x, y);
            // Any circle: most pixels are not bright enough for the largest.
            if self.curve.share(brightness, f32::INFINITY) > 0.0 {
                let circle = self.circle_of(x, y);
                let share = self.curve.share(brightness, circle);
                if share > 0.0 {
                    found.push(Found { x: x as u32, circle, share });
                }
            }
        }
        found
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

/// Where sprites are seen.
#[derive(Debug, Clone, Copy)]
pub enum Shown<'a> {
    /// Everywhere: a layer of its own.
    All,
    /// What belongs to this layer ([`Lights::share_out`]), everywhere.
    InLayer(usize),
    /// In the only layer, whose circles these are: where nothing nearer and sharper is ([`pullfocus_core::bokeh::seen`]).
    ByCircle(&'a Plane),
}

/// `count` values, or an error.
fn make<T: Clone + Default>(values: &mut Vec<T>, count: usize, size: Size) -> Result<()> {
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
        let found = {
            let colors: Vec<&Plane> = colors.iter().map(|plane| &**plane).collect();
            let picture = Bright { colors: &colors, circle, curve: bokeh.curve(display_width) };
            let row = |y: usize| if cancel.is_cancelled() { Vec::new() } else { picture.row(y) };
            (0..size.height).into_par_iter().with_min_len(BAND).map(row).collect::<Vec<_>>()
        };
        cancel.check()?;
        make(&mut self.rows, size.height + 1, size)?;
        self.reaches.clear();
        for (y, row) in found.iter().enumerate() {
            self.rows[y + 1] = self.rows[y] + row.len();
            self.reaches.push(row.iter().fold(0.0, |reach, light| f32::max(reach, light.circle.abs())));
        }
        let count = self.rows[size.height];
        make(&mut self.columns, count, size)?;
        make(&mut self.circles, count, size)?;
        make(&mut self.colors, count * self.planes, size)?;
        let mut at = 0;
        for (y, row) in found.iter().enumerate() {
            cancel.check()?;
            for light in row {
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

    /// Adds the sprites to `colors`.
    pub fn add(
        &mut self,
        colors: &mut [&mut Plane],
        look: &Look<'_>,
        seen: Shown<'_>,
        cancel: &Cancel,
    ) -> Result<()> {
        if self.count() == 0 {
            return Ok(());
        }
        let sprites = Sprites::new(look);
        let total = self.weigh(&sprites, look, seen, cancel)?;
        if total == 0.0 {
            return Ok(());
        }
        for (group, colors) in colors.chunks_mut(4).enumerate() {
            let call = Call {
                lights: self,
                sprites: &sprites,
                look,
                seen,
                grid: Grid::new(total),
                first: 4 * group,
                cancel,
            };
            match colors.len() {
                1 => call.run::<1>(colors)?,
                2 => call.run::<2>(colors)?,
                _ => call.run::<4>(colors)?,
            }
        }
        Ok(())
    }

    /// Finds every light's factor, and the sum of what all sprites have at their brightest.
    fn weigh(&mut self, sprites: &Sprites, look: &Look<'_>, seen: Shown<'_>, cancel: &Cancel) -> Result<f64> {
        let count = self.count();
        make(&mut self.factors, count, self.size)?;
        let (circles, colors) = (&self.circles, &self.colors);
        let shares = match seen {
            Shown::InLayer(layer) => self.shares.get(layer * count..(layer + 1) * count),
            Shown::All | Shown::ByCircle(_) => None,
        };
        let (planes, longer, gain) =
            (self.planes, self.size.width.max(self.size.height), look.bokeh.gain as f32);
        let sums: Vec<Result<f64>> = self
            .factors
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(chunk, factors)| {
                let mut sum = 0.0;
                // Neighbours often have one circle.
                let (mut last, mut of_last) = (f32::NAN, 0.0);
                for (i, factor) in factors.iter_mut().enumerate() {
                    if i % LIGHTS == 0 {
                        cancel.check()?;
                    }
                    let at = chunk * CHUNK + i;
                    let share = shares.map_or(1.0, |shares| shares[at]);
                    if share == 0.0 {
                        continue;
                    }
                    let c = diameter(circles[at], longer);
                    if c != last {
                        (last, of_last) = (c, sprites.factor(c));
                    }
                    *factor = gain * share * of_last;
                    let brightest = colors[at * planes..][..planes].iter().fold(0f32, |a, b| a.max(b.abs()));
                    sum += f64::from(*factor) * f64::from(brightest);
                }
                Ok(sum)
            })
            .collect();
        sums.into_iter().sum()
    }
}

/// What sprites look like.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// Which light is spread.
    pub bokeh: Bokeh,
    /// The sprites' shape.
    pub aperture: &'a Aperture,
    /// Pixels of height for one of width.
    pub vertical_scale: f32,
    /// Width of the display window in pixels.
    pub display_width: f32,
    /// Where the optical axis is.
    pub field: Field,
}

impl<'a> Look<'a> {
    /// The look in a frame.
    pub fn new(frame: &Frame, bokeh: Bokeh, aperture: &'a Aperture) -> Self {
        Self {
            bokeh,
            aperture,
            vertical_scale: frame.vertical_scale(),
            display_width: frame.display_width() as f32,
            field: Field::new(frame),
        }
    }
}

/// Sprites of every size.
struct Sprites {
    kind: Kind,
    /// A diameter in pixels across and down.
    unit: [f64; 2],
    /// The farthest that the shape reaches, in diameters.
    reach: f64,
    /// Diameters below this lie within their own pixel.
    point: f64,
}

/// Diameters below which a cat's eye takes nothing away.
const LEAST_CUT: f64 = 1.0 / 16.0;

enum Kind {
    /// Behind focus, and in front.
    Outline(Box<[Shape; 2]>),
    Picture(Pictures),
}

impl Sprites {
    fn new(look: &Look<'_>) -> Self {
        let aperture = look.aperture;
        let cut = look.bokeh.cats_eye > 0.0;
        let point = |reach: f64, unit: [f64; 2]| {
            let within = 0.5 / (reach * unit[0].max(unit[1]));
            if cut { LEAST_CUT.min(within) } else { within }
        };
        let unit = [1.0 / aperture.squeeze, f64::from(look.vertical_scale)];
        match (&aperture.shape, aperture.outline()) {
            (ApertureShape::Image(mask), _) => {
                let (width, height) = (mask.width() as f64, mask.height() as f64);
                let kind = Kind::Picture(Pictures::new(aperture, look.vertical_scale, mask));
                let reach = 0.5 * width.hypot(height) / width.max(height);
                Self { kind, unit, reach, point: point(reach, unit) }
            }
            (_, outline) => {
                let outline = outline.unwrap_or(pullfocus_core::aperture::Outline { sides: Vec::new() });
                let shapes = [Shape::new(&outline), Shape::new(&outline.turned_over())];
                let reach = shapes[0].reach;
                Self { kind: Kind::Outline(Box::new(shapes)), unit, reach, point: point(reach, unit) }
            }
        }
    }

    /// Whether a sprite lies within its own pixel.
    fn is_point(&self, diameter: f32) -> bool {
        f64::from(diameter) < self.point
    }

    /// 1 / the sum of all that a sprite covers, in pixels.
    fn factor(&self, diameter: f32) -> f32 {
        if self.is_point(diameter) {
            return 1.0;
        }
        match &self.kind {
            Kind::Outline(shapes) => {
                let area = shapes[0].area(self.unit.map(|unit| unit * f64::from(diameter)));
                (1.0 / area) as f32
            }
            Kind::Picture(pictures) => pictures.factor,
        }
    }

    /// Rows that a sprite reaches to either side, at most.
    #[inline(always)]
    fn rows(&self, diameter: f32) -> usize {
        match &self.kind {
            Kind::Outline(_) => (self.reach * f64::from(diameter) * self.unit[1] + 0.5) as usize,
            Kind::Picture(pictures) => pictures.rows(diameter),
        }
    }
}

#[derive(Clone, Copy)]
struct Call<'a> {
    lights: &'a Lights,
    sprites: &'a Sprites,
    look: &'a Look<'a>,
    seen: Shown<'a>,
    grid: Grid,
    /// The first of the planes.
    first: usize,
    cancel: &'a Cancel,
}

impl Call<'_> {
    fn run<const G: usize>(self, colors: &mut [&mut Plane]) -> Result<()> {
        let Size { width, height } = self.lights.size;
        let mut bands: Vec<Vec<&mut [f32]>> = (0..height.div_ceil(BAND)).map(|_| Vec::new()).collect();
        for plane in colors.iter_mut() {
            for (band, rows) in bands.iter_mut().zip(plane.data_mut().chunks_mut(width * BAND)) {
                band.push(rows);
            }
        }
        bands.into_par_iter().enumerate().try_for_each_init(Sums::<G>::default, |sums, (band, planes)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            let mut result = Ok(());
            wide::run(Band { call: self, rows, planes, sums, weights: Vec::new(), result: &mut result });
            result
        })
    }
}

struct Band<'a, 'b, const G: usize> {
    call: Call<'a>,
    rows: std::ops::Range<usize>,
    planes: Vec<&'b mut [f32]>,
    sums: &'a mut Sums<G>,
    /// A picture's row.
    weights: Vec<f32>,
    result: &'a mut Result<()>,
}

impl<const G: usize> wide::Work for Band<'_, '_, G> {
    #[inline(always)]
    fn run(mut self) {
        *self.result = self.passes();
    }
}

/// Lights in front of focus, which are seen wherever they reach; the nodes follow.
const IN_FRONT: u32 = 0;

impl<const G: usize> Band<'_, '_, G> {
    #[inline(always)]
    fn passes(&mut self) -> Result<()> {
        self.sums.reset(self.call.lights.size.width, self.rows.len());
        let Shown::ByCircle(own) = self.call.seen else {
            self.lights(|_| 1.0)?;
            self.give(|_, _| 1.0);
            return Ok(());
        };
        let width = self.call.look.display_width;
        let mut passes = 0u32;
        self.visit(|_, _, c, _| {
            passes |= if c < 0.0 { 1 << IN_FRONT } else { 0b11 << (1 + nodes(c, width).0) };
            Ok(())
        })?;
        // Where nothing in these rows can hide the largest, there is no need to tell lights apart.
        let largest = passes.checked_ilog2().map_or(0.0, |pass| node(pass.saturating_sub(1) as usize, width));
        let sharpest =
            self.rows.clone().flat_map(|y| own.row(y)).fold(f32::INFINITY, |least, c| least.min(c.abs()));
        if seen(largest, sharpest) >= 1.0 {
            self.lights(|_| 1.0)?;
            self.give(|_, _| 1.0);
            return Ok(());
        }
        for pass in (0..=NODES as u32).filter(|pass| passes & (1 << pass) != 0) {
            if pass == IN_FRONT {
                self.lights(|c| if c < 0.0 { 1.0 } else { 0.0 })?;
                self.give(|_, _| 1.0);
                continue;
            }
            let number = pass as usize - 1;
            self.lights(|c| {
                if c < 0.0 {
                    return 0.0;
                }
                let (first, share) = nodes(c, width);
                match number.wrapping_sub(first) {
                    0 => 1.0 - share,
                    1 => share,
                    _ => 0.0,
                }
            })?;
            let node = node(number, width);
            self.give(|x, y| f64::from(seen(node, own.at(x, y))));
        }
        Ok(())
    }

    /// Calls `each(light, row, signed diameter, rows reached)` for every light that reaches the band.
    #[inline(always)]
    fn visit(&mut self, mut each: impl FnMut(usize, usize, f32, usize) -> Result<()>) -> Result<()> {
        let Call { lights, sprites, cancel, .. } = self.call;
        let longer = lights.size.width.max(lights.size.height);
        for y in 0..lights.size.height {
            let row = lights.rows[y]..lights.rows[y + 1];
            let away = y.clamp(self.rows.start, self.rows.end - 1).abs_diff(y);
            if row.is_empty() || sprites.rows(diameter(lights.reaches[y], longer)) < away {
                continue;
            }
            for light in row {
                if light % LIGHTS == 0 {
                    cancel.check()?;
                }
                let c = lights.circles[light];
                let size = diameter(c, longer);
                let reach = sprites.rows(size);
                if reach >= away {
                    each(light, y, size.copysign(c), reach)?;
                }
            }
        }
        Ok(())
    }

    /// Writes all lights, each multiplied with `share` of its signed diameter.
    #[inline(always)]
    fn lights(&mut self, share: impl Fn(f32) -> f32) -> Result<()> {
        let call = self.call;
        let rows = self.rows.clone();
        let mut sums = std::mem::take(self.sums);
        let mut weights = std::mem::take(&mut self.weights);
        let done = self.visit(|light, y, c, reach| {
            let factor = call.lights.factors[light] * share(c);
            if factor == 0.0 {
                return Ok(());
            }
            let mut values = [0.0; G];
            let colors = &call.lights.colors[light * call.lights.planes..][call.first..];
            for (value, color) in
                values.iter_mut().zip(&colors[..colors.len().min(call.lights.planes - call.first)])
            {
                *value = f64::from(*color) * f64::from(factor);
            }
            let x = call.lights.columns[light] as usize;
            let from = y.saturating_sub(reach).max(rows.start);
            let to = (y + reach + 1).min(rows.end);
            let sprite = Sprite { call: &call, values, x, y, c };
            wide::run(Writing {
                sprite,
                rows: from..to,
                first: rows.start,
                sums: &mut sums,
                weights: &mut weights,
            });
            Ok(())
        });
        *self.sums = sums;
        self.weights = weights;
        done
    }

    /// Adds the sums to the planes, as far as they are seen.
    #[inline(always)]
    fn give(&mut self, seen: impl Fn(usize, usize) -> f64) {
        let width = self.call.lights.size.width;
        for (row, y) in self.rows.clone().enumerate() {
            let planes = &mut self.planes;
            self.sums.take(row, |x, sum| {
                let seen = seen(x, y);
                for (plane, sum) in planes.iter_mut().zip(sum) {
                    let value = &mut plane[row * width + x];
                    *value = (f64::from(*value) + seen * sum) as f32;
                }
            });
        }
    }
}

/// One light and what is written of it.
struct Sprite<'a, const G: usize> {
    call: &'a Call<'a>,
    values: [f64; G],
    x: usize,
    y: usize,
    /// Signed diameter.
    c: f32,
}

/// Rows of the picture in which a sprite is written.
struct Writing<'a, const G: usize> {
    sprite: Sprite<'a, G>,
    rows: std::ops::Range<usize>,
    /// The sums' first row.
    first: usize,
    sums: &'a mut Sums<G>,
    weights: &'a mut Vec<f32>,
}

impl<const G: usize> wide::Work for Writing<'_, G> {
    #[inline(always)]
    fn run(self) {
        self.sprite.write(self.rows, self.first, self.sums, self.weights);
    }
}

impl<const G: usize> Sprite<'_, G> {
    /// Writes the rows `rows` of the picture; `first` is the sums' first.
    #[inline(always)]
    fn write(&self, rows: std::ops::Range<usize>, first: usize, sums: &mut Sums<G>, weights: &mut Vec<f32>) {
        let Call { sprites, look, grid, .. } = *self.call;
        let diameter = self.c.abs();
        if sprites.is_point(diameter) {
            let mut row = sums.row(self.y - first);
            let (x, value) = (self.x as isize, grid.on(&self.values, 1.0));
            row.uses(x, x + 2);
            row.add(x, value);
            row.add(x + 1, value.map(|value| -value));
            return;
        }
        let unit = sprites.unit.map(|unit| unit * f64::from(diameter));
        let displacement = match look.bokeh.cats_eye {
            0.0 => [0.0; 2],
            cats_eye => {
                let by = cats_eye * sprites.reach * f64::from(1f32.copysign(self.c));
                look.field.at(self.x as f64, self.y as f64).map(|place| place * by)
            }
        };
        match &sprites.kind {
            Kind::Outline(shapes) => {
                let shape = &shapes[usize::from(self.c < 0.0)];
                let extent = shape.cut(displacement);
                let mut slices = Slices::new();
                for y in rows {
                    shape.row(&extent, unit, y as f64 - self.y as f64, &mut slices);
                    self.outline(&slices, &mut sums.row(y - first));
                }
            }
            Kind::Picture(pictures) => {
                let cut =
                    (displacement != [0.0; 2]).then_some(Cut { centre: displacement, radius: sprites.reach });
                for y in rows {
                    let dy = y as isize - self.y as isize;
                    let turned = if self.c < 0.0 { -dy } else { dy };
                    let Some(from) = pictures.row(diameter, turned, weights) else { continue };
                    let from = if self.c < 0.0 {
                        weights.reverse();
                        1 - from - weights.len() as isize
                    } else {
                        from
                    };
                    cut_weights(weights, from, dy, cut, unit);
                    self.picture(weights, from, &mut sums.row(y - first));
                }
            }
        }
    }

    #[inline(always)]
    fn outline(&self, slices: &Slices, row: &mut Row<'_, G>) {
        let x = self.x as f64 + 0.5;
        let grid = self.call.grid;
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        for slice in slices.all() {
            let ([low, low_slope], [high, high_slope]) = (slice.low, slice.high);
            from = if low - low_slope < from { low - low_slope } else { from };
            to = if high + high_slope > to { high + high_slope } else { to };
            for (sign, end) in [(1.0, [x + low, low_slope]), (-1.0, [x + high, high_slope])] {
                row.end(grid, &self.values, slice.height, sign, end);
            }
        }
        row.uses((x + from).floor() as isize, (x + to).floor() as isize + 2);
    }

    #[inline(always)]
    fn picture(&self, weights: &[f32], from: isize, row: &mut Row<'_, G>) {
        let first = self.x as isize + from;
        row.uses(first, first + weights.len() as isize + 1);
        let mut before = [0.0; G];
        for (i, weight) in weights.iter().chain([&0.0]).enumerate() {
            let now = self.call.grid.on(&self.values, f64::from(*weight));
            let mut step = now;
            step.iter_mut().zip(before).for_each(|(step, before)| *step -= before);
            row.add(first + i as isize, step);
            before = now;
        }
    }
}

/// Lines of a row on which a second disc's ends are found.
const LINES: usize = 4;

/// Multiplies a row's weights, the first one `from` pixels from the middle, with what a second disc lets through.
fn cut_weights(weights: &mut [f32], from: isize, dy: isize, cut: Option<Cut>, unit: [f64; 2]) {
    let Some(cut) = cut else { return };
    let ends: [[f64; 2]; LINES] = std::array::from_fn(|line| {
        let y = dy as f64 - 0.5 + (line as f64 + 0.5) / LINES as f64;
        cut.ends(y / unit[1]).map(|x| x * unit[0])
    });
    for (i, weight) in weights.iter_mut().enumerate() {
        let x = (from + i as isize) as f64;
        let part = |[low, high]: &[f64; 2]| (high.min(x + 0.5) - low.max(x - 0.5)).max(0.0);
        *weight *= (ends.iter().map(part).sum::<f64>() / LINES as f64) as f32;
    }
}

impl Work<'_> {
    /// Takes highlights out of `colors`, if that was asked for. They are to be given back ([`Work::give_lights`]).
    pub fn take_lights(&mut self, colors: &mut [&mut Plane], circle: &Plane) -> Result<Option<Lights>> {
        let Some(look) = self.look else { return Ok(None) };
        self.stage("highlights", |work| {
            let mut lights = std::mem::take(&mut work.memory.lights);
            lights.take_out(colors, circle, &look.bokeh, look.display_width, work.cancel)?;
            *work.report.highlights.get_or_insert(0) += lights.count();
            Ok(Some(lights))
        })
    }

    /// Adds lights that were taken out, as sprites.
    pub fn add_lights(
        &mut self,
        lights: &mut Option<Lights>,
        colors: &mut [&mut Plane],
        seen: Shown<'_>,
    ) -> Result<()> {
        let (Some(look), Some(lights)) = (self.look, lights) else { return Ok(()) };
        self.stage("highlights", |work| lights.add(colors, &look, seen, work.cancel))
    }

    /// Gives their memory back.
    pub fn give_lights(&mut self, lights: Option<Lights>) {
        if let Some(lights) = lights {
            self.memory.lights = lights;
        }
    }
}
