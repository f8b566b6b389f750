//! Where the tensor filter's sites lie: at the leaves of a quadtree over the circles of confusion, or by skip level.

use super::{Call, zeros};
use pullfocus_core::psf::variance;
use pullfocus_core::pyramid::level_of;
use pullfocus_core::tensor::{Sites as Placing, beyond, gathered};
use pullfocus_core::{Error, Quality, Result};
use rayon::prelude::*;

/// Rows in one piece of work.
const ROWS: usize = 16;

/// One site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Cell of the group's size in whose middle it lies; it may lie beyond the picture.
    pub x: i32,
    /// The same down the columns.
    pub y: i32,
    /// Variance of its blur along the width, in square pixels.
    pub variance: f32,
    /// How many pixels away the next ones lie.
    pub distance: f32,
    /// How much of it this one is: cells of two sizes can share a place, and two levels a site.
    pub share: f32,
}

impl Site {
    /// How many pixels it stands for.
    #[inline(always)]
    pub fn weight(&self) -> f32 {
        self.share * self.distance * self.distance
    }

    /// The variances with which it gathers, across and down, in square pixels of which `scale` are a pixel of height.
    #[inline(always)]
    pub fn gathers(&self, scale: f32) -> [f64; 2] {
        self.axes(scale).map(|variance| gathered(variance, f64::from(self.distance)))
    }

    /// The variances with which it spreads.
    #[inline(always)]
    pub fn spreads(&self, scale: f32) -> [f64; 2] {
        self.axes(scale).map(|variance| variance - gathered(variance, f64::from(self.distance)))
    }

    #[inline(always)]
    fn axes(&self, scale: f32) -> [f64; 2] {
        [self.variance, self.variance * scale * scale].map(f64::from)
    }
}

/// Sites in the middle of cells of one size, spread on one level.
#[derive(Debug, Default)]
pub struct Group {
    /// Cells have 2^this pixels.
    pub cell: usize,
    /// Level of the pyramid on which they spread; `cell` less one at least.
    pub level: usize,
    /// Row by row.
    pub sites: Vec<Site>,
    /// The averages, site after site, channel after channel.
    pub values: Vec<f32>,
}

impl Group {
    /// The sites whose cells lie in these rows of cells.
    pub fn rows(&self, rows: std::ops::Range<isize>) -> std::ops::Range<usize> {
        let before = |end: isize| self.sites.partition_point(|site| (site.y as isize) < end);
        before(rows.start)..before(rows.end)
    }
}

/// All sites, and what they were placed by.
#[derive(Debug, Default)]
pub struct Sites {
    pub groups: Vec<Group>,
    /// Least and largest diameter of every cell, from single pixels on.
    cells: Vec<Cells>,
}

#[derive(Debug, Default)]
struct Cells {
    width: usize,
    height: usize,
    least: Vec<f32>,
    most: Vec<f32>,
    /// How much of a leaf each of them can be; for cells of more than a pixel.
    leaf: Vec<f32>,
}

impl Cells {
    /// Fills `leaf`: a site gathers from the cells around its own too, which have to suit it.
    fn judge(&mut self, call: &Call<'_>, level: usize) -> Result<()> {
        let Self { width, height, least, most, leaf } = self;
        let (width, height) = (*width, *height);
        zeros(leaf, width * height, "the circles of a quadtree", call.size())?;
        leaf.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let rows = y.saturating_sub(1)..(y + 2).min(height);
            let column = |x: usize| {
                rows.clone()
                    .map(|y| y * width + x)
                    .fold((f32::INFINITY, 0.0f32), |(low, high), at| (low.min(least[at]), high.max(most[at])))
            };
            let join = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
            let (mut before, mut this) = (column(0), column(0));
            for (x, leaf) in row.iter_mut().enumerate() {
                let after = column((x + 1).min(width - 1));
                let (low, high) = join(join(before, this), after);
                *leaf = call.spread.tensor.leaf(level, low, high);
                (before, this) = (this, after);
            }
        });
        Ok(())
    }

    fn ends(&self, x: usize, y: usize) -> (f32, f32) {
        let at = y * self.width + x;
        (self.least[at], self.most[at])
    }
}

/// Sites of one size of cell, by the level on which they spread.
#[derive(Debug, Default)]
struct Found {
    /// In the picture's rows.
    inside: Vec<Vec<Site>>,
    /// Above and below it, in any order.
    outside: Vec<Vec<Site>>,
}

