//! Colour profiles (ICC): not applied, but handed on.

use super::encode::Bits;
use super::{Encoding, Format, Stored};

/// More bytes than this go into no file: a JPEG holds not many more, and profiles of displays have a few hundred.
const MOST_BYTES: usize = 8 << 20;

/// The colour profile of a file, where it is not sRGB's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Profile {
    bytes: Vec<u8>,
    /// Whether it belongs to floats, which are read as they are, or to whole numbers, read by sRGB's curve.
    float: bool,
}

impl Profile {
    /// A file's profile; none where it calls itself sRGB.
    pub(super) fn new(bytes: Vec<u8>, stored: Stored) -> Option<Self> {
        (!is_srgb(&bytes)).then_some(Self { bytes, float: stored == Stored::Float })
    }

    /// As it lies in the file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Whether it can stand beside red, green and blue: what is grey or of printing colours in the file is neither
    /// where it is written.
    fn is_rgb(&self) -> bool {
        let word = |at: usize| self.bytes.get(at..at + 4);
        word(36) == Some(b"acsp") && word(16) == Some(b"RGB ") && self.bytes.len() <= MOST_BYTES
    }

    /// Whether it says of such a file what it says of the one that it comes from.
    pub(super) fn fits(&self, encoding: Encoding, colors: usize) -> bool {
        let holds = matches!(encoding.format(), Format::Png | Format::Jpeg | Format::Tiff);
        holds && colors == 3 && self.is_rgb() && self.float == (encoding.bits() == Bits::Float)
    }

    /// What the user should know.
    pub(super) fn note(&self) -> String {
        let read = if self.float { "its numbers are read as linear light" } else { SRGB };
        let way = match (self.is_rgb(), self.float) {
            (true, false) => "the profile goes along into a result as PNG, JPEG or TIFF of whole numbers",
            (true, true) => "the profile goes along into a result as TIFF of floats",
            (false, _) => "the profile does not go along; bring the picture to sRGB first where that matters",
        };
        format!("its colour profile is not applied: {read}, and {way}")
    }
}

const SRGB: &str = "its numbers are read by sRGB's curve";

/// Whether a profile calls itself sRGB, in ASCII or UTF-16, and not a linear one.
fn is_srgb(profile: &[u8]) -> bool {
    let narrow: Vec<u8> = profile.iter().copied().filter(|&byte| byte != 0).collect();
    let says = |name: &[u8]| narrow.windows(name.len()).any(|word| word.eq_ignore_ascii_case(name));
    (says(b"sRGB") || says(b"IEC61966-")) && !says(b"linear")
}
