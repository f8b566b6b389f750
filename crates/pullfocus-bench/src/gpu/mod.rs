//! A GPU: solvers, whole frames, storage; beside the papers, a memory copy and cuSPARSE.

mod cusparse;
mod frames;
mod session;
mod solvers;
mod storage;
mod tune;

use crate::adapter::{AdapterOption, describe};
use crate::frames::FrameOptions;
use crate::place::{Output, provenance};
use crate::table::Table;
use anyhow::Result;
use clap::{Args, ValueEnum};
use pullfocus::Size;
use session::{Session, ms};
use std::time::Duration;

/// Options of `gpu`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    adapter: AdapterOption,
    #[command(flatten)]
    frames: FrameOptions,
    /// The most rounds of a case; long ones have fewer.
    #[arg(long, default_value_t = 20)]
    rounds: usize,
    /// The largest picture, as 1920x1080; 7680x4320 where none is given, 512x512 on a software adapter.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    largest: Option<Size>,
    /// After so many minutes the cases that are left are left out.
    #[arg(long, default_value_t = 5.0)]
    minutes: f64,
    /// Only these sections.
    #[arg(long, value_enum, value_delimiter = ',')]
    only: Vec<Section>,
    /// Only tries ways to cut the partitioned solver's work and prints them, fastest first; writes nothing.
    #[arg(long)]
    tune: bool,
}

/// A section of the document.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Section {
    Solvers,
    Sweeps,
    Frames,
    Storage,
    Cusparse,
}

fn parse_size(text: &str) -> std::result::Result<Size, String> {
    let parsed = text.split_once('x').and_then(|(w, h)| Some(Size::new(w.parse().ok()?, h.parse().ok()?)));
    parsed.filter(|size| size.area() > 0).ok_or_else(|| "write it as 1920x1080".into())
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let host = options.adapter.open()?;
    let software = crate::adapter::is_software(host.info());
    let largest = if software { Size::new(512, 512) } else { Size::new(7680, 4320) };
    let quick = options.output.quick;
    let rounds = if quick { 1 } else { options.rounds.max(1) };
    let limit = Duration::from_secs_f64(60.0 * options.minutes.clamp(0.0, 1e4));
    let described = describe(host.info());
    let mut session = Session::new(host, (rounds, options.largest.unwrap_or(largest), quick), limit);
    if options.tune {
        println!("{described}\n");
        return tune::run(&mut session);
    }
    let wanted = |section| options.only.is_empty() || options.only.contains(&section);
    // What the targets are about comes first, in case the time is up.
    let (mut frame_rows, mut solver_rows) = (None, None);
    let (mut frames_text, mut solvers_text) = (String::new(), String::new());
    let mut measure_frames = |session: &mut Session| -> Result<()> {
        eprintln!("frames");
        let rows = frames::measure(session)?;
        let beside = frames::measure_beside(session)?;
        frames_text = frames::section(&rows) + &frames::beside_section(&beside);
        frame_rows = Some(rows);
        Ok(())
    };
    // llvmpipe's timestamps tell too little once something was drawn, as a frame's last pass does.
    if wanted(Section::Frames) && !software {
        measure_frames(&mut session)?;
    }
    let mut sweeps_text = String::new();
    if wanted(Section::Sweeps) {
        eprintln!("sweeps");
        let (size, rows) = solvers::measure_sweeps(&mut session)?;
        sweeps_text = solvers::sweeps_section(size, &rows);
    }
    let mut storage_text = String::new();
    if wanted(Section::Storage) {
        eprintln!("storage");
        storage_text = storage::section(&storage::measure(&mut session, &options.frames)?);
    }
    if wanted(Section::Solvers) {
        eprintln!("solvers");
        let rows = solvers::measure(&mut session)?;
        solvers_text = solvers::section(&rows);
        solver_rows = Some(rows);
    }
    if wanted(Section::Frames) && software {
        measure_frames(&mut session)?;
    }
    let mut cusparse_text = String::new();
    if wanted(Section::Cusparse) {
        eprintln!("cuSPARSE");
        let measured = cusparse::measure(&session)?;
        cusparse_text = cusparse::section(&measured, solver_rows.as_deref().unwrap_or_default());
    }
    // What a processor needs says nothing about them.
    let measured = Targets {
        ratio: solver_rows.as_deref().and_then(solvers::worst_ratio),
        three: frame_rows.as_deref().and_then(|rows| frames::seconds_4k(rows, frames::THREE)),
        last: frame_rows.as_deref().and_then(|rows| frames::seconds_4k(rows, frames::FINAL)),
        lights: frame_rows.as_deref().and_then(frames::seconds_of_lights),
        spread: frame_rows.as_deref().and_then(|rows| {
            frames::worst_spread(rows, |what| what != frames::FINAL && what != frames::LIGHTS)
        }),
        spread_of_last: frame_rows
            .as_deref()
            .and_then(|rows| frames::worst_spread(rows, |what| what == frames::FINAL)),
    };
    let targets = if software { Targets::default() } else { measured };
    let head = head(&described, software, session.by_device, rounds);
    let text = format!(
        "# On a GPU\n\n{head}{}{solvers_text}{sweeps_text}{frames_text}{storage_text}{cusparse_text}",
        targets.section()
    );
    options.output.write("results/gpu.md", &(text.trim_end().to_owned() + "\n"))
}

