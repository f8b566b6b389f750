//! A shot's lens for other programs.

mod common;

use common::{Folder, ok, pullfocus, refused};
use std::fs;

/// A pull over three frames, whose lens lacks a sensor.
fn shot(folder: &Folder, more: &str) -> String {
    let shot = folder.path("pull.toml");
    fs::write(
        &shot,
        format!(
            "f-stop = 2\n{more}\n[[key]]\nframe = 1001\nfocus-distance = 1\neasing = 'linear'\n\
             [[key]]\nframe = 1003\nfocus-distance = 3\n"
        ),
    )
    .unwrap();
    shot
}

#[test]
fn a_pull_becomes_a_table_and_a_layer() {
    let folder = Folder::new();
    let shot = shot(&folder, "focal-length = 50\nsensor-width = 36");
    let table = folder.path("pull.csv");
    let said = ok(pullfocus(["camera", &shot, "-o", &table]));
    assert!(said.contains("3 frames, 1001-1003") && said.contains("keys at frame 1001"), "{said}");
    let table = fs::read_to_string(table).unwrap();
    let lines: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((lines.len(), lines[0][1], lines[0][8]), (4, "focus_distance_m", "far_m"));
    assert_eq!((lines[2][0], lines[2][2], lines[2][3]), ("1002", "2", "50"));
    let number = |line: usize, column: usize| lines[line][column].parse::<f64>().unwrap();
    // Half way between 1 and 1/3 dioptres.
    assert!((number(2, 1) - 1.5).abs() < 1e-12);
    assert!((1..4).all(|line| number(line, 7) < number(line, 1) && number(line, 1) < number(line, 8)));

    let layer = folder.path("pull.usda");
    let arguments = ["camera", &shot, "-o", &layer, "--frames", "1002-1010x4", "--fps", "25", "--json"];
    let json: serde_json::Value = serde_json::from_str(&ok(pullfocus(arguments))).unwrap();
    assert_eq!((&json["frames"], &json["range"]), (&3.into(), &"1002-1010x4".into()), "{json}");
    let text = fs::read_to_string(&layer).unwrap();
    for line in [
        "startTimeCode = 1002",
        "endTimeCode = 1010",
        "timeCodesPerSecond = 25",
        "metersPerUnit = 0.01",
        "float focusDistance.timeSamples",
        "1002: 150,",
        "1010: 300,",
        "float focalLength = 50",
        "float horizontalAperture = 36",
        // The usual sensor of that width: no picture was read.
        "float verticalAperture = 24",
        "float fStop = 2",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    // A flag takes the keys' place.
    ok(pullfocus(["camera", &shot, "-o", &layer, "--overwrite", "--focus-distance", "inf", "--frames", "1"]));
    assert!(fs::read_to_string(&layer).unwrap().contains("float focusDistance = 1000000000\n"));
}

#[test]
fn what_a_shot_leaves_out_comes_from_its_frames() {
    let folder = Folder::new();
    folder.frame_with_camera("f.1001.exr");
    let shot = shot(&folder, "input = 'f.####.exr'");
    let table = folder.path("pull.csv");
    // The pictures say which frames there are, and how wide a pixel is.
    let said = ok(pullfocus(["camera", &shot, "-o", &table, "--sharp", "1"]));
    assert!(said.contains("1 frame, 1001") && said.contains("attribute pinholeFocalLength"), "{said}");
    let layer = folder.path("pull.usda");
    ok(pullfocus(["camera", &shot, "-o", &layer, "--frames", "1001-1003"]));
    let text = fs::read_to_string(&layer).unwrap();
    // 36 mm over 48 x 32 pixels.
    assert!(text.contains("horizontalAperture = 36\n") && text.contains("verticalAperture = 24\n"), "{text}");
    assert!(text.contains("fStop = 2\n"), "the shot's own f-stop wins: {text}");
    // A zoom that the renderer keyed; a frame without a file has the lens of the one before.
    folder.frame_with_lens("f.1002.exr", 85.0);
    ok(pullfocus(["camera", &shot, "-o", &table, "--overwrite", "--frames", "1001-1003"]));
    let text = fs::read_to_string(&table).unwrap();
    let focal: Vec<&str> = text.lines().map(|line| line.split(',').nth(3).unwrap()).collect();
    assert_eq!(focal[1..], ["50", "85", "85"], "{text}");
    fs::remove_file(folder.path("f.1002.exr")).unwrap();
    // A picture that cannot be read is told of; then the lens is incomplete.
    fs::write(folder.path("f.1001.exr"), "no picture").unwrap();
    let said = refused(2, pullfocus(["camera", &shot, "-o", &folder.path("x.csv")]));
    assert!(said.contains("f.1001.exr") && said.contains("add --focal-length MM"), "{said}");
    assert!(!folder.has("x.csv") && folder.leftovers() == 0);
}

#[test]
fn nothing_is_written_over_or_guessed() {
    let folder = Folder::new();
    let shot = shot(&folder, "focal-length = 50\nsensor-width = 36");
    let table = folder.path("pull.csv");
    for (arguments, word) in [
        (&["-o", "pull.fbx"][..], ".usda"),
        (&["-o", &table, "--fps", "0"], "0 frames a second"),
        (&["-o", &table, "--sharp", "1"], "part of the width"),
        (&["-o", &table, "--aperture-diameter", "-1"], "pinhole"),
        (&["-o", &table, "--frames", "a"], "1001-1100"),
        (&["-o", "no-such-folder/pull.csv"], "folder does not exist"),
    ] {
        let said = refused(2, pullfocus([&["camera", &shot], arguments].concat()));
        assert!(said.contains(word) && said.trim_end().lines().count() == 1, "{said}");
    }
    fs::write(&table, "mine").unwrap();
    let (status, stdout, said) = pullfocus(["camera", &shot, "-o", &table, "--json"]);
    assert!(status == 1 && said.contains("--overwrite"), "{said}");
    assert!(stdout.contains("\"error\""), "{stdout}");
    assert_eq!(fs::read_to_string(&table).unwrap(), "mine");
    fs::write(&shot, "f-stop = 2\nfocus-distance = 2\nfov-x = 40\nsensor-width = 36").unwrap();
    let said = refused(2, pullfocus(["camera", &shot, "-o", &folder.path("y.csv")]));
    assert!(said.contains("--frames 1001-1100"), "{said}");
    ok(pullfocus(["camera", &shot, "-o", &folder.path("y.csv"), "--frames", "-5--4"]));
}
