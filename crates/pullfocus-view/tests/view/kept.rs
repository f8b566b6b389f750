//! What was made stays, and is whose it seems: takes, pulls that nobody saved, sessions, frames that are not there.

use crate::window::*;
use eframe::egui::{Event, Key, Modifiers};
use egui_kittest::kittest::Queryable;
use pullfocus_core::{Frame, Plane, Size};
use pullfocus_io::{SampleType, write_exr};
use pullfocus_job::config::{self, Options};
use pullfocus_view::engine::Choice;
use pullfocus_view::look::View;
use pullfocus_view::ui::Start;
use std::path::Path;

pub const TESTS: &[(&str, fn())] = &[
    ("a_smaller_picture_comes_under_the_cursor", a_smaller_picture_comes_under_the_cursor),
    ("the_last_sessions_pull_is_kept", the_last_sessions_pull_is_kept),
    ("every_pull_that_was_not_saved_is_kept", every_pull_that_was_not_saved_is_kept),
    ("take_b_becomes_the_shot", take_b_becomes_the_shot),
    ("each_side_of_a_wipe_is_its_own_take", each_side_of_a_wipe_is_its_own_take),
    ("a_sequence_opens_without_its_first_frame", a_sequence_opens_without_its_first_frame),
    ("a_lens_that_cannot_be_says_so_while_it_is", a_lens_that_cannot_be_says_so_while_it_is),
    ("a_key_that_is_held_is_one_step", a_key_that_is_held_is_one_step),
    ("stops_beyond_the_ends_do_not_turn_back", stops_beyond_the_ends_do_not_turn_back),
    ("a_held_still_is_released", a_held_still_is_released),
    ("a_reference_goes_with_the_frame", a_reference_goes_with_the_frame),
    ("a_shot_is_saved_under_a_name_that_opens", a_shot_is_saved_under_a_name_that_opens),
    ("a_session_that_cannot_be_kept_is_told_of", a_session_that_cannot_be_kept_is_told_of),
    ("keys_want_frames_with_numbers", keys_want_frames_with_numbers),
];

fn press(window: &mut Window, key: Key) {
    window.key_press(key);
    settle(window);
}

fn message(window: &Window) -> String {
    window.state().message().unwrap_or_default().to_owned()
}

fn small_frame(path: &Path) {
    let size = Size::new(24, 12);
    let plane = |value: f32| Plane::filled(size, value).unwrap();
    let planes = [("R", plane(0.5)), ("G", plane(0.5)), ("B", plane(0.5)), ("Z", plane(2.0))];
    let planes: Vec<_> = planes.iter().map(|(name, plane)| (*name, plane, SampleType::Float)).collect();
    write_exr(&mut std::fs::File::create(path).unwrap(), &Frame::full(size), &planes, &[]).unwrap();
}

fn a_smaller_picture_comes_under_the_cursor() {
    let folder = sequence(1);
    let small = folder.path().join("small.exr");
    small_frame(&small);
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    let corner = point(&window, [190.5, 94.5]);
    window.hover_at(corner);
    settle(&mut window);
    assert!(window.query_by_label_contains("190, 94").is_some());
    window.state_mut().open_path(&small);
    settle(&mut window);
    window.step();
    assert!(window.query_by_label_contains("190, 94").is_none());
    assert_eq!(focus(&window), 2.0);
}

/// A pull that is made by keys on both frames of a sequence.
fn pull(window: &mut Window, [first, last]: [[f32; 2]; 2]) {
    click(window, first);
    press(window, Key::K);
    press(window, Key::End);
    click(window, last);
    press(window, Key::Home);
}

fn kept(session: &Path, name: &str) -> Vec<f64> {
    let options: Options = config::read(&session.with_file_name(name)).unwrap();
    options.keys.keys().iter().map(|key| key.focus_distance_m.unwrap()).collect()
}

