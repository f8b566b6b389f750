//! The third paper's figures 8 to 12 again: what each method costs beside naive spreading, and how far it is from it.

mod cases;

use crate::difference::Difference;
use crate::panels::Panel;
use crate::place::{Output, provenance};
use crate::table::Table;
use anyhow::Result;
use cases::{Case, Pictures};
use clap::Args;
use pullfocus::tensor::{Gathering, Spreading};
use pullfocus::{
    Cancel, Distance, Element, Frame, Layering, Method, Mipmap, Picture, Plane, Quality, Renderer, Scene,
    Settings, Size, Tensor,
};
use pullfocus_metrics::{display, flip, psnr};
use std::time::Instant;

/// Options of `spreading`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    pictures: Pictures,
}

/// One method to compare with naive spreading.
struct Row {
    name: &'static str,
    settings: Settings,
    /// Figures of the third paper and how many times faster than naive spreading it is there.
    paper: &'static [(usize, f64)],
}

fn with(method: Method) -> Settings {
    Settings { method, layering: Layering::Single, ..Settings::default() }
}

/// The methods, each a line.
fn rows() -> Vec<Row> {
    let row = |name, settings, paper| Row { name, settings, paper };
    let pyramid = with(Method::Pyramid);
    let naive = Tensor { gather: Gathering::Naive, spread: Spreading::Naive, ..Tensor::default() };
    vec![
        row("square", with(Method::Square), &[(8, 269.3), (9, 227.5), (10, 73.0), (11, 19.9)]),
        row("pyramid", pyramid.clone(), &[(8, 12.1), (9, 8.5), (10, 3.3), (11, 1.5)]),
        row("pyramid, one level", Settings { mipmap: Mipmap::Nearest, ..pyramid.clone() }, &[]),
        row("pyramid, fine", Settings { quality: Quality::Fine, ..pyramid }, &[]),
        row("tensor, naive steps", Settings { tensor: naive, ..with(Method::Tensor) }, &[(12, 5.1)]),
        row("tensor, pyramid steps", with(Method::Tensor), &[(12, 5.5)]),
    ]
}

/// What one method came to on one picture.
struct Entry {
    seconds: f64,
    psnr: f64,
    flip: f64,
    /// Part of the values that are within 1 % of naive spreading's.
    within: f64,
}

/// One picture, every method.
struct Outcome {
    case: Case,
    naive: f64,
    entries: Vec<Entry>,
}

/// An error of this part of a value, or of 0.05, is allowed.
const BOUND: f64 = 0.01;

/// Seconds of processor time that all threads of this program have had, from the kernel; the wall clock's where it does not say.
pub fn spent(since: Instant) -> f64 {
    let read = || -> Option<f64> {
        let mut nanoseconds = 0u64;
        for task in std::fs::read_dir("/proc/self/task").ok()? {
            // A thread that has just ended has no such file.
            let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).unwrap_or_default();
            nanoseconds += text.split(' ').next().and_then(|n| n.parse::<u64>().ok()).unwrap_or(0);
        }
        (nanoseconds > 0).then_some(nanoseconds as f64 * 1e-9)
    };
    read().unwrap_or_else(|| since.elapsed().as_secs_f64())
}

/// The kernel counts a running thread's time at its ticks: less than this, in seconds, is not told apart.
const TICK: f64 = 4e-3;

/// A blurred picture, and the least processor time of some runs in seconds: other programs on the machine do not count.
fn blurred(case: &Case, settings: &Settings, renderer: &mut Renderer, runs: usize) -> Result<(Picture, f64)> {
    let element = Element { picture: case.picture.clone(), distance: Distance::Coc(case.circle.clone()) };
    let scene = Scene::new(Frame::full(case.circle.size()), element);
    let (mut picture, mut seconds) = (Picture::default(), f64::INFINITY);
    let start = Instant::now();
    for _ in 0..runs {
        let mut scene = scene.clone();
        let before = spent(start);
        renderer.render(&mut scene, None, settings, &Cancel::new())?;
        seconds = seconds.min((spent(start) - before).max(TICK));
        picture = scene.base.picture;
    }
    Ok((picture, seconds))
}