/// A place in a grid of cells.
struct Place {
    /// Cells have 2^this pixels.
    cell: usize,
    at: [usize; 2],
    /// Number of cells in the picture.
    size: [usize; 2],
    /// How many cells the neighbouring sites are away.
    distance: usize,
    /// The blur's variance along the width, in square pixels.
    variance: f64,
    /// How much of it is a site.
    share: f32,
}

impl Found {
    /// Those that spread on a level, inside and outside.
    fn of(&mut self, level: usize) -> (&mut Vec<Site>, &mut Vec<Site>) {
        if self.inside.len() <= level {
            self.inside.resize_with(level + 1, Vec::new);
            self.outside.resize_with(level + 1, Vec::new);
        }
        (&mut self.inside[level], &mut self.outside[level])
    }

    /// Adds a site and what continues it beyond the borders.
    fn add(&mut self, place: &Place, call: &Call<'_>) {
        let &Place { cell, at, size, distance, variance, share } = place;
        let scale = f64::from(call.spread.vertical_scale);
        let pixels = (distance << cell) as f64;
        let narrower = variance * scale.min(1.0).powi(2);
        let (level, next) = level_of(narrower - gathered(narrower, pixels), Quality::Standard);
        if (0..2).all(|axis| at[axis] >= distance && at[axis] + distance < size[axis]) && next == 0.0 {
            let (x, y) = (at[0] as i32, at[1] as i32);
            let site = Site { x, y, variance: variance as f32, distance: pixels as f32, share };
            self.of(level).0.push(site);
            return;
        }
        let places = |axis: usize, variance: f64| {
            let more = beyond(variance, pixels) as i32;
            let before = if at[axis] < distance { more } else { 0 };
            let after = if at[axis] + distance >= size[axis] { more } else { 0 };
            (-before..=after).map(move |n| at[axis] as i32 + n * distance as i32)
        };
        for (level, part) in
            [(level, 1.0 - next), (level + 1, next)].into_iter().filter(|(_, part)| *part > 0.0)
        {
            let site =
                Site { x: 0, y: 0, variance: variance as f32, distance: pixels as f32, share: share * part };
            for y in places(1, variance * scale * scale) {
                let rows = 0..size[1] as i32;
                let (inside, outside) = self.of(level);
                let to = if rows.contains(&y) { inside } else { outside };
                to.extend(places(0, variance).map(|x| Site { x, y, ..site }));
            }
        }
    }
}

impl Sites {
    /// Places the sites of a call.
    pub fn place(&mut self, call: &Call<'_>) -> Result<()> {
        self.groups.clear();
        match call.spread.tensor.sites {
            Placing::Quadtree => self.quadtree(call),
            Placing::Skip => self.skip(call),
        }
    }

    fn quadtree(&mut self, call: &Call<'_>) -> Result<()> {
        self.measure(call)?;
        (0..self.cells.len()).try_for_each(|level| self.leaves(call, level))
    }

