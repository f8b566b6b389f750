//! The program from outside: what it prints, writes and returns.

mod common;

use common::{Folder, command, ok, pullfocus, refused};
use std::fs;

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "2", "--focal-length", "50", "--sensor-width", "36"];

#[test]
fn help_teaches_with_examples() {
    for command in ["render", "coc", "camera", "inspect", "compare", "demo", "devices", "bench"] {
        let help = ok(pullfocus([command, "--help"]));
        assert!(
            help.contains("Example") && help.contains(&format!("pullfocus {command}")),
            "{command}: {help}"
        );
    }
    let all = ok(pullfocus(["--help"]));
    // A terminal of 80 columns must not break the commands in two.
    for help in [&all, &ok(pullfocus(["render", "--help"])), &ok(pullfocus(["coc", "--help"]))] {
        let examples = help.split("Examples:").nth(1).unwrap_or_default();
        let longest = examples.lines().map(str::len).max().unwrap_or(0);
        assert!(longest < 80, "{longest}: {examples}");
    }
    for command in
        ["render", "coc", "camera", "inspect", "compare", "demo", "devices", "bench", "completions"]
    {
        assert!(all.contains(command), "{command}");
    }
    let render = ok(pullfocus(["render", "--help"]));
    insta::assert_snapshot!("render_options", options_of(&render));
}

/// The options' names alone, one a line: what scripts rely on.
fn options_of(help: &str) -> String {
    let before_examples = help.split("Examples:").next().unwrap_or_default();
    before_examples
        .lines()
        .map(str::trim)
        .filter(|line| {
            line.starts_with("--")
                || line.starts_with("-o")
                || line.starts_with("-v")
                || line.starts_with("-q")
        })
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn mistakes_of_usage_are_one_sentence_and_exit_2() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let (input, output) = (input.as_str(), output.as_str());
    let cases: [(&[&str], &str); 11] = [
        (&["--f-stop", "2"], "add --focus-distance M and --focal-length MM and --sensor-width MM"),
        (&["--f-stop", "2", "--aperture-diameter", "0.01"], "give one of them"),
        (&["--integrator", "rational", "--steps", "2"], "--steps goes with --integrator backward-euler"),
        (&["--method", "naive", "--solver", "lu"], "--solver goes with --method diffusion"),
        (&["--psf", "aperture"], "--psf goes with --method naive or gather"),
        (&["--layering", "single", "--layers", "3"], "single has one layer"),
        (&["--overwrite", "--resume"], "give one of them"),
        (&["--foreground", input], "--foreground needs --behind"),
        (&["--depth", "normalized"], "needs --depth-near M and --depth-far M"),
        (&["--frames", "1-3"], "####"),
        (&["--threads", "0"], "--threads is 0"),
    ];
    for (flags, sentence) in cases {
        let error = refused(2, pullfocus([&["render", input, "-o", output], flags].concat()));
        assert!(error.starts_with("pullfocus: error: ") && error.contains(sentence), "{flags:?}: {error}");
        assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    }
    let unknown = refused(2, pullfocus(["render", input, "--blades", "6"]));
    assert!(unknown.starts_with("pullfocus: error: unexpected argument '--blades'"), "{unknown}");
    let ending = refused(2, pullfocus([&["render", input, "-o", "out.webp"], &LENS[..]].concat()));
    assert!(ending.contains("out.webp"), "{ending}");
    assert!(!folder.has("out.exr"));
}

