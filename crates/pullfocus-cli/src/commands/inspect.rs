//! `pullfocus inspect`: what is in files.

use crate::args::InspectArgs;
use crate::console::print_line;
use crate::describe;
use crate::report;
use pullfocus_io::Limits;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::storage::{self, Inspected, limits};
use serde::Serialize;
use std::path::Path;

#[derive(Debug, Serialize)]
struct Document {
    pullfocus: &'static str,
    command: &'static str,
    files: Vec<FileReport>,
}

#[derive(Debug, Serialize)]
struct FileReport {
    file: String,
    contents: Option<Inspected>,
    /// The command to go on with.
    suggestion: Option<String>,
    error: Option<String>,
}

/// Tells of each file; a file that cannot be read does not keep the others from being told of.
///
/// # Errors
/// The last file that could not be read.
pub fn run(args: &InspectArgs) -> Result<()> {
    let mut files = Vec::new();
    let mut failed = Vec::new();
    for (index, path) in args.files.iter().enumerate() {
        let report = look(path, &limits(args.allow_large_files));
        if !args.json {
            if index > 0 {
                print_line("");
            }
            tell(path, &report);
        }
        failed.extend(report.error.clone());
        files.push(report);
    }
    if args.json {
        report::print(&Document { pullfocus: env!("CARGO_PKG_VERSION"), command: "inspect", files })?;
    }
    if failed.is_empty() { Ok(()) } else { Err(Failure::failed(failed.join("\npullfocus: error: "))) }
}

fn look(path: &Path, limits: &Limits) -> FileReport {
    let file = path.display().to_string();
    match storage::inspect(path, limits) {
        // There is no going on with it.
        Ok((contents, Some(wrong))) => {
            FileReport { file, contents: Some(contents), suggestion: None, error: Some(wrong.to_string()) }
        }
        Ok((contents, None)) => {
            let suggestion = match &contents {
                Inspected::Exr(contents) => describe::suggestion(path, contents),
                // A grey picture is more likely the depth of another one.
                Inspected::Image { grey: true, .. } => None,
                Inspected::Image { .. } => Some(describe::image_suggestion(path)),
            };
            FileReport { file, contents: Some(contents), suggestion, error: None }
        }
        Err(error) => FileReport { file, contents: None, suggestion: None, error: Some(error.to_string()) },
    }
}

fn tell(path: &Path, report: &FileReport) {
    match &report.contents {
        Some(Inspected::Exr(contents)) => describe::lines(contents).iter().for_each(|line| print_line(line)),
        Some(Inspected::Image { format, width, height, alpha, grey, stored, as_depth }) => {
            let color = if *grey { "grey" } else { "colour" };
            let alpha = if *alpha { " with alpha" } else { "" };
            print_line(&format!(
                "{}: {format}, {width} x {height}, {color}{alpha}, {stored}",
                path.display()
            ));
            if let Some([low, high]) = as_depth {
                print_line(&format!("  as --depth-file: values from {low} to {high}"));
            }
        }
        None => {}
    }
    if let Some(suggestion) = &report.suggestion {
        print_line(&format!("  go on with: {suggestion}"));
    }
}
