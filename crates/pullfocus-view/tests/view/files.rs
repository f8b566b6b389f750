//! Files: bad ones, shots that come back, runs that are stopped.

use crate::window::*;
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use pullfocus_core::Cancel;
use pullfocus_job::config::Options;
use pullfocus_job::job::Job;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::{config, load};
use pullfocus_view::engine::Choice;
use pullfocus_view::export::What;
use pullfocus_view::loader::ROOM;
use pullfocus_view::ui::Start;

pub const TESTS: &[(&str, fn())] = &[
    ("a_bad_file_leaves_what_is_open", a_bad_file_leaves_what_is_open),
    ("a_file_is_replaced_only_when_asked", a_file_is_replaced_only_when_asked),
    ("a_camera_goes_to_other_programs", a_camera_goes_to_other_programs),
    ("a_saved_shot_renders_to_the_same_pixels", a_saved_shot_renders_to_the_same_pixels),
    ("the_last_session_comes_back", the_last_session_comes_back),
    ("a_run_that_is_stopped_leaves_nothing_by_half", a_run_that_is_stopped_leaves_nothing_by_half),
    ("a_shot_plays", a_shot_plays),
    ("frames_come_in_the_order_of_their_numbers", frames_come_in_the_order_of_their_numbers),
    ("little_memory_is_enough", little_memory_is_enough),
    ("take_b_comes_back_and_an_unsaved_pull_is_kept", take_b_comes_back_and_an_unsaved_pull_is_kept),
    ("a_frame_that_was_damaged_is_read_again", a_frame_that_was_damaged_is_read_again),
    ("a_still_is_held_with_both_takes", a_still_is_held_with_both_takes),
];

fn a_bad_file_leaves_what_is_open() {
    let folder = sequence(1);
    let good = folder.path().join("f.0001.exr");
    let bad = folder.path().join("bad.exr");
    let bytes = std::fs::read(&good).unwrap();
    std::fs::write(&bad, &bytes[..bytes.len() / 2]).unwrap();
    let mut window = open(&good, Choice::Cpu, None);
    click(&mut window, FAR);
    for path in [bad, folder.path().join("none.exr"), folder.path().join("none.toml")] {
        window.state_mut().open_path(&path);
        settle(&mut window);
        let message = window.state().message().unwrap_or_default().to_owned();
        assert!(message.contains(path.file_name().unwrap().to_str().unwrap()), "{message}");
        assert_eq!(focus(&window), DEPTHS[2]);
    }
}

/// Frame by frame: what the window shows is what a saved shot renders to.
fn a_saved_shot_renders_to_the_same_pixels() {
    let folder = sequence(3);
    let mut window = open(folder.path(), Choice::Cpu, None);
    click(&mut window, NEAR);
    window.key_press(Key::K);
    settle(&mut window);
    window.key_press(Key::End);
    settle(&mut window);
    click(&mut window, FAR);
    window.key_press(Key::OpenBracket);
    settle(&mut window);
    let shot = folder.path().join("pull.toml");
    window.state_mut().save(&shot, false);
    assert!(window.state().message().unwrap().starts_with("Saved"), "{:?}", window.state().message());

    // The shot and its frames may be moved together.
    assert!(std::fs::read_to_string(&shot).unwrap().contains("input = \"f.####.exr\""));
    let mut options: Options = config::read(&shot).unwrap();
    options.files.output = Some(folder.path().join("out.####.exr"));
    let job = Job::new(&options, Purpose::Render).unwrap();
    assert_eq!(job.frames.len(), 3);
    let mut renderer = pullfocus::Renderer::new();
    for files in &job.frames {
        window.state_mut().go_to(files.number.unwrap());
        settle(&mut window);
        let shown = window.state().rendered_picture().unwrap();
        let mut loaded = load::load(&job, files, &Cancel::new()).unwrap();
        let camera = loaded.camera.as_ref().map(|resolved| resolved.camera);
        renderer.render(&mut loaded.scene, camera.as_ref(), &job.settings, &Cancel::new()).unwrap();
        for (shown, rendered) in shown.colors.iter().zip(&loaded.scene.base.picture.colors) {
            for (&shown, &rendered) in shown.data().iter().zip(rendered.data()) {
                // The screen's picture is of halves: 11 bits.
                assert!((shown - rendered).abs() <= rendered.abs() / 2048.0 + 1e-6, "{shown} {rendered}");
            }
        }
    }
    // And it opens again as it was.
    let document = window.state().document().clone();
    window.state_mut().open_path(&shot);
    settle(&mut window);
    assert_eq!(window.state().document().shot().keys, document.shot().keys);
    assert_eq!(window.state().document().shot().lens, document.shot().lens);
}

