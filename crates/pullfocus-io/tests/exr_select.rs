//! Finding colour, depth, views and cameras in files as programs write them.

mod common;
#[path = "common/raw.rs"]
mod raw;

use common::*;
use exr::prelude::*;
use pullfocus_core::Size;
use pullfocus_io::{Document, FileError, Limits, Selection, align_element};

const SINGLE: &[u8] = include_bytes!("data/beachball-singlepart.exr");
const MULTI: &[u8] = include_bytes!("data/beachball-multipart.exr");
const N: usize = 20 * 10;

fn view(name: &str) -> Selection {
    Selection { view: Some(name.to_owned()), ..Selection::default() }
}

fn layers(names: &[&str]) -> Selection {
    Selection { layers: names.iter().map(|&name| name.to_owned()).collect(), ..Selection::default() }
}

/// One part of 20 x 10 pixels.
fn one(channels: Vec<Channel>) -> Document {
    document(&file((20, 10), vec![part((20, 10), (0, 0), scan_lines(Compression::ZIP16), channels)]))
}

fn rgb(prefix: &str) -> Vec<Channel> {
    ["R", "G", "B"].map(|c| half(&format!("{prefix}{c}"), N, c.len() + prefix.len())).into()
}

fn names(document: &Document, selection: &Selection) -> Vec<String> {
    let selected = document.select(selection).unwrap();
    selected.channels.all().map(|source| source.name.clone()).collect()
}

fn refused(document: &Document, selection: &Selection) -> String {
    document.select(selection).unwrap_err().to_string()
}

#[test]
fn both_eyes_of_a_single_part_are_found_by_prefix() {
    let document = document(SINGLE);
    assert_eq!(document.views(), ["right", "left"]);
    assert_eq!(names(&document, &view("right")), ["R", "G", "B", "A"]);
    assert_eq!(names(&document, &view("left")), ["left.R", "left.G", "left.B", "left.A"]);
    let right = document.select(&Selection::default()).unwrap();
    assert_eq!(right.view.as_deref(), Some("right"));
    assert_eq!(right.depth.unwrap().name, "Z");
    let left = document.select(&view("left")).unwrap();
    assert_eq!(left.depth.unwrap().name, "left.Z");
    let decoded = decoded(SINGLE);
    let FlatSamples::F16(red) = channel(&decoded, 0, "left.R") else { panic!("half in the file") };
    assert!(red.iter().zip(left.picture.colors[0].data()).all(|(a, b)| a.to_f32() == *b));
    assert!(red.iter().any(|value| value.to_f32() > 0.0), "the crop shows the ball");
}

#[test]
fn both_eyes_of_a_multi_part_file_are_found_by_attribute() {
    let document = document(MULTI);
    assert_eq!(document.views(), ["right", "left"]);
    for (eye, x) in [("left", 688), ("right", 654)] {
        let selected = document.select(&view(eye)).unwrap();
        assert_eq!(selected.channels.colors[0].name, "R");
        assert_eq!(selected.frame.data.x, x, "the part's own window");
        assert_eq!(selected.frame.display.size, Size::new(2048, 1556));
        let depth = selected.depth.as_ref().unwrap();
        assert_eq!(depth.name, format!("depth_{eye}:Z"));
        for name in ["rgba", "rgba_*", &format!("rgba_{eye}")] {
            let named = Selection { layers: vec![name.to_owned()], ..view(eye) };
            assert_eq!(document.select(&named).unwrap().channels, selected.channels, "{name}");
        }
        assert_eq!(depth.plane.size(), selected.picture.size());
    }
}

#[test]
fn the_other_eye_stays_as_it_was() {
    for (bytes, prefix) in [(SINGLE, "left."), (MULTI, "")] {
        let document = document(bytes);
        let selected = document.select(&view("left")).unwrap();
        let part = selected.channels.colors[0].part;
        let out = rewritten(&document, selected, |value| value + 1.0);
        let changed = ["R", "G", "B", "A"].map(|c| format!("{prefix}{c}"));
        let changed: Vec<(usize, &str)> = changed.iter().map(|name| (part, name.as_str())).collect();
        same_but(bytes, &out, &changed);
    }
}