#[test]
fn failures_are_one_sentence_and_exit_1() {
    let folder = Folder::new();
    let output = folder.path("out.exr");
    let missing = folder.path("no.exr");
    let error = refused(1, pullfocus([&["render", &missing, "-o", &output], &LENS[..]].concat()));
    assert!(error.contains("no.exr"), "{error}");

    let damaged = folder.path("damaged.exr");
    let whole = fs::read(folder.frame("in.exr", 1)).unwrap();
    fs::write(&damaged, &whole[..whole.len() / 2]).unwrap();
    let error = refused(1, pullfocus([&["render", &damaged, "-o", &output], &LENS[..]].concat()));
    assert!(error.contains("damaged.exr"), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");

    let (status, told, error) = pullfocus(["inspect", &damaged]);
    assert_eq!(status, 1, "{error}");
    assert!(told.contains("48 x 32") && told.contains("depth: Z") && !told.contains("go on with"), "{told}");
    assert!(error.contains("damaged.exr") && error.trim_end().lines().count() == 1, "{error}");
    let (_, json, _) = pullfocus(["inspect", "--json", &damaged]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["files"][0]["contents"]["exr"]["depth_channel"], "Z");
    assert!(json["files"][0]["error"].as_str().unwrap().contains("damaged.exr"), "{json}");

    let flat = folder.picture("flat.png");
    let error = refused(1, pullfocus([&["render", &flat, "-o", &output], &LENS[..]].concat()));
    assert!(error.contains("--depth-file"), "{error}");
    assert!(!folder.has("out.exr") && folder.leftovers() == 0);
}

#[test]
fn existing_outputs_are_kept_unless_told() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let render = |extra: &[&str]| pullfocus([&["render", &input, "-o", &output], &LENS[..], extra].concat());
    ok(render(&[]));
    let first = fs::read(&output).unwrap();
    let error = refused(1, render(&[]));
    assert!(error.contains("--overwrite") && error.contains("--resume"), "{error}");
    let kept = ok(render(&["--resume"]));
    assert!(kept.contains("kept"), "{kept}");
    assert_eq!(fs::read(&output).unwrap(), first);
    ok(render(&["--overwrite", "--preset", "preview"]));
    assert_ne!(fs::read(&output).unwrap(), first);
    let itself =
        refused(2, pullfocus([&["render", &input, "-o", &input, "--overwrite"], &LENS[..]].concat()));
    assert!(itself.contains("in.exr") && itself.contains("input"), "{itself}");
}

#[test]
fn a_preview_is_not_written_over_the_result() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("same.png"));
    let spelled = format!("{}/./same.png", std::path::Path::new(&output).parent().unwrap().display());
    for preview in [&output, &spelled] {
        let arguments = ["render", &input, "-o", &output, "--preview-png", preview];
        let error = refused(2, pullfocus([&arguments, &LENS[..]].concat()));
        assert!(error.contains("same.png") && error.contains("--preview-png"), "{error}");
        assert!(!folder.has("same.png"));
    }
    let other = folder.path("other.png");
    ok(pullfocus([&["render", &input, "-o", &output, "--preview-png", &other], &LENS[..]].concat()));
}

#[test]
fn the_result_is_the_same_for_any_number_of_threads() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let bytes = ["1", "2", "5"].map(|threads| {
        let output = folder.path(&format!("out{threads}.exr"));
        ok(pullfocus([&["render", &input, "-o", &output, "--threads", threads], &LENS[..]].concat()));
        fs::read(output).unwrap()
    });
    assert!(bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn json_tells_all_and_nothing_else() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let text = ok(pullfocus([&["render", &input, "-o", &output, "--json"], &LENS[..]].concat()));
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let frame = &json["frames"][0];
    assert_eq!(frame["inputs"]["input"], input.as_str());
    assert_eq!(frame["outputs"][0], output.as_str());
    assert_eq!(frame["outcome"], "written");
    assert_eq!(frame["camera"][0]["from"], "--focus-distance");
    assert_eq!(frame["camera"][0]["value"], 2.0);
    let range = frame["coc_range_px"].as_array().unwrap();
    assert!(range[0].as_f64().unwrap() < 0.0 && range[1].as_f64().unwrap() > 0.0);
    let stages: Vec<_> =
        frame["stages"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert!(
        stages.first() == Some(&"read") && stages.last() == Some(&"write") && stages.len() > 3,
        "{stages:?}"
    );
    assert!(json["error"].is_null() && json["settings"]["layering"].is_object());

    let (status, text, stderr) = pullfocus(["render", &input, "-o", &output, "--json", "--f-stop", "2"]);
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(status, 1, "{stderr}");
    assert!(json["error"].as_str().unwrap().contains("out.exr"), "{json}");
}

#[test]
fn a_settings_file_holds_the_options_and_flags_lie_over_it() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let settings = folder.path("shot.toml");
    fs::write(
        &settings,
        format!(
            "input = {input:?}\noutput = {output:?}\nfocus-distance = 2\nf-stop = 2\nfocal-length = 50\nsensor-width = 36\n\
             preset = 'preview'\njson = true\noverwrite = true\n"
        ),
    )
    .unwrap();
    let run = |extra: &[&str]| -> serde_json::Value {
        let text = ok(pullfocus([&["render", "--config", &settings], extra].concat()));
        serde_json::from_str(&text).unwrap()
    };
    let from = |json: &serde_json::Value| json["frames"][0]["camera"][1]["value"].as_f64().unwrap();
    let json = run(&[]);
    assert_eq!(from(&json), 2.0);
    assert!(json["settings"]["layering"]["background"].is_object(), "{}", json["settings"]);
    let json = run(&["--f-stop", "4", "--preset", "final"]);
    assert_eq!(from(&json), 4.0);
    assert!(json["settings"]["layering"]["general"].is_object(), "{}", json["settings"]);
    assert!(ok(pullfocus(["render", "--config", &settings, "--json=false"])).contains("layers"));
    // Flags that exclude what the file says take its place.
    let json = run(&["--fov-x", "40", "--aperture-diameter", "0.01"]);
    assert_eq!(json["frames"][0]["camera"][1]["name"], "field of view", "{json}");

    fs::write(&settings, "f-stopp = 2").unwrap();
    let error = refused(2, pullfocus(["render", "--config", &settings]));
    assert!(
        error.contains("shot.toml") && error.contains("'f-stopp'") && error.contains("'f-stop'"),
        "{error}"
    );
    let error = refused(2, pullfocus(["render", "--config", &folder.path("none.toml")]));
    assert!(error.contains("none.toml"), "{error}");
}

