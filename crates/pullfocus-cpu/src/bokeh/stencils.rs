//! What a sprite covers of each pixel, tabled by size: lights lie in the middle of pixels, so the size is all that differs.
//!
//! Between two sizes covers are mixed, and so is the area that light is divided by, so none of it is lost. Rims of neighbouring sizes
//! lie a 16th of a pixel apart, and a mixed one lies where it should but in a pixel whose border is between them, where it is off by
//! a quarter of that.

use super::shape::{Shape, Slices};
use super::sums::{Grid, Sums};
use crate::wide;
use pullfocus_core::{Cancel, Result};
use rayon::prelude::*;

/// Sizes in a pixel of the larger side.
const STEPS: f64 = 8.0;
/// Pixels of the larger side from which on sprites are cut each by itself: all stencils below have some 20 MB.
const MOST: usize = 256;
/// Columns without a change that still do not divide a row: as many cost what another run does.
const GAP: usize = 3;

/// The place of a diameter among the sizes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Its number: 0 behind focus, 1 in front.
    side: usize,
    number: usize,
    /// How far it lies towards the next larger size.
    pub part: f32,
}

/// Cells of a row that lie side by side.
#[derive(Debug)]
struct Run {
    /// The first one's column, from the sprite's middle.
    first: i32,
    /// The last one's place in the list of all cells, and one.
    end: u32,
}

/// What sprites between two neighbouring sizes cover.
#[derive(Debug)]
pub struct Stencil {
    /// Rows to either side of the middle.
    reach: usize,
    /// Where each row's runs begin, and its cells; one more than there are rows.
    rows: Vec<[u32; 2]>,
    runs: Vec<Run>,
    /// The smaller one's cover of a pixel, and how much more the larger one's is. From a run's last cell to the next run it is the same.
    cells: Vec<[f32; 2]>,
    /// Both sums.
    area: [f64; 2],
}

/// Stencils of one shape, made as they are asked for.
#[derive(Debug, Default)]
pub struct Stencils {
    shapes: Vec<Shape>,
    /// A diameter in pixels across and down.
    unit: [f64; 2],
    /// Sizes in a pixel of diameter, and the inverse.
    per_pixel: f64,
    step: f64,
    made: [Vec<Option<Stencil>>; 2],
}

impl Stencils {
    /// Keeps what is of these shapes, behind focus and in front, and this unit.
    pub fn of(mut self, shapes: &[Shape; 2], unit: [f64; 2]) -> Self {
        if self.shapes != shapes || self.unit != unit {
            let per_pixel = STEPS * 2.0 * shapes[0].reach * unit[0].max(unit[1]);
            self = Self {
                shapes: shapes.to_vec(),
                unit,
                per_pixel,
                step: 1.0 / per_pixel,
                made: Default::default(),
            };
        }
        self
    }

    /// Where a signed diameter lies; none if it is too large.
    #[inline(always)]
    pub fn place(&self, c: f32) -> Option<Place> {
        let size = f64::from(c.abs()) * self.per_pixel;
        let number = size as usize;
        // A disc is the same on both sides.
        let side = usize::from(c < 0.0 && self.shapes.first().is_some_and(|shape| !shape.is_disc()));
        (number < MOST * STEPS as usize).then_some(Place {
            side,
            number,
            part: (size - number as f64) as f32,
        })
    }

    /// The larger of the diameters about a place, which is what its stencil reaches.
    #[inline(always)]
    pub fn larger(&self, place: Place) -> f64 {
        (place.number + 1) as f64 * self.step
    }

    /// The stencil of a place, if it was made.
    #[inline(always)]
    pub fn at(&self, place: Place) -> Option<&Stencil> {
        self.made[place.side].get(place.number)?.as_ref()
    }

    /// Makes those that are missing at `places`.
    pub fn make(&mut self, places: impl Iterator<Item = Place>, cancel: &Cancel) -> Result<()> {
        let mut asked: [Vec<bool>; 2] = Default::default();
        for place in places {
            let asked = &mut asked[place.side];
            if asked.len() <= place.number {
                asked.resize(place.number + 1, false);
            }
            asked[place.number] = true;
        }
        for (side, asked) in asked.iter().enumerate() {
            let Some(shape) = self.shapes.get(side) else { continue };
            let made = &mut self.made[side];
            if made.len() < asked.len() {
                made.resize_with(asked.len(), || None);
            }
            let (unit, step) = (self.unit, self.step);
            made.par_iter_mut()
                .zip(asked)
                .enumerate()
                .filter(|(_, (made, asked))| **asked && made.is_none())
                .try_for_each(|(number, (made, _))| {
                    cancel.check()?;
                    let sizes = [0, 1].map(|more| (number + more) as f64 * step);
                    *made = Some(Stencil::new(shape, unit, sizes));
                    Ok(())
                })?;
        }
        Ok(())
    }
}

