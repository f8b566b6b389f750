//! `pullfocus bench`: how fast this machine is, on frames made up for it.

use crate::args::BenchArgs;
use crate::console::print_line;
use pullfocus::Renderer;
use pullfocus_core::response::Rational;
use pullfocus_core::{
    Cancel, Diffusion, Distance, Element, Frame, Integrator, Layering, Method, Picture, Plane, Preset, Scene,
    Settings, Size,
};
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::threads::in_pool;
use pullfocus_job::values::BenchSize;
use serde::Serialize;
use std::time::{Duration, Instant};

/// One measured line.
#[derive(Debug, Serialize)]
struct Line {
    width: usize,
    height: usize,
    what: String,
    /// Diameter in pixels; none for the copy.
    largest_circle_px: Option<f32>,
    /// Median of the runs.
    ms: f64,
    frames_per_second: f64,
    /// Time over that of copying, once per axis, the 28 bytes a pixel that a single layer must touch.
    times_the_copy: f64,
    /// Pixels x colours x axes of one diffusion; only said of a single layer of diffusion.
    ns_per_unknown: Option<f64>,
    runs: usize,
}

#[derive(Debug, Serialize)]
struct Document<'a> {
    pullfocus: &'static str,
    command: &'static str,
    threads: usize,
    lines: &'a [Line],
}

/// Runs the table.
///
/// # Errors
/// [`Failure`]: no memory for a frame, no threads.
pub fn run(args: &BenchArgs, cancel: &Cancel) -> Result<()> {
    if !(args.seconds.is_finite() && (0.0..=60.0).contains(&args.seconds)) {
        return Err(Failure::usage(format!("--seconds is {}; it must lie between 0 and 60", args.seconds)));
    }
    let least = Duration::from_secs_f64(args.seconds);
    in_pool(args.threads, || {
        let threads = rayon::current_num_threads();
        let mut lines = Vec::new();
        if !args.json {
            print_line(&format!(
                "pullfocus {} on {threads} threads, made-up frames of 3 colours with circles given, median of at least {} s",
                env!("CARGO_PKG_VERSION"),
                args.seconds
            ));
            print_line(&format!(
                "{:>11}  {:<28} {:>8} {:>10} {:>9} {:>8} {:>10}",
                "size", "what", "circle", "ms", "frames/s", "x copy", "ns/unknown"
            ));
        }
        for &BenchSize(size) in &args.size {
            measure(size, least, cancel, &mut |line| {
                if !args.json {
                    print_line(&text(&line));
                }
                lines.push(line);
            })?;
        }
        if args.json {
            let document =
                Document { pullfocus: env!("CARGO_PKG_VERSION"), command: "bench", threads, lines: &lines };
            crate::report::print(&document)?;
        }
        Ok(())
    })
}

fn text(line: &Line) -> String {
    format!(
        "{:>11}  {:<28} {:>8} {:>10.2} {:>9.1} {:>8.1} {:>10}",
        format!("{}x{}", line.width, line.height),
        line.what,
        line.largest_circle_px.map_or(String::new(), |c| format!("{c} px")),
        line.ms,
        line.frames_per_second,
        line.times_the_copy,
        line.ns_per_unknown.map_or(String::new(), |ns| format!("{ns:.2}")),
    )
}

/// The settings measured, by name; a single layer is timed for every size of circle, the others for one.
fn cases() -> [(&'static str, Settings, &'static [f32]); 7] {
    let single = |integrator| Settings {
        layering: Layering::Single,
        diffusion: Diffusion { integrator, ..Diffusion::default() },
        ..Settings::default()
    };
    let spread = |method| Settings { method, layering: Layering::Single, ..Settings::default() };
    [
        ("single, backward Euler", single(Integrator::BackwardEuler { steps: 1 }), &[5.0, 50.0, 500.0]),
        ("single, rational", single(Integrator::Rational(Rational::GAUSSIAN)), &[5.0, 50.0, 500.0]),
        ("single, disc", single(Integrator::Disc), &[5.0, 50.0, 500.0]),
        ("single, square", spread(Method::Square), &[5.0, 50.0, 500.0]),
        ("single, pyramid", spread(Method::Pyramid), &[5.0, 50.0, 500.0]),
        ("preview (2 layers)", Settings::preset(Preset::Preview), &[5.0, 50.0, 500.0]),
        ("final", Settings::preset(Preset::Final), &[5.0, 50.0, 500.0]),
    ]
}