#[test]
fn paths_in_a_settings_file_count_from_its_folder() {
    let (folder, elsewhere) = (Folder::new(), Folder::new());
    folder.frame("in.exr", 1);
    let text = "input = 'in.exr'\noutput = 'out.exr'\nfocus-distance = 2\nf-stop = 2\nfocal-length = 50\nsensor-width = 36\n";
    fs::write(folder.path("shot.toml"), text).unwrap();
    let run = command(["coc", "-q", "--config", &folder.path("shot.toml")])
        .current_dir(elsewhere.path(""))
        .status();
    assert!(run.unwrap().success() && folder.has("out.exr") && !elsewhere.has("out.exr"));
    // What the command line says counts from the working folder, and so does what comes from a pipe.
    let flag = command(["coc", "-q", "--config", &folder.path("shot.toml"), "-o", "flag.exr"])
        .current_dir(elsewhere.path(""))
        .status();
    assert!(flag.unwrap().success() && elsewhere.has("flag.exr"));
    #[cfg(unix)]
    {
        let mut piped = command(["coc", "-q", "--config", "/dev/stdin", "-o", "piped.exr"])
            .current_dir(folder.path(""))
            .stdin(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        std::io::Write::write_all(&mut piped.stdin.take().unwrap(), text.as_bytes()).unwrap();
        assert!(piped.wait().unwrap().success() && folder.has("piped.exr"));
    }
}

#[test]
fn a_sequence_is_rendered_and_continued() {
    let folder = Folder::new();
    for number in 1..=4 {
        folder.frame(&format!("in.{number:04}.exr"), number);
    }
    let (input, output) = (folder.path("in.####.exr"), folder.path("out.%04d.exr"));
    let preview = folder.path("look.####.png");
    let render = |extra: &[&str]| {
        pullfocus([&["render", &input, "-o", &output, "--preview-png", &preview], &LENS[..], extra].concat())
    };
    let text = ok(render(&["--frames", "1-4x2"]));
    assert!(text.contains("2 of 2 frames done"), "{text}");
    assert!(folder.has("out.0001.exr") && folder.has("out.0003.exr") && folder.has("look.0003.png"));
    assert!(!folder.has("out.0002.exr"));
    let first = fs::read(folder.path("out.0001.exr")).unwrap();
    let text = ok(render(&["--resume"]));
    assert!(text.contains("4 of 4 frames done, 2 kept as they were"), "{text}");
    assert_eq!(fs::read(folder.path("out.0001.exr")).unwrap(), first);
    // A frame is the same alone as behind others whose buffers it uses.
    let alone = folder.path("alone.exr");
    let fourth = folder.path("in.0004.exr");
    ok(pullfocus([&["render", &fourth, "-o", &alone], &LENS[..]].concat()));
    assert_eq!(fs::read(alone).unwrap(), fs::read(folder.path("out.0004.exr")).unwrap());
    let error = refused(1, render(&["--frames", "3-9", "--overwrite"]));
    assert!(error.contains("5-9"), "{error}");
}

#[test]
fn a_killed_run_leaves_nothing_broken_and_goes_on() {
    let folder = Folder::new();
    for number in 1..=12 {
        folder.sized_frame(&format!("in.{number:02}.exr"), number, 320, 180);
    }
    let input = folder.path("in.##.exr");
    let clean = folder.path("clean.##.exr");
    ok(pullfocus([&["render", &input, "-o", &clean], &LENS[..]].concat()));
    let output = folder.path("killed.##.exr");
    let arguments = [&["render", &input, "-o", &output, "-q", "--resume"], &LENS[..]].concat();
    let mut child = common::command(&arguments).spawn().unwrap();
    // Until it is in the midst of its work: something is written, something is not.
    let begin = std::time::Instant::now();
    while !folder.has("killed.02.exr") && begin.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    for number in 1..=12 {
        let name = format!("killed.{number:02}.exr");
        if folder.has(&name) {
            let clean = fs::read(folder.path(&format!("clean.{number:02}.exr"))).unwrap();
            assert_eq!(fs::read(folder.path(&name)).unwrap(), clean, "{name}");
        }
    }
    ok(pullfocus(&arguments));
    for number in 1..=12 {
        let [clean, killed] = ["clean", "killed"]
            .map(|name| fs::read(folder.path(&format!("{name}.{number:02}.exr"))).unwrap());
        assert!(clean == killed, "{number}");
    }
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_says_how_far_it_came_and_cleans_up() {
    let folder = Folder::new();
    for number in 1..=40 {
        folder.sized_frame(&format!("in.{number:02}.exr"), number, 320, 180);
    }
    let (input, output) = (folder.path("in.##.exr"), folder.path("out.##.exr"));
    let child = common::command([&["render", &input, "-o", &output], &LENS[..]].concat())
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begin = std::time::Instant::now();
    while !folder.has("out.01.exr") && begin.elapsed().as_secs() < 60 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let killed = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let finished = child.wait_with_output().unwrap();
    let error = String::from_utf8(finished.stderr).unwrap();
    assert_eq!(finished.status.code(), Some(1), "{error}");
    assert!(error.contains("of 40 frames are done") && error.contains("--resume"), "{error}");
    assert_eq!(folder.leftovers(), 0);
}

#[test]
fn every_format_is_written_and_compared() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let exr = folder.path("out.exr");
    ok(pullfocus([&["render", &input, "-o", &exr], &LENS[..]].concat()));
    // What 8 and 16 bits, RGBE and JPEG's quality of 92 keep of a smooth small picture, in dB.
    for (ending, flags, least) in [
        ("png", &[][..], 60.0),
        ("tif", &[][..], 60.0),
        ("tiff", &["--bits", "float"][..], 60.0),
        ("hdr", &[][..], 40.0),
        ("pfm", &[][..], 60.0),
        ("jpg", &[][..], 25.0),
    ] {
        let output = folder.path(&format!("out.{ending}"));
        ok(pullfocus([&["render", &input, "-o", &output], &LENS[..], flags].concat()));
        let text = ok(pullfocus(["compare", &output, &exr, "--json"]));
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let psnr = json["psnr_db"].as_f64().unwrap_or(f64::INFINITY);
        assert!(psnr > least, "{ending}: {json}");
    }
}

#[test]
fn a_photograph_with_disparity_is_blurred() {
    let folder = Folder::new();
    let (photo, depth, output) =
        (folder.picture("photo.png"), folder.picture("depth.png"), folder.path("out.png"));
    let flags =
        ["--depth-file", &depth, "--depth", "disparity", "--depth-scale", "0.9", "--depth-shift", "0.1"];
    ok(pullfocus([&["render", &photo, "-o", &output], &flags[..], &LENS[..]].concat()));
    let (status, text, stderr) = pullfocus(
        [&["render", &photo, "-o", &output, "--overwrite", "--depth-file", &depth], &LENS[..]].concat(),
    );
    assert_eq!(status, 0, "{stderr}");
    assert!(stderr.contains("read as 0 to 1 m") && text.contains("out.png"), "{stderr}");
}

#[test]
fn circles_are_drawn_and_taken_back() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let (png, exr) = (folder.path("coc.png"), folder.path("coc.exr"));
    ok(pullfocus([&["coc", &input, "-o", &png], &LENS[..]].concat()));
    let picture = pullfocus_io::images::read_picture(png.as_ref(), &pullfocus_io::Limits::default()).unwrap();
    // The near strip of the frame is red, what is far is blue.
    let at = |x: usize, y: usize| [0, 1, 2].map(|c: usize| picture.colors[c].at(x, y));
    let (near, far) = (at(2, 10), at(common::WIDTH - 2, 10));
    assert!(near[0] > near[2] && near[0] > near[1], "{near:?}");
    assert!(far[2] > far[0] && far[2] > far[1], "{far:?}");

    ok(pullfocus([&["coc", &input, "-o", &exr], &LENS[..]].concat()));
    let [by_depth, by_coc] = ["depth.exr", "coc_out.exr"].map(|name| folder.path(name));
    ok(pullfocus([&["render", &input, "-o", &by_depth], &LENS[..]].concat()));
    ok(pullfocus(["render", &exr, "-o", &by_coc, "--coc-channel", "coc"]));
    let text = ok(pullfocus(["compare", &by_depth, &by_coc]));
    assert!(text.contains("infinite"), "{text}");

    let text = ok(pullfocus(["inspect", &exr]));
    let suggested = text.lines().find(|line| line.contains("go on with")).unwrap();
    assert!(suggested.ends_with("--coc-channel coc"), "{suggested}");
    assert!(!ok(pullfocus(["inspect", &input])).contains("--coc-channel"));
}

