//! Sequences, whose frames are read, computed and written at the same time: as if it were one after the other.

mod common;

use common::{Folder, ok, pullfocus, refused};
use pullfocus_cli::overlap::{self, Arrival, Made};
use pullfocus_core::Cancel;
use pullfocus_job::config::Options;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::frames::FrameFiles;
use pullfocus_job::job::Job;
use pullfocus_job::load::LoadedFrame;
use pullfocus_job::purpose::Purpose;
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

const LENS: [&str; 8] =
    ["--focus-distance", "2", "--f-stop", "2", "--focal-length", "50", "--sensor-width", "36"];

/// Frames of different sizes, so that buffers of one do not fit the next; some take longer than others.
fn frames(folder: &Folder, count: usize) {
    for number in 1..=count {
        let name = format!("in.{number:02}.exr");
        folder.sized_frame(&name, number, 40 + 60 * (number % 3), 30 + 20 * (number % 4));
    }
}

/// The result of one frame alone, under another name.
fn alone(folder: &Folder, command: &str, number: usize, ending: &str) -> Vec<u8> {
    let (input, output) =
        (folder.path(&format!("in.{number:02}.exr")), folder.path(&format!("alone.{number:02}.{ending}")));
    ok(pullfocus([&[command, &input, "-o", &output, "--overwrite"], &LENS[..]].concat()));
    fs::read(output).unwrap()
}

#[test]
fn a_sequence_gives_the_bytes_of_its_frames_one_by_one() {
    let folder = Folder::new();
    frames(&folder, 5);
    let input = folder.path("in.##.exr");
    for (command, ending) in [("render", "exr"), ("render", "png"), ("coc", "exr"), ("coc", "png")] {
        for threads in ["1", "3"] {
            let output = folder.path(&format!("out.##.{ending}"));
            let arguments = [command, &input, "-o", &output, "--overwrite", "--threads", threads];
            ok(pullfocus([&arguments, &LENS[..]].concat()));
            for number in 1..=5 {
                let there = fs::read(folder.path(&format!("out.{number:02}.{ending}"))).unwrap();
                assert!(there == alone(&folder, command, number, ending), "{command} {ending} {number}");
            }
        }
    }
}

#[test]
fn a_focus_pull_gives_each_frame_its_own_lens() {
    let folder = Folder::new();
    frames(&folder, 3);
    let shot = folder.path("pull.toml");
    fs::write(
        &shot,
        "f-stop = 2\nfocal-length = 50\nsensor-width = 36\n[[key]]\nframe = 1\nfocus-distance = 1\neasing = 'linear'\n\
         [[key]]\nframe = 3\nfocus-distance = 3\n",
    )
    .unwrap();
    let (input, output) = (folder.path("in.##.exr"), folder.path("out.##.exr"));
    let said = ok(pullfocus(["render", &input, "-o", &output, "--shot", &shot, "--json"]));
    assert!(said.contains("keys at frame 2"), "{said}");
    // Half way between 1 and 1/3 dioptres.
    for (number, focus) in [(1, "1"), (2, "1.5"), (3, "3")] {
        let (input, output) = (folder.path(&format!("in.{number:02}.exr")), folder.path("alone.exr"));
        let arguments = ["render", &input, "-o", &output, "--overwrite", "--focus-distance", focus];
        ok(pullfocus([&arguments, &LENS[2..]].concat()));
        let pulled = fs::read(folder.path(&format!("out.{number:02}.exr"))).unwrap();
        assert!(pulled == fs::read(&output).unwrap(), "frame {number}");
    }
    // A flag takes the keys' place; a frame without a number has none.
    let fixed = folder.path("fixed.##.exr");
    let arguments =
        ["render", &input, "-o", &fixed, "--config", &shot, "--focus-distance", "3", "--frames", "1"];
    ok(pullfocus(arguments));
    assert!(fs::read(folder.path("fixed.01.exr")).unwrap() != fs::read(folder.path("out.01.exr")).unwrap());
    folder.frame("plain.exr", 1);
    let plain = folder.path("plain.exr");
    let said = refused(2, pullfocus(["render", &plain, "-o", &folder.path("x.exr"), "--shot", &shot]));
    assert!(said.contains("no frame with a number"), "{said}");
}

