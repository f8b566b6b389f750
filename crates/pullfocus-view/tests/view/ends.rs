//! Ends that nobody planned: a window closed in the middle of something, a device that is gone, an encoder that fails.

use crate::window::*;
use eframe::egui::{Key, ViewportCommand, ViewportId};
use pullfocus_job::config::Options;
use pullfocus_view::engine::Choice;
use pullfocus_view::export::What;
use pullfocus_view::ui::Start;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

pub const TESTS: &[(&str, fn())] = &[
    ("a_window_closed_while_it_renders_loses_nothing", a_window_closed_while_it_renders_loses_nothing),
    (
        "a_window_closed_while_it_writes_leaves_whole_files",
        a_window_closed_while_it_writes_leaves_whole_files,
    ),
    ("a_lost_device_keeps_the_session", a_lost_device_keeps_the_session),
    ("a_lost_device_keeps_the_session_on_the_gpu", a_lost_device_keeps_the_session_on_the_gpu),
    ("a_movie_is_whole_or_not_there", a_movie_is_whole_or_not_there),
];

/// A window that goes on with the last session.
fn again(session: &Path) -> Window {
    with(Start { session: Some(session.to_owned()), ..start(None, Options::default()) })
}

fn a_window_closed_while_it_renders_loses_nothing() {
    let folder = sequence(1);
    let session = folder.path().join("view.toml");
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, Some(&session));
    click(&mut window, FAR);
    let rendered = window.state().rendered();
    window.key_press(Key::OpenBracket);
    window.step();
    assert!(!window.state().is_settled() || window.state().rendered() > rendered);
    eframe::App::on_exit(window.state_mut());
    // The threads are waited for here.
    drop(window);
    let window = again(&session);
    assert_eq!(focus(&window), DEPTHS[2]);
    let f_stop = window.state().lens_values().unwrap().f_stop.unwrap();
    assert!((f_stop - 2f64.powf(8.0 / 6.0)).abs() < 1e-12, "{f_stop}");
}

fn a_window_closed_while_it_writes_leaves_whole_files() {
    // So many that they are not all written while the window ends.
    let folder = sequence(80);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.state_mut().start_export(order(What::Shot, out.join("s.####.exr"))).unwrap();
    loop {
        let progress = window.state().export().unwrap().progress();
        assert!(progress.end.is_none(), "{progress:?}");
        if progress.done > 0 {
            break;
        }
        std::thread::yield_now();
    }
    drop(window);
    let files: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(!files.is_empty() && files.len() < 80, "{files:?}");
    for file in files {
        assert!(file.extension().is_some_and(|ending| ending == "exr"), "{file:?}");
        let image = pullfocus_io::Document::open(&file, &pullfocus_io::Limits::default()).unwrap();
        image.select(&Default::default()).unwrap();
    }
}

fn a_lost_device_keeps_the_session() {
    lost(Choice::Cpu);
}

fn a_lost_device_keeps_the_session_on_the_gpu() {
    lost(Choice::Gpu);
}

fn lost(choice: Choice) {
    let folder = sequence(1);
    let session = folder.path().join("view.toml");
    let mut window = open(&folder.path().join("f.0001.exr"), choice, Some(&session));
    click(&mut window, FAR);
    // In the middle of a picture.
    window.key_press(Key::OpenBracket);
    window.step();
    window.state().device().destroy();
    let (mut closes, start) = (false, Instant::now());
    while start.elapsed() < Duration::from_secs(60) {
        window.step();
        // As a window does that shows what was drawn.
        let _ = window.state().device().poll(eframe::wgpu::PollType::Poll);
        let commands = &window.output().viewport_output[&ViewportId::ROOT].commands;
        closes |= commands.contains(&ViewportCommand::Close);
        if closes {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(closes, "the window stays open with nothing to draw on");
    drop(window);
    let window = again(&session);
    assert_eq!(focus(&window), DEPTHS[2]);
}

#[cfg(not(unix))]
fn a_movie_is_whole_or_not_there() {}

#[cfg(unix)]
fn a_movie_is_whole_or_not_there() {
    let folder = sequence(4);
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let left = || fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect::<Vec<_>>();
    let mut window = open(folder.path(), Choice::Cpu, None);
    let mut run = |encoder: &Path, name: &str, stop: bool| {
        let order = pullfocus_view::export::Order {
            encoder: encoder.to_owned(),
            ..order(What::Movie, out.join(name))
        };
        window.state_mut().start_export(order).unwrap();
        if stop {
            window.state().export().unwrap().cancel();
        }
        settle(&mut window);
        window.state().export().unwrap().progress().end.unwrap()
    };
    // The last argument is where it goes.
    let good = script(folder.path(), "good", "for last; do :; done; cat > \"$last\"");
    let bad = script(folder.path(), "bad", "head -c 1000 > /dev/null; echo 'no such codec' >&2; exit 3");
    for (encoder, name, stop, word) in [
        (folder.path().join("none"), "m.mp4", false, "cannot be started"),
        (bad, "m.mp4", false, "no such codec"),
        (good.clone(), "m.mp4", true, "Stopped"),
        (good.clone(), "m.txt", false, ".mp4"),
        (good.clone(), "no-folder/m.mp4", false, "no-folder"),
    ] {
        let sentence = run(&encoder, name, stop).unwrap_err();
        assert!(sentence.contains(word), "{sentence}");
        assert!(left().is_empty(), "{:?}", left());
    }
    run(&good, "m.mp4", false).unwrap();
    assert_eq!(left(), ["m.mp4"]);
    let bytes = fs::metadata(out.join("m.mp4")).unwrap().len();
    assert_eq!(bytes, (4 * 3 * SIZE.area()) as u64);
    // It is there now.
    assert!(run(&good, "m.mp4", false).is_err());
}
