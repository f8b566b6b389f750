//! Sprites: the lights of a picture, each in the aperture's shape, band by band.

use super::lights::make;
use super::shape::{Cut, Shape, Slices};
use super::stencils::{self, Mixed, Place, Stencils};
use super::sums::{Grid, Row, Sums};
use super::{BAND, Lights, Look, Shown};
use crate::spreading::footprint::Pictures;
use crate::wide;
use pullfocus_core::aperture::Outline;
use pullfocus_core::bokeh::{LEAST_CUT, NODES, node, nodes, seen};
use pullfocus_core::psf::diameter;
use pullfocus_core::{ApertureShape, Cancel, Plane, Result, Size};
use rayon::prelude::*;
use std::sync::Mutex;

/// Lights between two looks at the caller's flag: a millisecond of the largest.
const LIGHTS: usize = 64;
/// Lights whose factors are found together.
const CHUNK: usize = 1024;

impl Lights {
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
        let mut sprites = Sprites::new(look, std::mem::take(&mut self.stencils));
        let done = self.spread(colors, &mut sprites, look, seen, cancel);
        if let Kind::Outline { stencils: Some(stencils), .. } = sprites.kind {
            self.stencils = stencils;
        }
        done
    }

    fn spread(
        &mut self,
        colors: &mut [&mut Plane],
        sprites: &mut Sprites,
        look: &Look<'_>,
        seen: Shown<'_>,
        cancel: &Cancel,
    ) -> Result<()> {
        sprites.make_stencils(self, cancel)?;
        let total = self.weigh(sprites, look, seen, cancel)?;
        if total == 0.0 {
            return Ok(());
        }
        for (group, colors) in colors.chunks_mut(4).enumerate() {
            let call =
                Call { lights: self, sprites, look, seen, grid: Grid::new(total), first: 4 * group, cancel };
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
                    let c = diameter(circles[at], longer).copysign(circles[at]);
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

enum Kind {
    /// Behind focus, and in front.
    Outline {
        shapes: Box<[Shape; 2]>,
        /// Without a cat's eye, whose cut differs from light to light.
        stencils: Option<Stencils>,
    },
    Picture(Pictures),
}

impl Sprites {
    fn new(look: &Look<'_>, stencils: Stencils) -> Self {
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
                let outline = outline.unwrap_or(Outline { sides: Vec::new() });
                let shapes = [Shape::new(&outline), Shape::new(&outline.turned_over())];
                let reach = shapes[0].reach;
                let stencils = (!cut).then(|| stencils.of(&shapes, unit));
                let kind = Kind::Outline { shapes: Box::new(shapes), stencils };
                Self { kind, unit, reach, point: point(reach, unit) }
            }
        }
    }

    /// Whether a sprite lies within its own pixel.
    fn is_point(&self, diameter: f32) -> bool {
        f64::from(diameter) < self.point
    }

    /// Makes the stencils that `lights` need.
    fn make_stencils(&mut self, lights: &Lights, cancel: &Cancel) -> Result<()> {
        let point = self.point;
        let Kind::Outline { stencils: Some(stencils), .. } = &mut self.kind else { return Ok(()) };
        let known = std::mem::take(stencils);
        let longer = lights.size.width.max(lights.size.height);
        let circles = lights.circles.iter().map(|c| diameter(*c, longer).copysign(*c));
        let places: Vec<Place> =
            circles.filter(|c| f64::from(c.abs()) >= point).filter_map(|c| known.place(c)).collect();
        *stencils = known;
        stencils.make(places.into_iter(), cancel)
    }

    /// The stencil of a signed diameter, and its place.
    #[inline(always)]
    fn place(&self, c: f32) -> Option<(&Stencils, Place)> {
        match &self.kind {
            Kind::Outline { stencils: Some(stencils), .. } if !self.is_point(c.abs()) => {
                stencils.place(c).map(|place| (stencils, place))
            }
            _ => None,
        }
    }

    /// 1 / the sum of all that a sprite of signed diameter `c` covers, in pixels.
    fn factor(&self, c: f32) -> f32 {
        let diameter = c.abs();
        if self.is_point(diameter) {
            return 1.0;
        }
        if let Some((stencils, place)) = self.place(c)
            && let Some(stencil) = stencils.at(place)
        {
            return (1.0 / stencil.area(place.part)) as f32;
        }
        match &self.kind {
            Kind::Outline { shapes, .. } => {
                let area = shapes[0].area(self.unit.map(|unit| unit * f64::from(diameter)));
                (1.0 / area) as f32
            }
            Kind::Picture(pictures) => pictures.factor,
        }
    }

    /// Rows that a sprite of signed diameter `c` reaches to either side, at most.
    #[inline(always)]
    fn rows(&self, c: f32) -> usize {
        if self.is_point(c.abs()) {
            // It is its own pixel, whatever its shape.
            return 0;
        }
        let diameter = match self.place(c) {
            Some((stencils, place)) => stencils.larger(place),
            None => f64::from(c.abs()),
        };
        match &self.kind {
            Kind::Outline { .. } => (self.reach * diameter * self.unit[1] + 0.5) as usize,
            Kind::Picture(pictures) => pictures.rows(c.abs()),
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
        // Where a thread's last band has left it: no more of them than threads.
        let spare = Mutex::new(Vec::<Written<G>>::new());
        bands.into_par_iter().enumerate().try_for_each(|(band, planes)| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            let mut written = spare.lock().ok().and_then(|mut spare| spare.pop()).unwrap_or_default();
            let mut result = Ok(());
            wide::run(Band { call: self, rows, planes, written: &mut written, result: &mut result });
            if let (Ok(()), Ok(mut spare)) = (&result, spare.lock()) {
                spare.push(written);
            }
            result
        })
    }
}