fn the_last_sessions_pull_is_kept() {
    let folder = sequence(2);
    let other = folder.path().join("other.exr");
    write_frame(&other);
    let session = folder.path().join("config/view.toml");
    let mut window = open(folder.path(), Choice::Cpu, Some(&session));
    pull(&mut window, [NEAR, FAR]);
    eframe::App::on_exit(window.state_mut());
    drop(window);
    // Another file is named when the program is started again.
    let window = open(&other, Choice::Cpu, Some(&session));
    assert!(message(&window).contains("unsaved.toml"), "{}", message(&window));
    assert_eq!(kept(&session, "unsaved.toml"), [DEPTHS[0], DEPTHS[2]]);
    assert!(window.state().document().shot().keys.is_empty());
}

fn every_pull_that_was_not_saved_is_kept() {
    let folder = sequence(2);
    let other = folder.path().join("other.exr");
    write_frame(&other);
    let session = folder.path().join("config/view.toml");
    let mut window = open(folder.path(), Choice::Cpu, Some(&session));
    pull(&mut window, [NEAR, FAR]);
    press(&mut window, Key::B);
    pull(&mut window, [FAR, NEAR]);
    window.state_mut().open_path(&other);
    settle(&mut window);
    window.state_mut().open_path(folder.path());
    settle(&mut window);
    window.state_mut().look_mut().left = View::Result;
    pull(&mut window, [MIDDLE, FAR]);
    // One that was kept is opened, which is saved: only the newest is kept besides.
    window.state_mut().open_path(&session.with_file_name("unsaved.toml"));
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[0], "{}", message(&window));
    window.state_mut().open_path(&other);
    settle(&mut window);
    assert_eq!(kept(&session, "unsaved.toml"), [DEPTHS[0], DEPTHS[2]]);
    assert_eq!(kept(&session, "unsaved-2.toml"), [DEPTHS[2], DEPTHS[0]]);
    assert_eq!(kept(&session, "unsaved-3.toml"), [DEPTHS[1], DEPTHS[2]]);
    assert!(!session.with_file_name("unsaved-4.toml").exists());
}

fn take_b_becomes_the_shot() {
    let folder = sequence(2);
    let mut window = open(folder.path(), Choice::Cpu, None);
    click(&mut window, NEAR);
    press(&mut window, Key::B);
    click(&mut window, FAR);
    let shot = folder.path().join("shot.toml");
    window.state_mut().save(&shot, false);
    assert!(message(&window).contains("take A"), "{}", message(&window));
    let saved = |path: &Path| config::read(path).unwrap().lens.focus_distance.unwrap().0;
    assert_eq!(saved(&shot), DEPTHS[0]);
    window.get_by_label("B to A").click();
    settle(&mut window);
    window.state_mut().save(&shot, false);
    assert!(message(&window).contains("renders these pixels"), "{}", message(&window));
    assert_eq!(saved(&shot), DEPTHS[2]);
    window.state_mut().undo_redo(false);
    assert_eq!(window.state().document().shot().lens.focus_distance.unwrap().0, DEPTHS[0]);
}

fn each_side_of_a_wipe_is_its_own_take() {
    let folder = sequence(1);
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    (window.state_mut().look_mut().left, window.state_mut().look_mut().right) =
        (View::Result, Some(View::Other));
    settle(&mut window);
    // The border is in the middle of the picture.
    click(&mut window, NEAR);
    click(&mut window, FAR);
    let focused = |window: &Window| {
        let takes = &window.state().document().takes;
        takes.each_ref().map(|take| take.lens.focus_distance.unwrap().0)
    };
    assert_eq!(focused(&window), [DEPTHS[0], DEPTHS[2]]);
    // The circles on each side are those of its take: nothing in focus is red or blue.
    window.state_mut().look_mut().overlay = 1.0;
    settle(&mut window);
    let image = window.render().unwrap();
    for pixel in [NEAR, FAR] {
        let at = point(&window, pixel);
        let [red, green, blue, _] = image.get_pixel(at.x as u32, at.y as u32).0;
        assert!(green > red.max(blue), "{pixel:?}: {red} {green} {blue}");
    }
    // The other take comes to the front by changing places.
    press(&mut window, Key::B);
    let look = window.state_mut().look_mut().clone();
    assert_eq!((look.left, look.right), (View::Other, Some(View::Result)));
    assert_eq!(focus(&window), DEPTHS[2]);
    click(&mut window, FAR);
    click(&mut window, [104.0, 48.0]);
    assert_eq!(focused(&window), [DEPTHS[1], DEPTHS[2]]);
    // A drag over the border is that of the take where it began: at the right, take A's.
    drag(&mut window, FAR, NEAR, Modifiers::NONE);
    assert_eq!(focused(&window), [DEPTHS[0], DEPTHS[2]]);
}