impl Stencil {
    fn new(shape: &Shape, unit: [f64; 2], sizes: [f64; 2]) -> Self {
        let mut stencil =
            Self { reach: 0, rows: vec![[0; 2]], runs: Vec::new(), cells: Vec::new(), area: [0.0; 2] };
        wide::run(Making {
            shape,
            units: sizes.map(|size| unit.map(|unit| unit * size)),
            stencil: &mut stencil,
        });
        stencil
    }

    /// Pixels that a sprite covers.
    pub fn area(&self, part: f32) -> f64 {
        self.area[0] + f64::from(part) * (self.area[1] - self.area[0])
    }
}

struct Making<'a> {
    shape: &'a Shape,
    /// A diameter in pixels across and down, of both sizes.
    units: [[f64; 2]; 2],
    stencil: &'a mut Stencil,
}

impl wide::Work for Making<'_> {
    #[inline(always)]
    fn run(self) {
        let Self { shape, units, stencil } = self;
        let reach = |axis: usize| (shape.reach * units[1][axis] + 0.5) as usize;
        // Something is left of the first column, so that it changes, and zero to the right of all.
        let middle = reach(0) + 1;
        let width = 2 * middle + 2;
        stencil.reach = reach(1);
        let (extent, mut slices) = (shape.cut([0.0; 2]), Slices::new());
        let mut sums = Sums::<1>::default();
        sums.reset(width, 1);
        // Up to two rows meet in a sum, each at most 1.
        let grid = Grid::new(4.0);
        let mut covers = [vec![0f32; width], vec![0f32; width]];
        for row in -(stencil.reach as isize)..=stencil.reach as isize {
            for (which, cover) in covers.iter_mut().enumerate() {
                cover.fill(0.0);
                shape.row(&extent, units[which], row as f64, &mut slices);
                sums.row(0).slices(grid, &[1.0], middle as f64 + 0.5, &slices);
                sums.take(0, |from, sums| {
                    cover[from..].iter_mut().zip(sums).for_each(|(cover, [sum])| *cover = *sum as f32);
                });
                stencil.area[which] += cover.iter().map(|cover| f64::from(*cover)).sum::<f64>();
            }
            stencil.push(&covers, middle);
        }
    }
}

impl Stencil {
    /// One row more.
    fn push(&mut self, [smaller, larger]: &[Vec<f32>; 2], middle: usize) {
        let mut last = None;
        let changes = |x: &usize| smaller[*x] != smaller[*x - 1] || larger[*x] != larger[*x - 1];
        for x in (1..smaller.len()).filter(changes) {
            let from = match last {
                Some(last) if x - last <= GAP => last + 1,
                _ => {
                    self.runs.push(Run { first: x as i32 - middle as i32, end: 0 });
                    x
                }
            };
            self.cells.extend((from..=x).map(|x| [smaller[x], larger[x] - smaller[x]]));
            if let Some(run) = self.runs.last_mut() {
                run.end = self.cells.len() as u32;
            }
            last = Some(x);
        }
        debug_assert!(last.is_none() || self.cells.last() == Some(&[0.0; 2]), "rows end with nothing");
        self.rows.push([self.runs.len() as u32, self.cells.len() as u32]);
    }

    /// Replaces `covers` by what a sprite covers of the pixels where that changes, in the rows from `from` to before `to`, counted
    /// from its middle.
    #[inline(always)]
    fn mix(&self, part: f32, [from, to]: [usize; 2], covers: &mut Vec<f64>) {
        covers.clear();
        let cells = &self.cells[self.rows[from][1] as usize..self.rows[to][1] as usize];
        covers.extend(cells.iter().map(|[cover, more]| f64::from(cover + part * more)));
    }
}

/// The covers of the sprite that was written last: neighbours often have one size.
#[derive(Debug, Default)]
pub struct Mixed {
    of: Option<(Place, [usize; 2])>,
    covers: Vec<f64>,
}

