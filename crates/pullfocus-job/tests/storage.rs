//! What becomes of pictures that are no OpenEXR files, and of windows.

use pullfocus_core::{Cancel, Frame, Picture, Plane, Size, Window};
use pullfocus_io::images::{Bits, Encoding, save};
use pullfocus_io::output::Existing;
use pullfocus_io::{Document, Limits, SampleType, Selection, write_exr};
use pullfocus_job::storage::{self, Loaded};
use std::path::Path;

const SIZE: Size = Size::new(4, 2);

fn load(path: &Path, limits: &Limits, layers: &[&str]) -> Loaded {
    let layers = layers.iter().map(|&layer| layer.to_owned()).collect();
    let selection = Selection { without_depth: true, layers, ..Selection::default() };
    storage::load(path, &selection, limits, &Cancel::new()).unwrap()
}

/// The picture through an OpenEXR file, and how its channels are stored there.
fn through_exr(input: &Path) -> (Picture, Picture, SampleType) {
    let limits = Limits::default();
    let mut loaded = load(input, &limits, &[]);
    let mut picture = std::mem::take(&mut loaded.picture);
    let output = input.with_extension("exr");
    storage::save(&loaded, &mut picture, &output, None, Existing::Replace).unwrap();
    let contents = Document::open(&output, &limits).unwrap().contents();
    let kind = contents.parts[0].layers[0].channels[0].sample_type;
    (picture, load(&output, &limits, &[]).picture, kind)
}

#[test]
fn an_exr_file_holds_all_that_another_picture_does() {
    let folder = tempfile::tempdir().unwrap();
    let plane = |scale: f32| Plane::from_fn(SIZE, |x, y| scale * (1 + x + 4 * y) as f32 / 9.7).unwrap();
    for (name, bits, scale, expected) in [
        ("a.hdr", None, 3e5, SampleType::Float),
        ("a.pfm", None, 3e5, SampleType::Float),
        ("a.tif", Some(Bits::Float), 3e5, SampleType::Float),
        ("b.tif", Some(Bits::Sixteen), 1.0, SampleType::Float),
        ("c.png", Some(Bits::Eight), 1.0, SampleType::Half),
    ] {
        let input = folder.path().join(name);
        let picture = Picture::opaque(vec![plane(scale), plane(0.7 * scale), plane(0.2 * scale)]);
        save(&input, &picture, Encoding::for_name(&input, bits).unwrap(), Existing::Refuse).unwrap();
        let (before, after, kind) = through_exr(&input);
        assert_eq!(kind, expected, "{name}");
        if kind == SampleType::Float {
            assert_eq!(before, after, "{name}");
        }
    }
}

#[test]
fn halves_keep_the_codes_of_eight_bits_apart() {
    let folder = tempfile::tempdir().unwrap();
    let code = |x: usize| x as f32 / 255.0;
    let ramp = Plane::from_fn(Size::new(256, 1), |x, _| pullfocus_core::srgb::decode(code(x))).unwrap();
    let input = folder.path().join("ramp.png");
    let encoding = Encoding::for_name(&input, Some(Bits::Eight)).unwrap();
    save(&input, &Picture::opaque(vec![ramp.clone(), ramp.clone(), ramp]), encoding, Existing::Refuse)
        .unwrap();
    let (_, after, _) = through_exr(&input);
    for (x, &value) in after.colors[0].data().iter().enumerate() {
        assert_eq!((255.0 * pullfocus_core::srgb::encode(value)).round() as usize, x);
    }
}

#[test]
fn colours_beyond_three_are_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("layers.exr");
    let plane = Plane::filled(SIZE, 0.5).unwrap();
    let names = ["key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B"];
    let planes = names.map(|name| (name, &plane, SampleType::Half));
    write_exr(std::fs::File::create(&path).unwrap(), &Frame::full(SIZE), &planes, &[]).unwrap();
    let limits = Limits::default();
    let said = load(&path, &limits, &["key", "fill"]).left_out().unwrap();
    assert!(said.contains("fill.R, fill.G, fill.B are left out") && said.contains(".exr"), "{said}");
    assert_eq!(load(&path, &limits, &["key"]).left_out(), None);
}

#[test]
fn a_display_window_may_be_as_large_as_the_limits_say() {
    let plane = Plane::filled(SIZE, 0.5).unwrap();
    let large = Window { x: 0, y: 0, size: Size::new(40, 20) };
    let frame = Frame { display: large, ..Frame::full(SIZE) };
    let small = Limits { max_pixels: 100, ..Limits::default() };
    let error = storage::on_display(&plane, &frame, 0.0, &small).unwrap_err().to_string();
    assert!(error.contains("800") && error.ends_with("--allow-large-files"), "{error}");
    assert!(storage::on_display(&plane, &frame, 0.0, &storage::NO_LIMITS).is_ok());

    // What was loaded without limits is shown without them.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let planes = ["R", "G", "B"].map(|name| (name, &plane, SampleType::Half));
    write_exr(std::fs::File::create(&path).unwrap(), &frame, &planes, &[]).unwrap();
    for (limits, shown) in [(small, false), (storage::NO_LIMITS, true)] {
        let mut loaded = load(&path, &limits, &[]);
        let mut picture = std::mem::take(&mut loaded.picture);
        let output = folder.path().join("a.png");
        let saved = storage::save(&loaded, &mut picture, &output, None, Existing::Replace);
        assert_eq!(saved.is_ok(), shown);
    }
}