/// Naive, then every row; pictures of the middle third go beside the results.
fn compare(case: Case, rows: &[Row], options: &Options) -> Result<Outcome> {
    let runs = if options.output.quick { 1 } else { 4 };
    let mut renderer = Renderer::new();
    let (naive, seconds) = blurred(&case, &with(Method::Naive), &mut renderer, 1)?;
    let shown = display(&naive)?;
    let Size { width, height } = case.circle.size();
    let crop = [width / 3, height / 3, width / 3, height / 3];
    let panel = |picture: &Picture| -> Result<Panel> { Ok(Panel::of(picture)?.crop(crop)) };
    let (mut entries, mut panels) = (vec![], vec![panel(&case.picture)?]);
    for row in rows {
        let (picture, seconds) = blurred(&case, &row.settings, &mut renderer, runs)?;
        let difference = Difference::between(&picture, &naive, BOUND, 0.0);
        let own = display(&picture)?;
        entries.push(Entry {
            seconds,
            psnr: psnr(&shown, &own)?,
            flip: flip(&shown, &own)?.mean,
            within: 1.0 - difference.above as f64 / difference.count.max(1) as f64,
        });
        if matches!(row.name, "square" | "pyramid") || row.name.starts_with("tensor") {
            panels.push(panel(&picture)?);
        }
    }
    panels.push(panel(&naive)?);
    if case.shown() {
        options.output.write_bytes(&picture_name(&case.name), &Panel::grid(&panels, 4)?.to_jpeg()?)?;
    }
    Ok(Outcome { case, naive: seconds, entries })
}

fn picture_name(case: &str) -> String {
    let name: String = case.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    format!("pictures/spreading/{name}.jpg")
}

/// Circles, in pixels, that the cost is measured for.
const CIRCLES: [f32; 9] = [5.0, 7.0, 10.0, 14.0, 20.0, 50.0, 100.0, 200.0, 500.0];

/// Nanoseconds a pixel on one thread for even circles and for one that grows from 0 to the largest across the picture.
fn costs(rows: &[Row], quick: bool) -> Result<Table> {
    let size = if quick { Size::new(96, 54) } else { Size::new(960, 540) };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut head = vec!["method".to_owned()];
    head.extend(CIRCLES.iter().map(|c| format!("{c} px")));
    head.extend(["0 to 500 px".to_owned(), "most over least, 5 to 500".to_owned()]);
    let mut table = Table::new(head);
    let color = Plane::from_fn(size, |x, y| ((x * 3) ^ (y * 5)) as f32 % 17.0 / 17.0)?;
    let growing = Plane::from_fn(size, |x, _| x as f32 * 500.0 / (size.width - 1) as f32)?;
    for row in rows {
        let mut renderer = Renderer::new();
        let mut cost = |circle: Plane| -> Result<f64> {
            let picture = Picture::opaque(vec![color.clone(); 3]);
            let case = Case { name: String::new(), picture, circle, figures: &[] };
            let runs = if quick { 1 } else { 6 };
            let (_, seconds) = one.install(|| blurred(&case, &row.settings, &mut renderer, runs))?;
            Ok(seconds * 1e9 / size.area() as f64)
        };
        let mut all = vec![];
        for circle in CIRCLES {
            all.push(cost(Plane::filled(size, circle)?)?);
        }
        let (least, most) = all.iter().fold((f64::INFINITY, 0.0), |(a, b), v| (v.min(a), v.max(b)));
        all.push(cost(growing.clone())?);
        let cells = all.iter().map(|ns| format!("{ns:.0}"));
        table.row([row.name.to_owned()].into_iter().chain(cells).chain([format!("{:.2}", most / least)]));
    }
    Ok(table)
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let rows = rows();
    let mut outcomes = vec![];
    for case in options.pictures.read(options.output.quick)? {
        eprintln!("{}, mean deviation {:.1} px", case.name, case.mean_deviation());
        outcomes.push(compare(case, &rows, options)?);
    }
    let costs = costs(&rows, options.output.quick)?;
    options.output.write("results/spreading.md", &report(&outcomes, &rows, &costs))
}