#[test]
fn what_is_not_there_is_said_with_what_is() {
    let document = document(SINGLE);
    let error = refused(&document, &view("middle"));
    assert!(
        error.contains("test.exr") && error.contains("'middle'") && error.contains("right, left"),
        "{error}"
    );
    let error = refused(&document, &layers(&["light_*"]));
    assert!(error.contains("'light_*'") && error.contains("rgba"), "{error}");
    let error = refused(&document, &Selection { depth_channel: Some("zz".into()), ..Selection::default() });
    assert!(error.contains("channel 'zz'") && error.contains("left.Z"), "{error}");
    let error = refused(&document, &Selection { part: Some("7".into()), ..Selection::default() });
    assert!(error.contains("part '7'"), "{error}");
    let error = refused(&one(rgb("")), &view("left"));
    assert!(error.contains("view 'left'") && error.contains("leave the view out"), "{error}");
}

#[test]
fn depth_is_found_under_every_name_of_the_field() {
    for name in [
        "Z",
        "depth.Z",
        "beauty.Z",
        "cam1.Z",
        "VRayZDepth.R",
        "FinalImageMovieRenderQueue_WorldDepth.red",
        "dd.T",
        "ViewLayer.Depth.Z",
        "ViewLayer.Depth.V",
        "depth.Y",
        "zdepth",
    ] {
        let mut channels = rgb("");
        // Siblings as renderers write them, and what looks like depth and is not.
        if name.ends_with(".R") || name.ends_with(".red") {
            let stem = name.rsplit_once('.').unwrap().0;
            let others = if name.ends_with(".R") { ["G", "B"] } else { ["green", "blue"] };
            channels.extend(others.map(|c| float(&format!("{stem}.{c}"), N, 9)));
        }
        channels.extend(["N.X", "N.Y", "N.Z"].map(|name| half(name, N, 3)));
        channels.push(float("ZBack", N, 2));
        channels.push(float(name, N, 1));
        let document = one(channels);
        let selected = document.select(&Selection::default()).unwrap();
        assert_eq!(selected.depth.as_ref().map(|d| d.name.as_str()), Some(name));
        assert_eq!(selected.channels.colors[0].name, "R", "{name}");
        assert_eq!(document.contents().depth_channel.as_deref(), Some(name));
    }
    let without = one([rgb(""), ["N.X", "N.Y", "N.Z"].map(|name| half(name, N, 3)).into()].concat());
    assert_eq!(without.select(&Selection::default()).unwrap().depth, None);
}

#[test]
fn layers_are_chosen_by_name_and_pattern() {
    let mut channels = rgb("");
    channels.push(half("A", N, 4));
    for light in ["light_key.", "light_fill."] {
        channels.extend(rgb(light));
    }
    channels.push(half("light_key.A", N, 4));
    channels.extend(rgb("cryptoObject00."));
    channels.extend(["shadow.mask", "N.X", "N.Y", "N.Z"].map(|name| float(name, N, 2)));
    channels.push(float("Z", N, 1));
    let document = one(channels);
    assert_eq!(names(&document, &Selection::default()), ["R", "G", "B", "A"]);
    assert_eq!(
        names(&document, &layers(&["rgba", "light_*"])),
        [
            "R",
            "G",
            "B",
            "light_fill.R",
            "light_fill.G",
            "light_fill.B",
            "light_key.R",
            "light_key.G",
            "light_key.B",
            "light_key.A",
            "A"
        ],
        "the first layer's alpha is the picture's, another one is a colour"
    );
    assert_eq!(names(&document, &layers(&["*"])).len(), 11, "patterns take light, not data");
    assert_eq!(names(&document, &layers(&["shadow"])), ["shadow.mask"]);
    assert_eq!(names(&document, &layers(&["light_fill.G"])), ["light_fill.G"]);
    assert_eq!(names(&document, &layers(&["rgba", "rgba", "beauty"])).len(), 4, "each channel once");
    let selected = document.select(&layers(&["light_fill"])).unwrap();
    let out = rewritten(&document, selected, |value| value + 1.0);
    assert_eq!(common::document(&out).contents().parts[0].layers.len(), 6);
}

