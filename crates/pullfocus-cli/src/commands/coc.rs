//! `pullfocus coc`: the circle of confusion as a picture or as a channel.

use crate::args::CocArgs;
use crate::commands::render::run_options;
use crate::console::Console;
use crate::draw::Canvas;
use crate::failure::{Failure, Result};
use crate::frames::FrameFiles;
use crate::job::Job;
use crate::load::{self, LoadedFrame};
use crate::purpose::Purpose;
use crate::report::{Document, FrameReport};
use crate::storage;
use pullfocus::Renderer;
use pullfocus_core::{Cancel, Plane};
use std::time::Instant;

/// Runs `coc`.
///
/// # Errors
/// [`Failure`], which with `--json` is told on standard output too.
pub fn run(args: CocArgs, cancel: &Cancel) -> Result<()> {
    let (flags, config) = args.split();
    let json = flags.run.json == Some(true);
    let options = match flags.with_file(config.as_deref()) {
        Ok(options) => options,
        Err(failure) => return Document::refused("coc", failure, json),
    };
    let mut coc = Plane::default();
    run_options(&options, "coc", Purpose::Coc, cancel, &mut |job, renderer, files, console| {
        one(job, renderer, files, console, cancel, &mut coc)
    })
}

fn one(
    job: &Job,
    renderer: &mut Renderer,
    files: &FrameFiles,
    console: &mut Console,
    cancel: &Cancel,
    coc: &mut Plane,
) -> Result<FrameReport> {
    let mut report = FrameReport::new(files.inputs(), files.outputs());
    let start = Instant::now();
    let LoadedFrame { scene, target, camera, distance, warnings, .. } = load::load(job, files, cancel)?;
    report.stage("read", start.elapsed());
    for warning in warnings {
        console.warn(warning);
    }
    report.size = Some([scene.frame.data.size.width, scene.frame.data.size.height]);
    report.distance = Some(distance);
    let (camera, values) = match camera {
        Some(resolved) => (Some(resolved.camera), resolved.values),
        None => (None, Vec::new()),
    };
    report.camera = values;
    let found = renderer
        .circle_of_confusion(&scene.frame, &scene.base.distance, camera.as_ref(), &job.settings, cancel, coc)
        .map_err(|error| Failure::Failed(anyhow::Error::from(error).context(files.name())))?;
    report.take(&found);
    report.layers = None;
    let [low, high] = found.coc_range;
    let range = job.coc_range.unwrap_or_else(|| low.abs().max(high.abs()));
    let start = Instant::now();
    // Black where there are no pixels.
    let canvas = || -> Result<Canvas> {
        Ok(Canvas::from_coc(&storage::on_display(coc, &scene.frame, f32::NAN)?, range))
    };
    if storage::is_exr(&files.output) {
        storage::save_with_coc(&target, &scene.frame, &scene.base.picture, coc, &files.output, job.existing)?;
    } else {
        storage::save_canvas(&canvas()?, &files.output, job.existing)?;
    }
    if let Some(preview) = &files.preview_png {
        storage::save_canvas(&canvas()?, preview, job.existing)?;
    }
    report.stage("write", start.elapsed());
    Ok(report)
}