#[test]
fn depth_of_nothing_is_told() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let warnings = |flags: &[&str]| {
        let output = folder.path("out.exr");
        let arguments = ["render", &input, "-o", &output, "--json", "--overwrite"];
        let json = ok(pullfocus([&arguments, &LENS[..], flags].concat()));
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        json["warnings"].as_array().unwrap().iter().map(|warning| format!("{warning}\n")).collect::<String>()
    };
    // Nearest is 1 m: beyond this far clip as the rest.
    let told = warnings(&["--depth-far-clip", "0.5"]);
    assert!(told.contains("its depth (Z)") && told.contains("--depth-channel"), "{told}");
    let told = warnings(&["--depth", "disparity", "--depth-scale", "-1"]);
    assert!(told.contains("its depth (Z)"), "{told}");
    assert!(!warnings(&[]).contains("nothing"), "{}", warnings(&[]));
    let stderr = pullfocus(
        [&["render", &input, "-o", &folder.path("b.exr"), "--depth-far-clip", "0.5"], &LENS[..]].concat(),
    )
    .2;
    assert!(stderr.contains("warning") && stderr.contains("nothing there"), "{stderr}");
}

#[test]
fn layers_go_into_the_inputs_file() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let (near, far) = folder.layers("near.exr", "far.exr");
    let output = folder.path("out.exr");
    let layers = ["--foreground", &near, "--behind", &far];
    ok(pullfocus([&["render", &input, "-o", &output], &layers[..], &LENS[..]].concat()));
    let contents =
        pullfocus_io::Document::open(&output, &pullfocus_io::Limits::default()).unwrap().contents();
    let channels: Vec<_> = contents.parts[0]
        .layers
        .iter()
        .flat_map(|layer| layer.channels.iter().map(|c| c.name.as_str()))
        .collect();
    assert_eq!(channels, ["B", "G", "R", "Z", "id.X"]);
    let without = folder.path("without.exr");
    ok(pullfocus([&["render", "-o", &without], &layers[..], &LENS[..]].concat()));
    assert!(ok(pullfocus(["compare", &output, &without])).contains("infinite"));
}

