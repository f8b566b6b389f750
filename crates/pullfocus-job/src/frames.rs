//! Which files make a frame.

use crate::config::Options;
use crate::failure::{Failure, Result};
use crate::purpose::Purpose;
use crate::shot;
use pullfocus_core::pull::Pull;
use pullfocus_io::output::{Existing, Need, check_target};
use pullfocus_io::sequence::{Frames, Pattern, Request, number_in, plan};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// The files of one frame.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct FrameFiles {
    /// Its number in the sequence.
    pub number: Option<i64>,
    /// The picture, or the file that the result goes into.
    pub input: Option<PathBuf>,
    /// Depth in its own file.
    pub depth_file: Option<PathBuf>,
    /// Near objects.
    pub foreground: Option<PathBuf>,
    /// What is behind them.
    pub behind: Option<PathBuf>,
    /// The result.
    pub output: PathBuf,
    /// The result as an 8-bit PNG.
    pub preview_png: Option<PathBuf>,
}

impl FrameFiles {
    fn roles(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        [
            ("input", &self.input),
            ("depth-file", &self.depth_file),
            ("foreground", &self.foreground),
            ("behind", &self.behind),
        ]
        .into_iter()
        .filter_map(|(role, path)| Some((role, path.as_ref()?)))
    }

    /// Files read.
    pub fn read(&self) -> impl Iterator<Item = &PathBuf> {
        self.roles().map(|(_, path)| path)
    }

    /// Files read, by their role.
    pub fn inputs(&self) -> BTreeMap<&'static str, String> {
        self.roles().map(|(role, path)| (role, path.display().to_string())).collect()
    }

    /// Files written.
    pub fn outputs(&self) -> Vec<String> {
        std::iter::once(&self.output)
            .chain(&self.preview_png)
            .map(|path| path.display().to_string())
            .collect()
    }

    /// The file that the frame goes by in messages.
    pub fn name(&self) -> String {
        self.input
            .as_ref()
            .or(self.behind.as_ref())
            .map_or_else(String::new, |path| path.display().to_string())
    }

    /// Whether anything is left to do for this frame.
    ///
    /// # Errors
    /// Outputs that are there and may not be replaced, that are inputs, or whose folder is missing.
    pub fn need(&self, existing: Existing) -> Result<Need> {
        let mut need = Need::Finished;
        for output in std::iter::once(&self.output).chain(&self.preview_png) {
            if check_target(output, self.read(), existing)? == Need::Make {
                need = Need::Make;
            }
        }
        Ok(need)
    }
}

