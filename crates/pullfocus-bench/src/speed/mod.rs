//! Frames per second, time per unknown, memory.

pub mod cases;
mod memory;

use crate::place::{Output, last_level_cache, provenance};
use crate::table::Table;
use anyhow::Result;
use cases::Case;
use clap::Args;
use pullfocus::diffusion::JacobiStop;
use pullfocus::{Diffusion, Integrator, Layering, Settings, Size, Solver};
use std::hint::black_box;
use std::time::Instant;

/// Options of `speed`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    /// Rounds; each runs every case once, the table has the medians.
    #[arg(long, default_value_t = 15)]
    rounds: usize,
    /// Also 16384 x 16384 RGBA and depth in `preview`: some 12 GiB of memory and a minute.
    #[arg(long)]
    memory_16k: bool,
    /// Only print the peak memory of one case (this program calls itself with it).
    #[arg(long, hide = true, value_name = "CASE")]
    memory_of: Option<String>,
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    if let Some(case) = &options.memory_of {
        return memory::measure(case);
    }
    let quick = options.output.quick;
    let rounds = if quick { 1 } else { options.rounds.max(1) };
    let text = format!(
        "# Speed\n\n{}\n\n\
         Medians of {rounds} rounds; every round runs each case of a table once, so that a slow moment hits all of them. A warm renderer: its\n\
         buffers are there from the frame before. Reading and writing files is not in it. Circles of confusion come from depth.\n\n\
         {}{}{}{}{}{}",
        provenance(),
        papers(rounds, quick)?,
        sizes(rounds, quick)?,
        circles(rounds, quick)?,
        copies(rounds, quick)?,
        solvers(rounds, quick)?,
        memory::table(quick, options.memory_16k)?,
    );
    options.output.write("results/speed.md", &text)
}

/// The median of some times.
fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    match times.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => times[n / 2],
        n => 0.5 * (times[n / 2 - 1] + times[n / 2]),
    }
}

/// Runs all cases once per round, after one run that counts for nothing, and returns each one's median in seconds.
fn interleaved(cases: &mut [Case], rounds: usize) -> Result<Vec<f64>> {
    let mut times = vec![vec![]; cases.len()];
    for round in 0..=rounds {
        for (case, times) in cases.iter_mut().zip(&mut times) {
            let seconds = case.run()?;
            if round > 0 {
                times.push(seconds);
            }
        }
    }
    Ok(times.iter_mut().map(|times| median(times)).collect())
}

fn size(width: usize, height: usize, quick: bool) -> Size {
    if quick { Size::new((width / 16).max(1), (height / 16).max(1)) } else { Size::new(width, height) }
}

fn per_second(seconds: f64) -> String {
    let frames = 1.0 / seconds;
    if frames < 10.0 { format!("{frames:.1}") } else { format!("{frames:.0}") }
}

/// The first paper's table, section 5.1.
fn papers(rounds: usize, quick: bool) -> Result<String> {
    let mut table = Table::new([
        "picture",
        "first paper (GeForce 7800), frames/s",
        "the same here, frames/s",
        "default settings, frames/s",
    ]);
    for (width, height, layered, theirs) in [
        (256, 256, false, "80-90"),
        (512, 512, false, "21-23"),
        (1024, 1024, false, "6-7"),
        (1024, 768, true, "3-4"),
    ] {
        let size = size(width, height, quick);
        let make = |settings| Case::new(size, 40.0, layered, settings);
        let mut cases = [make(cases::preview())?, make(cases::last())?];
        let times = interleaved(&mut cases, rounds)?;
        let what = if layered { "three layers" } else { "two layers" };
        table.row([format!("{size}, {what}"), theirs.to_owned(), per_second(times[0]), per_second(times[1])]);
    }
    Ok(format!(
        "## Beside the first paper\n\nIts two layers (midground and background) and one backward-Euler step are `--preset preview`; three layers have\n\
         a foreground element on top. Three colour planes, largest circle 40 px.\n\n{}\n",
        table.to_markdown()
    ))
}

