//! Nobody's file is lost, nothing is left out in silence, and what is refused says the way out.

mod common;

use common::{Folder, HEIGHT, WIDTH, command, ok, pullfocus, refused};
use pullfocus_core::{Frame, Picture, Plane, Size, Window};
use pullfocus_io::images::{Encoding, read_image, save};
use pullfocus_io::output::Existing;
use pullfocus_io::{Document, Limits, SampleType, Selection, write_exr};
use std::fs;
use std::path::Path;

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "2", "--focal-length", "50", "--sensor-width", "36"];

fn render(input: &str, output: &str, flags: &[&str]) -> (i32, String, String) {
    pullfocus([&["render", input, "-o", output], &LENS[..], flags].concat())
}

#[test]
fn the_demo_replaces_nobodys_files() {
    let folder = Folder::new();
    let demo = |flags: &[&str]| {
        let quick = ["demo", "--preset", "preview", "--device", "cpu"];
        let mut command = command([&quick[..], flags].concat());
        command.current_dir(folder.path(""));
        let output = command.output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (output.status.code().unwrap_or(-1), text(output.stdout), text(output.stderr))
    };
    for mine in ["input.exr", "behind.exr", "contact-sheet.png", "focus-0.8m-f2.png"] {
        fs::write(folder.path(mine), "mine").unwrap();
        let error = refused(1, demo(&["-o", "."]));
        assert!(error.contains(mine) && error.contains("--overwrite"), "{error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
        assert_eq!(fs::read(folder.path(mine)).unwrap(), b"mine");
        let names = fs::read_dir(folder.path("")).unwrap().count();
        assert_eq!(names, 1, "nothing is written beside {mine}");
        fs::remove_file(folder.path(mine)).unwrap();
    }
    let text = ok(demo(&["-o", "my demo"]));
    if cfg!(unix) {
        assert!(text.contains("pullfocus render 'my demo/input.exr' --foreground 'my demo/"), "{text}");
    }
    // Again, over its own results; over a frame that was changed only when told.
    fs::write(folder.path("my demo/contact-sheet.png"), "old").unwrap();
    ok(demo(&["-o", "my demo"]));
    assert!(fs::read(folder.path("my demo/contact-sheet.png")).unwrap().len() > 1000);
    fs::write(folder.path("my demo/input.exr"), "mine").unwrap();
    assert!(refused(1, demo(&["-o", "my demo"])).contains("input.exr"));
    ok(demo(&["-o", "my demo", "--overwrite"]));
}

#[test]
fn folders_may_have_a_frame_numbers_signs_in_their_names() {
    let folder = Folder::new();
    fs::create_dir(folder.path("proj #7")).unwrap();
    let input = folder.frame("proj #7/in.0001.exr", 1);
    ok(render(&input, &folder.path("proj #7/out.exr"), &[]));
    ok(render(&folder.path("proj #7/in.####.exr"), &folder.path("proj #7/b.####.exr"), &[]));
    assert!(folder.has("proj #7/b.0001.exr"));
    let error = refused(2, render(&input, &folder.path("no ##/out.exr"), &[]));
    assert!(error.contains("folder"), "{error}");
}

#[test]
fn frames_before_zero_can_be_asked_for() {
    let folder = Folder::new();
    let input = folder.frame("still.exr", 1);
    ok(render(&input, &folder.path("out.###.exr"), &["--frames", "-2--1"]));
    assert!(folder.has("out.-02.exr") && folder.has("out.-01.exr"));
}

#[test]
fn the_pictures_of_apertures_are_inputs() {
    let folder = Folder::new();
    let (input, iris) = (folder.frame("in.exr", 1), folder.picture("iris.png"));
    let before = fs::read(&iris).unwrap();
    let shape = format!("image:{iris}");
    let flags = &["--aperture", &shape, "--overwrite"][..];
    let error = refused(2, render(&input, &iris, flags));
    assert!(error.contains("iris.png") && error.contains("inputs are never overwritten"), "{error}");
    let preview = [flags, &["--preview-png", &iris]].concat();
    assert!(refused(2, render(&input, &folder.path("out.exr"), &preview)).contains("never overwritten"));
    assert_eq!(fs::read(&iris).unwrap(), before);
}

#[test]
fn floats_stay_floats() {
    let folder = Folder::new();
    let depth = folder.frame("depth.exr", 1);
    let bright = Plane::filled(Size::new(WIDTH, HEIGHT), 1e6).unwrap();
    let sky = folder.path("sky.hdr");
    let picture = Picture::opaque(vec![bright.clone(), bright.clone(), bright]);
    save(sky.as_ref(), &picture, Encoding::for_name(sky.as_ref(), None).unwrap(), Existing::Refuse).unwrap();
    for command in ["render", "coc"] {
        let output = folder.path(&format!("{command}.exr"));
        let flags = [command, &sky, "-o", &output, "--depth-file", &depth];
        ok(pullfocus([&flags[..], &LENS[..]].concat()));
        let document = Document::open(&output, &Limits::default()).unwrap();
        let selection = Selection { without_depth: true, ..Selection::default() };
        let brightest = document.select(&selection).unwrap().picture.colors[0].data()[0];
        assert!((brightest / 1e6 - 1.0).abs() < 0.01, "{command}: {brightest}");
    }
}

#[test]
fn a_colour_profile_is_told_of_and_goes_along() {
    use image::ImageEncoder;
    let folder = Folder::new();
    let depth = folder.frame("depth.exr", 1);
    let photo = folder.path("photo.jpg");
    let mut profile = vec![0; 128];
    profile[16..20].copy_from_slice(b"RGB ");
    profile[36..40].copy_from_slice(b"acsp");
    profile.extend(b"Display P3");
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(fs::File::create(&photo).unwrap());
    encoder.set_icc_profile(profile.clone()).unwrap();
    let grey = vec![90; WIDTH * HEIGHT * 3];
    encoder.write_image(&grey, WIDTH as u32, HEIGHT as u32, image::ExtendedColorType::Rgb8).unwrap();
    let output = folder.path("out.png");
    let (status, _, stderr) = render(&photo, &output, &["--depth-file", &depth]);
    assert_eq!(status, 0, "{stderr}");
    assert!(stderr.contains("photo.jpg: its colour profile") && stderr.contains("goes along"), "{stderr}");
    let image = read_image(output.as_ref(), &Limits::default()).unwrap();
    assert_eq!(image.profile.unwrap().bytes(), profile);
}

#[test]
fn colours_that_a_png_cannot_hold_are_told_of() {
    let folder = Folder::new();
    let size = Size::new(WIDTH, HEIGHT);
    let plane = Plane::filled(size, 0.5).unwrap();
    let input = folder.path("layers.exr");
    let names = ["key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B", "Z"];
    let planes = names.map(|name| (name, &plane, SampleType::Float));
    write_exr(fs::File::create(&input).unwrap(), &Frame::full(size), &planes, &[]).unwrap();
    let flags = ["--channels", "key,fill"];
    let (status, _, stderr) = render(&input, &folder.path("out.png"), &flags);
    assert!(status == 0 && stderr.contains("fill.R, fill.G, fill.B are left out"), "{stderr}");
    let (status, _, stderr) = render(&input, &folder.path("out.exr"), &flags);
    assert!(status == 0 && !stderr.contains("left out"), "{stderr}");
}

#[test]
fn limits_name_the_option_that_lifts_them() {
    let folder = Folder::new();
    let path = folder.path("wide.exr");
    let size = Size::new(4, 4);
    let plane = Plane::filled(size, 0.5).unwrap();
    let frame =
        Frame { display: Window { x: 0, y: 0, size: Size::new(1 << 15, 1 << 15) }, ..Frame::full(size) };
    let planes = ["R", "G", "B"].map(|name| (name, &plane, SampleType::Half));
    write_exr(fs::File::create(&path).unwrap(), &frame, &planes, &[]).unwrap();
    let error = refused(1, pullfocus(["compare", &path, &path]));
    assert!(error.contains("raise the limit with --allow-large-files"), "{error}");
    for command in ["inspect", "compare", "camera"] {
        assert!(ok(pullfocus([command, "--help"])).contains("--allow-large-files"), "{command}");
    }
    ok(pullfocus(["inspect", "--allow-large-files", &path]));
}

/// A limit on the size of files is the full disk that a test can have.
#[cfg(unix)]
#[test]
fn a_full_disk_is_told_with_the_outputs_name() {
    let folder = Folder::new();
    let input = folder.sized_frame("in.exr", 1, 160, 120);
    let output = folder.path("out.exr");
    for name in ["out.exr", "out.tif"] {
        let output = folder.path(name);
        let program = env!("CARGO_BIN_EXE_pullfocus");
        let run = std::process::Command::new("sh")
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$@\"", "sh", program, "render", &input])
            .args(["-o", &output, "--device", "cpu"])
            .args(LENS)
            .output()
            .unwrap();
        let error = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(1), "{error}");
        assert!(error.contains(&format!("{name}: cannot write")), "{error}");
        assert!(!error.contains(".part") && !error.contains("the output"), "{error}");
    }
    assert!(!Path::new(&output).exists() && folder.leftovers() == 0);
}