fn a_file_is_replaced_only_when_asked() {
    let folder = sequence(1);
    let shot = folder.path().join("pull.toml");
    std::fs::write(&shot, "mine").unwrap();
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    window.state_mut().save(&shot, false);
    assert!(window.state().message().unwrap().contains("pull.toml"));
    let asks = |window: &Window, text: &str| window.query_by_label_contains(text).is_some();
    let save = |window: &mut Window, key: Modifiers| {
        window.key_press_modifiers(Modifiers::COMMAND | key, Key::S);
        settle(window);
    };
    // The name that the window offers is there already.
    save(&mut window, Modifiers::NONE);
    window.get_by_label("Save").click();
    settle(&mut window);
    assert!(asks(&window, "is there already"));
    assert_eq!(std::fs::read_to_string(&shot).unwrap(), "mine");
    window.get_by_label("Replace it").click();
    settle(&mut window);
    assert!(!asks(&window, "is there already"));
    let mut saved = std::fs::read_to_string(&shot).unwrap();
    assert!(saved.contains("f.0001.exr"), "{saved}");
    // From now on it is the shot's own.
    click(&mut window, FAR);
    save(&mut window, Modifiers::NONE);
    assert_ne!(std::fs::read_to_string(&shot).unwrap(), saved);
    // Until another hand writes into it.
    saved = std::fs::read_to_string(&shot).unwrap() + "# the director liked this\n";
    std::fs::write(&shot, &saved).unwrap();
    click(&mut window, NEAR);
    save(&mut window, Modifiers::NONE);
    assert!(asks(&window, "what was not saved here"));
    assert_eq!(std::fs::read_to_string(&shot).unwrap(), saved);
    // Opened, it still has that comment.
    window.state_mut().open_path(&shot);
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[2]);
    assert!(window.query_by_label("Replace it").is_some());
    window.get_by_label("Save").click();
    settle(&mut window);
    assert_eq!(std::fs::read_to_string(&shot).unwrap(), saved);
}

fn a_camera_goes_to_other_programs() {
    let folder = sequence(3);
    let mut window = open(folder.path(), Choice::Cpu, None);
    drag(&mut window, NEAR, FAR, Modifiers::SHIFT);
    for (name, word) in [("c.csv", "focus_distance_m"), ("c.usda", "focusDistance.timeSamples")] {
        let output = folder.path().join(name);
        for ends_well in [true, false] {
            window.state_mut().start_export(order(What::Camera, output.clone())).unwrap();
            settle(&mut window);
            let end = window.state().export().unwrap().progress().end.unwrap();
            // The second time the file is there already.
            assert_eq!(end.is_ok(), ends_well, "{end:?}");
        }
        assert!(std::fs::read_to_string(output).unwrap().contains(word));
    }
    let table = std::fs::read_to_string(folder.path().join("c.csv")).unwrap();
    let second: Vec<&str> = table.lines().nth(2).unwrap().split(',').collect();
    assert_eq!(second[0], "2");
    assert!((second[1].parse::<f64>().unwrap() / focus_at_two() - 1.0).abs() < 1e-9, "{table}");
}

/// Half way in dioptres.
fn focus_at_two() -> f64 {
    2.0 / (1.0 / DEPTHS[0] + 1.0 / DEPTHS[2])
}

fn the_last_session_comes_back() {
    let folder = sequence(2);
    let session = folder.path().join("config/view.toml");
    let mut window = open(folder.path(), Choice::Cpu, Some(&session));
    click(&mut window, FAR);
    window.key_press(Key::ArrowRight);
    settle(&mut window);
    window.state_mut().look_mut().exposure = 1.0;
    // Closed as a user closes it.
    eframe::App::on_exit(window.state_mut());
    drop(window);
    let mut window = with(Start { session: Some(session), ..start(None, Options::default()) });
    assert_eq!(focus(&window), DEPTHS[2]);
    assert_eq!((window.state().frame_number(), window.state_mut().look_mut().exposure), (2, 1.0));
}

fn a_run_that_is_stopped_leaves_nothing_by_half() {
    let folder = sequence(12);
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    let mut window = open(folder.path(), Choice::Cpu, None);
    let order = |what, name: &str| order(what, out.join(name));
    window.state_mut().start_export(order(What::Shot, "s.####.exr")).unwrap();
    while window.state().export().unwrap().progress().done == 0 && !window.state().export().unwrap().is_done()
    {
        std::thread::yield_now();
    }
    window.state().export().unwrap().cancel();
    settle(&mut window);
    let progress = window.state().export().unwrap().progress();
    let written = std::fs::read_dir(&out).unwrap().count();
    assert_eq!(written, progress.done, "{progress:?}");
    let window_state = window.state_mut();
    window_state.start_export(order(What::Pictures, "p.####.png")).unwrap();
    settle(&mut window);
    let progress = window.state().export().unwrap().progress();
    assert!(progress.end.unwrap().is_ok());
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), written + 12);
    // Once more: nothing is overwritten unasked.
    window.state_mut().start_export(order(What::Pictures, "p.####.png")).unwrap();
    settle(&mut window);
    assert!(window.state().export().unwrap().progress().end.unwrap().is_err());
}

fn a_shot_plays() {
    let folder = sequence(6);
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.state_mut().look_mut().fps = 30.0;
    window.key_press_modifiers(Modifiers::NONE, Key::P);
    let mut seen = std::collections::BTreeSet::new();
    let start = std::time::Instant::now();
    while start.elapsed() < std::time::Duration::from_secs(20) && seen.len() < 4 {
        window.step();
        seen.insert(window.state().frame_number());
    }
    assert!(seen.len() >= 4, "{seen:?}");
    window.key_press(Key::P);
    settle(&mut window);
}

