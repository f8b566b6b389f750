//! `pullfocus render`: frames go through the lens, one after the other, with the same buffers. Here is also what
//! `render` and `coc` share: a run over all frames, and what is told of it.

use crate::args::RenderArgs;
use crate::console::{Console, milliseconds, seconds};
use crate::overlap::{self, Arrival, Compute, Made};
use crate::report::{Document, FrameReport, Outcome, camera_text};
use pullfocus::Renderer;
use pullfocus_core::Cancel;
use pullfocus_io::output::{STALE_AFTER, clean_leftovers};
use pullfocus_job::config::Options;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::frames::FrameFiles;
use pullfocus_job::job::Job;
use pullfocus_job::load::LoadedFrame;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::storage;
use pullfocus_job::threads::start_pool;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

/// Runs `render`.
///
/// # Errors
/// [`Failure`], which with `--json` is told on standard output too.
pub fn run(args: RenderArgs, cancel: &Cancel) -> Result<()> {
    let (flags, config) = args.split();
    let json = flags.run.json == Some(true);
    let options = match flags.with_file(config.as_deref()) {
        Ok(options) => options,
        Err(failure) => return Document::refused("render", failure, json),
    };
    run_options(&options, Purpose::Render, (blur, write), cancel)
}

/// Writes what was computed.
pub type Write = fn(&Job, &FrameFiles, &mut Made) -> Result<()>;

/// Runs a job over all of its frames, and tells of it.
///
/// # Errors
/// [`Failure`], which with `--json` is told on standard output too.
pub fn run_options(
    options: &Options,
    purpose: Purpose,
    (compute, write): (Compute, Write),
    cancel: &Cancel,
) -> Result<()> {
    let start = Instant::now();
    let command = purpose.name();
    let mut console = Console::new(&options.run);
    let mut job = match Job::new(options, purpose) {
        Ok(job) => job,
        Err(failure) => return Document::refused(command, failure, console.json),
    };
    for warning in std::mem::take(&mut job.warnings) {
        console.warn(warning);
    }
    let mut told = Told::default();
    let result = start_pool(job.threads)
        .and_then(|()| all(&job, purpose, (compute, write), &mut told, &mut console, cancel));
    console.finish();
    let Told { device, frames: reports, .. } = told;
    let result = result.map_err(|failure| stopped(failure, &job, &reports, cancel));
    let document = Document {
        pullfocus: env!("CARGO_PKG_VERSION"),
        command,
        device,
        settings: serde_json::to_value(&job.settings).map_err(anyhow::Error::from)?,
        frames: reports,
        warnings: console.take_warnings(),
        error: result.as_ref().err().map(ToString::to_string),
        total_ms: milliseconds(start.elapsed()),
    };
    if console.json {
        crate::report::print(&document)?;
    } else if document.frames.len() > 1 {
        let skipped = document.frames.iter().filter(|frame| frame.outcome == Outcome::Skipped).count();
        let kept = if skipped > 0 { format!(", {skipped} kept as they were") } else { String::new() };
        console.say(format!(
            "{} of {} frames done{kept}, {}",
            document.frames.len(),
            job.frames.len(),
            seconds(start.elapsed())
        ));
    }
    result
}

/// What was told so far.
#[derive(Debug, Default)]
struct Told {
    device: Option<String>,
    camera: String,
    frames: Vec<FrameReport>,
}

fn all(
    job: &Job,
    purpose: Purpose,
    (compute, write): (Compute, Write),
    told: &mut Told,
    console: &mut Console,
    cancel: &Cancel,
) -> Result<()> {
    // Before any work: a name that is taken by the last frame should not cost the night.
    for files in &job.frames {
        files.need(job.existing)?;
    }
    sweep(job, console);
    console.start(job.frames.len());
    overlap::run(job, compute, cancel, &mut |files, arrival| {
        let report = match arrival {
            Arrival::Device(device) => {
                if purpose == Purpose::Render {
                    console.say(format!("device: {device}"));
                }
                told.device = Some(device);
                return Ok(());
            }
            Arrival::Kept(report) => *report,
            Arrival::Made(mut made, time) => {
                std::mem::take(&mut made.warnings).into_iter().for_each(|warning| console.warn(warning));
                cancel.check()?;
                let start = Instant::now();
                write(job, files, &mut made)?;
                made.report.stage("write", start.elapsed());
                made.report.total_ms = milliseconds(time + start.elapsed());
                made.report
            }
        };
        let camera = camera_text(&report.camera);
        if !camera.is_empty() && camera != told.camera {
            console.say(format!("camera: {camera}"));
            told.camera = camera;
        }
        if !console.has_bar() || console.verbose {
            tell(&report, console);
        }
        console.step();
        told.frames.push(report);
        Ok(())
    })
}