#[test]
fn flags_take_the_place_of_what_they_exclude() {
    let folder = Folder::new();
    let (near, far) = folder.layers("near.exr", "far.exr");
    let input = folder.frame("in.exr", 1);
    let lens = "focus-distance = 2\nf-stop = 2\nsensor-width = 36\n";
    let file = |name: &str, text: &str| {
        fs::write(folder.path(name), format!("{lens}{text}")).unwrap();
        folder.path(name)
    };
    let depth = file("depth.toml", "focal-length = 50\ndepth-file = 'in.exr'");
    let out = folder.path("layers.exr");
    let layers = ["--foreground", &near, "--behind", &far];
    ok(pullfocus([&["render", &input, "-o", &out, "--config", &depth], &layers[..]].concat()));
    let bits = file("bits.toml", "focal-length = 50\noutput = 'k.png'\nbits = 16");
    ok(pullfocus(["render", &input, "-o", &folder.path("k.exr"), "--config", &bits]));
    let zoom =
        file("zoom.toml", "[[key]]\nframe = 1\nfocal-length = 50\n[[key]]\nframe = 2\nfocal-length = 60");
    let held = folder.path("z.##.exr");
    ok(pullfocus(["render", &input, "-o", &held, "--shot", &zoom, "--fov-x", "30", "--frames", "1-2"]));
    let both = ["--fov-x", "30", "--sensor-width", "36"];
    let csv = folder.path("z.csv");
    let text = ok(pullfocus([&["camera", &zoom, "-o", &csv, "--frames", "1-2"], &both[..]].concat()));
    assert!(text.contains("z.csv"), "{text}");
}
