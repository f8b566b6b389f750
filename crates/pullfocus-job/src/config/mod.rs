//! Settings files: TOML with the long names of the command line's options as keys, and for a shot `[[key]]`.
//!
//! Paths in a settings file count from its own folder, so that a shot can be moved with its pictures; [`read`] makes them
//! paths of the working folder, [`write_to`] the other way round, and [`parse`] and [`write()`] leave them as
//! they are.

mod paths;
mod write;

pub use write::{text, write, write_to};

use crate::failure::{Failure, Result};
use crate::options::{Blur, Circle, CocView, Depth, Files, Lens, Run};
use crate::shot;
use crate::yielding;
use clap::Args;
use pullfocus_core::pull::Pull;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The options of `render` and `coc` together: one settings file serves both.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Which files.
    pub files: Files,
    /// The lens.
    pub lens: Lens,
    /// Where depth is and what it means.
    pub depth: Depth,
    /// The circle of confusion.
    pub circle: Circle,
    /// The blur.
    pub blur: Blur,
    /// What `coc` alone has.
    pub view: CocView,
    /// How the program runs.
    pub run: Run,
    /// The keys of a shot; settings files alone have them.
    pub keys: Pull,
}

impl Options {
    /// These options, and where one is missing that of `below`, unless these exclude it.
    #[must_use]
    pub fn over(self, mut below: Self) -> Self {
        let mut keys = shot::under(std::mem::take(&mut below.keys), &self.lens);
        let own = if self.keys.is_empty() { &keys } else { &self.keys };
        yielding::files(&mut below.files, &self.files);
        yielding::distance((&mut below.files, &mut below.depth), (&self.files, &self.depth));
        if yielding::lens(&mut below.lens, shot::has_focal_length(own), &self.lens) {
            keys = shot::without_focal_length(keys);
        }
        yielding::depth(&mut below.depth, &self.depth);
        yielding::layering(&mut below.blur, &self.blur);
        yielding::method(&mut below.blur, &self.blur);
        yielding::diffusion(&mut below.blur, &self.blur);
        Self {
            files: self.files.over(below.files),
            lens: self.lens.over(below.lens),
            depth: self.depth.over(below.depth),
            circle: self.circle.over(below.circle),
            blur: self.blur.over(below.blur),
            view: self.view.over(below.view),
            run: self.run.over(below.run),
            keys: if self.keys.is_empty() { keys } else { self.keys },
        }
    }

    /// These options over those of the settings file, if one is given.
    ///
    /// # Errors
    /// [`Failure::Usage`] where the file cannot be read or holds what it may not.
    pub fn with_file(self, file: Option<&Path>) -> Result<Self> {
        match file {
            Some(path) => Ok(self.over(read(path)?)),
            None => Ok(self),
        }
    }
}

/// Settings files hold a few lines; one of this many bytes is some other file.
pub const LARGEST_BYTES: u64 = 1 << 20;

/// Where a settings file has the keys of a shot: `[[key]]`.
const KEY: &str = "key";

/// The keys of a shot.
#[derive(Debug, Default, serde::Deserialize, serde::Serialize)]
struct Keyed {
    #[serde(default, skip_serializing_if = "Pull::is_empty")]
    key: Pull,
}

/// Every key that a settings file may have: the long names of the options.
pub fn keys() -> Vec<String> {
    let mut command = clap::Command::new("keys");
    for augment in [
        Files::augment_args,
        Lens::augment_args,
        Depth::augment_args,
        Circle::augment_args,
        Blur::augment_args,
        CocView::augment_args,
        Run::augment_args,
    ] {
        command = augment(command);
    }
    command.get_arguments().map(|arg| arg.get_id().as_str().replace('_', "-")).collect()
}

/// Reads a settings file's text.
///
/// # Errors
/// One sentence with the line: TOML that is none, a key that is no option, a value that the option cannot take.
pub fn parse(text: &str) -> std::result::Result<Options, String> {
    let table: toml::Table = group(text)?;
    let keys = keys();
    if let Some(unknown) = table.keys().find(|key| *key != KEY && !keys.contains(key)) {
        let near = keys
            .iter()
            .map(|key| (strsim::jaro(key, unknown), key))
            .filter(|(likeness, _)| *likeness > 0.75)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let hint = near.map_or(
            "keys are the long names of the options in 'pullfocus help render'".into(),
            |(_, key)| format!("did you mean '{key}'?"),
        );
        return Err(format!("'{}' is no option; {hint}", unknown.escape_debug()));
    }
    Ok(Options {
        files: group(text)?,
        lens: group(text)?,
        depth: group(text)?,
        circle: group(text)?,
        blur: group(text)?,
        view: group(text)?,
        run: group(text)?,
        keys: group::<Keyed>(text)?.key,
    })
}

fn group<T: DeserializeOwned>(text: &str) -> std::result::Result<T, String> {
    toml::from_str(text).map_err(|error| {
        let reason = error.message().replace('\n', ", ");
        match error.span().and_then(|span| text.get(..span.start)) {
            Some(before) => {
                let line = before.matches('\n').count() + 1;
                let start = before.rfind('\n').map_or(0, |end| end + 1);
                let content = text[start..].lines().next().unwrap_or_default().trim();
                let content: String = content.chars().take(60).collect();
                format!("line {line} ('{content}'): {reason}")
            }
            None => reason,
        }
    })
}