/// A sprite to be written: where its light is, and the rows of the picture that are asked for.
pub struct Sprite<'a, const G: usize> {
    pub values: &'a [f64; G],
    pub x: usize,
    pub y: usize,
    pub rows: std::ops::Range<usize>,
}

impl Stencil {
    /// Writes rows of a sprite; `first` is the sums' first.
    #[inline(always)]
    pub fn write<const G: usize>(
        &self,
        place: Place,
        sprite: &Sprite<'_, G>,
        grid: Grid,
        first: usize,
        sums: &mut Sums<G>,
        mixed: &mut Mixed,
    ) {
        let top = sprite.y as isize - self.reach as isize;
        let own = |y: usize| (y as isize - top).clamp(0, self.rows.len() as isize - 1) as usize;
        let rows = [own(sprite.rows.start), own(sprite.rows.end)];
        if mixed.of != Some((place, rows)) {
            self.mix(place.part, rows, &mut mixed.covers);
            mixed.of = Some((place, rows));
        }
        let mut covers = &mixed.covers[..];
        for row in rows[0]..rows[1] {
            let [[run, mut cell], [last, _]] = [self.rows[row], self.rows[row + 1]];
            let y = (top + row as isize) as usize;
            let mut to = sums.row(y - first);
            let mut before = grid.nothing();
            for run in &self.runs[run as usize..last as usize] {
                let (these, rest) = covers.split_at((run.end - cell) as usize);
                to.covers(grid, sprite.values, sprite.x as isize + run.first as isize, these, &mut before);
                (covers, cell) = (rest, run.end);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Aperture;

    /// Covers of a sprite in `width` x `width` pixels, its light in the middle.
    fn covers(width: usize, mut write: impl FnMut(&mut Sums<1>)) -> Vec<f64> {
        let mut sums = Sums::<1>::default();
        sums.reset(width, width);
        write(&mut sums);
        let mut covers = vec![0.0; width * width];
        for y in 0..width {
            sums.take(y, |from, sums| {
                covers[y * width + from..].iter_mut().zip(sums).for_each(|(cover, [sum])| *cover = *sum);
            });
        }
        covers
    }

    #[test]
    fn mixed_sizes_cover_what_their_outline_does() {
        let grid = Grid::new(4.0);
        for aperture in [Aperture::DISC, Aperture::blades(5, 10.0), Aperture::blades(4, 45.0)] {
            let outline = aperture.outline().unwrap();
            let shapes = [Shape::new(&outline), Shape::new(&outline.turned_over())];
            let unit = [0.8, 1.3];
            let mut stencils = Stencils::default().of(&shapes, unit);
            for c in [1.9, 7.03, -12.34, 33.333, -50.01] {
                let (middle, width) = (50, 101);
                let place = stencils.place(c).unwrap();
                stencils.make([place].into_iter(), &Cancel::new()).unwrap();
                let stencil = stencils.at(place).unwrap();
                let mixed = covers(width, |sums| {
                    let sprite = Sprite { values: &[1.0], x: middle, y: middle, rows: 0..width };
                    stencil.write(place, &sprite, grid, 0, sums, &mut Mixed::default());
                });
                let shape = &shapes[usize::from(c < 0.0)];
                let (extent, mut slices) = (shape.cut([0.0; 2]), Slices::new());
                let size = unit.map(|unit| unit * f64::from(c.abs()));
                let exact = covers(width, |sums| {
                    for y in 0..width {
                        shape.row(&extent, size, y as f64 - middle as f64, &mut slices);
                        sums.row(y).slices(grid, &[1.0], middle as f64 + 0.5, &slices);
                    }
                });
                let error = mixed.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // A quarter of a 16th, twice where both ends or a tip lie in one pixel.
                assert!(error < 2.0 / 64.0, "{aperture:?}, {c}: {error}");
                let (sum, area) = (mixed.iter().sum::<f64>(), stencil.area(place.part));
                // Covers are mixed in f32.
                assert!((sum / area - 1.0).abs() < 1e-7, "{aperture:?}, {c}: {}", sum / area - 1.0);
                let exact = exact.iter().sum::<f64>();
                // Between two squares lies a parabola: a 64th of a squared step above it at most, with some for slices at tips.
                assert!((area - exact).abs() < 0.01 + 2e-3 * exact, "{aperture:?}, {c}: {area} {exact}");
            }
        }
    }
}