/// Every setting at the usual sizes.
fn sizes(rounds: usize, quick: bool) -> Result<String> {
    let mut table = Table::new([
        "picture",
        "settings",
        "ms",
        "frames/s",
        "ns per pixel",
        "times one layer of its integrator",
    ]);
    for (width, height) in [(1920, 1080), (3840, 2160)] {
        let size = size(width, height, quick);
        let named = cases::named();
        let mut cases = vec![];
        for (_, settings) in &named {
            cases.push(Case::new(size, 50.0, false, settings.clone())?);
        }
        let times = interleaved(&mut cases, rounds.div_ceil(2))?;
        for ((name, settings), time) in named.iter().zip(&times) {
            let same = |other: &Settings| {
                other.layering == Layering::Single
                    && other.diffusion.integrator == settings.diffusion.integrator
            };
            let single = named.iter().position(|(_, other)| same(other)).unwrap_or(0);
            table.row([
                size.to_string(),
                (*name).to_owned(),
                format!("{:.1}", time * 1e3),
                per_second(*time),
                format!("{:.1}", time * 1e9 / size.area() as f64),
                format!("{:.1}", time / times[single]),
            ]);
        }
    }
    Ok(format!(
        "## Sizes and settings\n\nThree colour planes, largest circle 50 px.\n\n{}\n",
        table.to_markdown()
    ))
}

/// The cost does not depend on the blur.
fn circles(rounds: usize, quick: bool) -> Result<String> {
    let largest = [5.0, 50.0, 500.0];
    let size = size(1920, 1080, quick);
    let mut table = Table::new(["settings", "5 px, ms", "50 px, ms", "500 px, ms", "largest over smallest"]);
    for (name, settings) in cases::named() {
        let mut cases = vec![];
        for circle in largest {
            cases.push(Case::new(size, circle, false, settings.clone())?);
        }
        let times = interleaved(&mut cases, rounds)?;
        let (low, high) = times.iter().fold((f64::INFINITY, 0.0f64), |(l, h), t| (l.min(*t), h.max(*t)));
        let cells = times.iter().map(|t| format!("{:.1}", t * 1e3));
        table.row([name.to_owned()].into_iter().chain(cells).chain([format!("{:.2}", high / low)]));
    }
    Ok(format!("## Largest circles\n\n{size}, three colour planes.\n\n{}\n", table.to_markdown()))
}

/// Bytes that one axis of three planes must touch for each pixel: three read, three written, the circle read.
const BYTES: usize = 28;

/// A single-layer diffusion beside a memory copy of the bytes that it must touch.
fn copies(rounds: usize, quick: bool) -> Result<String> {
    let cache = last_level_cache();
    // A picture whose planes are four times the last-level cache, in the shape of a film frame.
    let pixels = if quick { 1 << 14 } else { (4 * cache / 16).max(1920 * 1080) };
    let width = ((pixels as f64 * 16.0 / 9.0).sqrt() / 16.0).ceil() as usize * 16;
    let large = Size::new(width, pixels.div_ceil(width));
    let mut table = Table::new([
        "picture",
        "integrator",
        "copy, ms",
        "diffusion, ms",
        "times the copy",
        "ns per unknown",
    ]);
    for size in [size(1920, 1080, quick), large] {
        for (name, diffusion) in cases::integrators() {
            let mut case = cases::DiffusionCase::new(size, diffusion)?;
            // Two axes; a copy reads one half of its bytes and writes the other. In pieces of at least four times the
            // cache, so that small pictures are not copied within it.
            let bytes = 2 * BYTES * size.area() / 2;
            let mut copy = Copy::new(bytes.max(if quick { 0 } else { 4 * cache }));
            let (mut times, mut copies) = (vec![], vec![]);
            for round in 0..=rounds {
                let (diffusion, copy) = (case.run()?, copy.run() * bytes as f64 / copy.bytes() as f64);
                if round > 0 {
                    times.push(diffusion);
                    copies.push(copy);
                }
            }
            let (time, copy) = (median(&mut times), median(&mut copies));
            table.row([
                size.to_string(),
                name.to_owned(),
                format!("{:.1}", copy * 1e3),
                format!("{:.1}", time * 1e3),
                format!("{:.2}", time / copy),
                format!("{:.2}", time * 1e9 / (6 * size.area()) as f64),
            ]);
        }
    }
    Ok(format!(
        "## One layer beside a memory copy\n\nThe diffusion alone, three planes, both axes: 6 unknowns a pixel. It must touch at least {BYTES} bytes for each pixel and axis\n\
         (three planes read and written, the circle read); the copy, on all threads, reads half as many and writes half as many, in arrays of at\n\
         least four times the last-level cache ({} MiB).\n\n{}\n",
        cache >> 20,
        table.to_markdown()
    ))
}

