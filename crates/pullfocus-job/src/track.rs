//! A shot's lens at each of its frames, for other programs ([`pullfocus_io::camera_file`]).

use crate::camera::{self, CameraValue, FileCamera};
use crate::config::Options;
use crate::failure::{Failure, Result};
use crate::load;
use crate::shot;
use crate::storage;
use crate::values::{Label, Largest};
use pullfocus_core::{Cancel, Frame, Size, focus, sensor};
use pullfocus_io::camera_file::{CameraSample, SENSOR_IF_UNKNOWN_MM, write_csv, write_usda};
use pullfocus_io::output::{Existing, PendingFile, check_target};
use pullfocus_io::sequence::{Frames, Pattern, number_in};
use pullfocus_io::{FileError, Selection};
use std::path::{Path, PathBuf};

/// What the files of a frame say.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// Their camera attributes.
    pub camera: FileCamera,
    /// Where the picture's pixels lie; none where no picture can be read.
    pub frame: Option<Frame>,
    /// Files that are there and cannot be read, in words.
    pub notes: Vec<String>,
}

/// Files that may say something of the camera at a frame: the picture before its layers. Of a list of pictures it is
/// the one with the frame's number; what is alone is every frame's.
fn pictures(options: &Options, frame: i64) -> impl Iterator<Item = &PathBuf> {
    let files = &options.files;
    let inputs = files.input.as_deref().unwrap_or_default();
    let input = match inputs {
        [_, _, ..] => inputs.iter().find(|path| match pattern(path) {
            Ok(None) => number_in(path) == Some(frame),
            Ok(Some(pattern)) => pattern.file(frame).is_file(),
            // It is told of where it is used.
            Err(_) => true,
        }),
        _ => inputs.first(),
    };
    input.into_iter().chain(&files.behind).chain(&files.foreground)
}

/// A pattern, where there is no file of just that name.
fn pattern(path: &Path) -> Result<Option<Pattern>> {
    if path.is_file() { Ok(None) } else { Ok(Pattern::parse(path)?) }
}

/// Reads what the files of a frame of a shot say, as far as they are there.
///
/// # Errors
/// [`Failure::Usage`] for names that are no patterns.
pub fn look(options: &Options, frame: i64) -> Result<Seen> {
    let label = |label: &Option<Label>| label.as_ref().map(|label| label.0.clone());
    let selection = Selection {
        view: label(&options.files.view),
        part: label(&options.files.part),
        without_depth: true,
        ..Selection::default()
    };
    let limits = storage::limits(options.files.allow_large_files == Some(true));
    let mut seen = Seen::default();
    for path in pictures(options, frame) {
        let file = pattern(path)?.map_or_else(|| path.clone(), |pattern| pattern.file(frame));
        if !file.is_file() {
            continue;
        }
        match storage::look(&file, &selection, &limits) {
            Ok((frame, camera)) => {
                let frame = seen.frame.get_or_insert(frame);
                seen.camera = seen.camera.or(load::file_camera(&camera, frame));
            }
            Err(failure) => seen.notes.push(failure.to_string()),
        }
    }
    Ok(seen)
}

/// The frames of a shot: those that it names, else those of its input's files, else from its first key to its last.
///
/// # Errors
/// [`Failure::Usage`] where nothing says which frames.
pub fn frames(options: &Options) -> Result<Frames> {
    if let Some(frames) = &options.files.frames {
        return Ok(frames.0.parse()?);
    }
    let inputs = options.files.input.as_deref().unwrap_or_default();
    if inputs.len() > 1 {
        let plain = |path: &&PathBuf| matches!(pattern(path), Ok(None));
        let found: Frames = inputs.iter().filter(plain).filter_map(|path| number_in(path)).collect();
        if !found.is_empty() {
            return Ok(found);
        }
    }
    for path in inputs.iter().chain(&options.files.behind).chain(&options.files.foreground) {
        if let Some(pattern) = pattern(path)? {
            // A folder that is not there has no files.
            let found = pattern.discover().unwrap_or_default();
            if !found.is_empty() {
                return Ok(found);
            }
        }
    }
    shot::span(&options.keys)?.ok_or_else(|| {
        Failure::usage(
            "nothing says which frames: the shot has no keys and no pictures; give --frames 1001-1100",
        )
    })
}