/// What a thread keeps from band to band.
#[derive(Default)]
struct Written<const G: usize> {
    sums: Sums<G>,
    mixed: Mixed,
    /// A picture's row.
    weights: Vec<f32>,
}

struct Band<'a, 'b, const G: usize> {
    call: Call<'a>,
    rows: std::ops::Range<usize>,
    planes: Vec<&'b mut [f32]>,
    written: &'a mut Written<G>,
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
        self.written.sums.reset(self.call.lights.size.width, self.rows.len());
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
                let signed = size.copysign(c);
                let reach = sprites.rows(signed);
                if reach >= away {
                    each(light, y, signed, reach)?;
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
        let mut written = std::mem::take(self.written);
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
            wide::run(Writing { sprite, rows: from..to, first: rows.start, written: &mut written });
            Ok(())
        });
        *self.written = written;
        done
    }

    /// Adds the sums to the planes, as far as they are seen.
    #[inline(always)]
    fn give(&mut self, seen: impl Fn(usize, usize) -> f64) {
        let width = self.call.lights.size.width;
        for (row, y) in self.rows.clone().enumerate() {
            let planes = &mut self.planes;
            self.written.sums.take(row, |from, sums| {
                for (i, plane) in planes.iter_mut().enumerate() {
                    let values = &mut plane[row * width + from..][..sums.len()];
                    for (x, (value, sum)) in values.iter_mut().zip(sums).enumerate() {
                        *value = (f64::from(*value) + seen(from + x, y) * sum[i]) as f32;
                    }
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
    written: &'a mut Written<G>,
}

impl<const G: usize> wide::Work for Writing<'_, G> {
    #[inline(always)]
    fn run(self) {
        self.sprite.write(self.rows, self.first, self.written);
    }
}

impl<const G: usize> Sprite<'_, G> {
    /// Writes the rows `rows` of the picture; `first` is the sums' first.
    #[inline(always)]
    fn write(&self, rows: std::ops::Range<usize>, first: usize, written: &mut Written<G>) {
        let Written { sums, mixed, weights } = written;
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
        if let Some((stencils, place)) = sprites.place(self.c)
            && let Some(stencil) = stencils.at(place)
        {
            let sprite = stencils::Sprite { values: &self.values, x: self.x, y: self.y, rows };
            stencil.write(place, &sprite, grid, first, sums, mixed);
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
            Kind::Outline { shapes, .. } => {
                let shape = &shapes[usize::from(self.c < 0.0)];
                let extent = shape.cut(displacement);
                let mut slices = Slices::new();
                for y in rows {
                    shape.row(&extent, unit, y as f64 - self.y as f64, &mut slices);
                    sums.row(y - first).slices(grid, &self.values, self.x as f64 + 0.5, &slices);
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