/// One backward-Euler step by each solver.
fn solvers(rounds: usize, quick: bool) -> Result<String> {
    let size = size(1920, 1080, quick);
    let sweeps = 10;
    let solvers = [
        ("elimination (`lu`)".to_owned(), Solver::Lu),
        ("cyclic reduction".to_owned(), Solver::CyclicReduction),
        ("parallel cyclic reduction".to_owned(), Solver::ParallelCyclicReduction),
        ("hybrid of both".to_owned(), Solver::Hybrid),
        (format!("Jacobi, {sweeps} sweeps an axis"), Solver::Jacobi(JacobiStop::Sweeps(sweeps))),
    ];
    let mut cases = vec![];
    for (_, solver) in &solvers {
        let integrator = Integrator::BackwardEuler { steps: 1 };
        cases.push(cases::DiffusionCase::new(
            size,
            Diffusion { integrator, solver: *solver, ..Diffusion::default() },
        )?);
    }
    let mut times = vec![vec![]; cases.len()];
    for round in 0..=rounds {
        for (case, times) in cases.iter_mut().zip(&mut times) {
            let seconds = case.run()?;
            if round > 0 {
                times.push(seconds);
            }
        }
    }
    let mut table = Table::new(["solver", "ms", "ns per unknown"]);
    for ((name, _), times) in solvers.iter().zip(&mut times) {
        let time = median(times);
        let unknown = time * 1e9 / (6 * size.area()) as f64;
        table.row([name.clone(), format!("{:.1}", time * 1e3), format!("{unknown:.2}")]);
    }
    Ok(format!(
        "## Solvers\n\n{size}, three planes, one backward-Euler step. All but the sweeps are exact; how far those are from the\n\
         solution is in [jacobi.md](jacobi.md).\n\n{}\n",
        table.to_markdown()
    ))
}

/// A copy on all threads.
struct Copy {
    from: Vec<u64>,
    to: Vec<u64>,
}

impl Copy {
    /// `bytes` are read and as many written.
    fn new(bytes: usize) -> Self {
        let words = bytes.div_ceil(8).max(1);
        Self { from: vec![1; words], to: vec![2; words] }
    }

    fn bytes(&self) -> usize {
        self.from.len() * 8
    }

    fn run(&mut self) -> f64 {
        use rayon::prelude::*;
        let piece = self.from.len().div_ceil(4 * rayon::current_num_threads()).max(1);
        let start = Instant::now();
        self.to
            .par_chunks_mut(piece)
            .zip(self.from.par_chunks(piece))
            .for_each(|(to, from)| to.copy_from_slice(from));
        let seconds = start.elapsed().as_secs_f64();
        black_box(&self.to);
        seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_lie_in_the_middle() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), 2.5);
    }

    #[test]
    fn copies_copy() {
        let mut copy = Copy::new(1001);
        assert!(copy.run() >= 0.0);
        assert_eq!((copy.bytes(), &copy.to), (1008, &copy.from));
    }

    #[test]
    fn a_quick_run_fills_every_table() {
        for table in [papers, sizes, circles, copies, solvers] {
            let text = table(1, true).unwrap();
            assert!(text.lines().filter(|line| line.starts_with('|')).count() > 3, "{text}");
            assert!(!text.contains("NaN"), "{text}");
        }
    }
}
