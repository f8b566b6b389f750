//! Configs as the library `ocio` reads them.

use super::{Ask, Choice, Display, Menu, Source, Table};
use ocio::config::archive::OciozArchive;
use ocio::config::collect_context_variables;
use ocio::{ColorSpaceDirection, ColorSpaceTransform, Config, Context, Transform};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

/// The config that is taken where nobody names one.
const BUILT_IN: &str = "ocio://studio-config-latest";

/// A config is text of some 100 kB, an archive holds its tables too; what is larger is another kind of file.
const LARGEST_BYTES: u64 = 1 << 30;

/// Configs are written without YAML's aliases. A few are somebody's short cut; many, one in another, would be a picture of any size
/// once they are written out, and memory has an end.
const MOST_ALIASES: usize = 8;

/// What pictures are that were decoded from sRGB when they were read, by the names that configs have for it.
const LINEAR_709: [&str; 6] = [
    "lin_rec709_scene",
    "lin_rec709_srgb",
    "lin_rec709",
    "Linear Rec.709 (sRGB)",
    "Utility - Linear - Rec.709",
    "Utility - Linear - sRGB",
];

/// Endings of pictures that hold encoded colours.
const ENCODED: [&str; 6] = ["png", "jpg", "jpeg", "tif", "tiff", "webp"];

/// Reads configs; the last one, and the last table, stay while they are what is asked for.
pub struct Reader {
    environment: Option<String>,
    config: Option<(Source, u64, Config)>,
    baked: Option<([String; 3], Arc<Table>)>,
}

/// Calls the library. It is young and its input is any file: where it panics, a sentence is told and the window goes on. What it was
/// working on is dropped by the caller, so that nothing half done is looked at again.
fn guarded<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
        Err(format!("the library that reads it stopped ({text})"))
    })
}