fn head(described: &str, software: bool, by_device: Option<bool>, rounds: usize) -> String {
    let warning = if software {
        "**A software device: only correctness and ratios mean anything here. The times are those of a processor that plays a GPU, and frames'\n\
         are too short, since its clock is wrong once something was drawn; figures of an H100-class GPU are owed.**\n\n"
    } else {
        ""
    };
    let clock = match by_device {
        Some(true) => "Times are the device's own (timestamps around its passes).",
        Some(false) => "Times are the host's, around submission and waiting: the device has no timestamps.",
        None => "Nothing was timed.",
    };
    format!(
        "{warning}{}\n\n{described} {clock} Medians of at most {rounds} rounds, fewer where a round takes long, after one that counts for nothing.\n\n",
        provenance()
    )
}

/// Figures that have targets.
#[derive(Debug, Clone, Copy, Default)]
struct Targets {
    ratio: Option<f64>,
    three: Option<f64>,
    last: Option<f64>,
    lights: Option<f64>,
    spread: Option<f64>,
    spread_of_last: Option<f64>,
}

impl Targets {
    fn section(&self) -> String {
        let mut table = Table::new(["target, on an H100-class GPU", "at most", "here", ""]);
        let mut row = |what: &str, most: f64, here: Option<f64>, show: &dyn Fn(f64) -> String| {
            let (value, verdict) = match here {
                Some(here) => (show(here), if here <= most { "reached" } else { "missed" }),
                None => (String::new(), "not measured"),
            };
            table.row([what.to_owned(), show(most), value, verdict.to_owned()]);
        };
        let times = |v: f64| format!("{v:.2} x");
        let milliseconds = |v: f64| format!("{} ms", ms(v));
        row("partitioned solver beside a copy, from 1920 x 1080 on", 1.5, self.ratio, &times);
        row("three layers, 3840 x 2160, f16, backward Euler", 0.002, self.three, &milliseconds);
        row("`final`, 3840 x 2160, f16", 0.008, self.last, &milliseconds);
        row("103,680 highlights of 50 px, 1920 x 1080, f16", 0.002, self.lights, &milliseconds);
        row("frames by diffusion: slowest circle over fastest", 1.05, self.spread, &times);
        row("frames of `final`: the same", 1.05, self.spread_of_last, &times);
        format!("## Targets\n\n{}\n", table.to_markdown())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_reached_missed_or_not_measured() {
        let targets = Targets {
            ratio: Some(1.5),
            three: Some(0.0021),
            lights: Some(0.002),
            spread: Some(1.01),
            spread_of_last: Some(1.3),
            ..Targets::default()
        };
        let text = targets.section();
        assert!(text.contains("| 1.50 x | 1.50 x | reached |"), "{text}");
        assert!(text.contains("| 2.00 ms | 2.10 ms | missed |"), "{text}");
        assert!(text.contains("| 8.00 ms |  | not measured |"), "{text}");
        assert!(text.contains("| 2.00 ms | 2.00 ms | reached |"), "{text}");
        assert!(text.contains("| 1.05 x | 1.01 x | reached |"), "{text}");
        assert!(text.contains("| 1.05 x | 1.30 x | missed |"), "{text}");
    }

    #[test]
    fn a_software_device_is_named_on_top() {
        let text = head("Adapter: x.", true, Some(false), 3);
        assert!(text.starts_with("**A software device") && text.contains("no timestamps"), "{text}");
        assert!(head("Adapter: x.", false, Some(true), 3).starts_with("Machine"));
    }

    #[test]
    fn sizes_are_read() {
        assert_eq!(parse_size("1920x1080"), Ok(Size::new(1920, 1080)));
        assert!(parse_size("1920").is_err() && parse_size("0x9").is_err());
    }
}
