//! `pullfocus render`: frames go through the lens, one after the other, with the same buffers.

use crate::args::RenderArgs;
use crate::config::Options;
use crate::console::{Console, seconds};
use crate::failure::{Failure, Result};
use crate::frames::FrameFiles;
use crate::job::Job;
use crate::load::{self, LoadedFrame};
use crate::purpose::Purpose;
use crate::report::{Document, FrameReport, Outcome};
use crate::storage;
use crate::threads::in_pool;
use pullfocus::Renderer;
use pullfocus_core::{Cancel, Error};
use pullfocus_io::FileError;
use pullfocus_io::output::{Need, STALE_AFTER, clean_leftovers};
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
    run_options(&options, "render", Purpose::Render, cancel, &mut |job, renderer, files, console| {
        one(job, renderer, files, console, cancel)
    })
}

/// Does one frame.
pub type DoFrame<'a> =
    dyn FnMut(&Job, &mut Renderer, &FrameFiles, &mut Console) -> Result<FrameReport> + Send + 'a;

/// Runs a job over all of its frames, and tells of it.
///
/// # Errors
/// [`Failure`], which with `--json` is told on standard output too.
pub fn run_options(
    options: &Options,
    command: &'static str,
    purpose: Purpose,
    cancel: &Cancel,
    do_frame: &mut DoFrame,
) -> Result<()> {
    let start = Instant::now();
    let mut console = Console::new(&options.run);
    let mut job = match Job::new(options, purpose) {
        Ok(job) => job,
        Err(failure) => return Document::refused(command, failure, console.json),
    };
    for warning in std::mem::take(&mut job.warnings) {
        console.warn(warning);
    }
    let mut reports = Vec::new();
    let result = in_pool(job.threads, || all(&job, &mut reports, &mut console, cancel, do_frame));
    console.finish();
    let result = result.map_err(|failure| stopped(failure, &job, &reports, cancel));
    let document = Document {
        pullfocus: env!("CARGO_PKG_VERSION"),
        command,
        settings: serde_json::to_value(&job.settings).map_err(anyhow::Error::from)?,
        frames: reports,
        warnings: console.take_warnings(),
        error: result.as_ref().err().map(ToString::to_string),
        total_ms: crate::console::milliseconds(start.elapsed()),
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

fn all(
    job: &Job,
    reports: &mut Vec<FrameReport>,
    console: &mut Console,
    cancel: &Cancel,
    do_frame: &mut DoFrame,
) -> Result<()> {
    // Before any work: a name that is taken by the last frame should not cost the night.
    for files in &job.frames {
        files.need(job.existing)?;
    }
    sweep(job, console);
    let mut renderer = Renderer::new();
    console.start(job.frames.len());
    let mut camera_told = String::new();
    for files in &job.frames {
        cancel.check()?;
        let start = Instant::now();
        let mut report = if files.need(job.existing)? == Need::Finished {
            FrameReport { outcome: Outcome::Skipped, ..FrameReport::new(files.inputs(), files.outputs()) }
        } else {
            do_frame(job, &mut renderer, files, console)?
        };
        report.total_ms = crate::console::milliseconds(start.elapsed());
        let camera = report.camera_text();
        if !camera.is_empty() && camera != camera_told {
            console.say(format!("camera: {camera}"));
            camera_told = camera;
        }
        if !console.has_bar() || console.verbose {
            tell(&report, console);
        }
        console.step();
        reports.push(report);
    }
    Ok(())
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
    let cancelled = match &failure {
        Failure::Failed(error) => error.chain().any(|cause| {
            matches!(cause.downcast_ref(), Some(Error::Cancelled))
                || matches!(cause.downcast_ref(), Some(FileError::Core(Error::Cancelled)))
        }),
        _ => false,
    };
    if !(cancelled && cancel.is_cancelled()) {
        return failure;
    }
    let frames = job.frames.len();
    let way_out = if frames > 1 { "; run the same command with --resume to go on" } else { "" };
    Failure::Stopped(format!(
        "stopped: {} of {frames} frames are done and no file is half written{way_out}",
        reports.len()
    ))
}

/// Reads, renders and writes one frame.
fn one(
    job: &Job,
    renderer: &mut Renderer,
    files: &FrameFiles,
    console: &mut Console,
    cancel: &Cancel,
) -> Result<FrameReport> {
    let mut report = FrameReport::new(files.inputs(), files.outputs());
    let start = Instant::now();
    let LoadedFrame { mut scene, target, camera, distance, channels, warnings } =
        load::load(job, files, cancel)?;
    report.stage("read", start.elapsed());
    for warning in warnings {
        console.warn(warning);
    }
    report.size = Some([scene.frame.data.size.width, scene.frame.data.size.height]);
    report.channels = channels;
    report.distance = Some(distance);
    let (camera, values) = match camera {
        Some(resolved) => (Some(resolved.camera), resolved.values),
        None => (None, Vec::new()),
    };
    report.camera = values;
    let rendered = renderer
        .render(&mut scene, camera.as_ref(), &job.settings, cancel)
        .map_err(|error| Failure::Failed(anyhow::Error::from(error).context(files.name())))?;
    if rendered.depth_looks_anti_aliased() && !job.settings.repair_depth {
        console.warn(format!(
            "{}: depth looks anti-aliased ({:.0} % of its edges hold values in between); --repair-depth mends it",
            files.name(),
            100.0 * rendered.blended_depth_edges.unwrap_or_default()
        ));
    }
    report.take(&rendered);
    let start = Instant::now();
    let mut picture = std::mem::take(&mut scene.base.picture);
    storage::save(&target, &mut picture, &files.output, job.bits, job.existing)?;
    if let Some(preview) = &files.preview_png {
        storage::save_preview(&target, &picture, preview, job.existing)?;
    }
    report.stage("write", start.elapsed());
    Ok(report)
}
