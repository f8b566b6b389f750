//! A blur that grows smoothly across a picture, drawn by the pyramid's two choices for sizes between levels (third paper, 5.1) and
//! by naive spreading: the picture, and what each does where the level changes.

use crate::chart::{Chart, Series};
use crate::panels::Panel;
use crate::place::Output;
use crate::table::Table;
use anyhow::Result;
use clap::Args;
use pullfocus::{Cancel, Picture, Plane, Size};
use pullfocus_core::psf::variance;
use pullfocus_core::pyramid::level_with;
use pullfocus_core::{Aperture, Method, Mipmap, Psf, Quality, Tensor};
use pullfocus_cpu::spreading::{Spread, SpreadBuffers, spread};

/// Options of `growing`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
}

/// Largest circle, in pixels, at the picture's right.
const MOST: f32 = 60.0;
/// What differences are multiplied with to be seen.
const ENLARGED: f32 = 100.0;

const NAMES: [&str; 3] = ["naive", "pyramid, both levels", "pyramid, one level"];

/// A chirp whose waves are as long as the blur is wide everywhere, an edge along the growth, and points.
fn pattern(size: Size) -> Result<Plane> {
    let (w, h) = (size.width as f32, size.height as f32);
    Ok(Plane::from_fn(size, |x, y| {
        let (x, y) = (x as f32, y as f32);
        let chirp = 0.45 + 0.35 * (0.033 * w * (0.04 * w + x).ln()).sin();
        let points = x % 40.0 == 20.0 && (y / h * 270.0 - 235.0).abs() < 0.6;
        match y / h {
            part if part < 0.45 => chirp,
            part if part < 0.7 => 0.75,
            // Once blurred they are equally bright: half of what the middle of their Gaussian was divided by.
            _ if points => 0.5 * (1.0 + 0.4 * (MOST * x / w).powi(2)),
            _ => 0.1,
        }
    })?)
}

fn blurred(pattern: &Plane, circle: &Plane, method: Method, mipmap: Mipmap) -> Result<Plane> {
    let mut plane = pattern.clone();
    let (psf, quality) = (Psf::Gaussian, Quality::Standard);
    let (aperture, tensor) = (&Aperture::DISC, Tensor::default());
    let spreading =
        Spread { method, psf, aperture, quality, mipmap, tensor, circle, gamma: None, vertical_scale: 1.0 };
    spread(&mut [&mut plane], &spreading, &mut SpreadBuffers::default(), &Cancel::new())?;
    Ok(plane)
}

/// All three, in the order of [`NAMES`].
fn all(pattern: &Plane, circle: &Plane) -> Result<[Plane; 3]> {
    Ok([
        blurred(pattern, circle, Method::Naive, Mipmap::Linear)?,
        blurred(pattern, circle, Method::Pyramid, Mipmap::Linear)?,
        blurred(pattern, circle, Method::Pyramid, Mipmap::Nearest)?,
    ])
}

/// The largest second difference along the rows, of each column but the first and the last.
fn second_differences(plane: &Plane) -> Vec<f64> {
    let size = plane.size();
    let of = |x: usize, y: usize| {
        let row = plane.row(y);
        f64::from(row[x - 1]) - 2.0 * f64::from(row[x]) + f64::from(row[x + 1])
    };
    (1..size.width - 1).map(|x| (0..size.height).map(|y| of(x, y).abs()).fold(0.0, f64::max)).collect()
}

/// Diameters at which a growing circle comes to another level when one level does alone.
fn changes() -> Vec<f32> {
    let level = |c: f32| level_with(variance(f64::from(c)), Quality::Standard, Mipmap::Nearest).0;
    let diameters = (0..).map(|i| 0.01 * i as f32).take_while(|c| *c < MOST);
    diameters.filter(|c| level(*c) != level(*c + 0.01)).collect()
}

fn difference(a: &Plane, b: &Plane) -> Result<Plane> {
    Ok(Plane::from_fn(a.size(), |x, y| a.at(x, y) - b.at(x, y))?)
}

/// Grey where there is no difference.
fn shown(difference: &Plane) -> Result<Panel> {
    let grey =
        Plane::from_fn(difference.size(), |x, y| (0.5 + ENLARGED * difference.at(x, y)).clamp(0.0, 1.0))?;
    Ok(Panel::of_display(&[grey.clone(), grey.clone(), grey]))
}

