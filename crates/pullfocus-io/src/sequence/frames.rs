//! Sets of frame numbers, as people write them.

use crate::error::FileError;
use std::fmt;
use std::str::FromStr;

/// Frame numbers lie between minus this and this.
pub const LARGEST_FRAME: i64 = 999_999_999;
/// A set holds no more frames than this.
pub const MOST_FRAMES: usize = 1_000_000;

/// Frame numbers in rising order, each once.
///
/// Written as frames and ranges with commas between: `7`, `1001-1100`, `1001-1100x2` (every second one from the
/// first on), `1,3,5-9`, `-10--5`. A range that falls, `9-5`, is the same set as the one that rises.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Frames(Vec<i64>);

impl Frames {
    /// The frames in rising order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = i64> + '_ {
        self.0.iter().copied()
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether `frame` is one of them.
    pub fn contains(&self, frame: i64) -> bool {
        self.0.binary_search(&frame).is_ok()
    }
}

impl FromIterator<i64> for Frames {
    fn from_iter<I: IntoIterator<Item = i64>>(frames: I) -> Self {
        let mut frames: Vec<i64> = frames.into_iter().collect();
        frames.sort_unstable();
        frames.dedup();
        Self(frames)
    }
}

/// A whole number at the start of `text`, with its sign, and what follows.
fn number(text: &str) -> Option<(i64, &str)> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    // Nine digits hold the largest frame; leading zeros may be more.
    let value: i64 = digits[..end].parse().ok()?;
    let value = if text.starts_with('-') { -value } else { value };
    (value.abs() <= LARGEST_FRAME).then_some((value, &digits[end..]))
}

/// First frame, last frame and step of one item between commas.
fn range(item: &str) -> Option<(i64, i64, i64)> {
    let (first, rest) = number(item)?;
    if rest.is_empty() {
        return Some((first, first, 1));
    }
    let (last, rest) = number(rest.strip_prefix('-')?)?;
    if rest.is_empty() {
        return Some((first, last, 1));
    }
    let (step, rest) = number(rest.strip_prefix('x')?)?;
    (rest.is_empty() && step > 0).then_some((first, last, step))
}

impl FromStr for Frames {
    type Err = FileError;

    fn from_str(text: &str) -> Result<Self, FileError> {
        let refuse = |reason: String| FileError::Argument { what: format!("the frames \"{text}\""), reason };
        let mut frames = Vec::new();
        for item in text.split(',') {
            let item = item.trim();
            let (first, last, step) = range(item).ok_or_else(|| {
                refuse(format!(
                    "\"{item}\" is no frame and no range; write them like 1001, 1001-1100 or 1001-1100x2, \
                     with commas between"
                ))
            })?;
            let count = (last.abs_diff(first) / step.unsigned_abs()) as usize + 1;
            if frames.len() + count > MOST_FRAMES {
                return Err(refuse(format!(
                    "these are more than {MOST_FRAMES} frames; render them in parts"
                )));
            }
            let direction = if last < first { -step } else { step };
            frames.extend((0..count as i64).map(|i| first + i * direction));
        }
        Ok(frames.into_iter().collect())
    }
}

impl fmt::Display for Frames {
    /// As short as ranges make it: `1-5, 8, 10-20x2`; empty for no frames.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rest = self.0.as_slice();
        let mut separator = "";
        while let [first, tail @ ..] = rest {
            let step = tail.first().map_or(1, |second| second - first);
            let run = rest.windows(2).take_while(|pair| pair[1] - pair[0] == step).count() + 1;
            // Two frames are a range only where they are neighbours: "3, 7" and not "3-7x4".
            let taken = if run >= 3 || (run == 2 && step == 1) { run } else { 1 };
            match (taken, step) {
                (1, _) => write!(f, "{separator}{first}")?,
                (_, 1) => write!(f, "{separator}{first}-{}", rest[taken - 1])?,
                (_, step) => write!(f, "{separator}{first}-{}x{step}", rest[taken - 1])?,
            }
            separator = ", ";
            rest = &rest[taken..];
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parsed(text: &str) -> Vec<i64> {
        text.parse::<Frames>().unwrap().0
    }

    #[test]
    fn ranges_are_read_as_people_write_them() {
        assert_eq!(parsed("1001-1005x2"), [1001, 1003, 1005]);
        assert_eq!(parsed("1001-1006x2"), [1001, 1003, 1005]);
        assert_eq!(parsed("1,3,5-9"), [1, 3, 5, 6, 7, 8, 9]);
        assert_eq!(parsed(" 9-7 , 8, 0007"), [7, 8, 9]);
        assert_eq!(parsed("-2-2x2"), [-2, 0, 2]);
        assert_eq!(parsed("-3--1"), [-3, -2, -1]);
        assert_eq!(parsed("10-5x2"), [6, 8, 10], "steps count from the first frame given");
    }

    #[test]
    fn what_is_no_range_is_refused_with_an_example() {
        for text in [
            "",
            "1-",
            "-",
            "1--",
            "a",
            "1-5x0",
            "1-5x-1",
            "1-5x",
            "1,,2",
            "1.5",
            "1-2-3",
            "１",
            "1001-1100x2,",
        ] {
            let said = text.parse::<Frames>().unwrap_err().to_string();
            assert!(said.contains("1001-1100x2"), "{text}: {said}");
        }
        for text in ["1-999999999", "0-999999,5-999999", "99999999999999999999"] {
            assert!(text.parse::<Frames>().is_err(), "{text}");
        }
    }

    #[test]
    fn lists_are_shown_as_ranges() {
        let shown = |frames: &[i64]| frames.iter().copied().collect::<Frames>().to_string();
        assert_eq!(shown(&[5, 1, 2, 3, 4, 8]), "1-5, 8");
        assert_eq!(shown(&[10, 12, 14, 16]), "10-16x2");
        assert_eq!(shown(&[3, 7]), "3, 7");
        assert_eq!(shown(&[3, 4]), "3-4");
        assert_eq!(shown(&[1, 3, 4, 5]), "1, 3-5");
        assert_eq!(shown(&[]), "");
    }

    proptest! {
        #[test]
        fn what_is_shown_reads_back(frames in proptest::collection::vec(-50i64..50, 1..40)) {
            let frames: Frames = frames.into_iter().collect();
            prop_assert_eq!(frames.to_string().parse::<Frames>().unwrap(), frames);
        }

        #[test]
        fn no_text_panics(text in "[-0-9x, ]{0,24}|\\PC{0,12}") {
            let _ = text.parse::<Frames>();
        }
    }
}
