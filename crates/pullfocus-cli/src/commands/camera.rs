//! `pullfocus camera`: a shot's lens, frame by frame, for other programs.

use crate::args::CameraArgs;
use crate::console::Console;
use crate::report::{self, camera_text};
use pullfocus_io::FileError;
use pullfocus_io::camera_file::{CameraSample, write_csv, write_usda};
use pullfocus_io::output::{Existing, PendingFile, check_target};
use pullfocus_job::camera::{self, CameraValue};
use pullfocus_job::config::Options;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::track;
use pullfocus_job::values::Label;
use serde::Serialize;
use std::path::Path;

#[derive(Debug, Serialize)]
struct Document {
    pullfocus: &'static str,
    command: &'static str,
    output: String,
    /// How many, and their numbers as ranges.
    frames: usize,
    range: String,
    /// The first frame's values and where they came from.
    camera: Vec<CameraValue>,
    warnings: Vec<String>,
}

/// What the output's ending asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Csv,
    Usda,
}

/// Writes the lens of every frame of a shot.
///
/// # Errors
/// [`Failure`], which with `--json` is told on standard output too.
pub fn run(args: CameraArgs) -> Result<()> {
    let json = args.json;
    match write(args) {
        Err(failure) => report::Document::refused("camera", failure, json),
        done => done,
    }
}

fn form(output: &Path) -> Result<Form> {
    match output.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("csv") => Ok(Form::Csv),
        Some("usda") => Ok(Form::Usda),
        _ => Err(Failure::usage(format!(
            "{}: a camera is written as .csv (a table) or .usda (a USD layer); end the name so",
            output.display()
        ))),
    }
}

fn write(args: CameraArgs) -> Result<()> {
    let CameraArgs { shot, output, frames, fps, sharp, lens, overwrite, json } = args;
    let form = form(&output)?;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(Failure::usage(format!("--fps is {fps}; it must be a number above 0")));
    }
    let existing = if overwrite { Existing::Replace } else { Existing::Refuse };
    let mut console = Console::plain(json);
    let mut options = Options { lens, ..Options::default() }.with_file(Some(&shot))?;
    if frames.is_some() {
        options.files.frames = frames.map(Label);
    }
    camera::check(&options.lens)?;
    check_target(&output, [&shot], existing)?;
    let frames = track::frames(&options)?;
    let seen = track::look(&options, frames.iter().next().unwrap_or_default())?;
    for note in &seen.notes {
        console.warn(format!("{note}; what it says of the camera is not used"));
    }
    let name = shot.display().to_string();
    let tracked: Vec<(CameraSample, Vec<CameraValue>)> = frames
        .iter()
        .map(|frame| track::sample(&options, &seen, frame, sharp, &name))
        .collect::<Result<_>>()?;
    let (samples, mut values): (Vec<_>, Vec<_>) = tracked.into_iter().unzip();

    let mut pending = PendingFile::create(&output, existing)?;
    match form {
        Form::Csv => write_csv(&samples, &mut pending),
        Form::Usda => {
            let height = samples.first().and_then(|first| track::sensor_height_mm(first, &seen));
            write_usda(&samples, fps, height, &mut pending)
        }
    }
    .map_err(|error| FileError::io(&output, "write", error))?;
    pending.commit()?;

    let first = values.drain(..).next().unwrap_or_default();
    console.say(format!("camera: {}", camera_text(&first)));
    let count = if samples.len() == 1 { "1 frame".into() } else { format!("{} frames", samples.len()) };
    console.say(format!("{}: {count}, {frames}", output.display()));
    if json {
        report::print(&Document {
            pullfocus: env!("CARGO_PKG_VERSION"),
            command: "camera",
            output: output.display().to_string(),
            frames: samples.len(),
            range: frames.to_string(),
            camera: first,
            warnings: console.take_warnings(),
        })?;
    }
    Ok(())
}
