//! From what the user named to the files of every frame.

use super::frames::Frames;
use super::pattern::{Pattern, number_in};
use crate::error::{FileError, FileResult};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// What the user asked for.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// One pattern, one file, or a list of files.
    pub inputs: Vec<PathBuf>,
    /// Files that go beside each input, with what they are called in messages ("foreground"): a pattern takes
    /// the frame's number, a file is the same for all frames.
    pub companions: Vec<(&'static str, PathBuf)>,
    /// A pattern, a file (for one input), or a folder, where each output gets its input's name; none where nothing is
    /// written.
    pub output: Option<PathBuf>,
    /// Which frames of a pattern; all that exist if nothing is said. For one picture that is no pattern: how often it
    /// is rendered, and under which numbers (a held still, whose output is a pattern).
    pub frames: Option<Frames>,
}

/// The files of one frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FrameFiles {
    /// The frame's number, where it has one.
    pub frame: Option<i64>,
    /// The picture.
    pub input: PathBuf,
    /// In the order of [`Request::companions`].
    pub companions: Vec<PathBuf>,
    /// The result; empty where nothing is written.
    pub output: PathBuf,
}

impl FrameFiles {
    /// All files that are read for this frame.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(self.input.as_path()).chain(self.companions.iter().map(PathBuf::as_path))
    }
}

fn argument<T>(what: impl ToString, reason: impl Into<String>) -> FileResult<T> {
    Err(FileError::Argument { what: what.to_string(), reason: reason.into() })
}

/// A pattern, or the one file that exists under just that name.
fn pattern_in(path: &Path) -> FileResult<Option<Pattern>> {
    // Somebody's file may be called "take#2.exr".
    if path.is_file() { Ok(None) } else { Pattern::parse(path) }
}

/// The files of every frame, in order.
///
/// Every input exists when this returns, every output has its own name, and none of these names is an
/// input's ([`crate::output::check_target`] asks that again with links followed, and whether it exists).
///
/// # Errors
/// [`FileError::Argument`] for a pattern without files, frames that are missing (as ranges), names that are
/// missing a place for the frame number, and outputs that would overwrite inputs or one another.
pub fn plan(request: &Request) -> FileResult<Vec<FrameFiles>> {
    let inputs = match held(request)? {
        Some(held) => held,
        None => inputs(request)?,
    };
    let mut frames: Vec<FrameFiles> = inputs
        .into_iter()
        .map(|(frame, input)| FrameFiles { frame, input, companions: vec![], output: PathBuf::new() })
        .collect();
    for (what, path) in &request.companions {
        add_companion(&mut frames, what, path)?;
    }
    if let Some(output) = &request.output {
        name_outputs(&mut frames, output)?;
        refuse_collisions(&frames)?;
    }
    Ok(frames)
}

/// A frame's number, where it has one, and its input.
type Numbered = (Option<i64>, PathBuf);

/// The one picture of a held still, once for each frame; none where the request is for other things.
fn held(request: &Request) -> FileResult<Option<Vec<Numbered>>> {
    let (Some(frames), [path]) = (&request.frames, request.inputs.as_slice()) else { return Ok(None) };
    if pattern_in(path)?.is_some() || !path.is_file() {
        return Ok(None);
    }
    if let Some(number) = number_in(path).filter(|&number| frames.contains(number)) {
        return argument(
            path.display(),
            format!(
                "this is one picture, and by its name frame {number} of those asked for; name the sequence \
                 (shot.####.exr), or give a still that is to be held a name without that number"
            ),
        );
    }
    if let Some(output) = &request.output
        && frames.len() > 1
        && (output.is_dir() || Pattern::parse(output)?.is_none())
    {
        return argument(
            output.display(),
            format!(
                "this is one name for {} frames of a still; write a place for the frame number, like \
                 out.####.exr, or name a sequence as the input (shot.####.exr)",
                frames.len()
            ),
        );
    }
    Ok(Some(frames.iter().map(|frame| (Some(frame), path.clone())).collect()))
}

