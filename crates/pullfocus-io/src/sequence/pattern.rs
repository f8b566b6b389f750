//! File names with a place for the frame number.

use super::frames::{Frames, LARGEST_FRAME};
use crate::error::{FileError, FileResult};
use std::fmt;
use std::path::{Path, PathBuf};

/// A file name with one place for the frame number.
///
/// - `####` and `@@@@` (two or more): the number with leading zeros, as many digits as signs; one `#` is a
///   number without them.
/// - `%04d`, `%4d` with a leading zero, and `%d`: as in C.
///
/// A number with more digits than that is written in full. Folders that are there are taken as they are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
    /// As it was written, for messages.
    written: String,
}

impl Pattern {
    /// The pattern in `path`'s file name; `None` where it has no place for a number.
    ///
    /// # Errors
    /// [`FileError::Argument`] for two such places, one in the name of a folder that is not there, or `%4d` (blanks in
    /// a file name).
    pub fn parse(path: &Path) -> FileResult<Option<Self>> {
        let refuse = |reason: &str| {
            Err(FileError::Argument { what: path.display().to_string(), reason: reason.to_owned() })
        };
        let folder = path.parent().unwrap_or(Path::new(""));
        let has_place = |folder: &Path| {
            let name = folder.file_name().and_then(|name| name.to_str());
            name.is_some_and(|name| matches!(find(name), Ok(Some(_))))
        };
        // Somebody's folder may be called "proj #7".
        if folder.ancestors().any(|folder| has_place(folder) && !folder.is_dir()) {
            return refuse("the frame number may stand in the file's name but not in a folder's name");
        }
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        match find(name) {
            Ok(None) => Ok(None),
            Ok(Some((start, end, digits))) => {
                if !matches!(find(&name[end..]), Ok(None)) {
                    return refuse("the name has two places for the frame number; keep one");
                }
                Ok(Some(Self {
                    folder: folder.to_owned(),
                    before: name[..start].to_owned(),
                    digits,
                    after: name[end..].to_owned(),
                    written: name.to_owned(),
                }))
            }
            Err(reason) => refuse(reason),
        }
    }

    /// The file of one frame.
    pub fn file(&self, frame: i64) -> PathBuf {
        self.folder.join(self.name(frame))
    }

    fn name(&self, frame: i64) -> String {
        format!("{}{frame:0width$}{}", self.before, self.after, width = self.digits)
    }

    /// The frame whose file has this name; `None` for other files.
    pub fn frame_of(&self, name: &str) -> Option<i64> {
        let number = name.strip_prefix(self.before.as_str())?.strip_suffix(self.after.as_str())?;
        let digits = number.strip_prefix('-').unwrap_or(number);
        if digits.is_empty() || digits.len() > 18 || !digits.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        let frame: i64 = number.parse().ok()?;
        // Another number of leading zeros is another sequence.
        (frame.abs() <= LARGEST_FRAME && self.name(frame) == name).then_some(frame)
    }

    /// The frames whose files exist.
    ///
    /// # Errors
    /// [`FileError::Io`] if the folder cannot be listed.
    pub fn discover(&self) -> FileResult<Frames> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let entries = std::fs::read_dir(folder).map_err(|error| FileError::io(folder, "list", error))?;
        let frames = entries
            .filter_map(|entry| entry.ok())
            .filter_map(|entry| self.frame_of(entry.file_name().to_str()?))
            .filter(|&frame| self.file(frame).is_file());
        Ok(frames.collect())
    }
}

impl fmt::Display for Pattern {
    /// As it was written.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.folder.join(&self.written).display())
    }
}

/// Widths beyond this are no frame number.
const MOST_DIGITS: usize = 32;

/// Start, end and digits of the first place for a number in a name.
fn find(name: &str) -> Result<Option<(usize, usize, usize)>, &'static str> {
    let bytes = name.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let sign = bytes[at];
        let run = bytes[at..].iter().take_while(|&&b| b == sign).count();
        match sign {
            b'#' => return signs(at, run),
            // A single @ is a letter like others.
            b'@' if run >= 2 => return signs(at, run),
            b'%' => {
                let width = bytes[at + 1..].iter().take_while(|b| b.is_ascii_digit()).count();
                let end = at + 1 + width;
                if bytes.get(end) == Some(&b'd') {
                    let width = &name[at + 1..end];
                    if !width.is_empty() && !width.starts_with('0') {
                        return Err("this pads the frame number with blanks; write a zero first, as in %04d");
                    }
                    let digits = if width.is_empty() { 1 } else { width.parse().unwrap_or(usize::MAX) };
                    return if digits <= MOST_DIGITS {
                        Ok(Some((at, end + 1, digits)))
                    } else {
                        Err(TOO_WIDE)
                    };
                }
                at += 1;
            }
            _ => at += run,
        }
    }
    Ok(None)
}

const TOO_WIDE: &str = "no frame number has that many digits; four (####) is usual";

fn signs(at: usize, run: usize) -> Result<Option<(usize, usize, usize)>, &'static str> {
    if run <= MOST_DIGITS { Ok(Some((at, at + run, run))) } else { Err(TOO_WIDE) }
}

