//! What a hand does.

use crate::window::*;
use eframe::egui::accesskit::{Action, Role};
use eframe::egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use pullfocus_core::{Frame, Plane};
use pullfocus_io::{AttributeValue, SampleType, write_exr};
use pullfocus_job::config::Options;
use pullfocus_job::values::Number;
use pullfocus_view::engine::Choice;
use pullfocus_view::look::View;
use pullfocus_view::session::Session;

pub const TESTS: &[(&str, fn())] = &[
    ("a_click_focuses_there", a_click_focuses_there),
    ("a_click_focuses_there_on_the_gpu", a_click_focuses_there_on_the_gpu),
    ("a_drag_racks_and_with_shift_it_is_two_keys", a_drag_racks_and_with_shift_it_is_two_keys),
    ("a_file_is_opened_by_dropping_and_by_the_window", a_file_is_opened_by_dropping_and_by_the_window),
    ("each_take_has_keys_of_its_own", each_take_has_keys_of_its_own),
    ("undo_and_redo", undo_and_redo),
    ("each_key_is_a_step_to_undo", each_key_is_a_step_to_undo),
    ("a_lens_that_cannot_be_can_be_set_right", a_lens_that_cannot_be_can_be_set_right),
    ("the_wheel_zooms_about_the_cursor", the_wheel_zooms_about_the_cursor),
    ("stops_go_in_thirds_by_key", stops_go_in_thirds_by_key),
    ("every_control_has_a_name_and_the_sheet_opens", every_control_has_a_name_and_the_sheet_opens),
    ("memory_stays_over_a_thousand_changes", memory_stays_over_a_thousand_changes),
    ("nothing_for_a_hand_is_nameless", nothing_for_a_hand_is_nameless),
    ("a_shot_that_is_shown_stays_as_it_is", a_shot_that_is_shown_stays_as_it_is),
    ("a_file_with_an_angle_alone_has_a_lens", a_file_with_an_angle_alone_has_a_lens),
    ("the_pixel_says_what_is_rendered", the_pixel_says_what_is_rendered),
    ("what_is_typed_has_the_unit_of_its_field", what_is_typed_has_the_unit_of_its_field),
    ("dark_or_light_is_kept", dark_or_light_is_kept),
    ("the_wipe_does_not_go_to_what_is_not_there", the_wipe_does_not_go_to_what_is_not_there),
];

fn frame() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.exr");
    write_frame(&path);
    (folder, path)
}

fn a_click_focuses_there() {
    clicks_focus(Choice::Cpu);
}

fn a_click_focuses_there_on_the_gpu() {
    clicks_focus(Choice::Gpu);
}

fn clicks_focus(device: Choice) {
    let (_folder, path) = frame();
    let mut window = open(&path, device, None);
    // Nobody said where the focus is: it is on the middle of the picture.
    assert_eq!(focus(&window), DEPTHS[1]);
    // Wide open, since the frames are small.
    window.state_mut().set_f_stop(0.7);
    settle(&mut window);
    for (pixel, others, metres) in [(NEAR, [MIDDLE, FAR], DEPTHS[0]), (FAR, [NEAR, MIDDLE], DEPTHS[2])] {
        click(&mut window, pixel);
        // Depth is stored as f32, and these are whole numbers.
        assert_eq!(focus(&window), metres);
        let sharp = contrast(&mut window, pixel);
        for other in others {
            let blurred = contrast(&mut window, other);
            // A pattern of two pixels under a circle of several is all but gone.
            assert!(sharp > 2.0 * blurred, "{metres} m: {sharp} there, {blurred} at {other:?}");
        }
    }
}

fn a_drag_racks_and_with_shift_it_is_two_keys() {
    let folder = sequence(3);
    let mut window = open(folder.path(), Choice::Cpu, None);
    drag(&mut window, NEAR, FAR, Modifiers::NONE);
    assert_eq!(focus(&window), DEPTHS[2]);
    assert!(window.state().document().shot().keys.is_empty());
    drag(&mut window, NEAR, FAR, Modifiers::SHIFT);
    let keys = window.state().document().shot().keys.keys().to_vec();
    assert_eq!(keys.len(), 2, "{keys:?}");
    assert_eq!((keys[0].frame, keys[0].focus_distance_m), (1.0, Some(DEPTHS[0])));
    assert_eq!((keys[1].frame, keys[1].focus_distance_m), (3.0, Some(DEPTHS[2])));
    // Half way on the second of three frames, in dioptres.
    window.key_press(Key::ArrowRight);
    settle(&mut window);
    assert_eq!(window.state().frame_number(), 2);
    let expected = 2.0 / (1.0 / DEPTHS[0] + 1.0 / DEPTHS[2]);
    // Two inversions in f64.
    assert!((focus(&window) / expected - 1.0).abs() < 1e-9);
}

