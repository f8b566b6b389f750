//! Options as a settings file.

use super::{Keyed, Options, paths};
use crate::failure::{Failure, Result};
use pullfocus_io::FileError;
use pullfocus_io::output::{Existing, Need, PendingFile, check_target};
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a reader should know before anything else.
const HEAD: &str = "# A shot of pullfocus. Render it: pullfocus render --shot FILE (this file; paths count from its folder)\n";

/// The text of a settings file that [`super::parse`] reads as these options: what is given and nothing else, the keys of a
/// shot at the end, in the same order for the same options.
///
/// Paths stay as they are ([`write_to`] makes them relative to the file); what is no text in UTF-8 in one is
/// replaced.
pub fn write(options: &Options) -> String {
    let mut options = options.clone();
    paths::each(&mut options, |path| {
        if path.to_str().is_none() {
            *path = path.to_string_lossy().into_owned().into();
        }
    });
    let Options { files, lens, depth, circle, blur, view, run, keys } = options;
    let mut text = HEAD.to_owned();
    for group in [
        toml(&files),
        toml(&lens),
        toml(&depth),
        toml(&circle),
        toml(&blur),
        toml(&view),
        toml(&run),
        toml(&Keyed { key: keys }),
    ] {
        if !group.is_empty() {
            text.push('\n');
            text.push_str(&group);
        }
    }
    text
}

fn toml(group: &impl Serialize) -> String {
    ::toml::to_string(group).expect("text, numbers and lists of these are TOML")
}