fn a_sequence_opens_without_its_first_frame() {
    let folder = sequence(3);
    let first = folder.path().join("f.0001.exr");
    let bytes = std::fs::read(&first).unwrap();
    std::fs::write(&first, &bytes[..bytes.len() / 2]).unwrap();
    let mut window = open(folder.path(), Choice::Cpu, None);
    assert_eq!(window.state().frame_number(), 2);
    assert!(message(&window).contains("f.0001.exr"), "{}", message(&window));
    click(&mut window, FAR);
    press(&mut window, Key::Home);
    assert!(window.query_by_label_contains("f.0001.exr").is_some(), "it is told of");
    // To go where one is changes nothing, and comes to rest.
    press(&mut window, Key::Home);
    assert!(window.query_by_label_contains("f.0001.exr").is_some(), "it is told of");
    std::fs::write(&first, &bytes).unwrap();
    press(&mut window, Key::End);
    press(&mut window, Key::Home);
    click(&mut window, NEAR);
    assert_eq!((window.state().frame_number(), focus(&window)), (1, DEPTHS[0]));
}

fn a_lens_that_cannot_be_says_so_while_it_is() {
    let folder = sequence(1);
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    click(&mut window, NEAR);
    window.state_mut().set_focal_length(1200.0);
    settle(&mut window);
    let says = |window: &Window| window.query_by_label_contains("within the focal length").is_some();
    assert!(says(&window));
    // Messages go after a while; this stays, and the field that mends it is there.
    for _ in 0..100 {
        window.step();
    }
    assert!(says(&window) && window.query_by_label("there is no such lens").is_some());
    assert!(window.query_all_by_label("Focus distance").next().is_some());
    window.state_mut().set_focal_length(50.0);
    settle(&mut window);
    assert!(!says(&window));
}

fn a_key_that_is_held_is_one_step() {
    let folder = sequence(1);
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    click(&mut window, NEAR);
    for repeat in std::iter::once(false).chain([true; 150]) {
        let (key, modifiers) = (Key::Period, Modifiers::NONE);
        window.event(Event::Key { key, physical_key: None, pressed: true, repeat, modifiers });
        window.step();
    }
    settle(&mut window);
    assert_ne!(focus(&window), DEPTHS[0]);
    for _ in 0..3 {
        window.state_mut().undo_redo(false);
    }
    settle(&mut window);
    // The click is still there to be undone.
    assert_eq!(focus(&window), DEPTHS[1]);
}

fn stops_beyond_the_ends_do_not_turn_back() {
    let folder = sequence(1);
    let mut window = open(&folder.path().join("f.0001.exr"), Choice::Cpu, None);
    let mut stop = |from: f64, key: Key| {
        window.state_mut().set_f_stop(from);
        settle(&mut window);
        press(&mut window, key);
        window.state().lens_values().unwrap().f_stop.unwrap()
    };
    assert!(stop(0.95, Key::OpenBracket) < 0.95);
    let closed = stop(0.7, Key::CloseBracket);
    assert!(closed > 0.7 && closed < 0.9, "{closed}");
    for (f_stop, key) in
        [(0.3, Key::OpenBracket), (200.0, Key::CloseBracket), (f64::INFINITY, Key::CloseBracket)]
    {
        assert_eq!(stop(f_stop, key), f_stop);
    }
}

