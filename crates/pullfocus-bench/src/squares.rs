//! Square spreading's family, measured: tents by differences of second order, squares one after the other, octagons. What is not
//! in the product is a plain prototype here, on one thread.

use crate::data::{DevScene, read_all};
use crate::place::{Output, provenance, workspace};
use crate::spreading::spent;
use crate::table::Table;
use anyhow::Result;
use clap::Args;
use pullfocus::{Cancel, Picture, Plane, Size};
use pullfocus_core::psf::{extended_box, variance};
use pullfocus_core::{Aperture, Method, Mipmap, Psf, Quality, Tensor};
use pullfocus_cpu::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_metrics::{display, psnr};
use std::path::PathBuf;
use std::time::Instant;

/// Options of `squares`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    /// Folder of scenes; the 480 x 270 ones that ship with the project where none is given.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

/// Colours and weight.
type Value = [f64; 4];

/// Differences of a picture, with `pad` cells around it.
struct Cells {
    size: Size,
    pad: usize,
    stride: usize,
    data: Vec<Value>,
}

impl Cells {
    fn new(size: Size, pad: usize) -> Self {
        let stride = size.width + 2 * pad;
        Self { size, pad, stride, data: vec![[0.0; 4]; stride * (size.height + 2 * pad)] }
    }

    fn add(&mut self, x: isize, y: isize, value: &Value, weight: f64) {
        let pad = self.pad as isize;
        let at = (y + pad) as usize * self.stride + (x + pad) as usize;
        self.data[at].iter_mut().zip(value).for_each(|(cell, value)| *cell += weight * value);
    }

    /// The running sum in a direction: each cell takes the one that lies `dx` columns and `dy` rows before it.
    fn sum(&mut self, dx: isize, dy: usize) {
        let (stride, rows) = (self.stride as isize, self.data.len() / self.stride);
        let columns = dx.max(0)..stride + dx.min(0);
        for y in dy..rows {
            for x in columns.clone() {
                let at = y as isize * stride + x;
                let before = self.data[(at - dx - dy as isize * stride) as usize];
                self.data[at as usize].iter_mut().zip(before).for_each(|(cell, before)| *cell += before);
            }
        }
    }

    fn add_all(&mut self, other: &Self) {
        for (cell, other) in self.data.iter_mut().zip(&other.data) {
            cell.iter_mut().zip(other).for_each(|(cell, other)| *cell += other);
        }
    }

    /// Colours divided by the weight.
    fn picture(&self) -> Result<Picture> {
        let value = |x: usize, y: usize| &self.data[(y + self.pad) * self.stride + x + self.pad];
        let plane = |c: usize| Plane::from_fn(self.size, |x, y| (value(x, y)[c] / value(x, y)[3]) as f32);
        Ok(Picture::opaque(vec![plane(0)?, plane(1)?, plane(2)?]))
    }
}

/// Each pixel's colours and weight, and its diameter.
fn pixels<'a>(
    picture: &'a Picture,
    circle: &'a Plane,
) -> impl Iterator<Item = ((isize, isize), Value, f64)> + 'a {
    let Size { width, height } = circle.size();
    (0..height).flat_map(move |y| (0..width).map(move |x| (x, y))).map(move |(x, y)| {
        let color = |c: usize| f64::from(picture.colors[c].at(x, y));
        ((x as isize, y as isize), [color(0), color(1), color(2), 1.0], f64::from(circle.at(x, y).abs()))
    })
}

/// Second-order differences of a tent: a box convolved with itself, which has half the variance.
fn tent(k: isize, f: f64) -> [(isize, f64); 9] {
    let (whole, part, both) = ((1.0 - f).powi(2), f * f, 2.0 * f * (1.0 - f));
    [
        (-2 * k, part),
        (1 - 2 * k, both),
        (2 - 2 * k, whole),
        (0, -both),
        (1, -2.0 * (part + whole)),
        (2, -both),
        (2 * k, whole),
        (2 * k + 1, both),
        (2 * k + 2, part),
    ]
}

/// A tent along each axis (Bartlett); with whole sides nine cells are written, else 81.
fn tents(picture: &Picture, circle: &Plane, whole: bool) -> Result<Picture> {
    let half = |c: f64| {
        let (k, f) = extended_box(0.5 * variance(c));
        if whole { (k + u32::from(f >= 0.5), 0.0) } else { (k, f) }
    };
    let widest = circle.data().iter().fold(0.0f32, |most, c| most.max(c.abs()));
    let mut cells = Cells::new(circle.size(), 2 * half(widest.into()).0 as usize + 3);
    for ((x, y), value, c) in pixels(picture, circle) {
        let (k, f) = half(c);
        let side = 2.0 * (f64::from(k) + f) - 1.0;
        let taps = tent(k as isize, f);
        for (dy, down) in taps.iter().filter(|tap| tap.1 != 0.0) {
            for (dx, across) in taps.iter().filter(|tap| tap.1 != 0.0) {
                cells.add(x + dx, y + dy, &value, down * across / side.powi(4));
            }
        }
    }
    (0..2).for_each(|_| cells.sum(1, 0));
    (0..2).for_each(|_| cells.sum(0, 1));
    cells.picture()
}