#[test]
fn a_channel_beside_its_layer_is_taken_once() {
    let document = one([rgb(""), vec![half("A", N, 4), half("mask.A", N, 5)]].concat());
    assert_eq!(names(&document, &layers(&["R", "rgba"])), ["R", "G", "B", "A"]);
    assert_eq!(names(&document, &layers(&["A", "rgba"])), ["R", "G", "B", "A"]);
    assert_eq!(names(&document, &layers(&["rgba", "R", "A"])), ["R", "G", "B", "A"]);
    assert_eq!(names(&document, &layers(&["mask", "rgba"])), ["mask.A", "R", "G", "B", "A"]);
    let masks = document.select(&layers(&["mask"])).unwrap().picture;
    assert_eq!((masks.colors.len(), masks.alpha), (1, None));
}

#[test]
fn a_file_of_depth_alone_is_depth() {
    let vray = ["R", "G", "B"].map(|c| float(&format!("VRayZDepth.{c}"), N, c.len()));
    let depth = ["R", "G", "B"].map(|c| float(&format!("depth.{c}"), N, c.len()));
    for (channels, name) in [
        (vec![float("Z", N, 1)], "Z"),
        (vec![half("A", N, 2), float("Z", N, 1)], "Z"),
        (vec![float("depth.Z", N, 1)], "depth.Z"),
        (depth.into(), "depth.R"),
        (vray.into(), "VRayZDepth.R"),
        (vec![float("mono", N, 1)], "mono"),
        ([rgb(""), vec![float("Z", N, 1)]].concat(), "Z"),
    ] {
        let document = one(channels);
        let selected = document.select_depth(&Selection::default()).unwrap().unwrap();
        assert_eq!(selected.depth.name, name);
        let original = document.select(&Selection {
            layers: vec![name.to_owned()],
            without_depth: true,
            ..Selection::default()
        });
        assert_eq!(selected.depth.plane, original.unwrap().picture.colors[0]);
    }
    let error = |document: Document, selection: &Selection| {
        let select = document.select_depth(selection);
        select.unwrap_err().to_string()
    };
    assert_eq!(one(rgb("")).select_depth(&Selection::default()).unwrap(), None);
    let zz = Selection { depth_channel: Some("zz".into()), ..Selection::default() };
    assert!(error(one(vec![float("Z", N, 1)]), &zz).contains("channel 'zz'"));
    let (deep, chunk) = raw::deep_part();
    let deep = document(&raw::assemble(0x802, &[deep], &[(0, chunk)]));
    assert!(error(deep, &Selection::default()).contains("deep pictures"));
    assert_eq!(document(MULTI).select_depth(&view("left")).unwrap().unwrap().depth.name, "depth_left:Z");
}

#[test]
fn depth_is_taken_without_colour_where_that_is_enough() {
    let enough = Selection { color_optional: true, ..Selection::default() };
    let document = one(vec![float("depth.Z", N, 1), float("depth.size", N, 2)]);
    let selected = document.select(&enough).unwrap();
    assert_eq!((selected.picture.planes().count(), selected.frame.data.size), (0, Size::new(20, 10)));
    assert_eq!(selected.depth.unwrap().name, "depth.Z");
    assert_eq!(document.look(&enough).unwrap().0, selected.frame);
    let coc = Selection { coc_channel: Some("depth.size".into()), ..enough.clone() };
    assert_eq!(document.select(&coc).unwrap().coc.unwrap().name, "depth.size");
    let both = one([rgb(""), vec![float("Z", N, 1)]].concat());
    assert_eq!(both.select(&enough).unwrap(), both.select(&Selection::default()).unwrap());
    let error = refused(&one(vec![half("A", N, 1), half("B.x", N, 1), half("B.y", N, 1)]), &enough);
    assert!(error.contains("no colour layer and no depth channel"), "{error}");
    assert!(refused(&document, &Selection { layers: vec!["rgba".into()], ..enough }).contains("'rgba'"));
}

