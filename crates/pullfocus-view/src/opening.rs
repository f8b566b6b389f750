//! What a path means: a picture, a folder of frames, a pattern, or a shot.

use pullfocus_io::sequence::number_in;
use pullfocus_job::config::{self, Options};
use pullfocus_job::failure::{Failure, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Endings of pictures that can hold depth, or be given it.
const PICTURES: [&str; 9] = ["exr", "png", "jpg", "jpeg", "tif", "tiff", "hdr", "pfm", "webp"];

/// A picture or a sequence in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// What it is called: a file's name, or a pattern's.
    pub name: String,
    /// A file, or a pattern.
    pub path: PathBuf,
    /// How many frames.
    pub frames: usize,
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|ending| endings.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

/// Whether a file is a colour config, by its name.
pub fn is_config(path: &Path) -> bool {
    has_ending(path, &["ocio", "ocioz"])
}

/// What can be opened in a folder, sequences as one, and its folders.
///
/// # Errors
/// A folder that cannot be read.
pub fn entries(folder: &Path) -> Result<(Vec<PathBuf>, Vec<Entry>)> {
    let told = |error: std::io::Error| Failure::failed(format!("{}: {error}", folder.display()));
    let mut folders = Vec::new();
    let mut groups: BTreeMap<(String, String, usize), Vec<PathBuf>> = BTreeMap::new();
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(told)? {
        let path = entry.map_err(told)?.path();
        let name = crate::clip::file_name(&path);
        if name.starts_with('.') {
            continue;
        }
        if path.is_dir() {
            folders.push(path);
        } else if is_shot(&path) || is_config(&path) {
            entries.push(Entry { name, path, frames: 1 });
        } else if has_ending(&path, &PICTURES) {
            match numbered(&name) {
                Some((before, digits, after)) => {
                    groups.entry((before, after, digits)).or_default().push(path)
                }
                None => entries.push(Entry { name, path, frames: 1 }),
            }
        }
    }
    for ((before, after, digits), files) in groups {
        if let [file] = files.as_slice() {
            entries.push(Entry { name: crate::clip::file_name(file), path: file.clone(), frames: 1 });
            continue;
        }
        let name = format!("{before}{}{after}", "#".repeat(digits));
        entries.push(Entry { path: folder.join(&name), name, frames: files.len() });
    }
    folders.sort();
    entries.sort_by(|a, b| a.name.cmp(&b.name));
    Ok((folders, entries))
}

/// A name around its last number, and how many digits that has.
fn numbered(name: &str) -> Option<(String, usize, String)> {
    number_in(Path::new(name))?;
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem);
    let end = stem.rfind(|letter: char| letter.is_ascii_digit())? + 1;
    let start = stem[..end]
        .rfind(|letter: char| !letter.is_ascii_digit())
        .map_or(0, |at| at + stem[at..].chars().next().map_or(1, char::len_utf8));
    Some((name[..start].to_owned(), end - start, name[end..].to_owned()))
}

/// Whether a path is a shot's.
pub fn is_shot(path: &Path) -> bool {
    has_ending(path, &["toml"])
}

/// The options that a path stands for, with those of `base`, which win over a shot's.
///
/// # Errors
/// A folder without pictures, a shot that cannot be read.
pub fn options(path: &Path, base: &Options) -> Result<Options> {
    if is_shot(path) {
        let mut over = base.clone();
        // The shot's own picture, not the path that led to the shot.
        over.files.input = None;
        return Ok(over.over(config::read(path)?));
    }
    let mut options = base.clone();
    let input = if path.is_dir() {
        let (_, entries) = entries(path)?;
        // The longest sequence is what the folder is about.
        let most = entries
            .into_iter()
            // Of those that are as long, the first by name.
            .rev()
            .filter(|entry| has_ending(&entry.path, &PICTURES))
            .max_by_key(|entry| (entry.frames, has_ending(&entry.path, &["exr"])));
        most.ok_or_else(|| {
            Failure::failed(format!(
                "{}: there is no picture in this folder; open an OpenEXR file with depth",
                path.display()
            ))
        })?
        .path
    } else {
        path.to_owned()
    };
    options.files.input = Some(vec![input]);
    Ok(options)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_of_a_sequence_are_one_entry() {
        let folder = tempfile::tempdir().unwrap();
        for name in
            ["a.0001.exr", "a.0002.exr", "a.0003.exr", "still.exr", "take_7.png", "notes.txt", ".hidden.exr"]
        {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("more")).unwrap();
        let (folders, found) = entries(folder.path()).unwrap();
        assert_eq!(folders, [folder.path().join("more")]);
        let names: Vec<(&str, usize)> =
            found.iter().map(|entry| (entry.name.as_str(), entry.frames)).collect();
        assert_eq!(names, [("a.####.exr", 3), ("still.exr", 1), ("take_7.png", 1)]);
        let opened = options(folder.path(), &Options::default()).unwrap();
        assert_eq!(opened.files.input, Some(vec![folder.path().join("a.####.exr")]));
        assert!(
            options(&folder.path().join("more"), &Options::default())
                .unwrap_err()
                .to_string()
                .contains("no picture")
        );
    }
}