/// The library's messages have lines, and may have many.
fn told(error: &ocio::Error) -> String {
    let words: Vec<&str> = error.message().split_whitespace().collect();
    let text = words.join(" ");
    let text = text.trim_end_matches('.');
    match text.char_indices().nth(300) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

impl Reader {
    /// `environment` is what the variable OCIO holds.
    pub fn new(environment: Option<String>) -> Self {
        Self { environment, config: None, baked: None }
    }

    /// What the config offers, and the transform.
    pub fn read(&mut self, ask: &Ask) -> (Option<Menu>, Result<Arc<Table>, String>) {
        let path = match &ask.choice.config {
            Source::Usual => self.environment.clone().unwrap_or_else(|| BUILT_IN.into()),
            Source::BuiltIn => BUILT_IN.into(),
            Source::File(path) => path.to_string_lossy().into_owned(),
        };
        let instead = "choose another config, or another display transform (the picture is shown in sRGB)";
        if path.is_empty() {
            let sentence = "name the colour config's file (config.ocio or .ocioz) in the field below; until then the picture is shown in sRGB";
            return (None, Err(sentence.into()));
        }
        let is_kept =
            |(source, again, _): &(Source, u64, Config)| *source == ask.choice.config && *again == ask.again;
        if !self.config.as_ref().is_some_and(is_kept) {
            (self.config, self.baked) = (None, None);
            // Tables that configs name stay in the library's memory, whatever becomes of the files.
            ocio::clear_all_caches();
            match guarded(|| open(&path)) {
                Ok(config) => self.config = Some((ask.choice.config.clone(), ask.again, config)),
                Err(reason) => {
                    return (
                        None,
                        Err(format!("{path}: the colour config cannot be read: {reason}; {instead}")),
                    );
                }
            }
        }
        let Some((_, _, config)) = &self.config else { return (None, Err(format!("{path}: {instead}"))) };
        let menu = match guarded(|| menu(config, &path, ask)) {
            Ok(menu) => menu,
            Err(reason) => {
                // What there is instead, to choose from: the names may be of another show's config.
                let usual = Ask {
                    choice: Choice { config: ask.choice.config.clone(), ..Choice::default() },
                    ..ask.clone()
                };
                let menu = guarded(|| menu(config, &path, &usual)).ok();
                return (menu, Err(format!("{path}: {reason}; {instead}")));
            }
        };
        let key = [&menu.space, &menu.display, &menu.view].map(String::clone);
        if let Some((_, table)) = self.baked.as_ref().filter(|(known, _)| *known == key) {
            return (Some(menu), Ok(Arc::clone(table)));
        }
        match guarded(|| bake(config, &menu)) {
            Ok(table) => {
                let table = Arc::new(table);
                self.baked = Some((key, Arc::clone(&table)));
                (Some(menu), Ok(table))
            }
            Err(reason) => {
                self.baked = None;
                let sentence = format!(
                    "{path}: the view {} of the display {} cannot be made: {reason}; choose another view, or another display transform (the picture is shown in sRGB)",
                    menu.view, menu.display
                );
                (Some(menu), Err(sentence))
            }
        }
    }
}

fn open(path: &str) -> Result<Config, String> {
    if !path.contains("://") {
        let data = std::fs::metadata(path).map_err(|error| error.to_string())?;
        if !data.is_file() {
            return Err("it is no file; name the config.ocio in it".into());
        }
        if data.len() > LARGEST_BYTES {
            return Err(format!("it has {} bytes, more than any config", data.len()));
        }
        let mut text = std::fs::read(path).map_err(|error| error.to_string())?;
        if text.starts_with(b"PK") {
            let archive = OciozArchive::open(path).and_then(|archive| archive.config_data());
            text = archive.map_err(|error| told(&error))?.into_bytes();
        }
        if aliases(&text) > MOST_ALIASES {
            return Err(format!("it refers back to itself (YAML's *name) more than {MOST_ALIASES} times"));
        }
    }
    Config::create_from_file(path).map_err(|error| told(&error))
}

/// How often YAML's alias, a star before a name, stands where a value may begin.
fn aliases(text: &[u8]) -> usize {
    let begins = |byte: u8| byte.is_ascii_whitespace() || b",[{:-".contains(&byte);
    let named = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    text.windows(3).filter(|at| begins(at[0]) && at[1] == b'*' && named(at[2])).count()
}

/// What a config offers; defaults where nothing was chosen.
fn menu(config: &Config, path: &str, ask: &Ask) -> Result<Menu, String> {
    let display = |name: String| {
        let views = (0..config.num_views(&name)).map(|index| config.view(&name, index)).collect();
        Display { name, views }
    };
    let displays: Vec<Display> =
        (0..config.num_displays()).map(|index| display(config.display(index))).collect();
    let Choice { display, view, space, .. } = &ask.choice;
    let display = display.clone().unwrap_or_else(|| config.default_display());
    let space = match space {
        Some(space) => space.clone(),
        None => usual_space(config, path, ask.file.as_deref()),
    };
    let view = match view {
        Some(view) => view.clone(),
        // A config may say which views suit a colour space.
        None => config
            .default_view_for_color_space(&display, &space)
            .ok()
            .filter(|view| !view.is_empty())
            .unwrap_or_else(|| config.default_view(&display)),
    };
    let names = (0..config.num_color_spaces()).map(|index| config.color_space_name_by_index(index));
    let mut spaces: Vec<String> = names.filter(|name| is_linear(config, name)).map(str::to_owned).collect();
    if !space.is_empty() && !spaces.contains(&space) {
        spaces.insert(0, space.clone());
    }
    let known = displays.iter().find(|known| known.name == display);
    match known {
        None if displays.is_empty() => return Err("the colour config has no display".into()),
        None => return Err(format!("the colour config has no display {display}")),
        Some(known) if !known.views.contains(&view) => {
            return Err(format!("the display {display} of the colour config has no view {view}"));
        }
        Some(_) => {}
    }
    if !config.has_color_space(&space) {
        return Err(format!("the colour config has no colour space {space}"));
    }
    let named = [config.name().to_owned(), path.to_owned()].into_iter().find(|name| !name.is_empty());
    Ok(Menu { config: named.unwrap_or_default(), displays, spaces, display, view, space })
}

/// The colour space of a file's pixels, where nobody chose one.
fn usual_space(config: &Config, path: &str, file: Option<&Path>) -> String {
    let canonical = |name: &str| config.canonical_name(name).to_owned();
    let file = file.map(|file| file.to_string_lossy().into_owned()).unwrap_or_default();
    let ending = file.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase());
    if ENCODED.contains(&ending.as_str())
        && let Some(space) = LINEAR_709.iter().find(|name| config.has_color_space(name))
    {
        return canonical(space);
    }
    // The built-in config takes every .exr for ACES's archive format (ACES2065-1), which renderers do not write.
    let has_rule = path != BUILT_IN && !file.is_empty() && !config.filepath_only_matches_default_rule(&file);
    if !has_rule && config.has_color_space(ocio::ROLE_SCENE_LINEAR) {
        return canonical(ocio::ROLE_SCENE_LINEAR);
    }
    canonical(&config.color_space_from_filepath(&file))
}

