//! `pullfocus demo`: a shipped frame at three focus distances and two f-stops, and one sheet to look at.

use crate::args::DemoArgs;
use crate::console::{milliseconds, print_line, seconds};
use crate::describe::quoted;
use crate::report::{Document, FrameReport};
use anyhow::Context;
use pullfocus::Renderer;
use pullfocus_core::{Cancel, Distance, Picture, Plane, Scene};
use pullfocus_io::output::Existing;
use pullfocus_job::camera;
use pullfocus_job::config::Options;
use pullfocus_job::draw::Canvas;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::job::Job;
use pullfocus_job::load::{self, LoadedFrame};
use pullfocus_job::options::{Blur, Files, Lens};
use pullfocus_job::purpose::Purpose;
use pullfocus_job::storage;
use pullfocus_job::threads::in_pool;
use pullfocus_job::values::Number;
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The shipped frame: our own model, rendered in perfect focus, with its near objects and what is behind them.
const SHIPPED: [(&str, &[u8]); 3] = [
    ("input.exr", include_bytes!("../../demo/input.exr")),
    ("foreground.exr", include_bytes!("../../demo/foreground.exr")),
    ("behind.exr", include_bytes!("../../demo/behind.exr")),
];

/// What is in focus, and where it is in the shipped frame.
const FOCUS: [(&str, f64); 3] = [("the fence", 0.8), ("the flags", 6.0), ("the mountains", f64::INFINITY)];
const F_STOPS: [f64; 2] = [2.0, 5.6];
/// The shipped frame's camera.
const FOV_X_DEGREES: f64 = 30.0;
const SENSOR_WIDTH_MM: f64 = 36.0;

const SHEET: &str = "contact-sheet.png";

/// Runs the demonstration.
///
/// # Errors
/// A directory that cannot be written to, cancellation.
pub fn run(args: &DemoArgs, cancel: &Cancel) -> Result<()> {
    let start = Instant::now();
    let mut told = Told::default();
    let result = in_pool(args.threads, || demo(args, cancel, &mut told));
    if args.json {
        let document = Document {
            pullfocus: env!("CARGO_PKG_VERSION"),
            command: "demo",
            device: told.device,
            settings: serde_json::json!({ "preset": format!("{:?}", args.preset).to_lowercase() }),
            frames: told.frames,
            warnings: told.warnings,
            error: result.as_ref().err().map(ToString::to_string),
            total_ms: milliseconds(start.elapsed()),
        };
        crate::report::print(&document)?;
    } else if result.is_ok() {
        print_line(&format!("\nAll of it took {}. Open this first:", seconds(start.elapsed())));
        print_line(&format!("  {}", args.output.join(SHEET).display()));
        print_line("Then change something:");
        print_line(&format!("  {}", command_line(&args.output, 3.0, 1.4, "mine.png")));
    }
    result
}

/// What there is to tell of a demonstration.
#[derive(Debug, Default)]
struct Told {
    device: Option<String>,
    frames: Vec<FrameReport>,
    warnings: Vec<String>,
}

/// The command that does what one of the demo's lines did.
fn command_line(folder: &Path, focus: f64, f_stop: f64, output: &str) -> String {
    let file = |name: &str| quoted(&folder.join(name).display().to_string());
    format!(
        "pullfocus render {} --foreground {} --behind {} -o {} --focus-distance {focus} --f-stop {f_stop} --fov-x {FOV_X_DEGREES} --sensor-width {SENSOR_WIDTH_MM}",
        file("input.exr"),
        file("foreground.exr"),
        file("behind.exr"),
        file(output)
    )
}