/// A file that a hand lets go over the window.
#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl eframe::egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("nobody asks for them".into())
    }
}

fn a_file_is_opened_by_dropping_and_by_the_window() {
    let folder = sequence(1);
    let first = folder.path().join("f.0001.exr");
    let (other, shots) = (folder.path().join("other.exr"), folder.path().join("shots"));
    write_frame(&other);
    std::fs::create_dir(&shots).unwrap();
    write_frame(&shots.join("third.exr"));
    let mut window = open(&first, Choice::Cpu, None);
    window.input_mut().dropped_files.push(std::sync::Arc::new(Dropped(other.clone())));
    settle(&mut window);
    let inputs = |window: &Window| window.state().document().shot().files.input.clone().unwrap();
    assert_eq!(inputs(&window), std::slice::from_ref(&other));
    let find = |window: &mut Window, label: &str| {
        window.key_press_modifiers(Modifiers::COMMAND, Key::O);
        wait_for(window, label);
    };
    find(&mut window, "shots/");
    window.get_by_label("shots/").click();
    wait_for(&mut window, "third.exr");
    window.get_by_label("third.exr").click();
    settle(&mut window);
    assert_eq!(inputs(&window), [shots.join("third.exr")]);
    // What was open before is a click away.
    find(&mut window, "Recent");
    window.get_by_label("Recent").click();
    wait_for(&mut window, "other.exr");
    window.get_by_label("other.exr").click();
    settle(&mut window);
    assert_eq!(inputs(&window), [other]);
}

fn each_take_has_keys_of_its_own() {
    let folder = sequence(3);
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.key_press(Key::B);
    settle(&mut window);
    window.key_press(Key::K);
    settle(&mut window);
    let counts =
        |window: &Window| window.state().document().takes.each_ref().map(|take| take.keys.keys().len());
    assert_eq!(counts(&window), [0, 1]);
    // The timeline shows what the take in front has.
    assert!(window.query_by_label("Key at 1").is_some());
    window.key_press(Key::B);
    settle(&mut window);
    assert!(window.query_by_label("Key at 1").is_none());
    window.key_press(Key::End);
    window.key_press(Key::K);
    settle(&mut window);
    assert_eq!(counts(&window), [1, 1]);
    // Chosen and removed.
    window.get_by_label("Key at 3").click();
    settle(&mut window);
    window.key_press(Key::Delete);
    settle(&mut window);
    assert_eq!(counts(&window), [0, 1]);
}

fn undo_and_redo() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    let first = focus(&window);
    click(&mut window, FAR);
    let command = Modifiers::COMMAND;
    window.key_press_modifiers(command, Key::Z);
    settle(&mut window);
    assert_eq!(focus(&window), first);
    window.key_press_modifiers(command | Modifiers::SHIFT, Key::Z);
    settle(&mut window);
    assert_eq!(focus(&window), DEPTHS[2]);
}

fn each_key_is_a_step_to_undo() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    let f_stop = |window: &Window| window.state().lens_values().unwrap().f_stop.unwrap();
    let first = f_stop(&window);
    let mut stops = vec![first];
    // Sooner after one another than changes that are one step.
    for _ in 0..2 {
        window.key_press(Key::OpenBracket);
        window.step();
        stops.push(f_stop(&window));
    }
    settle(&mut window);
    assert!(stops[0] > stops[1] && stops[1] > stops[2], "{stops:?}");
    for expected in [stops[1], stops[0]] {
        window.key_press_modifiers(Modifiers::COMMAND, Key::Z);
        settle(&mut window);
        assert_eq!(f_stop(&window), expected);
    }
}

fn a_lens_that_cannot_be_can_be_set_right() {
    let (_folder, path) = frame();
    let mut options = Options::default();
    // It focuses behind itself.
    options.lens.focal_length = Some(Number(4000.0));
    let mut window = with(start(Some(&path), options));
    assert!(window.query_by_label_contains("4000").is_some(), "it is told of");
    assert_eq!(window.state().rendered(), 0);
    // The picture is there as it was rendered, and so are the controls.
    assert!(contrast(&mut window, MIDDLE) > 20.0);
    assert!(window.query_all_by_label("Focal length").next().is_some());
    window.state_mut().set_focal_length(50.0);
    settle(&mut window);
    assert!(window.state().rendered() > 0);
}