#[test]
fn a_still_is_held_under_a_moving_lens() {
    let folder = Folder::new();
    let still = folder.frame("still.exr", 1);
    let shot = folder.path("pull.toml");
    fs::write(
        &shot,
        "f-stop = 2\nfocal-length = 50\nsensor-width = 36\ninput = 'still.exr'\noutput = 'out.##.exr'\n\
         [[key]]\nframe = 1\nfocus-distance = 1\neasing = 'linear'\n[[key]]\nframe = 3\nfocus-distance = 3\n",
    )
    .unwrap();
    // Nothing but the shot, from another folder than the pictures'.
    ok(pullfocus(["render", "--shot", &shot]));
    for (number, focus) in [(1, "1"), (2, "1.5"), (3, "3")] {
        let output = folder.path("alone.exr");
        let arguments = ["render", &still, "-o", &output, "--overwrite", "--focus-distance", focus];
        ok(pullfocus([&arguments, &LENS[2..]].concat()));
        let held = fs::read(folder.path(&format!("out.{number:02}.exr"))).unwrap();
        assert!(held == fs::read(&output).unwrap(), "frame {number}");
    }
    let mattes = folder.path("matte.##.png");
    ok(pullfocus(["coc", "--shot", &shot, "-o", &mattes, "--frames", "2-6x2"]));
    let there = |number: usize| folder.has(&format!("matte.{number:02}.png"));
    assert_eq!([1, 2, 3, 4, 5, 6].map(there), [false, true, false, true, false, true]);
    let one = folder.path("one.exr");
    let said = refused(2, pullfocus(["render", "--shot", &shot, "-o", &one]));
    assert!(said.contains("no frame with a number") && said.contains("--frames 1-48"), "{said}");
    let said = refused(2, pullfocus(["render", "--shot", &shot, "-o", &one, "--frames", "1-2"]));
    assert!(said.contains("2 frames of a still") && said.contains("out.####.exr"), "{said}");
    let previews = ["--overwrite", "--preview-png", &folder.path("seen.png")].map(str::to_owned);
    let said = refused(2, pullfocus([&["render".into(), "--shot".into(), shot][..], &previews].concat()));
    assert!(said.contains("seen.png"), "{said}");
}

#[test]
fn a_stills_name_may_end_in_a_version() {
    let folder = Folder::new();
    let shot = folder.path("pull.toml");
    fs::write(
        &shot,
        "f-stop = 2\nfocal-length = 50\nsensor-width = 36\n[[key]]\nframe = 1001\nfocus-distance = 1\n\
         [[key]]\nframe = 1004\nfocus-distance = 3\n",
    )
    .unwrap();
    for name in ["plate_v02", "still_4k", "sh010"] {
        let (still, output) =
            (folder.frame(&format!("{name}.exr"), 1), folder.path(&format!("{name}.o.####.exr")));
        ok(pullfocus(["render", &still, "-o", &output, "--shot", &shot]));
        let there = |number: usize| folder.has(&format!("{name}.o.{number:04}.exr"));
        assert_eq!(
            [2, 4, 10, 1001, 1002, 1003, 1004].map(there),
            [false, false, false, true, true, true, true]
        );
        // No frame of the pull says which lens.
        let one = folder.path("one.exr");
        let said = refused(2, pullfocus(["render", &still, "-o", &one, "--shot", &shot]));
        assert!(said.contains("no frame with a number") && said.contains(name), "{said}");
    }
    // A frame of the sequence is that frame.
    let (frame, output) = (folder.frame("f.1002.exr", 1), folder.path("f.o.####.exr"));
    ok(pullfocus(["render", &frame, "-o", &output, "--shot", &shot]));
    let there = |number: usize| folder.has(&format!("f.o.{number}.exr"));
    assert_eq!([1001, 1002, 1003].map(there), [false, true, false]);
    let one = folder.path("one.exr");
    let told = ok(pullfocus(["render", &frame, "-o", &one, "--shot", &shot, "--json"]));
    assert!(told.contains("keys at frame 1002"), "{told}");
}

