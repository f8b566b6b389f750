//! What the user sees while the program runs: words on standard output, warnings and progress on standard error.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use pullfocus_job::options::Run;
use std::io::{IsTerminal, Write};
use std::time::Duration;

/// Where words go.
#[derive(Debug)]
pub struct Console {
    /// One JSON document on standard output and nothing else there.
    pub json: bool,
    /// Stage timings too.
    pub verbose: bool,
    /// Nothing but errors.
    pub quiet: bool,
    bar: Option<ProgressBar>,
    warnings: Vec<String>,
}

impl Console {
    /// A console as the options ask for it.
    pub fn new(run: &Run) -> Self {
        Self {
            json: run.json == Some(true),
            verbose: run.verbose == Some(true),
            quiet: run.quiet == Some(true),
            bar: None,
            warnings: Vec::new(),
        }
    }

    /// A console for commands that only know text and JSON.
    pub fn plain(json: bool) -> Self {
        Self { json, verbose: false, quiet: false, bar: None, warnings: Vec::new() }
    }

    /// Starts a progress bar over this many frames; none for a single frame, for machines, off a terminal.
    pub fn start(&mut self, frames: usize) {
        if frames < 2 || self.json || self.quiet || !std::io::stderr().is_terminal() {
            return;
        }
        let bar = ProgressBar::with_draw_target(Some(frames as u64), ProgressDrawTarget::stderr());
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos} of {len} frames, {elapsed} gone, {eta} left  {msg}")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(250));
        self.bar = Some(bar);
    }

    /// Whether a progress bar is shown.
    pub fn has_bar(&self) -> bool {
        self.bar.is_some()
    }

    /// One frame of the sequence is done.
    pub fn step(&self) {
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
    }

    /// Takes the progress bar away.
    pub fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }

    fn above_the_bar(&self, write: impl FnOnce()) {
        match &self.bar {
            Some(bar) => bar.suspend(write),
            None => write(),
        }
    }

    /// A line for people, on standard output.
    pub fn say(&self, line: impl AsRef<str>) {
        if self.json || self.quiet {
            return;
        }
        self.above_the_bar(|| print_line(line.as_ref()));
    }

    /// A line for people who asked for more.
    pub fn detail(&self, line: impl AsRef<str>) {
        if self.verbose {
            self.say(line);
        }
    }

    /// Something that the user should know; said once however often it happens.
    pub fn warn(&mut self, line: impl Into<String>) {
        let line = line.into();
        if self.warnings.contains(&line) {
            return;
        }
        if !self.quiet {
            self.above_the_bar(|| {
                let _ = writeln!(std::io::stderr(), "pullfocus: warning: {line}");
            });
        }
        self.warnings.push(line);
    }

    /// All warnings so far, and forgets them.
    pub fn take_warnings(&mut self) -> Vec<String> {
        std::mem::take(&mut self.warnings)
    }
}

/// Writes a line to standard output; a closed pipe ends nothing.
pub fn print_line(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Milliseconds with a tenth.
pub fn milliseconds(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e4).round() / 10.0
}

/// "412 ms" or "3.2 s".
pub fn seconds(time: Duration) -> String {
    if time < Duration::from_secs(1) {
        format!("{:.0} ms", time.as_secs_f64() * 1e3)
    } else {
        format!("{:.1} s", time.as_secs_f64())
    }
}
