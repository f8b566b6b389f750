//! What a run tells machines: one JSON document on standard output.

use crate::console::{milliseconds, print_line};
use pullfocus_core::Report;
use pullfocus_job::camera::CameraValue;
use pullfocus_job::failure::{Failure, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// Prints a document, indented.
///
/// # Errors
/// A value that JSON cannot hold.
pub fn print(document: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string_pretty(document).map_err(anyhow::Error::from)?;
    print_line(&text);
    Ok(())
}

/// What `render` and `coc` tell.
#[derive(Debug, Serialize)]
pub struct Document {
    /// The program's version.
    pub pullfocus: &'static str,
    /// The command.
    pub command: &'static str,
    /// The device and, where `auto` took the CPU, why; none where the run ended before it was open.
    pub device: Option<String>,
    /// The settings used, presets filled in.
    pub settings: serde_json::Value,
    /// Each frame in the order in which it was done.
    pub frames: Vec<FrameReport>,
    /// What the user should know, each thing once.
    pub warnings: Vec<String>,
    /// The sentence that ended the run, if one did.
    pub error: Option<String>,
    /// Milliseconds for all of it.
    pub total_ms: f64,
}

impl Document {
    /// Tells machines of a failure before the first frame, and hands it on.
    ///
    /// # Errors
    /// Always `failure`.
    pub fn refused<T>(command: &'static str, failure: Failure, json: bool) -> Result<T> {
        if json {
            print_failure(command, &failure)?;
        }
        Err(failure)
    }
}

/// Tells machines of a failure where there is nothing else to tell.
///
/// # Errors
/// None that a sentence could cause.
pub fn print_failure(command: &'static str, failure: &Failure) -> Result<()> {
    print(&serde_json::json!({
        "pullfocus": env!("CARGO_PKG_VERSION"),
        "command": command,
        "error": failure.to_string(),
    }))
}

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// The output was written.
    Written,
    /// The output was there, and `--resume` kept it.
    Skipped,
}

/// One frame.
#[derive(Debug, Clone, Serialize)]
pub struct FrameReport {
    /// Files read, by their role: "input", "depth-file", "foreground", "behind".
    pub inputs: BTreeMap<&'static str, String>,
    /// Files written.
    pub outputs: Vec<String>,
    /// What became of it.
    pub outcome: Outcome,
    /// The device that computed it: another than the run's where that had no room for it.
    pub device: Option<String>,
    /// Width and height of the picture blurred, in pixels.
    pub size: Option<[usize; 2]>,
    /// Channels that went through the lens.
    pub channels: Vec<String>,
    /// The depth or circle-of-confusion channel used, and its file.
    pub distance: Option<String>,
    /// The camera's values and where they came from.
    pub camera: Vec<CameraValue>,
    /// Smallest and largest signed diameter in pixels.
    pub coc_range_px: Option<[f32; 2]>,
    /// Number of layers blurred.
    pub layers: Option<usize>,
    /// Number of highlights spread, where that was asked for.
    pub highlights: Option<usize>,
    /// Part of depth edges that hold in-between values.
    pub blended_depth_edges: Option<f32>,
    /// Milliseconds of each stage, reading and writing included, in order.
    pub stages: Vec<StageReport>,
    /// Milliseconds spent on the frame. The frames before and after it were in work in the same time.
    pub total_ms: f64,
}

/// One stage.
#[derive(Debug, Clone, Serialize)]
pub struct StageReport {
    /// Its name.
    pub name: String,
    /// Milliseconds.
    pub ms: f64,
}

impl StageReport {
    /// A stage that took so long.
    pub fn new(name: &str, time: Duration) -> Self {
        Self { name: name.to_owned(), ms: milliseconds(time) }
    }
}

impl FrameReport {
    /// A frame of which nothing is known yet.
    pub fn new(inputs: BTreeMap<&'static str, String>, outputs: Vec<String>) -> Self {
        Self {
            inputs,
            outputs,
            outcome: Outcome::Written,
            device: None,
            size: None,
            channels: Vec::new(),
            distance: None,
            camera: Vec::new(),
            coc_range_px: None,
            layers: None,
            highlights: None,
            blended_depth_edges: None,
            stages: Vec::new(),
            total_ms: 0.0,
        }
    }

    /// Adds a stage.
    pub fn stage(&mut self, name: &str, time: Duration) {
        self.stages.push(StageReport::new(name, time));
    }

    /// Takes what the renderer tells.
    pub fn take(&mut self, report: &Report) {
        for stage in &report.stages {
            self.stage(stage.name, stage.time);
        }
        self.coc_range_px = Some(report.coc_range);
        self.layers = Some(report.layers);
        self.highlights = report.highlights;
        self.blended_depth_edges = report.blended_depth_edges;
    }

    /// "read 12 ms, blur 40 ms".
    pub fn stages_text(&self) -> String {
        let stages: Vec<String> =
            self.stages.iter().map(|stage| format!("{} {:.1} ms", stage.name, stage.ms)).collect();
        stages.join(", ")
    }
}

/// "focus distance 2 m (--focus-distance), f-stop 2.8 (attribute aperture)".
pub fn camera_text(values: &[CameraValue]) -> String {
    let values: Vec<String> =
        values.iter().map(|value| format!("{} {} ({})", value.name, value.text, value.from)).collect();
    values.join(", ")
}