fn demo(args: &DemoArgs, cancel: &Cancel, told: &mut Told) -> Result<()> {
    let folder = &args.output;
    let say = |line: &str| {
        if !args.json {
            print_line(line);
        }
    };
    fs::create_dir_all(folder).with_context(|| {
        format!("the directory {} cannot be made; choose another with -o", folder.display())
    })?;
    check_own(folder, args.overwrite)?;
    for (name, bytes) in SHIPPED {
        let path = folder.join(name);
        if !holds(&path, bytes) {
            storage::save_bytes(&path, bytes)?;
        }
    }
    let options = options(folder, args);
    let job = Job::new(&options, Purpose::Render)?;
    let mut renderer = Renderer::open(&job.device)?;
    renderer.set_storage(job.storage);
    say(&format!("device: {}", renderer.device_text()));
    told.device = Some(renderer.device_text());
    let begin = Instant::now();
    let LoadedFrame { scene, target, .. } = load::load(&job, &job.frames[0], cancel)?;
    let size = scene.frame.data.size;
    say(&format!(
        "A rendered frame of {size}, its near fence and what is behind it as two layers; read in {}.",
        seconds(begin.elapsed())
    ));

    let mut sheet = Sheet::new(size.width, size.height);
    let pinhole = storage::read_picture(&folder.join("input.exr"), &job.limits)?;
    sheet.add(0, 0, &Canvas::from_picture(&pinhole), "as rendered: all in focus");
    sheet.add(0, 1, &Canvas::from_inverse_depth(&inverse_depth(&scene)?), "depth: near is bright");
    sheet.add(0, 2, &Canvas::from_picture(&near(&scene)), "the near layer alone");

    for (column, (what, focus)) in FOCUS.into_iter().enumerate() {
        for (row, f_stop) in F_STOPS.into_iter().enumerate() {
            cancel.check()?;
            let start = Instant::now();
            let lens = Lens {
                focus_distance: Some(Number(focus)),
                f_stop: Some(Number(f_stop)),
                ..options.lens.clone()
            };
            let resolved = camera::resolve(&lens, &camera::FileCamera::default(), "the shipped frame")?;
            let mut scene = scene.clone();
            let place = place(focus);
            if row == 0 {
                let coc = circles(&mut renderer, &scene, &resolved.camera, &job, cancel)?;
                let most = coc.data().iter().fold(0.0f32, |most, c| most.max(c.abs()));
                let label = format!("circle of confusion, focus {place}, f/{f_stop}");
                sheet.add(column + 1, 0, &Canvas::from_coc(&coc, most), &label);
            }
            let rendered = renderer.render(&mut scene, Some(&resolved.camera), &job.settings, cancel)?;
            if let Some(sentence) = renderer.fell_back().filter(|&it| told.warnings.iter().all(|w| w != it)) {
                let _ = writeln!(std::io::stderr(), "pullfocus: warning: {sentence}");
                told.warnings.push(sentence.to_owned());
            }
            let outputs = results(focus, f_stop).map(|name| folder.join(name));
            let inputs = SHIPPED.map(|(file, _)| folder.join(file).display().to_string());
            let mut report = FrameReport::new(
                BTreeMap::from_iter(["input", "foreground", "behind"].into_iter().zip(inputs)),
                outputs.iter().map(|path| path.display().to_string()).collect(),
            );
            report.take(&rendered);
            report.device = Some(renderer.rendered_on().to_owned());
            report.camera = resolved.values;
            report.size = Some([size.width, size.height]);
            let writing = Instant::now();
            let mut picture = std::mem::take(&mut scene.base.picture);
            storage::save(&target, &mut picture, &outputs[0], None, Existing::Replace)?;
            storage::save_preview(&target, &picture, &outputs[1], Existing::Replace)?;
            report.stage("write", writing.elapsed());
            report.total_ms = milliseconds(start.elapsed());
            let [low, high] = rendered.coc_range;
            say(&format!(
                "\nFocus on {what} ({place}) at f/{f_stop}: circles of {low:.1} to {high:.1} px behind the fence"
            ));
            say(&format!("  {}", report.stages_text()));
            say(&format!("  wrote {} and .png", outputs[0].display()));
            sheet.add(
                column + 1,
                row + 1,
                &Canvas::from_picture(&picture),
                &format!("focus on {what}, {place}, f/{f_stop}"),
            );
            told.frames.push(report);
        }
    }
    storage::save_canvas(&sheet.canvas, &folder.join(SHEET), Existing::Replace)?;
    Ok(())
}

/// Where the focus is, in words.
fn place(focus: f64) -> String {
    if focus.is_infinite() { "infinity".to_owned() } else { format!("{focus} m") }
}

/// The names of the files that one setting of the lens is written to: all that it holds, and to look at.
fn results(focus: f64, f_stop: f64) -> [String; 2] {
    let stem = format!("focus-{}-f{f_stop}", place(focus).replace(' ', ""));
    ["exr", "png"].map(|ending| format!("{stem}.{ending}"))
}

/// Refuses a folder where files of the demo's names are somebody else's. Results are the demo's own beside its frame.
fn check_own(folder: &Path, overwrite: bool) -> Result<()> {
    if overwrite {
        return Ok(());
    }
    let is_there = |path: &PathBuf| path.symlink_metadata().is_ok();
    let shipped = SHIPPED
        .iter()
        .map(|(name, bytes)| (folder.join(name), *bytes))
        .filter(|(path, bytes)| is_there(path) && !holds(path, bytes))
        .map(|(path, _)| path);
    let (frame, bytes) = SHIPPED[0];
    let earlier = holds(&folder.join(frame), bytes);
    let lenses = FOCUS.iter().flat_map(|(_, focus)| F_STOPS.map(|f_stop| results(*focus, f_stop)));
    let written = lenses
        .flatten()
        .chain([SHEET.to_owned()])
        .map(|name| folder.join(name))
        .filter(|path| !earlier && is_there(path));
    match shipped.chain(written).next() {
        None => Ok(()),
        Some(path) => Err(Failure::failed(format!(
            "{}: exists already and is not the demo's own; choose another directory with -o, or --overwrite replaces it",
            path.display()
        ))),
    }
}