#[test]
fn a_layer_without_colour_is_refused() {
    let document = one([rgb(""), vec![float("depth.Z", N, 1), float("other.Z", N, 2)]].concat());
    for names in [&["depth"][..], &["other"], &["rgba", "depth"]] {
        let error = refused(&document, &layers(names));
        assert!(error.contains(&format!("layer '{}' holds no colour", names[names.len() - 1])), "{error}");
        assert!(document.look(&layers(names)).is_err());
    }
    assert_eq!(names(&document, &layers(&["depth.Z"])), ["depth.Z"], "who says so may blur it");
}

#[test]
fn pictures_without_red_green_and_blue() {
    assert_eq!(names(&one(vec![half("Y", N, 1), float("Z", N, 2)]), &Selection::default()), ["Y"]);
    assert_eq!(names(&one(vec![half("mono", N, 1)]), &Selection::default()), ["mono"]);
    let named =
        [rgb("ViewLayer.Combined."), rgb("ViewLayer.DiffCol."), vec![float("ViewLayer.Depth.Z", N, 1)]];
    assert_eq!(names(&one(named.concat()), &Selection::default())[0], "ViewLayer.Combined.R");
    let error = refused(&one(vec![float("Z", N, 1)]), &Selection::default());
    assert!(error.contains("colour layer") && error.contains('Z'), "{error}");
}

#[test]
fn chroma_subsampled_and_deep_pictures_say_what_to_do() {
    let yc = raw::required(
        "scanlineimage",
        [0, 0, 1, 1],
        &[("BY", 1, [2, 2]), ("RY", 1, [2, 2]), ("Y", 1, [1, 1])],
    );
    let lines = [(0, raw::scan_line(0, &[0; 8])), (0, raw::scan_line(1, &[0; 4]))];
    let error = refused(&document(&raw::assemble(2, &[yc], &lines)), &Selection::default());
    assert!(error.contains("chroma") && error.contains("save it with full R"), "{error}");

    let (deep, chunk) = raw::deep_part();
    let deep = document(&raw::assemble(0x802, &[deep], &[(0, chunk)]));
    let error = refused(&deep, &Selection::default());
    assert!(error.contains("deep pictures are not supported yet") && error.contains("flatten"), "{error}");
    assert_eq!(deep.contents().parts[0].kind, "deep scan lines");
    assert!(deep.inspect().unwrap().depth.is_empty());
}

#[test]
fn a_deep_part_beside_a_flat_one_is_carried_along() {
    let (mut deep, chunk) = raw::deep_part();
    deep.push(raw::text("name", "deep"));
    let channels = ["B", "G", "R"].map(|name| (name, 1u32, [1, 1]));
    let mut flat = raw::required("scanlineimage", [0, 0, 1, 0], &channels);
    flat.push(raw::text("name", "flat"));
    flat.push(("chunkCount".to_owned(), "int".to_owned(), raw::ints(&[1])));
    let one = f16::ONE.to_bits().to_le_bytes().repeat(6);
    let bytes = raw::assemble(0x1802, &[deep, flat], &[(0, chunk), (1, raw::scan_line(0, &one))]);
    let document = document(&bytes);
    let selected = document.select(&Selection::default()).unwrap();
    assert_eq!(selected.channels.colors[0].part, 1);
    assert_eq!(selected.depth, None, "the deep Z is not a plane");
    let same = rewritten(&document, selected.clone(), |value| value);
    assert_eq!(same, bytes);
    let out = rewritten(&document, selected, |value| value * 2.0);
    let two = f16::from_f32(2.0).to_bits().to_le_bytes().repeat(6);
    assert_eq!(out[..out.len() - 12], bytes[..bytes.len() - 12]);
    assert_eq!(out[out.len() - 12..], two);
}