#[test]
fn each_layer_is_written_alone() {
    let folder = Folder::new();
    let input = folder.frame("in.exr", 1);
    let (near, far) = folder.layers("near.exr", "far.exr");
    let shown = |what: &str| {
        let output = folder.path(&format!("{}.exr", what.replace(':', "")));
        let flags = ["--foreground", &near, "--behind", &far, "--layering", "single", "--show", what];
        let text = ok(pullfocus([&["render", &input, "-o", &output], &flags[..], &LENS[..]].concat()));
        assert!(text.contains("2 layers"), "{what}: {text}");
        let document = pullfocus_io::Document::open(&output, &pullfocus_io::Limits::default()).unwrap();
        document.select(&pullfocus_io::Selection::default()).unwrap().picture
    };
    let all = ["result", "layer:0", "layer:1", "matte:0", "matte:1", "layer:2"];
    let [result, behind, front, everywhere, matte, none] = all.map(shown);
    for plane in 0..3 {
        let value = |picture: &pullfocus_core::Picture, i: usize| picture.colors[plane].data()[i];
        for i in 0..common::WIDTH * common::HEIGHT {
            let covers = value(&matte, i);
            assert!((0.0..=1.0).contains(&covers) && value(&everywhere, i) == 1.0 && value(&none, i) == 0.0);
            let laid = value(&front, i) + (1.0 - covers) * value(&behind, i);
            // Four halves of at most 1, each rounded by 2^-12.
            assert!((laid - value(&result, i)).abs() <= 4.0 * 2.0f32.powi(-12), "{plane} {i}: {laid}");
        }
        // The near strip covers the left border, and nothing reaches the right one.
        let row = 10 * common::WIDTH;
        assert!(value(&matte, row) > 0.5 && value(&front, row) > 0.0, "{plane}");
        assert_eq!(
            [value(&matte, row + common::WIDTH - 1), value(&front, row + common::WIDTH - 1)],
            [0.0; 2]
        );
    }
}