/// Whether a file has just these bytes.
fn holds(path: &Path, bytes: &[u8]) -> bool {
    fs::metadata(path).is_ok_and(|meta| meta.is_file() && meta.len() == bytes.len() as u64)
        && fs::read(path).is_ok_and(|found| found == bytes)
}

fn options(folder: &Path, args: &DemoArgs) -> Options {
    let file = |name: &str| Some(folder.join(name));
    Options {
        files: Files {
            input: Some(vec![folder.join("input.exr")]),
            foreground: file("foreground.exr"),
            behind: file("behind.exr"),
            output: file("result.exr"),
            overwrite: Some(true),
            ..Files::default()
        },
        lens: Lens {
            focus_distance: Some(Number(FOCUS[0].1)),
            f_stop: Some(Number(F_STOPS[0])),
            fov_x: Some(Number(FOV_X_DEGREES)),
            sensor_width: Some(Number(SENSOR_WIDTH_MM)),
            ..Lens::default()
        },
        blur: Blur { preset: Some(args.preset), device: Some(args.device.clone()), ..Blur::default() },
        ..Options::default()
    }
}

/// The picture's circle of confusion: the near layer's where that covers more than half.
fn circles(
    renderer: &mut Renderer,
    scene: &Scene,
    camera: &pullfocus_core::Camera,
    job: &Job,
    cancel: &Cancel,
) -> Result<Plane> {
    let mut coc = Plane::default();
    renderer.circle_of_confusion(
        &scene.frame,
        &scene.base.distance,
        Some(camera),
        &job.settings,
        cancel,
        &mut coc,
    )?;
    if let Some(foreground) = &scene.foreground {
        let mut near = Plane::default();
        renderer.circle_of_confusion(
            &scene.frame,
            &foreground.distance,
            Some(camera),
            &job.settings,
            cancel,
            &mut near,
        )?;
        if let Some(alpha) = &foreground.picture.alpha {
            for ((coc, near), alpha) in coc.data_mut().iter_mut().zip(near.data()).zip(alpha.data()) {
                if *alpha > 0.5 {
                    *coc = *near;
                }
            }
        }
    }
    Ok(coc)
}

/// 1/z of what is seen.
fn inverse_depth(scene: &Scene) -> Result<Plane> {
    let inverse = |distance: &Distance, i: usize| match distance {
        Distance::Depth { plane, decoding } => {
            (1.0 / decoding.to_metres(plane.data()[i], || [0.0; 2])) as f32
        }
        Distance::Coc(_) => 0.0,
    };
    let mut i = 0;
    let plane = Plane::from_fn(scene.frame.data.size, |_, _| {
        let far = inverse(&scene.base.distance, i);
        let near = scene.foreground.as_ref().and_then(|foreground| {
            let covers = foreground.picture.alpha.as_ref().is_some_and(|alpha| alpha.data()[i] > 0.5);
            covers.then(|| inverse(&foreground.distance, i))
        });
        i += 1;
        near.unwrap_or(far)
    })?;
    Ok(plane)
}

fn near(scene: &Scene) -> Picture {
    scene.foreground.as_ref().map(|foreground| foreground.picture.clone()).unwrap_or_default()
}

/// Pictures of one size in four columns and three rows, each with a line of text above it.
struct Sheet {
    canvas: Canvas,
    width: usize,
    height: usize,
}

impl Sheet {
    const GAP: usize = 8;
    const LABEL: usize = 18;

    fn new(width: usize, height: usize) -> Self {
        let canvas = Canvas::new(
            4 * (width + Self::GAP) + Self::GAP,
            3 * (height + Self::LABEL + Self::GAP) + Self::GAP,
            [32, 32, 34],
        );
        Self { canvas, width, height }
    }

    fn add(&mut self, column: usize, row: usize, picture: &Canvas, label: &str) {
        let x = Self::GAP + column * (self.width + Self::GAP);
        let y = Self::GAP + row * (self.height + Self::LABEL + Self::GAP);
        self.canvas.text(label, x, y + 5, 1, [225, 225, 220]);
        self.canvas.put(picture, x, y + Self::LABEL);
    }
}