/// The lens at a frame, and which value came from where. `sharp` is the largest circle of confusion that still counts
/// as sharp, `name` what the shot is called in messages.
///
/// # Errors
/// [`Failure::Usage`] where the lens is incomplete or none that could be, and for pixels where the picture's width
/// is unknown.
pub fn sample(
    options: &Options,
    seen: &Seen,
    frame: i64,
    sharp: Largest,
    name: &str,
) -> Result<(CameraSample, Vec<CameraValue>)> {
    let lens = shot::lens_at(&options.lens, &options.keys, Some(frame));
    let mut resolved = camera::resolve(&lens, &seen.camera, name)?;
    shot::name_keyed(&mut resolved.values, &options.keys, Some(frame));
    let camera = resolved.camera;
    let sharp = match (sharp, &seen.frame) {
        (Largest::Pixels(px), Some(frame)) => focus::limits(&camera, frame, px),
        (Largest::Pixels(_), None) => {
            return Err(Failure::usage(format!(
                "{name}: no picture of the shot can be read, so a pixel has no size; give the circle as a part of the width, such as 0.08%"
            )));
        }
        (Largest::Width(part), _) => {
            // Parts of any width are the same.
            let frame = Frame::full(Size::new(1000, 1000));
            focus::limits(&camera, &frame, part * frame.display_width())
        }
    };
    let mut sample = CameraSample::new(frame as f64, &camera, sharp);
    let value = |name: &str| resolved.values.iter().find(|value| value.name == name).map(|value| value.value);
    sample.f_stop = sample.f_stop.or(value("f-stop"));
    sample.focal_length_mm = sample.focal_length_mm.or(value("focal length"));
    // A focal length and an angle fit one sensor.
    let width = sample.focal_length_mm.map(|focal| 2.0 * focal * camera.half_width_tangent());
    sample.sensor_width_mm = sample.sensor_width_mm.or(width);
    Ok((sample, resolved.values))
}

/// Height in millimetres of the picture on the sensor: by the picture's own shape, else that of the usual sensor of its
/// width.
pub fn sensor_height_mm(sample: &CameraSample, seen: &Seen) -> Option<f64> {
    match (sample.sensor_width_mm, &seen.frame) {
        (width, Some(frame)) => {
            let aspect = frame.display_width() / frame.display.size.height.max(1) as f64;
            let width = width.unwrap_or(SENSOR_IF_UNKNOWN_MM);
            Some(width / (aspect * f64::from(frame.vertical_scale())))
        }
        (Some(width), None) => sensor::find(width).map(|sensor| sensor.height_mm),
        (None, None) => None,
    }
}

/// What the first of the frames says whose files are there.
fn first_seen(options: &Options, frames: &Frames, cancel: &Cancel) -> Result<Option<Seen>> {
    for frame in frames.iter() {
        cancel.check()?;
        let seen = look(options, frame)?;
        if seen.frame.is_some() {
            return Ok(Some(seen));
        }
    }
    Ok(None)
}

/// What was written.
#[derive(Debug, Clone)]
pub struct Track {
    /// The frames.
    pub frames: Frames,
    /// The lens at the first of them, and which value came from where.
    pub first: Vec<CameraValue>,
}

/// How a track is written.
#[derive(Debug, Clone, Copy)]
pub struct Writing<'a> {
    /// Ends with `.csv` (a table) or `.usda` (a USD layer).
    pub output: &'a Path,
    /// Frames a second, above 0.
    pub fps: f64,
    /// The largest circle of confusion that still counts as sharp.
    pub sharp: Largest,
    /// Whether a file that is there may be replaced.
    pub existing: Existing,
    /// What the shot is called in messages.
    pub name: &'a str,
}

/// What the output's ending asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Csv,
    Usda,
}

fn form(output: &Path) -> Result<Form> {
    match output.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("csv") => Ok(Form::Csv),
        Some("usda") => Ok(Form::Usda),
        _ => Err(Failure::usage(format!(
            "{}: a camera is written as .csv (a table) or .usda (a USD layer); end the name so",
            output.display()
        ))),
    }
}

