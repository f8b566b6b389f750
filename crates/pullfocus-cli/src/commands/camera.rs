//! `pullfocus camera`: a shot's lens, frame by frame, for other programs.

use crate::args::CameraArgs;
use crate::console::Console;
use crate::report::{self, camera_text};
use pullfocus_core::Cancel;
use pullfocus_io::output::Existing;
use pullfocus_job::camera::CameraValue;
use pullfocus_job::config::Options;
use pullfocus_job::failure::Result;
use pullfocus_job::track::{self, Track, Writing};
use pullfocus_job::values::Label;
use serde::Serialize;

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

/// Writes the lens of every frame of a shot.
///
/// # Errors
/// [`Failure`](pullfocus_job::failure::Failure), which with `--json` is told on standard output too.
pub fn run(args: CameraArgs) -> Result<()> {
    let json = args.json;
    match write(args) {
        Err(failure) => report::Document::refused("camera", failure, json),
        done => done,
    }
}

fn write(args: CameraArgs) -> Result<()> {
    let CameraArgs { shot, output, frames, fps, sharp, lens, allow_large_files, overwrite, json } = args;
    let mut console = Console::plain(json);
    let mut options = Options { lens, ..Options::default() }.with_file(Some(&shot))?;
    if frames.is_some() {
        options.files.frames = frames.map(Label);
    }
    if allow_large_files {
        options.files.allow_large_files = Some(true);
    }
    let existing = if overwrite { Existing::Replace } else { Existing::Refuse };
    let name = shot.display().to_string();
    let writing = Writing { output: &output, fps, sharp, existing, name: &name };
    let note = |note| console.warn(format!("{note}; what it says of the camera is not used"));
    let Track { frames, first } = track::save(&options, &[shot], writing, &Cancel::new(), note)?;
    console.say(format!("camera: {}", camera_text(&first)));
    let count = if frames.len() == 1 { "1 frame".into() } else { format!("{} frames", frames.len()) };
    console.say(format!("{}: {count}, {frames}", output.display()));
    if json {
        report::print(&Document {
            pullfocus: env!("CARGO_PKG_VERSION"),
            command: "camera",
            output: output.display().to_string(),
            frames: frames.len(),
            range: frames.to_string(),
            camera: first,
            warnings: console.take_warnings(),
        })?;
    }
    Ok(())
}