/// An octagon of whole pixels: |x|, |y| <= a and |x| + |y| <= a + b.
#[derive(Clone, Copy, Debug)]
struct Octagon {
    a: isize,
    b: isize,
    /// Its number of pixels and their variance along each axis.
    area: f64,
    variance: f64,
}

impl Octagon {
    fn new(a: isize) -> Self {
        let b = (a as f64 * (2f64.sqrt() - 1.0)).round() as isize;
        let (mut area, mut moment) = (0.0, 0.0);
        for y in -a..=a {
            let half = a.min(a + b - y.abs()) as f64;
            area += 2.0 * half + 1.0;
            moment += (y * y) as f64 * (2.0 * half + 1.0);
        }
        Self { a, b, area, variance: moment / area }
    }

    /// Marks the ends of its sides: `straight` are summed down the columns, `left` and `right` down the diagonals; all
    /// of them together along the rows.
    fn mark(
        &self,
        [straight, left, right]: &mut [Cells; 3],
        (x, y): (isize, isize),
        value: &Value,
        weight: f64,
    ) {
        let (a, b) = (self.a, self.b);
        // The rows of each part: down to -b - 1 the sides spread, from -b to b they are straight, from b + 1 they close.
        let (top, bottom) = (y - a, y + a + 1);
        // Left side, then right side (a pixel beyond, taken away). A diagonal is cut where it has left its part.
        left.add(x - b, top, value, weight);
        left.add(x - b - (a - b), y - b, value, -weight);
        straight.add(x - a, y - b, value, weight);
        straight.add(x - a, y + b + 1, value, -weight);
        right.add(x - a + 1, y + b + 1, value, weight);
        right.add(x - a + 1 + (a - b), bottom, value, -weight);
        right.add(x + b + 1, top, value, -weight);
        right.add(x + b + 1 + (a - b), y - b, value, weight);
        straight.add(x + a + 1, y - b, value, -weight);
        straight.add(x + a + 1, y + b + 1, value, weight);
        left.add(x + a, y + b + 1, value, -weight);
        left.add(x + a - (a - b), bottom, value, weight);
    }
}

/// An octagon of whole pixels and the next larger one, mixed to the disc's variance.
fn octagons(picture: &Picture, circle: &Plane) -> Result<Picture> {
    let widest = circle.data().iter().fold(0.0f32, |most, c| most.max(c.abs()));
    let all: Vec<Octagon> = (0..widest as isize + 3).map(Octagon::new).collect();
    let size = circle.size();
    let mut cells = [0; 3].map(|_| Cells::new(size, all.len() + 2));
    for (at, value, c) in pixels(picture, circle) {
        let t = variance(c);
        let next = all.partition_point(|octagon| octagon.variance <= t).clamp(1, all.len() - 1);
        let [small, large] = [all[next - 1], all[next]];
        let share = (t - small.variance) / (large.variance - small.variance);
        for (octagon, share) in [(small, 1.0 - share), (large, share)] {
            octagon.mark(&mut cells, at, &value, share / octagon.area);
        }
    }
    let [mut straight, mut left, mut right] = cells;
    straight.sum(0, 1);
    left.sum(-1, 1);
    right.sum(1, 1);
    straight.add_all(&left);
    straight.add_all(&right);
    straight.sum(1, 0);
    straight.picture()
}

fn ours(method: Method, psf: Psf, picture: &Picture, circle: &Plane) -> Result<Picture> {
    let mut picture = picture.clone();
    let (quality, mipmap) = (Quality::Standard, Mipmap::Linear);
    let (aperture, tensor) = (&Aperture::DISC, Tensor::default());
    let spreading =
        Spread { method, psf, aperture, quality, mipmap, tensor, circle, gamma: None, vertical_scale: 1.0 };
    let mut planes: Vec<&mut Plane> = picture.colors.iter_mut().collect();
    spread(&mut planes, &spreading, &mut SpreadBuffers::default(), &Cancel::new())?;
    Ok(picture)
}

/// Squares of an `n`-th of the variance, one after the other.
fn repeated(n: u8, picture: &Picture, circle: &Plane) -> Result<Picture> {
    let part = f32::from(n).sqrt();
    let circle = Plane::from_fn(circle.size(), |x, y| circle.at(x, y) / part)?;
    (0..n).try_fold(picture.clone(), |picture, _| ours(Method::Square, Psf::Gaussian, &picture, &circle))
}

type Filter = fn(&Picture, &Plane) -> Result<Picture>;

