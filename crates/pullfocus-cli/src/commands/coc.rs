//! `pullfocus coc`: the circle of confusion as a picture or as a channel.

use crate::args::CocArgs;
use crate::commands::render::run_options;
use crate::overlap::Made;
use crate::report::Document;
use pullfocus::Renderer;
use pullfocus_core::{Cancel, Plane};
use pullfocus_job::draw::Canvas;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::frames::FrameFiles;
use pullfocus_job::job::Job;
use pullfocus_job::load::LoadedFrame;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::storage;

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
    run_options(&options, Purpose::Coc, (circles, write), cancel)
}

fn circles(
    job: &Job,
    renderer: &mut Renderer,
    files: &FrameFiles,
    loaded: LoadedFrame,
    cancel: &Cancel,
) -> Result<Made> {
    let (mut made, scene, camera) = Made::begin(files, loaded);
    // What is told of a frame that was blurred.
    made.report.channels = Vec::new();
    let mut coc = Plane::default();
    let found = renderer
        .circle_of_confusion(
            &scene.frame,
            &scene.base.distance,
            camera.as_ref(),
            &job.settings,
            cancel,
            &mut coc,
        )
        .map_err(|error| Failure::Failed(anyhow::Error::from(error).context(files.name())))?;
    made.report.take(&found);
    made.report.device = Some(renderer.rendered_on().to_owned());
    made.report.layers = None;
    made.picture = scene.base.picture;
    made.coc = coc;
    Ok(made)
}

fn write(job: &Job, files: &FrameFiles, made: &mut Made) -> Result<()> {
    let (coc, [low, high]) = (&made.coc, made.report.coc_range_px.unwrap_or_default());
    let range = job.coc_range.unwrap_or_else(|| low.abs().max(high.abs()));
    // Black where there are no pixels.
    let canvas = || -> Result<Canvas> {
        Ok(Canvas::from_coc(&storage::on_display(coc, &made.frame, f32::NAN, &job.limits)?, range))
    };
    if storage::is_exr(&files.output) {
        storage::save_with_coc(&made.target, &made.frame, &made.picture, coc, &files.output, job.existing)?;
    } else {
        storage::save_canvas(&canvas()?, &files.output, job.existing)?;
    }
    if let Some(preview) = &files.preview_png {
        storage::save_canvas(&canvas()?, preview, job.existing)?;
    }
    Ok(())
}