fn named(name: &str, size: (usize, usize), at: (i32, i32), channels: Vec<Channel>) -> Part {
    let mut part = part(size, at, scan_lines(Compression::ZIP1), channels);
    part.attributes.layer_name = Some(name.into());
    part
}

/// Two parts with the same channels, and one with depth alone.
fn parts_alike() -> Document {
    let channels = |depth: &str, seed| [rgb(""), vec![float(depth, N, seed)]].concat();
    document(&file(
        (20, 10),
        vec![
            named("bg", (20, 10), (0, 0), channels("Z", 1)),
            named("fg", (20, 10), (0, 0), channels("Z", 2)),
            named("deep", (20, 10), (0, 0), vec![float("depth.Z", N, 3), float("V", N, 4)]),
        ],
    ))
}

#[test]
fn names_of_channels_mean_those_of_the_chosen_part() {
    let document = parts_alike();
    let fg = Selection { part: Some("fg".into()), ..Selection::default() };
    let depth = |name: Option<&str>| {
        let selection = Selection { depth_channel: name.map(str::to_owned), ..fg.clone() };
        document.select(&selection).unwrap().depth.unwrap().name
    };
    assert_eq!([depth(Some("Z")), depth(None)], ["fg:Z", "fg:Z"]);
    assert_eq!([depth(Some("bg:Z")), depth(Some("bg.Z"))], ["bg:Z", "bg:Z"], "the name says the part");
    let coc = Selection { coc_channel: Some("Z".into()), ..fg.clone() };
    assert_eq!(document.select(&coc).unwrap().coc.unwrap().name, "fg:Z");
    let red = document.select(&Selection { layers: vec!["R".into()], ..fg.clone() }).unwrap();
    assert_eq!((red.channels.colors[0].part, red.channels.colors.len()), (1, 1));
    let red = document.select(&Selection { layers: vec!["bg:R".into()], ..fg.clone() }).unwrap();
    assert_eq!(red.channels.colors[0].part, 0);
    let error = refused(&document, &Selection { depth_channel: Some("V".into()), ..fg.clone() });
    assert!(error.contains("channel 'V' in part 'fg'") && error.contains("deep:V"), "{error}");
    let error = refused(&document, &Selection { layers: vec!["V".into()], ..fg });
    assert!(error.contains("layer 'V'"), "{error}");
}

#[test]
fn a_parts_own_depth_comes_before_likelier_names_in_others() {
    let channels = |depth: &str| [rgb(""), vec![float(depth, N, 1)]].concat();
    let document = document(&file(
        (20, 10),
        vec![
            named("bg", (20, 10), (0, 0), channels("Z")),
            named("fg", (20, 10), (0, 0), channels("depth.Z")),
        ],
    ));
    let fg = Selection { part: Some("fg".into()), ..Selection::default() };
    assert_eq!(document.select(&fg).unwrap().depth.unwrap().name, "fg:depth.Z");
}