/// Reads a settings file. Its relative paths count from its folder; from a pipe, from the working folder.
///
/// # Errors
/// [`Failure::Usage`], naming the file.
pub fn read(path: &Path) -> Result<Options> {
    use std::io::Read;
    let unreadable = |reason: &dyn std::fmt::Display| {
        Failure::usage(format!("the settings file {} cannot be read: {reason}", path.display()))
    };
    let file = std::fs::File::open(path).map_err(|error| unreadable(&error))?;
    // A pipe has no place of its own.
    let piped = file.metadata().is_ok_and(|meta| !meta.is_file());
    let mut bytes = Vec::new();
    file.take(LARGEST_BYTES + 1).read_to_end(&mut bytes).map_err(|error| unreadable(&error))?;
    if bytes.len() as u64 > LARGEST_BYTES {
        return Err(unreadable(&"it is larger than 1 MiB, so it is no settings file"));
    }
    let text = String::from_utf8(bytes).map_err(|_| unreadable(&"it is not text in UTF-8"))?;
    let mut options = parse(&text)
        .map_err(|reason| Failure::usage(format!("in the settings file {}, {reason}", path.display())))?;
    let folder = path.parent().filter(|_| !piped).unwrap_or(Path::new(""));
    // An absolute path takes the folder's place.
    paths::each(&mut options, |file| *file = folder.join(&file));
    Ok(options)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{IntegratorName, PresetName};
    use crate::values::{Largest, Number, Range, Unit};

    #[test]
    fn every_kind_of_value_is_read() {
        let options = parse(
            "focus-distance = 2\nf-stop = 2.8\npreset = 'preview'\nmax-coc = '2%'\nprotect = [1, 2.5]\n\
             depth-unit = 'cm'\nresume = true\nchannels = ['beauty', 'key']\nthreads = 3\nframes = '1-9x2'",
        )
        .unwrap();
        assert_eq!(options.lens.focus_distance, Some(Number(2.0)));
        assert_eq!(options.lens.f_stop, Some(Number(2.8)));
        assert_eq!(options.blur.preset, Some(PresetName::Preview));
        assert_eq!(options.circle.max_coc, Some(Largest::Width(0.02)));
        assert_eq!(options.circle.protect, Some(Range([1.0, 2.5])));
        assert_eq!(options.depth.depth_unit, Some(Unit(0.01)));
        assert_eq!(options.files.resume, Some(true));
        assert_eq!(options.blur.channels.unwrap().0, ["beauty", "key"]);
        assert_eq!(options.run.threads, Some(3));
        assert_eq!(parse("focus-distance = inf").unwrap().lens.focus_distance, Some(Number(f64::INFINITY)));
        assert_eq!(parse("focus-distance = 'inf'").unwrap().lens.focus_distance, Some(Number(f64::INFINITY)));
        assert_eq!(parse("").unwrap(), Options::default());
    }

    #[test]
    fn a_shot_has_keys() {
        let shot = parse(
            "f-stop = 2\n[[key]]\nframe = 1001\nfocus-distance = 2.5\neasing = 'linear'\n\
             [[key]]\nframe = 1010\nfocus-distance = inf\nf-stop = 4",
        )
        .unwrap();
        assert_eq!(shot.keys.at(1010.0).focus_distance_m, Some(f64::INFINITY));
        assert_eq!(shot.keys.keys().len(), 2);
        let flags = parse("focus-distance = 3").unwrap();
        assert_eq!(flags.over(shot.clone()).keys.at(1001.0).focus_distance_m, None);
        assert_eq!(parse("").unwrap().over(shot.clone()).keys, shot.keys);
        let error = |text| parse(text).unwrap_err();
        assert!(error("[[key]]\nframe = 1\nfocus = 2").contains("focus-distance"));
        assert!(error("[[key]]\nframe = 1\nfocus-distance = -2").contains("above 0"));
        assert!(error("[[key]]\nframe = 1\neasing = 'bouncy'").contains("smooth"));
    }

    #[test]
    fn mistakes_name_the_key_or_the_line() {
        let error = |text| parse(text).unwrap_err();
        assert_eq!(error("f-stopp = 2"), "'f-stopp' is no option; did you mean 'f-stop'?");
        assert!(error("blades = 6").starts_with("'blades' is no option; "));
        let typed = error("f-stop = 2\nthreads = 'many'");
        assert!(typed.starts_with("line 2 ('threads = 'many''): "), "{typed}");
        let named = error("preset = 'draft'");
        assert!(named.contains("line 1") && named.contains("preview"), "{named}");
        assert!(error("f-stop = [").contains("line 1"));
        assert!(error("f-stop = nan").contains("line 1"));
        assert!(!error("\"a\\nb\" = 1").contains('\n'));
        assert!(!error("depth-unit = \"a\\nb\"").contains('\n'));
        assert!(!error("a = 1\nb = 'x\n'").contains('\n'));
    }

    #[test]
    fn flags_lie_over_the_file() {
        let flags = parse("f-stop = 4").unwrap();
        let file = parse("f-stop = 2\nfocus-distance = 3\nintegrator = 'rational'").unwrap();
        let both = flags.over(file);
        assert_eq!(both.lens.f_stop, Some(Number(4.0)));
        assert_eq!(both.lens.focus_distance, Some(Number(3.0)));
        assert_eq!(both.blur.integrator, Some(IntegratorName::Rational));
    }

    #[test]
    fn every_key_is_accepted() {
        // A key that clap knows and serde does not would be ignored silently: a wrong type must be refused.
        for key in keys() {
            let text = format!("{key} = {{ a = 1 }}");
            assert!(parse(&text).is_err_and(|error| error.contains("line 1")), "{key}");
        }
        assert!(keys().contains(&"focus-distance".to_owned()) && keys().len() > 40);
    }
}