fn a_held_still_is_released() {
    let folder = tempfile::tempdir().unwrap();
    let still = folder.path().join("kitchen.exr");
    write_frame(&still);
    let mut window = open(&still, Choice::Cpu, None);
    window.get_by_label("Hold the still").click();
    settle(&mut window);
    press(&mut window, Key::End);
    assert_eq!(window.state().frame_number(), 48);
    drag(&mut window, NEAR, FAR, Modifiers::NONE);
    press(&mut window, Key::K);
    window.get_by_label("Release").click();
    settle(&mut window);
    assert!(window.query_by_label("Hold the still").is_some());
    let shot = window.state().document().shot();
    assert!(shot.files.frames.is_none() && !shot.keys.is_empty());
    // What a run would say of it is said here.
    window.state_mut().save(&folder.path().join("shot.toml"), false);
    assert!(message(&window).contains("will not take it"), "{}", message(&window));
}

fn a_reference_goes_with_the_frame() {
    let folder = sequence(3);
    for (frame, brightness) in [(1, 1.0), (2, 2.0)] {
        write_bright_frame(&folder.path().join(format!("ref.{frame:04}.exr")), brightness);
    }
    let mut window = open(&folder.path().join("f.####.exr"), Choice::Cpu, None);
    window.state_mut().set_f_stop(64.0);
    window.state_mut().open_reference(&folder.path().join("ref.####.exr"));
    settle(&mut window);
    let first = window.state().flip().unwrap();
    press(&mut window, Key::ArrowRight);
    let second = window.state().flip().unwrap();
    // Twice as bright is another picture.
    assert!(second > 2.0 * first + 0.05, "{first}, {second}");
    press(&mut window, Key::ArrowRight);
    assert!(message(&window).contains("ref.0003.exr"), "{}", message(&window));
    assert!(window.state().flip().is_none());
    press(&mut window, Key::Home);
    assert_eq!(window.state().flip(), Some(first));
    // What is looked at stays, whatever the reference does.
    press(&mut window, Key::Num1);
    press(&mut window, Key::ArrowRight);
    assert_eq!(window.state_mut().look_mut().left, View::Result);
    press(&mut window, Key::Num7);
    assert_eq!(window.state().flip(), Some(second));
}

fn a_shot_is_saved_under_a_name_that_opens() {
    let folder = sequence(2);
    std::fs::write(folder.path().join("old.toml"), "f-stop = 2").unwrap();
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.key_press_modifiers(Modifiers::COMMAND, Key::S);
    wait_for(&mut window, "old.toml");
    assert!(window.query_by_label_contains("f.####.exr (").is_none(), "a picture is no shot");
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.step();
    window.event(Event::Text(folder.path().join("approved").display().to_string()));
    window.step();
    window.key_press(Key::Enter);
    settle(&mut window);
    assert!(message(&window).contains("approved.toml"), "{}", message(&window));
    assert!(config::read(&folder.path().join("approved.toml")).is_ok());
}

fn a_session_that_cannot_be_kept_is_told_of() {
    let folder = sequence(1);
    let frame = folder.path().join("f.0001.exr");
    let session = frame.join("no folder/view.toml");
    let mut window = open(&frame, Choice::Cpu, Some(&session));
    click(&mut window, NEAR);
    eframe::App::on_exit(window.state_mut());
    assert!(message(&window).contains("the session cannot be kept"), "{}", message(&window));
}

fn keys_want_frames_with_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    files.iter().for_each(|file| write_frame(file));
    let mut options = Options::default();
    options.files.input = Some(files.to_vec());
    let mut window = with(Start { ..start(None, options) });
    press(&mut window, Key::K);
    assert!(message(&window).contains("####"), "{}", message(&window));
    drag(&mut window, NEAR, FAR, Modifiers::SHIFT);
    assert!(window.state().document().shot().keys.is_empty());
}