const FILTERS: [(&str, Filter); 7] = [
    ("square", |p, c| ours(Method::Square, Psf::Gaussian, p, c)),
    ("two squares, one after the other", |p, c| repeated(2, p, c)),
    ("three squares", |p, c| repeated(3, p, c)),
    ("tents (Bartlett), sides of whole pixels", |p, c| tents(p, c, true)),
    ("tents (Bartlett)", |p, c| tents(p, c, false)),
    ("octagons", octagons),
    ("pyramid", |p, c| ours(Method::Pyramid, Psf::Gaussian, p, c)),
];

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let folder = options.data.clone().unwrap_or_else(|| workspace().join("data/dev480"));
    let mut scenes = read_all(&folder)?;
    scenes.truncate(if options.output.quick { 1 } else { usize::MAX });
    let (gaussian, disc): (Filter, Filter) =
        (|p, c| ours(Method::Naive, Psf::Gaussian, p, c), |p, c| ours(Method::Naive, Psf::Aperture, p, c));
    let references = |scene: &DevScene| -> Result<_> {
        let (picture, circle) = (&scene.input.picture, &scene.references[0].circles);
        Ok([display(&gaussian(picture, circle)?)?, display(&disc(picture, circle)?)?])
    };
    let references = scenes.iter().map(references).collect::<Result<Vec<_>>>()?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut head = vec!["method".to_owned(), "ns a pixel".to_owned(), "times square".to_owned()];
    for against in ["Gaussian", "disc"] {
        head.extend(scenes.iter().map(|scene| format!("{}, {against}", &scene.name[..2])));
    }
    let mut table = Table::new(head);
    let mut square = 1.0;
    let start = Instant::now();
    for (name, filter) in FILTERS {
        eprintln!("{name}");
        let (mut seconds, mut pixels) = (0.0, 0);
        let mut decibels = [vec![], vec![]];
        for (scene, references) in scenes.iter().zip(&references) {
            let (picture, circle) = (&scene.input.picture, &scene.references[0].circles);
            let before = spent(start);
            let blurred = one.install(|| filter(picture, circle))?;
            seconds += spent(start) - before;
            pixels += circle.size().area();
            let shown = display(&blurred)?;
            for (list, reference) in decibels.iter_mut().zip(references) {
                list.push(format!("{:.1}", psnr(reference, &shown)?));
            }
        }
        let ns = seconds * 1e9 / pixels as f64;
        square = if name == "square" { ns } else { square };
        let cost = [name.to_owned(), format!("{ns:.0}"), format!("{:.1}", ns / square)];
        table.row(cost.into_iter().chain(decibels.concat()));
    }
    println!(
        "{}\n\nOne thread, processor time; PSNR in dB of the tone-mapped pictures, against naive Gaussian and naive disc.\n\n{}",
        provenance(),
        table.to_markdown()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prototypes_draw_what_they_are_called() {
        let size = Size::new(41, 41);
        let point = Plane::from_fn(size, |x, y| f32::from((x, y) == (20, 20))).unwrap();
        let picture = Picture::opaque(vec![point; 3]);
        for c in [0.0f32, 7.3, 16.0] {
            let circle = Plane::filled(size, c).unwrap();
            let t = variance(f64::from(c));
            for (name, filter) in FILTERS {
                let drawn = filter(&picture, &circle).unwrap().colors.swap_remove(0);
                let moment = |n: i32| -> f64 {
                    let at = |i: usize| (i % 41) as f64 - 20.0;
                    drawn.data().iter().enumerate().map(|(i, v)| f64::from(*v) * at(i).powi(n)).sum()
                };
                // Sides of whole pixels are off by up to half a pixel. Weights near the border are not 1, by 1 %.
                let least = if name.contains("whole") { 0.35 * t } else { 0.02 * t };
                assert!((moment(0) - 1.0).abs() < 0.01, "{name}, {c}: {}", moment(0));
                assert!((moment(2) - t).abs() < least + 1e-6, "{name}, {c}: {} for {t}", moment(2));
            }
        }
    }

    #[test]
    fn an_octagon_s_marks_fill_it() {
        let size = Size::new(31, 31);
        let octagon = Octagon::new(9);
        let mut cells = [0; 3].map(|_| Cells::new(size, 2));
        octagon.mark(&mut cells, (15, 15), &[1.0; 4], 1.0);
        let [mut straight, mut left, mut right] = cells;
        straight.sum(0, 1);
        left.sum(-1, 1);
        right.sum(1, 1);
        straight.add_all(&left);
        straight.add_all(&right);
        straight.sum(1, 0);
        for y in 0..31isize {
            for x in 0..31isize {
                let (dx, dy) = ((x - 15).abs(), (y - 15).abs());
                let inside = dx.max(dy) <= octagon.a && dx + dy <= octagon.a + octagon.b;
                let found = straight.data[(y + 2) as usize * 35 + (x + 2) as usize][0];
                assert_eq!(found, f64::from(u8::from(inside)), "{x}, {y}");
            }
        }
    }
}
