//! Depth in a file of its own.

mod common;
#[path = "../../pullfocus-io/tests/common/raw.rs"]
mod raw;

use common::{Folder, HEIGHT, WIDTH, ok, pullfocus, refused};
use pullfocus_io::{AttributeValue, Document, Limits};
use std::fs;

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "0.5", "--focal-length", "50", "--sensor-width", "36"];

#[test]
fn a_file_of_depth_alone_is_a_depth_file() {
    let folder = Folder::new();
    let photo = folder.picture("photo.png");
    let output = folder.path("out.png");
    let mut results = Vec::new();
    for (name, channels) in [
        ("z.exr", &["Z"][..]),
        ("layer.exr", &["depth.Z"]),
        ("rgb.exr", &["depth.R", "depth.G", "depth.B"]),
        ("vray.exr", &["VRayZDepth.R", "VRayZDepth.G", "VRayZDepth.B"]),
        ("mono.exr", &["mono"]),
    ] {
        let depth = folder.depth(name, channels);
        let arguments = ["render", &photo, "--depth-file", &depth, "-o", &output, "--overwrite"];
        ok(pullfocus([&arguments, &LENS[..]].concat()));
        results.push(fs::read(&output).unwrap());
    }
    assert!(results.iter().all(|result| *result == results[0]));
    let frame = folder.frame("frame.exr", 1);
    let (z, none) = (folder.path("z.exr"), folder.path("none.exr"));
    let said = refused(1, pullfocus([&["render", &z, "-o", &none], &LENS[..]].concat()));
    assert!(said.contains("no colour layer"), "{said}");
    let coc = folder.path("coc.exr");
    ok(pullfocus([&["coc", &frame, "-o", &coc], &LENS[..]].concat()));
    let arguments = ["render", &frame, "-o", &none, "--depth-file", &coc];
    let said = refused(1, pullfocus([&arguments, &LENS[..]].concat()));
    assert!(said.contains("coc.exr") && said.contains("--depth-channel"), "{said}");
}

#[test]
fn circles_need_no_colour() {
    let folder = Folder::new();
    let depth = folder.depth("z.exr", &["depth.Z"]);
    let [seen, channel] = ["seen.png", "coc.exr"].map(|name| folder.path(name));
    for output in [&seen, &channel] {
        ok(pullfocus([&["coc", &depth, "-o", output], &LENS[..]].concat()));
    }
    let contents = Document::open(&channel, &Limits::default()).unwrap().contents();
    let names: Vec<_> =
        contents.parts[0].layers.iter().flat_map(|layer| &layer.channels).map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["coc"]);
    let picture = pullfocus_io::images::read_picture(seen.as_ref(), &Limits::default()).unwrap();
    assert_eq!((picture.size().width, picture.size().height), (WIDTH, HEIGHT));
    let told = ok(pullfocus(["inspect", &depth]));
    assert!(told.contains("render PICTURE.exr --depth-file ") && !told.contains("--channels"), "{told}");
}

/// The picture of a run with this depth file, and what it told.
fn with_depth(folder: &Folder, input: &str, depth: &str, flags: &[&str]) -> (Vec<u8>, serde_json::Value) {
    let output = folder.path("out.png");
    let arguments = ["render", input, "--depth-file", depth, "-o", &output, "--overwrite", "--json"];
    let told = ok(pullfocus([&arguments, &LENS[..], flags].concat()));
    (fs::read(output).unwrap(), serde_json::from_str(&told).unwrap())
}

#[test]
fn unit_and_far_clip_are_those_of_the_file_with_the_depth() {
    let folder = Folder::new();
    let attributes = [
        ("unreal/camera/FinalImage/fstop", AttributeValue::Text("8".into())),
        ("cameraFarClip", AttributeValue::Float(300.0)),
    ];
    let (plain, unreal) = (folder.frame("plain.exr", 1), folder.frame_with("unreal.exr", &attributes));
    let metres = folder.depth("m.exr", &["Z"]);
    let centimetres = folder.depth_at("cm.exr", &["Z"], [0, 0], 0.01, &attributes);
    let (expected, told) = with_depth(&folder, &plain, &metres, &[]);
    assert!(!told["frames"][0]["camera"].to_string().contains("depth"), "{told}");
    // The picture's own unit and far clip are those of its own depth.
    let (seen, told) = with_depth(&folder, &unreal, &metres, &[]);
    assert!(seen == expected && !told["frames"][0]["camera"].to_string().contains("depth unit"), "{told}");
    // Centimetres, and nothing at 4 m, beyond the far clip.
    let (seen, told) = with_depth(&folder, &plain, &centimetres, &[]);
    let (clipped, _) = with_depth(&folder, &plain, &metres, &["--depth-far-clip", "3"]);
    let values = told["frames"][0]["camera"].to_string();
    assert!(seen == clipped, "{values}");
    assert!(seen != expected, "the wall at 4 m");
    assert!(values.contains("depth unit") && values.contains("depth far clip"), "{values}");
}