/// A window on files, as a shell's pattern names them.
fn listed(inputs: Vec<std::path::PathBuf>, frame_memory: usize) -> Window {
    let mut options = Options::default();
    options.files.input = Some(inputs);
    with(Start { frame_memory, ..start(None, options) })
}

fn frames_come_in_the_order_of_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let files = [10, 11, 2, 6].map(|frame| folder.path().join(format!("f{frame}.exr")));
    files.iter().for_each(|file| write_frame(file));
    let mut window = listed(files.to_vec(), ROOM);
    let mut seen = vec![window.state().frame_number()];
    for key in [Key::ArrowRight, Key::ArrowRight, Key::ArrowRight, Key::ArrowRight, Key::ArrowLeft, Key::Home]
    {
        window.key_press(key);
        settle(&mut window);
        seen.push(window.state().frame_number());
    }
    // One key is one frame, over gaps too; after the last there is none.
    assert_eq!(seen, [2, 6, 10, 11, 11, 10, 2]);
    // Frames that share a number are counted.
    let other = folder.path().join("g2.exr");
    write_frame(&other);
    let mut window = listed(vec![files[2].clone(), other], ROOM);
    window.key_press(Key::End);
    settle(&mut window);
    assert_eq!(window.state().frame_number(), 2);
}

/// Room for one frame: the window comes to rest all the same, and plays.
fn little_memory_is_enough() {
    let folder = sequence(5);
    let mut window = listed(vec![folder.path().join("f.####.exr")], 1);
    window.key_press(Key::End);
    settle(&mut window);
    let rendered = window.state().rendered();
    for _ in 0..100 {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    assert_eq!(window.state().rendered(), rendered, "it does not rest");
    window.key_press(Key::P);
    let start = std::time::Instant::now();
    while window.state().rendered() < rendered + 3 {
        window.step();
        assert!(start.elapsed() < std::time::Duration::from_secs(20), "it does not play");
    }
    window.key_press(Key::P);
    settle(&mut window);
}

fn take_b_comes_back_and_an_unsaved_pull_is_kept() {
    let folder = sequence(2);
    let session = folder.path().join("config/view.toml");
    let mut window = open(folder.path(), Choice::Cpu, Some(&session));
    window.key_press(Key::B);
    settle(&mut window);
    click(&mut window, NEAR);
    window.key_press(Key::B);
    settle(&mut window);
    click(&mut window, FAR);
    window.key_press(Key::K);
    settle(&mut window);
    eframe::App::on_exit(window.state_mut());
    drop(window);
    let mut window = with(Start { session: Some(session.clone()), ..start(None, Options::default()) });
    assert_eq!(focus(&window), DEPTHS[2]);
    window.key_press(Key::B);
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[0]);
    // Another file takes the place of a pull that nobody saved.
    window.state_mut().open_path(&folder.path().join("f.0001.exr"));
    settle(&mut window);
    let kept = session.with_file_name("unsaved.toml");
    assert!(window.state().message().unwrap().contains("unsaved.toml"));
    let kept: Options = config::read(&kept).unwrap();
    assert_eq!(kept.keys.keys()[0].focus_distance_m, Some(DEPTHS[2]));
}

/// A farm may still be writing it.
fn a_frame_that_was_damaged_is_read_again() {
    let folder = sequence(2);
    let second = folder.path().join("f.0002.exr");
    let bytes = std::fs::read(&second).unwrap();
    std::fs::write(&second, &bytes[..bytes.len() / 2]).unwrap();
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.key_press(Key::ArrowRight);
    settle(&mut window);
    assert!(window.query_by_label_contains("f.0002.exr").is_some(), "it is told of");
    // What is seen is another frame: nothing is focused on it.
    let keys = window.state().document().clone();
    click(&mut window, FAR);
    assert_eq!(*window.state().document(), keys);
    std::fs::write(&second, &bytes).unwrap();
    window.key_press(Key::ArrowLeft);
    settle(&mut window);
    window.key_press(Key::ArrowRight);
    settle(&mut window);
    click(&mut window, FAR);
    assert_eq!(focus(&window), DEPTHS[2]);
}

fn a_still_is_held_with_both_takes() {
    let folder = tempfile::tempdir().unwrap();
    let still = folder.path().join("kitchen_v2.exr");
    write_frame(&still);
    let mut window = open(&still, Choice::Cpu, None);
    window.key_press(Key::B);
    settle(&mut window);
    click(&mut window, NEAR);
    window.get_by_label("Hold the still").click();
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[0], "take B is as it was");
    window.key_press(Key::B);
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[1]);
    drag(&mut window, NEAR, FAR, Modifiers::SHIFT);
    let frames: Vec<f64> = window.state().document().shot().keys.keys().iter().map(|key| key.frame).collect();
    // Frame 2 is the file's own.
    assert_eq!(frames, [1001.0, 1025.0]);
}