/// Removes what killed runs have left beside the outputs.
fn sweep(job: &Job, console: &Console) {
    let folders: BTreeSet<&Path> = job.frames.iter().filter_map(|files| files.output.parent()).collect();
    for folder in folders {
        // What cannot be listed or removed stays; it is in nobody's way.
        for leftover in clean_leftovers(folder, STALE_AFTER).unwrap_or_default() {
            console.detail(format!("removed {}, left by a run that was killed", leftover.display()));
        }
    }
}

fn tell(report: &FrameReport, console: &Console) {
    let outputs = report.outputs.join(", ");
    if report.outcome == Outcome::Skipped {
        console.say(format!("{outputs}: is there already, kept"));
        return;
    }
    let mut facts = Vec::new();
    if let Some([width, height]) = report.size {
        facts.push(format!("{width} x {height}"));
    }
    if let Some([low, high]) = report.coc_range_px {
        facts.push(format!("circle of confusion {low:.1} to {high:.1} px"));
    }
    if let Some(layers) = report.layers {
        facts.push(if layers == 1 { "1 layer".into() } else { format!("{layers} layers") });
    }
    if let Some(count) = report.highlights {
        facts.push(if count == 1 { "1 highlight".into() } else { format!("{count} highlights") });
    }
    facts.push(format!("{:.0} ms", report.total_ms));
    console.say(format!("{outputs}: {}", facts.join(", ")));
    if let Some(distance) = &report.distance {
        console.detail(format!("  distance: {distance}"));
    }
    if !report.channels.is_empty() {
        console.detail(format!("  channels: {}", report.channels.join(", ")));
    }
    console.detail(format!("  stages: {}", report.stages_text()));
}

/// A cancelled run says how far it came.
fn stopped(failure: Failure, job: &Job, reports: &[FrameReport], cancel: &Cancel) -> Failure {
    if !(failure.is_cancelled() && cancel.is_cancelled()) {
        return failure;
    }
    let frames = job.frames.len();
    let way_out = if frames > 1 { "; run the same command with --resume to go on" } else { "" };
    Failure::Stopped(format!(
        "stopped: {} of {frames} frames are done and no file is half written{way_out}",
        reports.len()
    ))
}

/// Blurs one frame.
fn blur(
    job: &Job,
    renderer: &mut Renderer,
    files: &FrameFiles,
    loaded: LoadedFrame,
    cancel: &Cancel,
) -> Result<Made> {
    let (mut made, mut scene, camera) = Made::begin(files, loaded);
    let rendered = renderer
        .render(&mut scene, camera.as_ref(), &job.settings, cancel)
        .map_err(|error| Failure::Failed(anyhow::Error::from(error).context(files.name())))?;
    if rendered.depth_looks_anti_aliased() && !job.settings.repair_depth {
        made.warnings.push(format!(
            "{}: depth looks anti-aliased ({:.0} % of its edges hold values in between); --repair-depth mends it",
            files.name(),
            100.0 * rendered.blended_depth_edges.unwrap_or_default()
        ));
    }
    if !storage::is_exr(&files.output) || files.preview_png.is_some() {
        made.warnings.extend(made.target.left_out());
    }
    made.warnings.extend(renderer.fell_back().map(str::to_owned));
    made.report.take(&rendered);
    made.report.device = Some(renderer.rendered_on().to_owned());
    made.picture = scene.base.picture;
    Ok(made)
}

fn write(job: &Job, files: &FrameFiles, made: &mut Made) -> Result<()> {
    storage::save(&made.target, &mut made.picture, &files.output, job.bits, job.existing)?;
    if let Some(preview) = &files.preview_png {
        storage::save_preview(&made.target, &made.picture, preview, job.existing)?;
    }
    Ok(())
}