#[test]
fn reports_come_in_the_order_of_the_frames() {
    let folder = Folder::new();
    frames(&folder, 5);
    // The third is there already.
    folder.frame("out.03.exr", 9);
    let kept = fs::read(folder.path("out.03.exr")).unwrap();
    let (input, output) = (folder.path("in.##.exr"), folder.path("out.##.exr"));
    let arguments = ["render", &input, "-o", &output, "--resume", "--json", "--depth-far-clip", "0.5"];
    let json: serde_json::Value =
        serde_json::from_str(&ok(pullfocus([&arguments, &LENS[..]].concat()))).unwrap();
    let frames = json["frames"].as_array().unwrap();
    let mut warnings = json["warnings"].as_array().unwrap().iter().map(|text| text.as_str().unwrap());
    assert_eq!(frames.len(), 5);
    for (number, frame) in (1..).zip(frames) {
        let name = format!("in.{number:02}.exr");
        assert!(frame["inputs"]["input"].as_str().unwrap().ends_with(&name), "{frame}");
        if number == 3 {
            assert_eq!(frame["outcome"], "skipped");
            continue;
        }
        let stages = frame["stages"].as_array().unwrap();
        assert_eq!(
            (&stages[0]["name"], &stages[stages.len() - 1]["name"]),
            (&"read".into(), &"write".into())
        );
        let sum: f64 = stages.iter().map(|stage| stage["ms"].as_f64().unwrap()).sum();
        // A frame's time is its own: its stages (each rounded to a tenth), and not the wait for other frames.
        let total = frame["total_ms"].as_f64().unwrap();
        assert!(total > 0.9 * sum - 1.0, "{total} {sum}");
        let warning = warnings.next().unwrap();
        assert!(warning.contains(&name), "{warning}");
    }
    assert_eq!(fs::read(folder.path("out.03.exr")).unwrap(), kept);
}

#[test]
fn a_damaged_frame_ends_the_run_behind_the_frames_before_it() {
    let folder = Folder::new();
    frames(&folder, 6);
    let damaged = folder.path("in.04.exr");
    let whole = fs::read(&damaged).unwrap();
    fs::write(&damaged, &whole[..whole.len() / 2]).unwrap();
    let (input, output) = (folder.path("in.##.exr"), folder.path("out.##.exr"));
    let (status, text, stderr) =
        pullfocus([&["render", &input, "-o", &output, "--json"], &LENS[..]].concat());
    assert_eq!(status, 1, "{stderr}");
    assert!(stderr.contains("in.04.exr") && stderr.trim_end().lines().count() == 1, "{stderr}");
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["frames"].as_array().unwrap().len(), 3, "{json}");
    assert!(json["error"].as_str().unwrap().contains("in.04.exr"), "{json}");
    for number in 1..=3 {
        let there = fs::read(folder.path(&format!("out.{number:02}.exr"))).unwrap();
        assert!(there == alone(&folder, "render", number, "exr"), "{number}");
    }
    assert!((4..=6).all(|number| !folder.has(&format!("out.{number:02}.exr"))) && folder.leftovers() == 0);
}

#[test]
fn a_frame_that_lacks_a_layer_is_told_by_its_name() {
    let folder = Folder::new();
    frames(&folder, 3);
    fs::copy(folder.cropped_frame("crop.exr"), folder.path("in.02.exr")).unwrap();
    let (input, output) = (folder.path("in.##.exr"), folder.path("out.##.exr"));
    let arguments = ["render", &input, "-o", &output, "--channels", "id"];
    let error = refused(1, pullfocus([&arguments, &LENS[..]].concat()));
    assert!(error.contains("in.02.exr") && folder.has("out.01.exr") && !folder.has("out.03.exr"), "{error}");
}