#[test]
fn parts_of_other_windows_are_aligned() {
    let bytes = file(
        (40, 30),
        vec![
            named("rgba", (20, 10), (5, 5), rgb("")),
            named("depth", (10, 10), (10, 0), vec![float("Z", 100, 1)]),
            named("glow", (4, 4), (0, 0), ["R", "G", "B"].map(|c| half(c, 16, 2)).into()),
        ],
    );
    let document = document(&bytes);
    let selected = document.select(&Selection::default()).unwrap();
    let depth = selected.depth.unwrap().plane;
    assert_eq!(depth.size(), Size::new(20, 10));
    assert_eq!(depth.at(0, 0), f32::INFINITY, "its part has nothing there");
    let original = decoded(&bytes);
    let FlatSamples::F32(z) = channel(&original, 1, "Z") else { panic!("float in the file") };
    assert_eq!(depth.at(5, 0), z[5 * 10]);
    assert_eq!(depth.at(14, 4), z[9 * 10 + 9]);
    assert_eq!(depth.at(14, 5), f32::INFINITY);

    let both = document.select(&layers(&["rgba", "glow"])).unwrap();
    assert_eq!((both.frame.data.x, both.frame.data.y, both.frame.data.size), (0, 0, Size::new(25, 15)));
    assert_eq!(both.picture.colors.len(), 6);
    assert_eq!(both.picture.colors[0].at(0, 0), 0.0);
    let out = rewritten(&document, both, |value| value + 1.0);
    let colours = [0, 2].map(|part| ["R", "G", "B"].map(|c| (part, c))).concat();
    same_but(&bytes, &out, &colours);

    let covering = Selection { cover_display: true, ..Selection::default() };
    let covering = document.select(&covering).unwrap();
    assert_eq!(covering.frame.data, covering.frame.display);
    let out = rewritten(&document, covering, |value| value);
    same_but(&bytes, &out, &[]);
}

#[test]
fn a_second_file_is_laid_onto_the_first() {
    let main = one(rgb("")).select(&Selection::default()).unwrap();
    let crop = part((8, 6), (4, 2), scan_lines(Compression::PIZ), {
        vec![half("R", 48, 1), half("G", 48, 1), half("B", 48, 1), half("A", 48, 1), float("Z", 48, 1)]
    });
    let crop = document(&file((20, 10), vec![crop])).select(&Selection::default()).unwrap();
    let parts = (crop.picture.clone(), crop.depth.clone().map(|d| d.plane), &crop.frame);
    let (picture, depth) =
        align_element(std::path::Path::new("fg.exr"), parts, &main.frame, f32::INFINITY).unwrap();
    let depth = depth.unwrap();
    assert_eq!((picture.size(), depth.size()), (main.picture.size(), main.picture.size()));
    assert_eq!((depth.at(3, 2), depth.at(4, 2)), (f32::INFINITY, crop.depth.unwrap().plane.at(0, 0)));
    assert_eq!(picture.alpha.unwrap().at(0, 0), 0.0);
}