fn report(outcomes: &[Outcome], rows: &[Row], costs: &Table) -> String {
    let mut paper = Table::new([
        "picture",
        "figures",
        "mean deviation, px",
        "method",
        "times as fast as naive",
        "in the paper",
    ]);
    let mut all = Table::new([
        "picture",
        "range",
        "mean deviation, px",
        "method",
        "seconds",
        "times as fast as naive",
        "PSNR, dB",
        "FLIP",
        "values within 1 %",
    ]);
    for Outcome { case, naive, entries } in outcomes {
        let range = if case.hdr() { "HDR" } else { "LDR" };
        let head = [case.name.clone(), range.to_owned(), format!("{:.1}", case.mean_deviation())];
        let line = |cells: [String; 6]| head.clone().into_iter().chain(cells);
        let none = String::new;
        all.row(line(["naive".into(), format!("{naive:.2}"), none(), none(), none(), none()]));
        for (row, entry) in rows.iter().zip(entries) {
            let ratio = naive / entry.seconds;
            all.row(line([
                row.name.to_owned(),
                format!("{:.3}", entry.seconds),
                format!("{ratio:.1}"),
                format!("{:.1}", entry.psnr),
                format!("{:.4}", entry.flip),
                format!("{:.3} %", 100.0 * entry.within),
            ]));
            for (figure, theirs) in row.paper.iter().filter(|(figure, _)| case.figures.contains(figure)) {
                paper.row([
                    case.name.clone(),
                    figure.to_string(),
                    format!("{:.1}", case.mean_deviation()),
                    row.name.to_owned(),
                    format!("{ratio:.1}"),
                    format!("{theirs:.1}"),
                ]);
            }
        }
    }
    let mut text = format!(
        "# Spreading\n\n{}\n\n\
         Figures 8 to 12 of the third paper again, with pictures of ours: seconds of processor time of all threads together and\n\
         ratios to naive spreading of Gaussians; one layer, a warm renderer (naive once, the others the best of four); PSNR and FLIP to naive spreading, on sRGB clipped to 0..1; and how many values are\n\
         within 0.01 max(|b|, 0.05) of naive spreading's b, unclipped. The paper does not say how large its pictures and blurs are, so its ratios are beside ours\n\
         for their order of magnitude: naive spreading costs what its blur's area does, the others do not.\n\n\
         ## Beside the paper\n\n{}\n",
        provenance(),
        paper.to_markdown(),
    );
    text += &format!("## Targets\n\n{}\n", targets(outcomes, rows));
    text += &format!(
        "## Cost by the size of the blur\n\nNanoseconds a pixel of three planes, 960 x 540, one thread, processor time (which the kernel counts in steps of 4 ms, 8 ns a pixel here), the best of six.\n\n{}\n",
        costs.to_markdown()
    );
    text += &format!("## All pictures\n\n{}\n", all.to_markdown());
    text += "## Side by side\n\nThe middle third: input, square, pyramid, naive.\n\n";
    for outcome in outcomes.iter().filter(|outcome| outcome.case.shown()) {
        let name = &outcome.case.name;
        text +=
            &format!("{name}\n\n<img src=\"../{}\" alt=\"{name}\" width=\"100%\">\n\n", picture_name(name));
    }
    text
}

/// What was aimed at and what was reached, for the pyramid.
fn targets(outcomes: &[Outcome], rows: &[Row]) -> String {
    let at = |name: &str| rows.iter().position(|row| row.name == name);
    let (Some(pyramid), Some(square)) = (at("pyramid"), at("square")) else { return String::new() };
    let mut table = Table::new(["the pyramid", "aimed at", "reached"]);
    if let Some(wide) = outcomes.iter().find(|outcome| outcome.case.figures.contains(&8)) {
        let [seconds, squares] = [pyramid, square].map(|i| wide.entries[i].seconds);
        let name = "times as fast as naive at a mean deviation of 20 px";
        table.row([name.to_owned(), "100".to_owned(), format!("{:.0}", wide.naive / seconds)]);
        let name = "time over square's there";
        table.row([name.to_owned(), "3 at most".to_owned(), format!("{:.2}", seconds / squares)]);
    }
    let least = |of: fn(&Entry) -> f64, hdr: bool| {
        let list = outcomes.iter().filter(|outcome| !hdr || outcome.case.hdr());
        list.map(|outcome| of(&outcome.entries[pyramid])).fold(f64::INFINITY, f64::min)
    };
    let psnr = least(|entry| entry.psnr, false);
    table.row(["least PSNR of all pictures", "50 dB", &format!("{psnr:.1} dB")]);
    let within = 100.0 * least(|entry| entry.within, true);
    table.row(["least part of HDR values within 1 %", "99.9 %", &format!("{within:.3} %")]);
    table.to_markdown()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_has_every_method_and_the_paper_s_ratios() {
        let folder = tempfile::tempdir().unwrap();
        let output = Output { out: Some(folder.path().to_path_buf()), quick: true };
        run(&Options { output, pictures: Pictures::default() }).unwrap();
        let text = std::fs::read_to_string(folder.path().join("results/spreading.md")).unwrap();
        for row in rows() {
            assert!(text.contains(row.name), "{}", row.name);
            assert!(row.paper.iter().all(|(_, ratio)| text.contains(&format!("| {ratio:.1} |"))));
        }
        assert!(text.contains("| 100 |") && !text.contains("NaN") && !text.contains("inf |"), "{text}");
        assert!(folder.path().join(picture_name("made, LDR, 96 x 72")).is_file());
    }

    #[test]
    fn every_row_s_settings_are_legal() {
        for row in rows() {
            row.settings.check().unwrap();
        }
    }
}