/// Writes the lens of every frame of a shot, whole or not at all; each frame's own file says what the shot leaves out, where
/// a frame has none the file before it, or the first. `own` are files that must not be written over; `note` hears of files that are there and cannot be read.
///
/// # Errors
/// [`Failure::Usage`] for an output that cannot be, a lens that is incomplete, and where nothing says which frames;
/// [`Failure::Failed`] where the file is there and may not be replaced, or cannot be written; cancellation.
pub fn save(
    options: &Options,
    own: &[PathBuf],
    writing: Writing<'_>,
    cancel: &Cancel,
    mut note: impl FnMut(String),
) -> Result<Track> {
    let Writing { output, fps, sharp, existing, name } = writing;
    let form = form(output)?;
    if !(fps.is_finite() && fps > 0.0) {
        return Err(Failure::usage(format!("{fps} frames a second are none; give a number above 0")));
    }
    camera::check(&options.lens)?;
    shot::check_lens(&options.keys, &options.lens)?;
    check_target(output, own, existing)?;
    let frames = frames(options)?;
    let mut known: Option<Seen> = None;
    let mut samples = Vec::with_capacity(frames.len());
    let mut first = None;
    for frame in frames.iter() {
        cancel.check()?;
        let mut seen = look(options, frame)?;
        seen.notes.drain(..).for_each(&mut note);
        // A frame without a file has the lens of the one before, and before the first file that of the first.
        let seen = match (seen.frame, known.take()) {
            (None, Some(before)) => before,
            (None, None) => first_seen(options, &frames, cancel)?.unwrap_or(seen),
            (Some(_), _) => seen,
        };
        let seen = known.insert(seen);
        let (sample, values) = sample(options, seen, frame, sharp, name)?;
        first.get_or_insert_with(|| (sensor_height_mm(&sample, seen), values));
        samples.push(sample);
    }
    let (height, first) = first.unwrap_or_default();
    let mut pending = PendingFile::create(output, existing)?;
    match form {
        Form::Csv => write_csv(&samples, &mut pending),
        Form::Usda => write_usda(&samples, fps, height, &mut pending),
    }
    .map_err(|error| FileError::io(output, "write", error))?;
    pending.commit()?;
    Ok(Track { frames, first })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::parse;
    use pullfocus_io::{AttributeValue, write_exr};

    const SHARP: Largest = Largest::Width(0.001);

    fn at(text: &str, frame: i64) -> CameraSample {
        sample(&parse(text).unwrap(), &Seen::default(), frame, SHARP, "shot").unwrap().0
    }

    #[test]
    fn the_lens_moves_and_what_follows_from_it_is_there() {
        let shot = "sensor-width = 36\nf-stop = 2\n\
                    [[key]]\nframe = 1\nfocus-distance = 2\nfocal-length = 50\neasing = 'linear'\n\
                    [[key]]\nframe = 3\nfocus-distance = 1\nfocal-length = 72";
        let (first, middle) = (at(shot, 1), at(shot, 2));
        assert_eq!((first.focus_distance_m, first.aperture_diameter_m), (2.0, Some(0.025)));
        // Half way between 1/2 and 1 dioptres, and between 50 and 72 by ratio: rounding only.
        assert!((middle.focus_distance_m - 4.0 / 3.0).abs() < 1e-12);
        assert!((middle.focal_length_mm.unwrap() - 60.0).abs() < 1e-9);
        assert!((at(shot, 9).fov_x_degrees.unwrap() - (2.0 * 0.25f64.atan()).to_degrees()).abs() < 1e-9);
        assert!(first.near_m < 2.0 && 2.0 < first.far_m);
        let values = sample(&parse(shot).unwrap(), &Seen::default(), 2, SHARP, "shot").unwrap().1;
        assert!(values.iter().any(|value| value.from == "keys at frame 2"), "{values:?}");
    }

    #[test]
    fn a_renderers_lens_has_the_sensor_that_fits() {
        let lens = at("fov-x = 90\nf-stop = 2\nfocal-length = 18\nfocus-distance = 2", 1);
        assert_eq!((lens.f_stop, lens.focal_length_mm), (Some(2.0), Some(18.0)));
        assert!((lens.sensor_width_mm.unwrap() - 36.0).abs() < 1e-9, "tan 45 degrees is rounded");
        assert!((sensor_height_mm(&lens, &Seen::default()).unwrap() - 24.0).abs() < 1e-9);
        let plain = at("fov-x = 90\naperture-diameter = 0.01\nfocus-distance = inf", 1);
        assert_eq!((plain.f_stop, plain.focal_length_mm, plain.sensor_width_mm), (None, None, None));
        assert_eq!((plain.far_m, sensor_height_mm(&plain, &Seen::default())), (f64::INFINITY, None));
        let seen = Seen { frame: Some(Frame::full(Size::new(1920, 960))), ..Seen::default() };
        assert_eq!(sensor_height_mm(&plain, &seen), Some(18.0));
    }

    #[test]
    fn frames_come_from_the_shot_its_pictures_or_its_keys() {
        let folder = tempfile::tempdir().unwrap();
        let keys = "[[key]]\nframe = 3.5\nfocus-distance = 2\n[[key]]\nframe = 7.5\nfocus-distance = 1";
        let of = |text: &str| frames(&parse(text).unwrap()).map(|frames| frames.to_string());
        assert_eq!(of(&format!("frames = '1-9x2'\n{keys}")).unwrap(), "1-9x2");
        assert_eq!(of(keys).unwrap(), "3-8");
        let input = format!("input = {:?}\n", folder.path().join("f.##.exr"));
        assert_eq!(of(&format!("{input}{keys}")).unwrap(), "3-8");
        std::fs::write(folder.path().join("f.05.exr"), "x").unwrap();
        assert_eq!(of(&format!("{input}{keys}")).unwrap(), "5");
        assert!(of("f-stop = 2").unwrap_err().to_string().contains("--frames"));
        // What is no picture is told of.
        assert_eq!(look(&parse(&input).unwrap(), 5).unwrap().notes.len(), 1);
        assert!(look(&parse(&input).unwrap(), 6).unwrap().notes.is_empty());
        let pixels = sample(
            &parse("fov-x = 90\naperture-diameter = 0.01\nfocus-distance = 2").unwrap(),
            &Seen::default(),
            1,
            Largest::Pixels(2.0),
            "shot.toml",
        );
        assert!(pixels.unwrap_err().to_string().contains("0.08%"));
    }

    /// A picture that says where it is in focus.
    fn focused(path: &Path, metres: f32) {
        let size = Size::new(2, 1);
        let plane = pullfocus_core::Plane::from_fn(size, |_, _| 1.0).unwrap();
        let planes = ["R", "G", "B"].map(|name| (name, &plane, pullfocus_io::SampleType::Float));
        let focus = [("focus", AttributeValue::Float(metres))];
        write_exr(&mut std::fs::File::create(path).unwrap(), &Frame::full(size), &planes, &focus).unwrap();
    }

    #[test]
    fn frames_without_files_have_the_lens_of_the_one_before_or_the_first() {
        let folder = tempfile::tempdir().unwrap();
        focused(&folder.path().join("f.02.exr"), 2.0);
        focused(&folder.path().join("f.04.exr"), 5.0);
        let (input, output) = (folder.path().join("f.##.exr"), folder.path().join("out.csv"));
        let text = format!("input = {input:?}\nframes = '1-5'\nfov-x = 40\naperture-diameter = 0.01");
        let writing =
            Writing { output: &output, fps: 24.0, sharp: SHARP, existing: Existing::Refuse, name: "shot" };
        save(&parse(&text).unwrap(), &[], writing, &Cancel::new(), |note| panic!("{note}")).unwrap();
        let table = std::fs::read_to_string(&output).unwrap();
        let focus: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split(',').nth(1)).collect();
        assert_eq!(focus, ["2", "2", "2", "5", "5"], "{table}");
    }

    #[test]
    fn each_of_a_list_of_pictures_has_its_own_lens() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, metres) in [("f.0001.exr", 2.0_f32), ("f.0002.exr", 5.0)] {
            focused(&path(name), metres);
        }
        let list = format!("input = [{:?}, {:?}]", path("f.0001.exr"), path("f.0002.exr"));
        let options = parse(&list).unwrap();
        let focus = |frame| look(&options, frame).unwrap().camera.focus_distance.map(|found| found.value);
        assert_eq!([focus(1), focus(2), focus(3)], [Some(2.0), Some(5.0), None]);
        assert_eq!(frames(&options).unwrap().to_string(), "1-2");
    }
}