fn measure(size: Size, least: Duration, cancel: &Cancel, tell: &mut dyn FnMut(Line)) -> Result<()> {
    let copy = copy_time(size, least, cancel)?;
    let line =
        |what: &str, circle: Option<f32>, (time, runs): (Duration, usize), unknowns: Option<f64>| Line {
            width: size.width,
            height: size.height,
            what: what.to_owned(),
            largest_circle_px: circle,
            ms: time.as_secs_f64() * 1e3,
            frames_per_second: 1.0 / time.as_secs_f64().max(1e-9),
            times_the_copy: time.as_secs_f64() / copy.0.as_secs_f64().max(1e-9),
            ns_per_unknown: unknowns.map(|unknowns| time.as_secs_f64() * 1e9 / unknowns),
            runs,
        };
    tell(line("memory copy, twice 28 B/pixel", None, copy, None));
    let mut renderer = Renderer::new();
    let picture = picture(size)?;
    for (what, settings, circles) in cases() {
        for &circle in circles {
            let mut scene = Scene::new(
                Frame::full(size),
                Element { picture: picture.clone(), distance: Distance::Coc(circles_up_to(size, circle)?) },
            );
            let time = median(least, cancel, || {
                for (plane, clean) in scene.base.picture.planes_mut().zip(picture.planes()) {
                    plane.data_mut().copy_from_slice(clean.data());
                }
                let start = Instant::now();
                renderer.render(&mut scene, None, &settings, cancel)?;
                Ok(start.elapsed())
            })?;
            let solved = settings.layering == Layering::Single && settings.method == Method::Diffusion;
            let unknowns = solved.then_some(size.area() as f64 * 6.0);
            tell(line(what, Some(circle), time, unknowns));
        }
    }
    Ok(())
}

/// Median over runs that together take `least`, after one to warm up.
fn median(
    least: Duration,
    cancel: &Cancel,
    mut once: impl FnMut() -> Result<Duration>,
) -> Result<(Duration, usize)> {
    once()?;
    let start = Instant::now();
    let mut times = Vec::new();
    while times.len() < 3 || (start.elapsed() < least && times.len() < 1000) {
        cancel.check()?;
        times.push(once()?);
    }
    times.sort_unstable();
    Ok((times[times.len() / 2], times.len()))
}

/// Reads 16 and writes 12 bytes a pixel, once per axis, with all threads.
fn copy_time(size: Size, least: Duration, cancel: &Cancel) -> Result<(Duration, usize)> {
    use rayon::prelude::*;
    let from = Plane::filled(size, 1.0)?;
    let circles = Plane::filled(size, 2.0)?;
    let mut to = [Plane::filled(size, 0.0)?, Plane::filled(size, 0.0)?, Plane::filled(size, 0.0)?];
    let mut sources = [from.clone(), from.clone(), from];
    let rows = size.width * 16;
    median(least, cancel, || {
        let start = Instant::now();
        for _ in 0..2 {
            for (source, target) in sources.iter().zip(&mut to) {
                target
                    .data_mut()
                    .par_chunks_mut(rows)
                    .zip(source.data().par_chunks(rows))
                    .for_each(|(target, source)| target.copy_from_slice(source));
            }
            // The circles are read along with the colours.
            let sum: f32 = circles.data().par_chunks(rows).map(|chunk| chunk.iter().sum::<f32>()).sum();
            std::hint::black_box(sum);
            std::mem::swap(&mut sources, &mut to);
        }
        Ok(start.elapsed())
    })
}

fn picture(size: Size) -> Result<Picture> {
    let plane = |shift: usize| {
        Plane::from_fn(size, |x, y| {
            let checker = f32::from(((x + shift) / 16 + y / 16).is_multiple_of(2));
            0.2 + 0.6 * checker + 0.2 * (x as f32 / size.width as f32)
        })
    };
    Ok(Picture::opaque(vec![plane(0)?, plane(5)?, plane(11)?]))
}

/// A far wall that recedes to the right, and near bars before it.
fn circles_up_to(size: Size, largest: f32) -> Result<Plane> {
    Ok(Plane::from_fn(size, |x, y| {
        let across = x as f32 / size.width as f32;
        if (x + y) % (size.width / 4).max(2) < (size.width / 16).max(1) {
            -0.6 * largest
        } else {
            largest * across
        }
    })?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_reach_the_circle_they_are_made_for() {
        let circles = circles_up_to(Size::new(64, 32), 50.0).unwrap();
        let most = circles.data().iter().fold(0.0f32, |most, c| most.max(*c));
        // The last column's centre is a pixel short of the edge.
        assert!(most > 45.0 && most <= 50.0, "{most}");
        // 0.6 is rounded in f32.
        assert!(circles.data().iter().any(|c| (c + 30.0).abs() < 1e-4));
    }
}