/// The text of a settings file at `path`, with its paths relative to its folder where both lie under a common one.
///
/// # Errors
/// [`Failure::Usage`] for paths that are no text in UTF-8.
pub fn text(options: &Options, path: &Path) -> Result<String> {
    let mut options = options.clone();
    if let Some(odd) = named(&mut options).iter().find(|file| file.to_str().is_none()) {
        return Err(Failure::usage(format!(
            "{}: the name is no text in UTF-8, which a settings file must be; rename the file",
            odd.display()
        )));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    paths::each(&mut options, |file| {
        let told = paths::from(folder, file).or_else(|| std::path::absolute(&file).ok());
        if let Some(told) = told {
            *file = told;
        }
    });
    Ok(write(&options))
}

/// The files that options name.
fn named(options: &mut Options) -> Vec<PathBuf> {
    let mut named = Vec::new();
    paths::each(options, |file| named.push(file.clone()));
    named
}

/// Writes a settings file ([`text`]), whole or not at all.
///
/// # Errors
/// [`Failure::Usage`] for a place that cannot be written to, one of the options' own files, and paths that are no text in
/// UTF-8; [`Failure::Failed`] where the file is there and may not be replaced, or cannot be written.
pub fn write_to(options: &Options, path: &Path, existing: Existing) -> Result<()> {
    let text = text(options, path)?;
    if check_target(path, named(&mut options.clone()), existing)? == Need::Finished {
        return Ok(());
    }
    let mut pending = PendingFile::create(path, existing)?;
    pending.write_all(text.as_bytes()).map_err(|error| FileError::io(path, "write", error))?;
    pending.commit()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::{keys, parse, read};
    use super::*;
    use crate::values::Number;
    use proptest::prelude::*;
    use pullfocus_core::pull::{Easing, Key, Pull};
    use std::fs;

    const NUMBER: &[&str] = &["2", "-0.5", "inf", "1e300", "1e-300", "0.1", "1.2345678901234568e20"];
    const SWITCH: &[&str] = &["true", "false"];
    const NAME: &[&str] = &["'Z'", "'0'", "7", "'with \"quotes\" and \\ and é\t'"];
    const COUNT: &[&str] = &["1", "4294967295"];
    const PATH: &[&str] = &["'a b/c.####.exr'", "'/x/ü.exr'", "'C:\\\\x'", "'..'"];

    /// Every option, with all kinds of values that it may have.
    const VALUES: &[(&str, &[&str])] = &[
        ("input", &["'in.exr'", "['a.exr']", "['a.exr', 'b.exr']", "[]"]),
        ("output", PATH),
        ("depth-file", PATH),
        ("foreground", PATH),
        ("behind", PATH),
        ("bits", &["8", "'16'", "'float'"]),
        ("frames", &["'1001-1100x2'", "7", "'1,3,5-9'"]),
        ("part", NAME),
        ("view", NAME),
        ("overwrite", SWITCH),
        ("resume", SWITCH),
        ("allow-large-files", SWITCH),
        ("focus-distance", NUMBER),
        ("f-stop", NUMBER),
        ("focal-length", NUMBER),
        ("sensor-width", NUMBER),
        ("fov-x", NUMBER),
        ("aperture-diameter", NUMBER),
        ("depth", &["'planar'", "'ray'", "'inverse'", "'disparity'", "'normalized'"]),
        ("depth-channel", NAME),
        ("coc-channel", NAME),
        ("depth-unit", &["'m'", "'cm'", "'in'", "0.0254", "0.25", "3"]),
        ("depth-scale", NUMBER),
        ("depth-shift", NUMBER),
        ("depth-near", NUMBER),
        ("depth-far", NUMBER),
        ("depth-invert", SWITCH),
        ("depth-far-clip", NUMBER),
        ("repair-depth", SWITCH),
        ("max-coc", &["40", "'40.5px'", "'2%'", "'0.3%'", "'1.23456789e-7%'", "'129.9999999999999%'", "0"]),
        ("front", NUMBER),
        ("back", NUMBER),
        ("protect", &["[1.5, 3]", "'2,inf'", "[0.1, 0.1]"]),
        ("preset", &["'preview'", "'final'"]),
        (
            "method",
            &["'diffusion'", "'naive'", "'gather'", "'square'", "'pyramid'", "'tensor'", "'aperture'"],
        ),
        ("psf", &["'gaussian'", "'aperture'"]),
        ("aperture", &["'disc'", "'blades:6'", "'image:stars/a:b.png'", "'image:/x/y.png'"]),
        ("show", &["'result'", "'layer:0'", "'matte:12'"]),
        ("aperture-rotation", NUMBER),
        ("aperture-roundness", NUMBER),
        ("squeeze", NUMBER),
        ("bokeh-threshold", NUMBER),
        ("bokeh-gain", NUMBER),
        ("bokeh-knee", NUMBER),
        ("bokeh-least", NUMBER),
        ("cats-eye", NUMBER),
        ("quality", &["'standard'", "'fine'"]),
        ("mipmap", &["'linear'", "'nearest'"]),
        ("tensor-sites", &["'quadtree'", "'skip'"]),
        ("tensor-spacing", NUMBER),
        ("tensor-gather", &["'naive'", "'pyramid'", "'repeated-integration'"]),
        ("tensor-spread", &["'naive'", "'pyramid'"]),
        ("layering", &["'single'", "'background'", "'general'"]),
        ("layers", COUNT),
        ("layer-threshold", NUMBER),
        ("integrator", &["'backward-euler'", "'rational'", "'disc'"]),
        ("steps", COUNT),
        ("calibration", &["'variance'", "'kass'", "'beck'"]),
        ("solver", &["'lu'", "'cyclic-reduction'", "'parallel-cyclic-reduction'", "'hybrid'", "'jacobi'"]),
        ("sweeps", COUNT),
        ("tolerance", NUMBER),
        ("channels", &["['beauty', 'key']", "'a, b'", "'one'"]),
        ("preview-png", PATH),
        ("device", &["'auto'", "'cpu'", "'gpu'", "'gpu:RTX \"4090\"'"]),
        ("gpu-storage", &["'f32'", "'f16'"]),
        ("threads", COUNT),
        ("json", SWITCH),
        ("verbose", SWITCH),
        ("quiet", SWITCH),
        ("coc-range", NUMBER),
    ];

    #[track_caller]
    fn back(options: &Options) {
        let text = write(options);
        assert_eq!(parse(&text).as_ref(), Ok(options), "{text}");
        assert!(text.starts_with("# ") && text.lines().next().unwrap().contains("render --shot"), "{text}");
    }

    #[test]
    fn every_option_comes_back() {
        let mut all: Vec<&str> = VALUES.iter().map(|(key, _)| *key).collect();
        let mut known = keys();
        all.sort_unstable();
        known.sort_unstable();
        assert_eq!(all, known, "an option has no values here");
        for (key, values) in VALUES {
            for value in *values {
                let options = parse(&format!("{key} = {value}")).unwrap();
                back(&options);
                assert_eq!(write(&options).lines().count(), 3, "{}", write(&options));
            }
        }
        assert_eq!(write(&Options::default()), HEAD);
    }

    #[test]
    fn a_file_is_as_people_would_write_it() {
        let options = parse(
            "focus-distance = 2.0\nf-stop = 2.8\nprotect = '1.5,3'\nmax-coc = '2%'\ninput = ['in.####.exr']\n\
             depth-unit = 0.01\n[[key]]\nframe = 1001.0\nfocus-distance = inf\neasing = 'hold'\n\
             [[key]]\nframe = 1012.5\nfocus-distance = 3.0\nf-stop = 4",
        );
        let expected = "\n\
            input = \"in.####.exr\"\n\n\
            focus-distance = 2\n\
            f-stop = 2.8\n\n\
            depth-unit = \"cm\"\n\n\
            max-coc = \"2%\"\n\
            protect = [1.5, 3]\n\n\
            [[key]]\n\
            frame = 1001\n\
            focus-distance = inf\n\
            easing = \"hold\"\n\n\
            [[key]]\n\
            frame = 1012.5\n\
            focus-distance = 3\n\
            f-stop = 4\n\
            easing = \"smooth\"\n";
        assert_eq!(write(&options.unwrap()), format!("{HEAD}{expected}"));
    }

    fn key() -> impl Strategy<Value = Key> {
        let number = || prop::option::of(prop_oneof![1e-6..1e6f64, Just(50.0)]);
        let focus = prop::option::of(prop_oneof![1e-6..1e6f64, Just(f64::INFINITY)]);
        let easing =
            prop::sample::select(vec![Easing::Hold, Easing::Linear, Easing::Smooth, Easing::In, Easing::Out]);
        (-1e6..1e6f64, focus, number(), number(), easing).prop_map(
            |(frame, focus_distance_m, f_stop, focal_length_mm, easing)| Key {
                frame,
                focus_distance_m,
                f_stop,
                focal_length_mm,
                easing,
            },
        )
    }

    proptest! {
        #[test]
        fn any_options_come_back(
            picks in prop::collection::vec(0usize..12, VALUES.len()),
            numbers in prop::collection::vec(any::<f64>(), 4),
            part in 0.0..8.0f64,
            keys in prop::collection::vec(key(), 0..5),
        ) {
            let mut text = String::new();
            for ((key, values), pick) in VALUES.iter().zip(picks) {
                if let Some(value) = values.get(pick) {
                    text.push_str(&format!("{key} = {value}\n"));
                }
            }
            let mut options = parse(&text).unwrap();
            let number = |at: usize| Some(Number(numbers[at])).filter(|number| !number.0.is_nan());
            options.lens.focus_distance = number(0);
            options.depth.depth_shift = number(1);
            options.circle.front = number(2);
            options.blur.tolerance = number(3);
            options.circle.max_coc = Some(crate::values::Largest::Width(part));
            // Two keys at one frame are none.
            options.keys = Pull::new(keys).unwrap_or_default();
            let text = write(&options);
            prop_assert_eq!(parse(&text), Ok(options), "{}", text);
        }
    }

    #[test]
    fn paths_count_from_the_files_folder() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir_all(at("shots")).unwrap();
        fs::create_dir_all(at("renders")).unwrap();
        let absolute = parse(&format!(
            "input = {:?}\noutput = {:?}\naperture = {:?}\npreview-png = 'seen.####.png'",
            at("renders/f.####.exr"),
            at("shots/out/f.####.exr"),
            format!("image:{}", at("shots/star.png").display()),
        ))
        .unwrap();
        let file = at("shots/pull.toml");
        write_to(&absolute, &file, Existing::Refuse).unwrap();
        let text = fs::read_to_string(&file).unwrap();
        for line in [
            "input = \"../renders/f.####.exr\"",
            "output = \"out/f.####.exr\"",
            "aperture = \"image:star.png\"",
        ] {
            assert!(text.contains(line), "{text}");
        }
        // Read, they lie in the folder; moved together, they move along.
        let read_back = read(&file).unwrap();
        assert_eq!(read_back.files.output, Some(at("shots/out/f.####.exr")));
        assert_eq!(read_back.files.input, Some(vec![at("shots/../renders/f.####.exr")]));
        let seen = std::path::absolute("seen.####.png").unwrap();
        let seen_read = read_back.blur.preview_png.unwrap();
        assert_eq!(seen_read.file_name(), seen.file_name());
        assert_eq!(
            seen_read.parent().unwrap().canonicalize().unwrap(),
            seen.parent().unwrap().canonicalize().unwrap()
        );
        let elsewhere = at("x/out.exr");
        fs::write(&file, format!("input = 'in.exr'\noutput = {elsewhere:?}\naperture = 'blades:6'")).unwrap();
        let options = read(&file).unwrap();
        assert_eq!(options.files.input, Some(vec![at("shots/in.exr")]));
        assert_eq!(options.files.output, Some(elsewhere));
    }

    #[test]
    fn a_file_that_is_there_is_replaced_when_asked_and_never_an_input() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("shot.toml");
        let options = parse("f-stop = 2").unwrap();
        write_to(&options, &file, Existing::Refuse).unwrap();
        let said = write_to(&options, &file, Existing::Refuse).unwrap_err();
        assert!(said.exit_code() == 1 && said.to_string().contains("exists already"), "{said}");
        let other = parse("f-stop = 4").unwrap();
        write_to(&other, &file, Existing::Keep).unwrap();
        assert_eq!(read(&file).unwrap(), options);
        write_to(&other, &file, Existing::Replace).unwrap();
        assert_eq!(read(&file).unwrap(), other);
        let itself = parse(&format!("input = {file:?}")).unwrap();
        assert!(write_to(&itself, &file, Existing::Replace).unwrap_err().to_string().contains("inputs"));
        assert!(write_to(&options, &place.path().join("no/shot.toml"), Existing::Refuse).is_err());
    }
}