/// Whether a colour space is one that pictures are blurred in.
fn is_linear(config: &Config, name: &str) -> bool {
    let Some(space) = config.get_color_space(name) else { return false };
    if space.encoding().is_empty() {
        // The library tries colours, and would read every table of an old config for it. No table is linear.
        let ways = [ColorSpaceDirection::ToReference, ColorSpaceDirection::FromReference];
        if ways.into_iter().filter_map(|way| space.transform(way)).any(has_table) {
            return false;
        }
        // Of this function it is known that it notices transforms which lead back to themselves.
        let there = Transform::ColorSpace(ColorSpaceTransform::new(name, ocio::ROLE_SCENE_LINEAR));
        if collect_context_variables(config, config.current_context(), &there, &mut Context::new()).is_err() {
            return false;
        }
    }
    config.is_color_space_linear(name, ocio::ReferenceSpaceType::Scene).unwrap_or(false)
}

/// Whether a transform reads a file other than a matrix.
fn has_table(transform: &Transform) -> bool {
    match transform {
        Transform::Group(group) => group.transforms.iter().any(has_table),
        Transform::File(file) => !file.src.to_ascii_lowercase().ends_with(".spimtx"),
        _ => false,
    }
}

fn bake(config: &Config, menu: &Menu) -> Result<Table, String> {
    let processor = config
        .get_display_view_processor(&menu.space, &menu.display, &menu.view)
        .map_err(|error| told(&error))?
        .default_cpu_processor();
    Ok(Table::bake(|colors| processor.apply_pixels(colors)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::path::PathBuf;

    fn ask(config: Source) -> Ask {
        Ask { choice: Choice { config, ..Choice::default() }, file: None, again: 0 }
    }

    /// A config with one display, whose view is the colour space `out`.
    fn config(out: &str) -> String {
        format!(
            "ocio_profile_version: 2
roles: {{scene_linear: lin, default: lin}}
file_rules:
  - !<Rule> {{name: Plates, colorspace: wide, pattern: \"*plate*\", extension: \"*\"}}
  - !<Rule> {{name: Default, colorspace: default}}
displays:
  Cinema:
    - !<View> {{name: Film, colorspace: out}}
colorspaces:
  - !<ColorSpace> {{name: lin}}
  - !<ColorSpace> {{name: wide, to_scene_reference: !<MatrixTransform> {{matrix: [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}}}
  - !<ColorSpace> {{name: out, from_scene_reference: {out}}}
"
        )
    }

    fn written(folder: &Path, name: &str, text: &str) -> Source {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        Source::File(path)
    }

    #[test]
    fn the_table_is_the_librarys_transform() {
        let (menu, table) = Reader::new(None).read(&ask(Source::Usual));
        let (menu, table) = (menu.unwrap(), table.unwrap());
        assert_eq!(menu.space, "ACEScg");
        assert!(menu.spaces.iter().any(|space| space == "Linear Rec.709 (sRGB)"), "{:?}", menu.spaces);
        let config = open(BUILT_IN).unwrap();
        let processor = config.get_display_view_processor(&menu.space, &menu.display, &menu.view).unwrap();
        let processor = processor.default_cpu_processor();
        // Greys, primaries, complements and skin, from a 1000th of white to 60 times white.
        let hues = [[1.0, 1.0, 1.0], [1.0, 0.02, 0.02], [0.05, 1.0, 0.05], [0.02, 0.05, 1.0]];
        let mixed = [[1.0, 1.0, 0.1], [0.1, 1.0, 1.0], [1.0, 0.1, 1.0], [0.6, 0.4, 0.3]];
        let mut errors = Vec::new();
        for hue in hues.into_iter().chain(mixed) {
            for step in 0..64 {
                let light = hue.map(|part: f32| part * 0.001 * 60_000f32.powf(step as f32 / 63.0));
                let mut exact = light;
                processor.apply_rgb(&mut exact);
                let found = table.apply(light);
                let far = (0..3).map(|i| (found[i] - exact[i].clamp(0.0, 1.0)).abs());
                errors.push(255.0 * far.fold(0.0, f32::max));
            }
        }
        errors.sort_by(f32::total_cmp);
        let mean = errors.iter().sum::<f32>() / errors.len() as f32;
        // ACES 2.0 bends sharply where it fits saturated colours into the display, between points of any table: few colours are
        // several codes off; nearly all are within one.
        assert!(mean < 0.15, "mean {mean}");
        assert!(errors[errors.len() * 95 / 100] < 1.0, "one in twenty: {}", errors[errors.len() * 95 / 100]);
        assert!(errors[errors.len() - 1] < 12.0, "{:?}", errors.last());
    }

    /// An archive with this config.
    fn archived(folder: &Path, name: &str, text: &str) -> Source {
        let path = folder.join(name);
        let mut archive = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
        archive.start_file("config.ocio", zip::write::SimpleFileOptions::default()).unwrap();
        archive.write_all(text.as_bytes()).unwrap();
        archive.finish().unwrap();
        Source::File(path)
    }

    #[test]
    fn a_config_may_be_in_an_archive() {
        let folder = tempfile::tempdir().unwrap();
        let source = archived(folder.path(), "studio.ocioz", &config("!<MatrixTransform> {}"));
        let (menu, table) = Reader::new(None).read(&ask(source));
        assert!(menu.unwrap().display == "Cinema" && table.is_ok());
    }

    #[test]
    fn what_cannot_be_read_is_one_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let aliases = (0..9).map(|i| format!("a{}: &a{} [*a{i}, *a{i}]\n", i + 1, i + 1)).collect::<String>();
        let one = |name, out: &str| written(folder, name, &config(out));
        let bad = [
            (Source::File(folder.join("none.ocio")), "none.ocio"),
            (Source::File(folder.to_owned()), "no file"),
            (written(folder, "rubbish.ocio", "hello: ["), "rubbish.ocio"),
            (written(folder, "empty.ocio", ""), "empty.ocio"),
            (written(folder, "archive.ocioz", "PK\u{3}\u{4} and no more"), "archive.ocioz"),
            (
                written(
                    folder,
                    "bare.ocio",
                    "ocio_profile_version: 2\nroles: {default: raw}\ncolorspaces:\n  - !<ColorSpace> {name: raw}\n",
                ),
                "no display",
            ),
            (written(folder, "aliases.ocio", &aliases), "refers back"),
            (archived(folder, "aliases.ocioz", &aliases), "refers back"),
            (one("self.ocio", "!<ColorSpaceTransform> {src: out, dst: lin}"), "Film"),
            (one("missing.ocio", "!<FileTransform> {src: none.cube}"), "none.cube"),
            (
                one(
                    "deep.ocio",
                    &format!("{}{}", "!<GroupTransform> {children: [".repeat(5000), "]}".repeat(5000)),
                ),
                "deep.ocio",
            ),
            (Source::File(PathBuf::new()), "name the colour config's file"),
        ];
        let mut reader = Reader::new(None);
        for (source, part) in bad {
            let (_, table) = reader.read(&ask(source.clone()));
            let sentence = table.expect_err(&format!("{source:?}"));
            assert!(sentence.contains(part) && sentence.contains("sRGB"), "{source:?}: {sentence}");
            assert!(!sentence.contains('\n') && sentence.len() < 800, "{sentence}");
        }
        // And goes on.
        assert!(reader.read(&ask(Source::BuiltIn)).1.is_ok());
        let mut wrong = |choice: Choice| {
            let (menu, table) = reader.read(&Ask { choice, file: None, again: 0 });
            (menu, table.unwrap_err())
        };
        for (display, view, space) in
            [(Some("Nowhere"), None, None), (None, Some("Nothing"), None), (None, None, Some("No"))]
        {
            let [display, view, space] =
                [display, view, space].map(|name: Option<&str>| name.map(str::to_owned));
            let name = display.clone().or(view.clone()).or(space.clone()).unwrap();
            let (menu, sentence) = wrong(Choice { display, view, space, ..Choice::default() });
            assert!(sentence.contains(&name), "{sentence}");
            // The way out: what there is instead.
            let menu = menu.unwrap();
            assert!(menu.views(&menu.display).contains(&menu.view) && menu.spaces.contains(&menu.space));
        }
    }

    #[test]
    fn a_panic_is_a_sentence() {
        let result: Result<(), String> = guarded(|| panic!("index {}", 7));
        assert!(result.unwrap_err().contains("index 7"));
    }

    #[test]
    fn pixels_are_what_the_config_says_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let source = written(folder.path(), "config.ocio", &config("!<MatrixTransform> {}"));
        let Source::File(path) = &source else { unreachable!() };
        let mut reader = Reader::new(Some(path.display().to_string()));
        for (file, space) in [("a/beauty.exr", "lin"), ("a/plate.0001.exr", "wide")] {
            let (menu, table) = reader.read(&Ask { file: Some(file.into()), ..ask(Source::Usual) });
            let menu = menu.unwrap();
            assert_eq!(
                (menu.display.as_str(), menu.view.as_str(), menu.space.as_str()),
                ("Cinema", "Film", space)
            );
            assert_eq!(menu.spaces, ["lin", "wide", "out"]);
            // The table's points lie close around this value: a thousandth of it is generous.
            let red = table.unwrap().apply([0.25, 0.0, 0.0])[0];
            let expected = if space == "wide" { 0.5 } else { 0.25 };
            assert!((red / expected - 1.0).abs() < 1e-3, "{red}");
        }
        // A file that is written anew is read when that is asked for, not before.
        std::fs::write(path, config("!<MatrixTransform> {offset: [0.5, 0.5, 0.5, 0]}")).unwrap();
        let mut black =
            |again| reader.read(&Ask { again, ..ask(Source::Usual) }).1.unwrap().apply([0.0; 3])[0];
        assert_eq!((black(0), black(1)), (0.0, 0.5));
        // Of the built-in one, whatever it says of .exr.
        for (file, space) in [("beauty.exr", "ACEScg"), ("photo.jpg", "Linear Rec.709 (sRGB)")] {
            let ask = Ask { file: Some(file.into()), ..ask(Source::BuiltIn) };
            assert_eq!(reader.read(&ask).0.unwrap().space, space);
        }
    }
}