fn the_wheel_zooms_about_the_cursor() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    let cursor = point(&window, NEAR);
    window.hover_at(cursor);
    window.step();
    window.event(eframe::egui::Event::MouseWheel {
        unit: eframe::egui::MouseWheelUnit::Point,
        delta: eframe::egui::Vec2::new(0.0, 100.0),
        modifiers: Modifiers::NONE,
        phase: eframe::egui::TouchPhase::Move,
        source: eframe::egui::MouseWheelSource::Wheel,
    });
    for _ in 0..60 {
        window.step();
    }
    let place = window.state().place().unwrap();
    let under = place.pixel(cursor);
    assert!(place.step[0] < 192.0 / 1280.0, "not zoomed: {:?}", place.step);
    // Half a pixel: the position is in f32 of a window of a thousand points.
    assert!((under[0] - NEAR[0]).abs() < 0.5 && (under[1] - NEAR[1]).abs() < 0.5, "{under:?}");
    window.key_press(Key::F);
    settle(&mut window);
    assert_eq!(window.state_mut().look_mut().zoom, None);
}

fn stops_go_in_thirds_by_key() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    window.key_press(Key::OpenBracket);
    settle(&mut window);
    let f_stop = window.state().lens_values().unwrap().f_stop.unwrap();
    assert!((f_stop - 2f64.powf(8.0 / 6.0)).abs() < 1e-12, "{f_stop}");
}

fn every_control_has_a_name_and_the_sheet_opens() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    for name in ["Focus distance", "Focal length", "f-stop", "Timeline", "Picture", "Play", "Save shot"] {
        assert!(window.query_all_by_label(name).next().is_some(), "nothing is called {name}");
    }
    window.get_by_label("Keys").click();
    settle(&mut window);
    assert!(window.query_by_label("Rack from there to the cursor").is_some());
    window.get_by_label("Depth").click();
    settle(&mut window);
    assert_eq!(window.state_mut().look_mut().left, View::Depth);
}

/// Kilobytes of this process in memory.
#[cfg(target_os = "linux")]
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmRSS")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[cfg(not(target_os = "linux"))]
fn resident() -> u64 {
    0
}

fn memory_stays_over_a_thousand_changes() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    let turn = |window: &mut Window, times: usize| {
        for i in 0..times {
            window.key_press(if i % 2 == 0 { Key::Comma } else { Key::Period });
            window.step();
            while !window.state().is_settled() {
                std::thread::sleep(std::time::Duration::from_micros(200));
                window.step();
            }
            // What was dropped is freed when a window is drawn, which this one is only when it is asked.
            if i % 20 == 0 {
                window.render().unwrap();
            }
        }
    };
    turn(&mut window, 100);
    let (before, rendered) = (resident(), window.state().rendered());
    turn(&mut window, 1000);
    let (after, rendered) = (resident(), window.state().rendered() - rendered);
    assert!(rendered >= 1000, "{rendered} pictures only");
    // A leaked picture of each change would be 150 KiB, 150 MiB in all; allocators and drivers keep some.
    assert!(after < before + (24 << 10), "{before} KiB before, {after} KiB after");
}

/// What takes a click or the keyboard and has no name for those who do not see it.
fn nameless(window: &Window) -> Vec<String> {
    let mut nameless = Vec::new();
    let mut last = Role::Unknown;
    for node in window.root().children_recursive() {
        let node = node.accesskit_node();
        let takes = [Action::Click, Action::Focus, Action::SetValue]
            .into_iter()
            .any(|action| node.data().supports_action(action));
        // A slider's number stands right behind it and is a part of it.
        let part = last == Role::Slider && node.role() == Role::SpinButton;
        let name = node.label().or_else(|| node.value()).unwrap_or_default();
        // What a scroll bar is its role says; the title bar of a window in the window is that window's.
        let inside = std::iter::successors(node.parent(), |parent| parent.parent())
            .find(|parent| parent.role() != Role::GenericContainer)
            .is_some_and(|parent| parent.role() == Role::Window && !parent.is_root());
        let bar = node.role() == Role::ScrollBar || (node.role() == Role::Unknown && inside);
        if takes && !part && !bar && name.trim().is_empty() {
            nameless.push(format!("{:?} {:?}", node.role(), node.bounding_box()));
        }
        last = node.role();
    }
    nameless
}

fn nothing_for_a_hand_is_nameless() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    assert_eq!(nameless(&window), [""; 0]);
    let look = window.state_mut().look_mut();
    (look.right, look.layer, look.transmittance) = (Some(View::Depth), Some(0), Some(0.9));
    window.get_by_label("Render…").click();
    window.get_by_label("Highlights").click();
    window.key_press_modifiers(Modifiers::COMMAND, Key::O);
    wait_for(&mut window, "frame.exr");
    settle(&mut window);
    assert_eq!(nameless(&window), [""; 0]);
}