/// A job over so many small frames.
fn job(folder: &Folder, count: usize) -> Job {
    for number in 1..=count {
        folder.frame(&format!("in.{number:02}.exr"), number);
    }
    let text = format!(
        "input = {:?}\noutput = {:?}\ndevice = 'cpu'\n\
         focus-distance = 2\nf-stop = 2\nfocal-length = 50\nsensor-width = 36",
        folder.path("in.##.exr"),
        folder.path("out.##.exr")
    );
    let options: Options = pullfocus_job::config::parse(&text).unwrap();
    Job::new(&options, Purpose::Render).unwrap()
}

/// The number of the frame, by its input's name.
fn number(files: &FrameFiles) -> usize {
    files.number.unwrap() as usize
}

#[test]
fn no_more_than_three_frames_are_on_their_way() {
    static COMPUTED: AtomicUsize = AtomicUsize::new(0);
    fn compute(
        _: &Job,
        _: &mut pullfocus::Renderer,
        files: &FrameFiles,
        frame: LoadedFrame,
        _: &Cancel,
    ) -> Result<Made> {
        COMPUTED.fetch_add(1, Ordering::SeqCst);
        Ok(Made::begin(files, frame).0)
    }
    let folder = Folder::new();
    let job = job(&folder, 12);
    let mut arrived = 0;
    overlap::run(&job, compute, &Cancel::new(), &mut |files, arrival| {
        match arrival {
            Arrival::Device(device) => {
                assert_eq!((device.as_str(), arrived), ("cpu", 0));
                return Ok(());
            }
            Arrival::Kept(_) => panic!("nothing is there"),
            Arrival::Made(..) => arrived += 1,
        }
        assert_eq!(number(files), arrived);
        // Time for those who would run ahead: the one computed next waits to be taken.
        std::thread::sleep(std::time::Duration::from_millis(20));
        let computed = COMPUTED.load(Ordering::SeqCst);
        assert!(computed <= arrived + 1, "{computed} {arrived}");
        Ok(())
    })
    .unwrap();
    assert_eq!((arrived, COMPUTED.load(Ordering::SeqCst)), (12, 12));
}

/// Computes nothing; a frame of which nobody knows that it takes long.
fn idle(
    _: &Job,
    _: &mut pullfocus::Renderer,
    files: &FrameFiles,
    frame: LoadedFrame,
    cancel: &Cancel,
) -> Result<Made> {
    cancel.check()?;
    Ok(Made::begin(files, frame).0)
}

#[test]
fn what_cannot_be_written_ends_the_run() {
    let folder = Folder::new();
    let job = job(&folder, 12);
    let mut arrived = 0;
    let failure = overlap::run(&job, idle, &Cancel::new(), &mut |files, arrival| {
        if let Arrival::Made(..) = arrival {
            arrived += 1;
            if number(files) == 5 {
                return Err(Failure::failed("the disk is full"));
            }
        }
        Ok(())
    })
    .unwrap_err();
    assert_eq!((failure.to_string().as_str(), arrived), ("the disk is full", 5));
}

#[test]
fn a_run_that_is_cancelled_stops_within_two_frames() {
    let folder = Folder::new();
    let job = job(&folder, 12);
    let cancel = Cancel::new();
    let mut arrived = 0;
    let failure = overlap::run(&job, idle, &cancel, &mut |files, arrival| {
        if let Arrival::Made(..) = arrival {
            arrived += 1;
            if number(files) == 4 {
                cancel.cancel();
            }
        }
        Ok(())
    })
    .unwrap_err();
    assert!(failure.to_string().ends_with("cancelled"), "{failure}");
    // The fifth may have been computed before the flag was up.
    assert!((4..=5).contains(&arrived), "{arrived}");
}