#[test]
fn a_depth_file_is_laid_onto_the_pictures_display_window() {
    let folder = Folder::new();
    let frame = folder.frame("frame.exr", 1);
    let (here, there) =
        (folder.depth("here.exr", &["Z"]), folder.depth_at("there.exr", &["Z"], [100, -50], 1.0, &[]));
    let [here, there] = [here, there].map(|depth| with_depth(&folder, &frame, &depth, &[]).0);
    assert!(here == there);
}

#[test]
fn a_view_is_no_matter_of_files_without_views() {
    let folder = Folder::new();
    let eyes = folder.eyes("eyes.exr");
    let mono = folder.frame("mono.exr", 1);
    let depth = folder.depth("z.exr", &["Z"]);
    let (expected, _) = with_depth(&folder, &mono, &depth, &[]);
    // The right eye is the frame, the left one is dark.
    let (right, _) = with_depth(&folder, &eyes, &depth, &["--view", "right"]);
    let (left, _) = with_depth(&folder, &eyes, &depth, &["--view", "left"]);
    assert!(right == expected && left != expected);
    let (plain, _) = with_depth(&folder, &mono, &eyes, &["--view", "right"]);
    assert!(!plain.is_empty());
    let (near, far) = folder.layers("near.exr", "far.exr");
    let output = folder.path("layers.exr");
    let layers = ["--foreground", &near, "--behind", &far, "--view", "right", "--overwrite"];
    ok(pullfocus([&["render", &eyes, "-o", &output], &layers[..], &LENS[..]].concat()));
    // Where no file has views, it is a mistake.
    let said = refused(1, pullfocus([&["render", &mono, "-o", &output], &layers[..], &LENS[..]].concat()));
    assert!(said.contains("view 'right'") && said.contains("leave the view out"), "{said}");
}

/// Two parts of 4 x 2 pixels with the same channels.
fn parts_alike(folder: &Folder) -> String {
    let part = |name: &str| {
        let channels = [("B", 1, [1, 1]), ("G", 1, [1, 1]), ("R", 1, [1, 1]), ("Z", 2, [1, 1])];
        let mut attributes = raw::required("scanlineimage", [0, 0, 3, 1], &channels);
        attributes.push(raw::text("name", name));
        attributes.push(("chunkCount".to_owned(), "int".to_owned(), raw::ints(&[2])));
        attributes
    };
    let line = |y| {
        // 0.5 as halves, 1 as floats.
        let pixels = [0x3800u16.to_le_bytes().repeat(12), 1f32.to_le_bytes().repeat(4)].concat();
        raw::scan_line(y, &pixels)
    };
    let chunks = [(0, line(0)), (0, line(1)), (1, line(0)), (1, line(1))];
    let path = folder.path("parts.exr");
    fs::write(&path, raw::assemble(0x1002, &[part("bg"), part("fg")], &chunks)).unwrap();
    path
}

#[test]
fn channels_of_parts_that_are_called_alike_are_told_apart() {
    let folder = Folder::new();
    let (parts, output, png) = (parts_alike(&folder), folder.path("coc.exr"), folder.path("coc.png"));
    let settings = folder.path("c.toml");
    fs::write(&settings, "channels = ['bg', 'fg']").unwrap();
    for output in [&output, &png] {
        ok(pullfocus([&["coc", &parts, "-o", output, "--config", &settings], &LENS[..]].concat()));
    }
    let contents = Document::open(&output, &Limits::default()).unwrap().contents();
    let layers = &contents.parts[0].layers;
    let names: Vec<_> = layers.iter().flat_map(|layer| &layer.channels).map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["bg.B", "bg.G", "bg.R", "coc", "fg.B", "fg.G", "fg.R"]);
    let blurred = folder.path("blurred.exr");
    let arguments = ["render", &output, "-o", &blurred, "--coc-channel", "coc", "--channels", "bg,fg"];
    ok(pullfocus(arguments));
    // Names that are clear stay as they are.
    let one = folder.path("one.exr");
    let told = ok(pullfocus([&["coc", &parts, "-o", &one, "--part", "fg"], &LENS[..]].concat()));
    assert!(told.contains("one.exr"));
    let contents = Document::open(&one, &Limits::default()).unwrap().contents();
    assert!(contents.parts[0].layers.iter().any(|layer| layer.channels.iter().any(|c| c.name == "R")));
}