fn a_shot_that_is_shown_stays_as_it_is() {
    let (folder, path) = frame();
    let shot = folder.path().join("pull.toml");
    let text = format!(
        "input = {path:?}\nfocus-distance = 3.0\nf-stop = 0.7\nfocal-length = 500.0\nsensor-width = 250.0\n\
         aperture = 'blades:16'\nbokeh-threshold = 2000.0\n"
    );
    std::fs::write(&shot, &text).unwrap();
    let mut window = open(&shot, Choice::Cpu, None);
    settle(&mut window);
    let expected = pullfocus_job::config::parse(&text).unwrap();
    for take in &window.state().document().takes {
        assert_eq!((&take.lens, &take.blur), (&expected.lens, &expected.blur));
    }
}

fn a_file_with_an_angle_alone_has_a_lens() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.exr");
    let plane = |value: f32| Plane::from_fn(SIZE, |_, _| value).unwrap();
    let planes = [("R", plane(0.5)), ("G", plane(0.5)), ("B", plane(0.5)), ("Z", plane(3.0))];
    let planes: Vec<_> = planes.iter().map(|(name, plane)| (*name, plane, SampleType::Float)).collect();
    let angle = [("unreal/camera/Main/fov", AttributeValue::Float(30.0))];
    let mut file = std::fs::File::create(&path).unwrap();
    write_exr(&mut file, &Frame::full(SIZE), &planes, &angle).unwrap();
    let window = open(&path, Choice::Cpu, None);
    let values = window.state().lens_values().expect("a lens");
    assert_eq!(values.fov_degrees, Some(30.0));
}

fn the_pixel_says_what_is_rendered() {
    let (folder, path) = frame();
    let shot = folder.path().join("pull.toml");
    let lens = "focus-distance = 3.0\nf-stop = 0.7\nfocal-length = 50.0\nsensor-width = 36.0";
    // The circle in front would be of 13 pixels.
    std::fs::write(&shot, format!("input = {path:?}\n{lens}\nmax-coc = '5'\nback = 0.0\n")).unwrap();
    let mut window = open(&shot, Choice::Cpu, None);
    for (pixel, circle) in [(NEAR, "-5.00 px"), (FAR, "+0.00 px")] {
        let at = point(&window, pixel);
        window.hover_at(at);
        wait_for(&mut window, circle);
    }
}

/// A slider of this name.
fn slider<'a>(window: &'a Window, name: &'a str) -> egui_kittest::Node<'a> {
    window.get_by(move |node| node.role() == Role::Slider && node.label().as_deref() == Some(name))
}

/// Gives the keyboard to the number of a slider, which stands right behind it.
fn focus_number(window: &Window, name: &str) {
    let id = slider(window, name).accesskit_node().id();
    let mut after = window.root().children_recursive().skip_while(|node| node.accesskit_node().id() != id);
    after.find(|node| node.accesskit_node().role() == Role::SpinButton).unwrap().focus();
}

fn what_is_typed_has_the_unit_of_its_field() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    let shown = slider(&window, "f-stop").accesskit_node().numeric_value();
    assert_eq!(shown, window.state().lens_values().unwrap().f_stop);
    let foot = 0.3048;
    for (feet, text, metres) in [
        (true, "8", 8.0 * foot),
        (true, "50 cm", 0.5),
        // Beside 50.0 cm it is centimetres, though it is shown in metres then.
        (false, "150", 1.5),
        (false, "2", 2.0),
        (true, "2", 2.0 * foot),
    ] {
        window.state_mut().look_mut().feet = feet;
        settle(&mut window);
        focus_number(&window, "Focus distance");
        window.step();
        window.step();
        window.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.step();
        window.event(eframe::egui::Event::Text(text.into()));
        window.step();
        window.key_press(Key::Enter);
        settle(&mut window);
        // Two roundings of a product.
        assert!((focus(&window) / metres - 1.0).abs() < 1e-12, "{text}: {}", focus(&window));
    }
}

fn dark_or_light_is_kept() {
    let (folder, path) = frame();
    let session = folder.path().join("view.toml");
    let mut window = open(&path, Choice::Cpu, Some(&session));
    for _ in 0..2 {
        let wanted = if window.query_by_label("Dark").is_some() { "Dark" } else { "Light" };
        window.get_by_label(wanted).click();
        settle(&mut window);
        // Nothing else changes until the window is closed.
        eframe::App::on_exit(window.state_mut());
        assert_eq!(Session::read(&session).dark, Some(wanted == "Dark"));
    }
}

fn the_wipe_does_not_go_to_what_is_not_there() {
    let (_folder, path) = frame();
    let mut window = open(&path, Choice::Cpu, None);
    window.state_mut().look_mut().right = Some(View::Depth);
    settle(&mut window);
    window.get_by_label("Right of the border").click();
    settle(&mut window);
    // In the row of views and in the list.
    let all = window.query_all_by_label("Reference").map(|node| node.accesskit_node().is_disabled());
    assert_eq!(all.collect::<Vec<_>>(), [true, true]);
}