    /// Fills `cells`, as far up as there can be leaves.
    fn measure(&mut self, call: &Call<'_>) -> Result<()> {
        let size = call.size();
        let narrower = call.spread.vertical_scale.min(1.0);
        let tensor = call.spread.tensor;
        self.cells.truncate(1);
        self.cells.resize_with(1, Cells::default);
        let Cells { width, height, least, most, .. } = &mut self.cells[0];
        (*width, *height) = (size.width, size.height);
        zeros(least, size.area(), "the circles of a quadtree", size)?;
        least.par_chunks_mut(size.width).enumerate().for_each(|(y, row)| {
            row.iter_mut().enumerate().for_each(|(x, d)| *d = call.spread.diameter(x, y) * narrower);
        });
        most.clone_from(least);
        loop {
            call.cancel.check()?;
            let fine = self.cells.last().expect("the pixels are there");
            let level = self.cells.len();
            let widest = fine.least.par_iter().copied().reduce(|| 0.0, f32::max);
            if tensor.leaf(level, widest, widest) == 0.0 {
                return Ok(());
            }
            let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
            let mut coarse = Cells { width, height, ..Cells::default() };
            let fold = |from: &[f32], to: &mut Vec<f32>, pick: fn(f32, f32) -> f32| {
                zeros(to, width * height, "the circles of a quadtree", size)?;
                to.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                    let below = (2 * y + 1).min(fine.height - 1);
                    let lines = [2 * y, below].map(|y| &from[y * fine.width..][..fine.width]);
                    for (x, value) in row.iter_mut().enumerate() {
                        let right = (2 * x + 1).min(fine.width - 1);
                        let [a, b] = lines.map(|line| pick(line[2 * x], line[right]));
                        *value = pick(a, b);
                    }
                });
                Ok(())
            };
            fold(&fine.least, &mut coarse.least, f32::min)?;
            fold(&fine.most, &mut coarse.most, f32::max)?;
            coarse.judge(call, level)?;
            self.cells.push(coarse);
        }
    }

    /// Finds the leaves of one size.
    fn leaves(&mut self, call: &Call<'_>, level: usize) -> Result<()> {
        let cells = &self.cells;
        let Cells { width, height, .. } = cells[level];
        let leaf = |level: usize, x: usize, y: usize| {
            if level == 0 {
                1.0
            } else {
                cells.get(level).map_or(0.0, |cells| cells.leaf[y * cells.width + x])
            }
        };
        // What the larger cells around have left; where one has none, no larger one has any.
        let left = |x: usize, y: usize| {
            let (mut left, mut up) = (1.0, 1);
            loop {
                match leaf(level + up, x >> up, y >> up) {
                    0.0 => return left,
                    share => left *= 1.0 - share,
                }
                up += 1;
            }
        };
        // Circles were measured along the narrower axis.
        let narrower = f64::from(call.spread.vertical_scale.min(1.0)).powi(2);
        let row = |y: usize, found: &mut Found| {
            for x in 0..width {
                let share = match leaf(level, x, y) {
                    0.0 => 0.0,
                    share => share * left(x, y),
                };
                if share > 0.0 {
                    let (least, most) = cells[level].ends(x, y);
                    let mean = 0.5 * (variance(f64::from(least)) + variance(f64::from(most)));
                    let (size, variance) = ([width, height], mean / narrower);
                    found.add(&Place { cell: level, at: [x, y], size, distance: 1, variance, share }, call);
                }
            }
        };
        let groups = in_rows(height, level, &row, call)?;
        self.groups.extend(groups);
        Ok(())
    }

    fn skip(&mut self, call: &Call<'_>) -> Result<()> {
        let size = call.size();
        let narrower = call.spread.vertical_scale.min(1.0);
        let row = |y: usize, found: &mut Found| {
            for x in 0..size.width {
                let diameter = call.spread.diameter(x, y);
                let distance = call.spread.tensor.skip(diameter * narrower);
                if x.is_multiple_of(distance) && y.is_multiple_of(distance) {
                    let variance = variance(f64::from(diameter));
                    let size = [size.width, size.height];
                    found.add(&Place { cell: 0, at: [x, y], size, distance, variance, share: 1.0 }, call);
                }
            }
        };
        self.groups = in_rows(size.height, 0, &row, call)?;
        Ok(())
    }
}

/// The groups of what `row` finds in each row of cells of 2^`cell` pixels.
fn in_rows(
    height: usize,
    cell: usize,
    row: &(impl Fn(usize, &mut Found) + Sync),
    call: &Call<'_>,
) -> Result<Vec<Group>> {
    let pieces = (0..height.div_ceil(ROWS)).into_par_iter().map(|piece| {
        call.cancel.check()?;
        let mut found = Found::default();
        (piece * ROWS..((piece + 1) * ROWS).min(height)).for_each(|y| row(y, &mut found));
        Ok(found)
    });
    let pieces = pieces.collect::<Result<Vec<Found>>>()?;
    let levels = pieces.iter().map(|found| found.inside.len()).max().unwrap_or(0);
    let mut groups = Vec::new();
    for level in 0..levels {
        let outside = pieces.iter().filter_map(|found| found.outside.get(level));
        let mut outside: Vec<Site> = outside.flatten().copied().collect();
        outside.sort_by_key(|site| site.y);
        let (above, below) = outside.split_at(outside.partition_point(|site| site.y < 0));
        let count = pieces.iter().filter_map(|found| found.inside.get(level)).map(Vec::len).sum::<usize>();
        let mut sites = Vec::new();
        sites.try_reserve_exact(count + outside.len()).map_err(|_| Error::OutOfMemory {
            what: "the tensor filter's sites",
            size: call.size(),
            bytes: ((count + outside.len()) * size_of::<Site>()) as u64,
        })?;
        sites.extend_from_slice(above);
        pieces
            .iter()
            .filter_map(|found| found.inside.get(level))
            .for_each(|piece| sites.extend_from_slice(piece));
        sites.extend_from_slice(below);
        if !sites.is_empty() {
            groups.push(Group { cell, level, sites, values: Vec::new() });
        }
    }
    Ok(groups)
}
