//! cuSPARSE's batched tridiagonal solvers beside ours, where CUDA is at hand.

use super::session::{Session, ms};
use super::solvers::{self, PLANES, is_one_step};
use crate::speed::cases::circle;
use crate::table::Table;
use anyhow::{Context, Result, ensure};
use pullfocus::Size;
use pullfocus::diffusion::Calibration;
use pullfocus_gpu::Storage;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program; compiled by the command, never by the build.
const SOURCE: &str = include_str!("../../cuda/gtsv.cu");
/// The matrices of 7680 x 4320 come anew for each round.
const ROUNDS: usize = 5;

/// A line of the program.
#[derive(Debug, Deserialize)]
struct Line {
    solver: String,
    ms: Option<f64>,
    buffer_bytes: Option<u64>,
    largest_error: Option<f64>,
    error: Option<String>,
}

/// What one size gave.
pub struct Row {
    size: Size,
    /// Or why there is nothing.
    lines: std::result::Result<Vec<Line>, String>,
}

/// All sizes; why there are none where CUDA is not here.
pub fn measure(session: &Session) -> Result<std::result::Result<Vec<Row>, String>> {
    if Command::new("nvcc").arg("--version").output().is_err() {
        return Ok(Err("not measured: no CUDA here (`nvcc` is not on the path).".into()));
    }
    let folder = tempfile::tempdir()?;
    let program = match compile(folder.path())? {
        Ok(program) => program,
        Err(why) => return Ok(Err(format!("not measured: {why}"))),
    };
    let mut rows = vec![];
    for (width, height) in [(256, 256), (512, 512), (1024, 1024), (1920, 1080), (3840, 2160), (7680, 4320)] {
        let size = session.size(width, height);
        let lines = match session.may(size) {
            Ok(()) => one(&program, folder.path(), size)?,
            Err(why) => Err(why),
        };
        rows.push(Row { size, lines });
    }
    Ok(Ok(rows))
}

fn compile(folder: &Path) -> Result<std::result::Result<PathBuf, String>> {
    let (source, program) = (folder.join("gtsv.cu"), folder.join("gtsv"));
    std::fs::write(&source, SOURCE)?;
    let output =
        Command::new("nvcc").args(["-O3", "-o"]).arg(&program).arg(&source).arg("-lcusparse").output()?;
    if output.status.success() {
        return Ok(Ok(program));
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let first =
        said.lines().find(|line| line.contains("error")).or(said.lines().next()).unwrap_or("nvcc failed");
    Ok(Err(first.replace(&folder.display().to_string(), "").replace('|', "/")))
}

fn one(program: &Path, folder: &Path, size: Size) -> Result<std::result::Result<Vec<Line>, String>> {
    let file = folder.join("circles");
    let bytes: Vec<u8> = circle(size, 50.0)?.data().iter().flat_map(|c| c.to_le_bytes()).collect();
    std::fs::write(&file, bytes)?;
    let numbers = [size.width, size.height, PLANES].map(|n| n.to_string());
    let factor = Calibration::Variance.factor().to_string();
    let output = Command::new(program)
        .args(numbers)
        .args([factor, ROUNDS.to_string()])
        .arg(&file)
        .output()
        .context("cannot run what nvcc compiled")?;
    if !output.status.success() {
        return Ok(Err(String::from_utf8_lossy(&output.stderr).trim().replace(['\n', '|'], " ")));
    }
    Ok(Ok(parse(&String::from_utf8_lossy(&output.stdout))?))
}

fn parse(text: &str) -> Result<Vec<Line>> {
    let lines: Vec<Line> = text
        .lines()
        .map(|line| serde_json::from_str(line).with_context(|| format!("the program said {line:?}")))
        .collect::<Result<_>>()?;
    ensure!(!lines.is_empty(), "the program said nothing");
    Ok(lines)
}

/// The section; `ours` are the rows of the solvers' table.
pub fn section(measured: &std::result::Result<Vec<Row>, String>, ours: &[solvers::Row]) -> String {
    let head = "## Beside cuSPARSE\n\n";
    let rows = match measured {
        Ok(rows) => rows,
        Err(why) => return format!("{head}{why}\n\n"),
    };
    let mut table =
        Table::new(["picture", "solver", "ms", "times ours", "largest error", "working memory, MiB"]);
    for row in rows {
        let half = ours.iter().find(|ours| {
            ours.size == row.size && is_one_step(ours) && ours.circle == 50.0 && ours.storage == Storage::Full
        });
        let half = half.and_then(|ours| ours.run.as_ref().ok()).map(|run| 0.5 * run.seconds);
        let size = row.size.to_string();
        if let Some(half) = half {
            let name = "ours: half of both axes".to_owned();
            table.row([size.clone(), name, ms(half), "1".into(), String::new(), "0".into()]);
        }
        match &row.lines {
            Err(why) => {
                let [a, b, c] = [String::new(), String::new(), String::new()];
                table.row([size, "all".into(), why.clone(), a, b, c]);
            }
            Ok(lines) => {
                for line in lines {
                    let time = line.ms.map(|ms| ms / 1e3);
                    let times = time.zip(half).map(|(time, half)| format!("{:.1}", time / half));
                    table.row([
                        size.clone(),
                        line.solver.clone(),
                        time.map(ms).or(line.error.clone()).unwrap_or_default(),
                        times.unwrap_or_default(),
                        line.largest_error.map(|e| format!("{e:.1e}")).unwrap_or_default(),
                        line.buffer_bytes.map(|b| (b >> 20).to_string()).unwrap_or_default(),
                    ]);
                }
            }
        }
    }
    format!(
        "{head}The rows of four planes as one batch of systems, f32, circles up to 50 px, medians of {ROUNDS} by CUDA's events. Ours is half of the\n\
         time of both axes. cuSPARSE gets its matrices ready made and one copy of them for each plane, since its batches share none; making them,\n\
         and bringing rows or columns into the order that it wants, is not in its time. Ours makes them from the circles as it goes. Errors are\n\
         from elimination in f64 on some 257 lines.\n\n{}\n",
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::super::session::Run;
    use super::*;

    #[test]
    fn lines_become_rows_beside_ours() {
        let text = "{\"solver\": \"a\", \"ms\": 2.0, \"buffer_bytes\": 3145728, \"largest_error\": 1.000e-06}\n\
                    {\"solver\": \"b\", \"error\": \"cudaMalloc: out of memory\"}\n";
        let size = Size::new(64, 64);
        let rows = vec![Row { size, lines: parse(text).map_err(|e| e.to_string()) }];
        let run = Run { seconds: 0.001, bytes: 1, copy: 1.0, planes: vec![] };
        let ours = solvers::Row {
            size,
            what: "partitioned (`lu`)".into(),
            partitioned: true,
            storage: Storage::Full,
            circle: 50.0,
            unknowns: 1.0,
            run: Ok(run),
        };
        let text = section(&Ok(rows), &[ours]);
        assert!(text.contains("| a | 2.00 | 4.0 | 1.0e-6 | 3 |"), "{text}");
        assert!(text.contains("| b | cudaMalloc: out of memory |"), "{text}");
        assert!(parse("").is_err() && parse("what").is_err());
    }

    #[test]
    fn without_cuda_the_section_says_so() {
        let text = section(&Err("not measured: no CUDA here.".into()), &[]);
        assert!(text.contains("not measured: no CUDA here."), "{text}");
    }
}