#[test]
fn cameras_of_the_common_renderers() {
    let with = |attributes: &[(&str, AttributeValue)]| {
        let mut part = part((20, 10), (0, 0), scan_lines(Compression::ZIP16), rgb(""));
        for (name, value) in attributes {
            match (*name, value) {
                ("focus", AttributeValue::F32(value)) => part.attributes.focus = Some(*value),
                ("aperture", AttributeValue::F32(value)) => part.attributes.aperture = Some(*value),
                _ => drop(part.attributes.other.insert((*name).into(), value.clone())),
            }
        }
        document(&file((20, 10), vec![part])).select(&Selection::default()).unwrap().camera
    };
    let text = |value: &str| AttributeValue::Text(value.into());
    let read = |found: &Option<pullfocus_io::Found>| found.as_ref().map(|found| found.value);

    let openexr = with(&[
        ("focus", AttributeValue::F32(f32::INFINITY)),
        ("aperture", AttributeValue::F32(2.0)),
        ("nominalFocalLength", AttributeValue::F32(35.0)),
        ("pinholeFocalLength", AttributeValue::F32(34.0)),
        ("sensorOverallDimensions", AttributeValue::FloatVec2(Vec2(24.0, 18.0))),
    ]);
    assert_eq!(read(&openexr.focus_distance_m), Some(f64::INFINITY));
    assert_eq!(read(&openexr.f_stop), Some(2.0));
    assert_eq!(openexr.focal_length_mm.unwrap().attribute, "pinholeFocalLength");
    assert_eq!(read(&openexr.sensor_width_mm), Some(24.0));

    let vray = with(&[
        ("cameraAperture", AttributeValue::F32(36.0)),
        ("cameraFNumber", AttributeValue::F32(8.0)),
        ("cameraFocalLength", AttributeValue::F32(24.0)),
        ("cameraTargetDistance", AttributeValue::F32(65314.757)),
    ]);
    assert_eq!((read(&vray.sensor_width_mm), read(&vray.focal_length_mm)), (Some(36.0), Some(24.0)));
    assert_eq!(vray.focus_distance_m, None);
    assert!(vray.notes[0].contains("cameraTargetDistance"), "{:?}", vray.notes);

    let unreal = with(&[
        ("unreal/camera/FinalImage/focalLength", text("35.0")),
        ("unreal/camera/FinalImage/focalDistance", text("250.0")),
        ("unreal/camera/FinalImage/fstop", text("2.8")),
        ("unreal/camera/FinalImage/sensorWidth", text("23.76")),
    ]);
    assert_eq!(read(&unreal.focus_distance_m), Some(2.5), "written in centimetres");
    assert_eq!(read(&unreal.depth_unit_m), Some(0.01));
    assert_eq!(read(&unreal.sensor_width_mm), Some(23.76));

    let arnold = with(&[
        ("CameraFocalLength", AttributeValue::F32(50.0)),
        ("CameraFilmApertureHorizontal", AttributeValue::F32(36.0)),
        ("arnold/camera/far_clip", AttributeValue::F32(10000.0)),
    ]);
    assert_eq!((read(&arnold.focal_length_mm), read(&arnold.far_clip)), (Some(50.0), Some(10000.0)));

    let redshift = with(&[
        ("rs/camera/fov", AttributeValue::F32(54.4)),
        ("rs/camera/FStop", AttributeValue::F32(4.0)),
        ("rs/camera/DOFFocusDistance", AttributeValue::F32(12.0)),
    ]);
    assert_eq!((read(&redshift.f_stop), redshift.focus_distance_m), (Some(4.0), None));

    let nonsense = with(&[("aperture", AttributeValue::F32(-1.0)), ("focus", AttributeValue::F32(f32::NAN))]);
    assert_eq!((nonsense.f_stop, nonsense.focus_distance_m), (None, None));
}

#[test]
fn inspect_tells_the_depth_range_and_serialises() {
    let contents = document(SINGLE).inspect().unwrap();
    let depth = contents.depth.iter().find(|depth| depth.channel == "Z").unwrap();
    assert!(depth.nothing > 0.0 && depth.nothing < 1.0, "the crop shows the ball and what is beside it");
    assert!(depth.min <= depth.median && depth.median <= depth.max);
    assert_eq!(contents.beauty.as_deref(), Some("rgba"));
    let json = serde_json::to_value(&contents).unwrap();
    assert_eq!(json["parts"][0]["compression"], "ZIPS");
    assert_eq!(json["views"][1], "left");
}

#[test]
fn limits_are_asked_before_memory() {
    let limits = Limits::default();
    let open = |limits| Document::from_bytes("big.exr", SINGLE.to_vec(), &limits);
    for (limits, what) in [
        (Limits { max_pixels: 100, ..limits }, "pixels"),
        (Limits { max_channels: 5, ..limits }, "channels"),
        (Limits { max_chunks: 10, ..limits }, "blocks"),
    ] {
        let error = open(limits).unwrap_err();
        assert!(matches!(error, FileError::TooLarge { .. }), "{error}");
        assert!(error.to_string().contains(what), "{error}");
    }
    let document = open(Limits { max_plane_bytes: 1000, ..limits }).unwrap();
    assert!(refused(&document, &Selection::default()).contains("limit of 1000"));
}