/// The last number in a file's name before its ending: `shot_v2.1001.exr` is frame 1001. A minus counts where it begins the
/// name or follows a dot or an underscore: `shot.-005.exr` is frame -5, and `take-5.exr` frame 5.
pub fn number_in(path: &Path) -> Option<i64> {
    let stem = path.file_stem()?.to_str()?;
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let start = stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| {
        // Characters may be longer than a byte.
        at + stem[at..].chars().next().map_or(1, char::len_utf8)
    });
    let before = &stem[..start];
    let negative = before.strip_suffix('-').is_some_and(|rest| rest.is_empty() || rest.ends_with(['.', '_']));
    let size: i64 = stem[start..end].parse().ok().filter(|&size: &i64| size <= LARGEST_FRAME)?;
    Some(if negative { -size } else { size })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pattern(text: &str) -> Pattern {
        Pattern::parse(Path::new(text)).unwrap().unwrap()
    }

    #[test]
    fn every_way_of_writing_the_place_gives_the_same_files() {
        for text in ["a/frame.####.exr", "a/frame.%04d.exr", "a/frame.@@@@.exr"] {
            assert_eq!(pattern(text).file(7), Path::new("a/frame.0007.exr"));
            assert_eq!(pattern(text).file(12345), Path::new("a/frame.12345.exr"));
            assert_eq!(pattern(text).to_string(), text);
        }
        for text in ["frame#.exr", "frame%d.exr", "frame%01d.exr"] {
            assert_eq!(pattern(text).file(7), Path::new("frame7.exr"));
        }
        assert_eq!(pattern("100%.##.exr").file(3), Path::new("100%.03.exr"));
    }

    #[test]
    fn a_name_without_a_place_is_one_file() {
        for text in ["frame.exr", "user@host.png", "50%.exr", "%x.exr", "..", "/", ""] {
            assert_eq!(Pattern::parse(Path::new(text)).unwrap(), None, "{text}");
        }
    }

    #[test]
    fn names_that_nobody_can_mean_are_refused() {
        for (text, word) in [
            ("a.####.####.exr", "two places"),
            ("a.##.%04d.exr", "two places"),
            ("shot.##/a.exr", "folder"),
            ("a.%4d.exr", "%04d"),
            (&format!("{}.exr", "#".repeat(40)), "digits"),
            ("a.%0999999999999999999999d.exr", "digits"),
        ] {
            let said = Pattern::parse(Path::new(text)).unwrap_err().to_string();
            assert!(said.contains(word), "{said}");
        }
    }

    #[test]
    fn folders_that_are_there_are_taken_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["proj #7", "a@@b", "100%d", "v##"] {
            let inside = folder.path().join(name);
            assert!(Pattern::parse(&inside.join("out.exr")).is_err(), "{name}: not there yet");
            std::fs::create_dir(&inside).unwrap();
            assert_eq!(Pattern::parse(&inside.join("out.exr")).unwrap(), None);
            let pattern = Pattern::parse(&inside.join("out.####.exr")).unwrap().unwrap();
            assert_eq!(pattern.file(7), inside.join("out.0007.exr"));
            // What is missing within it is told of by others.
            assert_eq!(Pattern::parse(&inside.join("new/out.exr")).unwrap(), None);
            assert!(Pattern::parse(&inside.join("new ##/out.exr")).is_err());
        }
    }

    #[test]
    fn only_the_sequence_itself_is_found() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "f.0001.exr",
            "f.0003.exr",
            "f.12345.exr",
            "f.00012345.exr",
            "f.2.exr",
            "f..exr",
            "f.00a4.exr",
            "f.-005.exr",
            "f.0004.png",
            "f.0006.exr.bak",
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join("f.0009.exr")).unwrap();
        let found = pattern(folder.path().join("f.####.exr").to_str().unwrap()).discover().unwrap();
        assert_eq!(found.iter().collect::<Vec<_>>(), [-5, 1, 3, 12345]);
        assert!(pattern("no/such/folder/f.#.exr").discover().is_err());
    }

    #[test]
    fn the_number_in_a_name_is_the_last_one() {
        for (name, number) in [
            ("shot_v2.1001.exr", Some(1001)),
            ("a/12/b.exr", None),
            ("0007.png", Some(7)),
            ("é12ü.exr", Some(12)),
            ("n.-005.exr", Some(-5)),
            ("n_-5.exr", Some(-5)),
            ("-3.exr", Some(-3)),
            ("take-5.exr", Some(5)),
            ("n.--5.exr", Some(5)),
            ("2024-01-05.exr", Some(5)),
            ("99999999999999999999.exr", None),
        ] {
            assert_eq!(number_in(Path::new(name)), number, "{name}");
        }
    }

    proptest! {
        #[test]
        fn a_frames_file_is_found_as_that_frame(before in "[a-z_.]{0,6}", width in 1usize..8, frame in -LARGEST_FRAME..=LARGEST_FRAME) {
            let pattern = pattern(&format!("{before}{}.exr", "#".repeat(width)));
            let file = pattern.file(frame);
            prop_assert_eq!(pattern.frame_of(file.to_str().unwrap()), Some(frame));
            if frame >= 0 || before.is_empty() || before.ends_with(['.', '_']) {
                prop_assert_eq!(number_in(&file), Some(frame));
            }
        }

        #[test]
        fn names_are_one_to_one(width in 1usize..6, a in -2000i64..2000, b in -2000i64..2000) {
            let pattern = pattern(&"#".repeat(width));
            prop_assert_eq!(pattern.file(a) == pattern.file(b), a == b);
        }

        #[test]
        fn no_name_panics(name in "[#@%0-9d.a]{0,16}|\\PC{0,12}", other in "[-0-9.a]{0,24}") {
            if let Ok(Some(pattern)) = Pattern::parse(Path::new(&name)) {
                let _ = (pattern.frame_of(&other), pattern.file(-3));
            }
            let _ = number_in(Path::new(&name));
        }
    }
}