/// By how much a picture moves at most while an even circle grows by `step` at `diameter` pixels.
fn step(pattern: &Plane, method: Method, mipmap: Mipmap, diameter: f32, step: f32) -> Result<f64> {
    let at = |c: f32| blurred(pattern, &Plane::filled(pattern.size(), c)?, method, mipmap);
    let moved = difference(&at(diameter + step)?, &at(diameter)?)?;
    Ok(moved.data().iter().fold(0.0, |most, v| f64::max(most, f64::from(v.abs()))))
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let quick = options.output.quick;
    let size = if quick { Size::new(96, 54) } else { Size::new(480, 270) };
    let pattern = pattern(size)?;
    let circle = Plane::from_fn(size, |x, _| MOST * x as f32 / (size.width - 1) as f32)?;
    let pictures = all(&pattern, &circle)?;
    let panel = |plane: &Plane| Panel::of(&Picture::opaque(vec![plane.clone()]));
    let errors = [difference(&pictures[1], &pictures[0])?, difference(&pictures[2], &pictures[0])?];
    let mut panels = vec![panel(&pictures[0])?, Panel::of_circles(&circle, MOST)];
    for (picture, error) in pictures[1..].iter().zip(&errors) {
        panels.extend([panel(picture)?, shown(error)?]);
    }
    options.output.write_bytes("pictures/spreading/growing.png", &Panel::grid(&panels, 2)?.to_png()?)?;

    let series = |name: &str, plane: &Plane| Series {
        name: name.to_owned(),
        points: second_differences(plane)
            .into_iter()
            .enumerate()
            .map(|(i, v)| (f64::from(circle.at(i + 1, 0)), v))
            .collect(),
    };
    let chart = Chart {
        titles: ["second differences along the rows", "the same of what the pyramid errs by"],
        across: "circle of confusion, px",
        doubling: false,
        panels: [
            NAMES.iter().zip(&pictures).map(|(name, plane)| series(name, plane)).collect(),
            NAMES[1..].iter().zip(&errors).map(|(name, plane)| series(name, plane)).collect(),
        ],
    };
    options.output.write_bytes("pictures/spreading/growing.svg", chart.to_svg()?.as_bytes())?;

    let largest = |plane: &Plane| second_differences(plane).into_iter().fold(0.0, f64::max);
    let most = |plane: &Plane| plane.data().iter().fold(0.0f32, |most, v| most.max(v.abs()));
    let mut table = Table::new(["", "farthest from naive", "second differences", "of the error"]);
    table.row([NAMES[0], "", &format!("{:.1e}", largest(&pictures[0])), ""]);
    for ((name, picture), error) in NAMES[1..].iter().zip(&pictures[1..]).zip(&errors) {
        let cells = [f64::from(most(error)), largest(picture), largest(error)].map(|v| format!("{v:.1e}"));
        table.row([(*name).to_owned()].into_iter().chain(cells));
    }
    println!("{}", table.to_markdown());
    let mut table = Table::new(["an even circle of, px", NAMES[0], NAMES[1], NAMES[2]]);
    let changes = changes();
    for diameter in changes.iter().take(if quick { 1 } else { usize::MAX }) {
        let moved = [
            step(&pattern, Method::Naive, Mipmap::Linear, *diameter, 0.01)?,
            step(&pattern, Method::Pyramid, Mipmap::Linear, *diameter, 0.01)?,
            step(&pattern, Method::Pyramid, Mipmap::Nearest, *diameter, 0.01)?,
        ];
        table.row([format!("{diameter:.2}")].into_iter().chain(moved.map(|v| format!("{v:.1e}"))));
    }
    println!(
        "By how much the picture moves while an even circle grows by 0.01 px:\n\n{}",
        table.to_markdown()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_picture_is_made() {
        let folder = tempfile::tempdir().unwrap();
        run(&Options { output: Output { out: Some(folder.path().to_path_buf()), quick: true } }).unwrap();
        let svg = std::fs::read_to_string(folder.path().join("pictures/spreading/growing.svg")).unwrap();
        assert!(NAMES.iter().all(|name| svg.contains(name)));
        assert!(folder.path().join("pictures/spreading/growing.png").is_file());
    }

    #[test]
    fn levels_change_where_the_next_one_is_wide_enough() {
        // 9/16 of four squared pixels and 1.25 of enlarging: 4 sqrt(3.5) = 7.48.
        let changes = changes();
        assert!(changes.len() == 3 && (changes[0] - 7.48).abs() < 0.02, "{changes:?}");
    }
}