#[test]
fn a_camera_in_the_file_fills_what_was_not_given() {
    let folder = Folder::new();
    let input = folder.frame_with_camera("in.exr");
    let output = folder.path("out.exr");
    let text = ok(pullfocus(["render", &input, "-o", &output, "--f-stop", "4", "-v"]));
    assert!(text.contains("f-stop 4 (--f-stop)"), "{text}");
    assert!(text.contains("focus distance 2 m (attribute focus)"), "{text}");
    assert!(text.contains("focal length 50 mm (attribute pinholeFocalLength)"), "{text}");
    assert!(text.contains("stages: read "), "{text}");
    let inspected = ok(pullfocus(["inspect", &input]));
    assert!(
        inspected.contains("go on with: pullfocus render") && inspected.contains("pinholeFocalLength"),
        "{inspected}"
    );
    let json = ok(pullfocus(["inspect", "--json", &input]));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["files"][0]["contents"]["exr"]["depth_channel"], "Z");
}

#[test]
fn a_cropped_frame_is_seen_in_its_display_window() {
    let folder = Folder::new();
    let input = folder.cropped_frame("crop.exr");
    for (command, name) in [("render", "out.png"), ("coc", "coc.png")] {
        let output = folder.path(name);
        ok(pullfocus([&[command, &input, "-o", &output], &LENS[..]].concat()));
        let limits = pullfocus_io::Limits::default();
        let picture = pullfocus_io::images::read_picture(output.as_ref(), &limits).unwrap();
        assert_eq!((picture.size().width, picture.size().height), (2 * common::WIDTH, common::HEIGHT + 4));
        assert_eq!(picture.colors[0].at(0, 0), 0.0);
        assert!((0..3).any(|c| picture.colors[c].at(5, 6) > 0.0));
    }
}

#[test]
fn quiet_is_quiet() {
    let folder = Folder::new();
    let (input, output) = (folder.frame("in.exr", 1), folder.path("out.exr"));
    let (status, stdout, stderr) = pullfocus([&["render", &input, "-o", &output, "-q"], &LENS[..]].concat());
    assert_eq!((status, stdout.as_str(), stderr.as_str()), (0, "", ""));
}

#[test]
fn completions_are_written_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = ok(pullfocus(["completions", shell]));
        assert!(script.contains("focus-distance") && script.contains("devices"), "{shell}");
    }
}

#[test]
fn the_demo_writes_what_it_says() {
    let folder = Folder::new();
    let out = folder.path("demo");
    let text = ok(pullfocus(["demo", "-o", &out, "--preset", "preview"]));
    assert!(text.contains("contact-sheet.png") && text.contains("circle of confusion "), "{text}");
    let names: Vec<String> =
        fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    // The frame's three files, six results in two formats, the sheet.
    assert_eq!(names.len(), 3 + 12 + 1, "{names:?}");
    let json = ok(pullfocus(["demo", "-o", &out, "--preset", "preview", "--json"]));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["frames"].as_array().unwrap().len(), 6);
}

#[test]
fn the_bench_measures() {
    let text = ok(pullfocus(["bench", "--size", "64x48", "--seconds", "0", "--json"]));
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let lines = json["lines"].as_array().unwrap();
    assert!(lines.len() > 10 && lines.iter().all(|line| line["ms"].as_f64().unwrap() > 0.0), "{json}");
}