/// Frame numbers and input files.
fn inputs(request: &Request) -> FileResult<Vec<Numbered>> {
    let mut found = Vec::new();
    for path in &request.inputs {
        let Some(pattern) = pattern_in(path)? else {
            if request.frames.is_some() && request.inputs.len() > 1 {
                return argument(
                    path.display(),
                    "frames were asked for, but the name has no place for a frame number; write it like \
                     shot.####.exr, or give one picture alone to hold it",
                );
            }
            if !path.is_file() {
                let what = if path.is_dir() { "this is a folder" } else { "there is no such file" };
                return argument(
                    path.display(),
                    format!("{what}; give a picture, or a pattern like shot.####.exr"),
                );
            }
            found.push((number_in(path), path.clone()));
            continue;
        };
        let frames = match &request.frames {
            Some(frames) => frames.clone(),
            None => pattern.discover()?,
        };
        if frames.is_empty() {
            return argument(&pattern, "no file has a name of this pattern");
        }
        refuse_missing(&pattern, frames.iter())?;
        found.extend(frames.iter().map(|frame| (Some(frame), pattern.file(frame))));
    }
    if found.is_empty() { argument("the input", "no file was given") } else { Ok(found) }
}

fn refuse_missing(pattern: &Pattern, frames: impl Iterator<Item = i64>) -> FileResult<()> {
    let mut count = 0;
    let missing: Frames = frames.inspect(|_| count += 1).filter(|&f| !pattern.file(f).is_file()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let (files, are) = if missing.len() == 1 { ("file", "is") } else { ("files", "are") };
    argument(
        pattern,
        format!(
            "{} of {count} {files} {are} missing: {missing}; render them, or choose other frames",
            missing.len()
        ),
    )
}

fn add_companion(frames: &mut [FrameFiles], what: &str, path: &Path) -> FileResult<()> {
    let Some(pattern) = pattern_in(path)? else {
        if !path.is_file() {
            return argument(path.display(), format!("there is no such file (for {what})"));
        }
        for frame in frames {
            frame.companions.push(path.to_owned());
        }
        return Ok(());
    };
    for files in frames.iter_mut() {
        let Some(frame) = files.frame else {
            return argument(
                files.input.display(),
                format!("the name has no frame number, but {what} ({pattern}) needs one"),
            );
        };
        files.companions.push(pattern.file(frame));
    }
    refuse_missing(&pattern, frames.iter().filter_map(|files| files.frame))
}

fn name_outputs(frames: &mut [FrameFiles], output: &Path) -> FileResult<()> {
    if output.is_dir() {
        for files in frames {
            files.output =
                files.input.file_name().map_or_else(|| output.to_owned(), |name| output.join(name));
        }
        return Ok(());
    }
    if let Some(pattern) = Pattern::parse(output)? {
        for files in frames {
            let Some(frame) = files.frame else {
                return argument(
                    files.input.display(),
                    format!("the name has no frame number, but the output ({pattern}) needs one"),
                );
            };
            files.output = pattern.file(frame);
        }
        return Ok(());
    }
    match frames {
        [one] => {
            one.output = output.to_owned();
            Ok(())
        }
        several => argument(
            output.display(),
            format!(
                "this is one name for {} pictures; write a place for the frame number, like out.####.exr, or \
                 give a folder that exists",
                several.len()
            ),
        ),
    }
}

fn refuse_collisions(frames: &[FrameFiles]) -> FileResult<()> {
    let inputs: HashSet<&Path> = frames.iter().flat_map(FrameFiles::inputs).collect();
    let mut from: HashMap<&Path, &Path> = HashMap::new();
    for files in frames {
        if inputs.contains(files.output.as_path()) {
            return argument(
                files.output.display(),
                "the output would overwrite an input; choose another name or folder",
            );
        }
        if let Some(other) = from.insert(&files.output, &files.input) {
            return argument(
                files.output.display(),
                format!(
                    "both {} and {} would be written there; give names that differ",
                    other.display(),
                    files.input.display()
                ),
            );
        }
    }
    Ok(())
}