/// The files of every frame that the options name.
///
/// # Errors
/// [`Failure::Usage`] for names that do not go together, [`Failure::Failed`] for files that are not there.
pub fn find(options: &Options, purpose: Purpose) -> Result<Vec<FrameFiles>> {
    let files = &options.files;
    if files.output.is_none() && purpose != Purpose::View {
        return Err(Failure::usage(
            "no output was named; add -o OUT (its ending says the format: .exr, .png, ...)",
        ));
    }
    let output = files.output.clone().filter(|_| purpose != Purpose::View);
    let inputs = files.input.clone().unwrap_or_default();
    let layers = if purpose == Purpose::Coc { (&None, &None) } else { (&files.foreground, &files.behind) };
    let (main, has_input) = match (inputs.is_empty(), layers.1) {
        (false, _) => (inputs, true),
        (true, Some(behind)) => (vec![behind.clone()], false),
        (true, None) => return Err(Failure::usage("no picture was named; give IN, the picture to blur")),
    };
    let mut companions = Vec::new();
    let mut add = |what: &'static str, path: &Option<PathBuf>| {
        path.as_ref().map(|path| {
            companions.push((what, path.clone()));
            companions.len() - 1
        })
    };
    let depth_file = add("--depth-file", &files.depth_file);
    let foreground = add("--foreground", layers.0);
    let behind = if has_input { add("--behind", layers.1) } else { None };
    let frames = match &files.frames {
        Some(frames) => Some(frames.0.parse::<Frames>()?),
        None => held(&options.keys, &main, output.as_deref())?,
    };
    let request = Request { inputs: main, companions, output, frames };
    let planned = planned(&request)?;
    let preview = options.blur.preview_png.as_ref().filter(|_| purpose != Purpose::View);
    let previews = match preview {
        Some(preview) => Some(planned_previews(&request, preview)?),
        None => None,
    };
    if let Some(previews) = &previews {
        let outputs: HashSet<PathBuf> = planned.iter().map(|frame| resolved(&frame.output)).collect();
        if let Some(twice) = previews.iter().find(|preview| outputs.contains(&resolved(preview))) {
            return Err(Failure::usage(format!(
                "{}: -o and --preview-png name the same file; give the preview another name",
                twice.display()
            )));
        }
    }
    let still = request.frames.is_none() && still(&options.keys, &request.inputs)?;
    Ok(planned
        .into_iter()
        .enumerate()
        .map(|(index, frame)| {
            let companion = |at: Option<usize>| at.and_then(|at| frame.companions.get(at).cloned());
            let own = Some(frame.input.clone());
            FrameFiles {
                number: frame.frame.filter(|_| !still),
                depth_file: companion(depth_file),
                foreground: companion(foreground),
                behind: if has_input { companion(behind) } else { own.clone() },
                input: if has_input { own } else { None },
                preview_png: previews.as_ref().and_then(|previews| previews.get(index).cloned()),
                output: frame.output,
            }
        })
        .collect())
}

/// Whether the input is one picture under a moving lens and no frame of its shot. A number in its name that no key is near is a
/// version's or a size's.
fn still(keys: &Pull, inputs: &[PathBuf]) -> Result<bool> {
    let [still] = inputs else { return Ok(false) };
    let alone = still.is_file() || Pattern::parse(still)?.is_none();
    Ok(alone && !keys.is_empty() && number_in(still).is_none_or(|number| !shot::covers(keys, number)))
}

/// The frames of a still with a moving lens, where nothing else says which: from the first key to the last.
fn held(keys: &Pull, inputs: &[PathBuf], output: Option<&Path>) -> Result<Option<Frames>> {
    let named = match output {
        Some(output) => Pattern::parse(output)?.is_some(),
        // Nothing is written.
        None => true,
    };
    if named && still(keys, inputs)? { shot::span(keys) } else { Ok(None) }
}

/// The path as the system goes it: through links, without `.` and `..`, whether or not the file is there.
fn resolved(path: &Path) -> PathBuf {
    if let Ok(path) = path.canonicalize() {
        return path;
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (folder.canonicalize(), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => path.to_owned(),
    }
}

fn planned_previews(request: &Request, preview: &Path) -> Result<Vec<PathBuf>> {
    let request = Request { output: Some(preview.to_owned()), ..request.clone() };
    Ok(planned(&request)?.into_iter().map(|frame| frame.output).collect())
}

/// The plan; a file that is not there is a failure, names that cannot work are a mistake of usage.
fn planned(request: &Request) -> Result<Vec<pullfocus_io::sequence::FrameFiles>> {
    plan(request).map_err(|error| {
        let companions = request.companions.iter().map(|(_, path)| path);
        if request.inputs.iter().chain(companions).any(|path| is_missing(path, request.frames.as_ref())) {
            Failure::failed(error.to_string())
        } else {
            error.into()
        }
    })
}

fn is_missing(path: &Path, frames: Option<&Frames>) -> bool {
    if path.exists() {
        return false;
    }
    match (Pattern::parse(path), frames) {
        (Ok(Some(pattern)), Some(frames)) => frames.iter().any(|frame| !pattern.file(frame).is_file()),
        (Ok(Some(pattern)), None) => pattern.discover().is_ok_and(|frames| frames.is_empty()),
        (Ok(None), _) => true,
        (Err(_), _) => false,
    }
}
