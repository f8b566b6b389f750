//! Depth in a file of its own.

mod common;

use common::{Folder, HEIGHT, WIDTH, ok, pullfocus, refused};
use pullfocus_io::{Document, Limits};
use std::fs;

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "2", "--focal-length", "50", "--sensor-width", "36"];

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
        let depth = folder.depth(name, channels, 1.0);
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
    let depth = folder.depth("z.exr", &["depth.Z"], 1.0);
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
