//! Looking through OpenColorIO configs.

// Without them one test is left.
#![cfg_attr(not(feature = "ocio"), allow(dead_code, unused_imports))]

use crate::window::*;
use eframe::egui::accesskit::Role;
use egui_kittest::kittest::Queryable;
use pullfocus_core::{Cancel, Frame, Plane, Size};
use pullfocus_io::{Limits, SampleType, write_exr};
use pullfocus_job::config::Options;
use pullfocus_view::color::Source;
use pullfocus_view::engine::Choice;
use pullfocus_view::export::{Order, What};
use pullfocus_view::loader::ROOM;
use pullfocus_view::look::View;
use pullfocus_view::screen::Transform;
use pullfocus_view::ui::Start;
use std::path::{Path, PathBuf};

#[cfg(feature = "ocio")]
pub const TESTS: &[(&str, fn())] = &[
    ("a_view_of_the_built_in_config_is_what_is_written", a_view_of_the_built_in_config_is_what_is_written),
    ("a_bad_config_is_a_sentence_and_srgb", a_bad_config_is_a_sentence_and_srgb),
    ("the_config_that_ocio_names_is_the_usual_one", the_config_that_ocio_names_is_the_usual_one),
];

#[cfg(not(feature = "ocio"))]
pub const TESTS: &[(&str, fn())] =
    &[("a_program_without_configs_says_so", a_program_without_configs_says_so)];

const PIXELS: Size = Size { width: 96, height: 48 };

/// Every hue, from black to sixty times white, with some that are no numbers.
fn light(x: usize, y: usize, channel: usize) -> f32 {
    let hue = (x as f32 / 96.0 * std::f32::consts::TAU + channel as f32 * 2.0944).cos() * 0.5 + 0.5;
    match (x, y) {
        (90.., 40..) => [f32::NAN, f32::INFINITY, -1.0][channel],
        (_, 0..8) => 0.0,
        _ => hue * 0.001 * 60_000f32.powf(y as f32 / 47.0),
    }
}

fn frame(folder: &Path) -> PathBuf {
    let path = folder.join("colours.exr");
    let plane = |channel| Plane::from_fn(PIXELS, |x, y| light(x, y, channel)).unwrap();
    let depth = Plane::from_fn(PIXELS, |_, _| 3.0).unwrap();
    let planes = [("R", plane(0)), ("G", plane(1)), ("B", plane(2)), ("Z", depth)];
    let planes: Vec<_> = planes.iter().map(|(name, plane)| (*name, plane, SampleType::Float)).collect();
    let mut file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
    write_exr(&mut file, &Frame::full(PIXELS), &planes, &[]).unwrap();
    path
}

fn open_with(path: Option<&Path>, session: Option<PathBuf>, ocio: Option<String>) -> Window {
    let start = Start {
        path: path.map(Path::to_owned),
        options: Options::default(),
        device: Choice::Cpu,
        session,
        ocio,
        frame_memory: ROOM,
        quit: Cancel::new(),
    };
    let mut window = with(start);
    // Everything is in focus, and each pixel is several of the screen's.
    let look = window.state_mut().look_mut();
    (look.zoom, look.center, look.left) = (Some(8.0), [48.0, 24.0], View::Result);
    window.state_mut().set_f_stop(1e6);
    settle(&mut window);
    window
}

/// The screen's colour at the middle of each pixel, row by row.
fn screen(window: &mut Window) -> Vec<[u8; 3]> {
    let image = window.render().unwrap();
    let at = |i: usize| point(window, [(i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5]);
    (0..PIXELS.area())
        .map(|i| {
            let at = at(i);
            let [r, g, b, _] = image.get_pixel(at.x as u32, at.y as u32).0;
            [r, g, b]
        })
        .collect()
}

/// How far apart pictures are: the largest difference, and how many pixels differ by more than 16.
fn apart(a: &[[u8; 3]], b: &[[u8; 3]]) -> (u8, usize) {
    assert_eq!(a.len(), b.len());
    let far = |(a, b): (&[u8; 3], &[u8; 3])| (0..3).map(|i| a[i].abs_diff(b[i])).max().unwrap_or(0);
    let differences: Vec<u8> = a.iter().zip(b).map(far).collect();
    let most = differences.iter().copied().max().unwrap_or(0);
    (most, differences.iter().filter(|&&difference| difference > 16).count())
}

/// What *Render…* writes of what is seen.
fn written(window: &mut Window, path: &Path) -> Vec<[u8; 3]> {
    let look = window.state_mut().look_mut().clone();
    let order = Order {
        overwrite: true,
        transform: look.transform,
        table: window.state().table(),
        gain: look.exposure.exp2(),
        ..order(What::Pictures, path.to_owned())
    };
    window.state_mut().start_export(order).unwrap();
    settle(window);
    window.state().export().unwrap().progress().end.unwrap().unwrap();
    let picture = pullfocus_io::images::read_picture(path, &Limits::default()).unwrap();
    let code = |linear: f32| (pullfocus_core::srgb::encode(linear) * 255.0).round() as u8;
    (0..PIXELS.area()).map(|i| [0, 1, 2].map(|c| code(picture.colors[c].data()[i]))).collect()
}

fn look_through_a_config(window: &mut Window) {
    // The controls are longer than the window.
    window.get_by_label("OCIO").scroll_to_me();
    settle(window);
    window.get_by_label("OCIO").click();
    settle(window);
    assert_eq!(window.state_mut().look_mut().transform, Transform::Ocio);
}

fn choose(window: &mut Window, control: &str, value: &str) {
    window.get_by_role_and_label(Role::ComboBox, control).scroll_to_me();
    settle(window);
    window.get_by_role_and_label(Role::ComboBox, control).click();
    settle(window);
    window.get_by_role_and_label(Role::Button, value).scroll_to_me();
    settle(window);
    window.get_by_role_and_label(Role::Button, value).click();
    settle(window);
}

#[cfg(not(feature = "ocio"))]
fn a_program_without_configs_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = frame(folder.path());
    let mut window = open_with(Some(&path), None, None);
    let srgb = screen(&mut window);
    look_through_a_config(&mut window);
    let message = window.state().message().unwrap_or_default().to_owned();
    assert!(message.contains("without OpenColorIO"), "{message}");
    assert_eq!(apart(&screen(&mut window), &srgb).0, 0);
}

fn a_view_of_the_built_in_config_is_what_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let session = folder.path().join("view.toml");
    let path = frame(folder.path());
    let mut window = open_with(Some(&path), Some(session.clone()), None);
    let srgb = screen(&mut window);
    look_through_a_config(&mut window);
    let png = folder.path().join("seen.png");
    let mut seen = vec![srgb];
    for view in ["ACES 2.0 - SDR 100 nits (Rec.709)", "Un-tone-mapped"] {
        if view == "Un-tone-mapped" {
            choose(&mut window, "View", view);
            window.state_mut().look_mut().exposure = -1.5;
            settle(&mut window);
        }
        assert!(window.state().table().is_some(), "{:?}", window.state().message());
        let shown = screen(&mut window);
        let (most, _) = apart(&shown, &written(&mut window, &png));
        // The screen's picture is of halves, and a power in f32 stands between them.
        assert!(most <= 2, "{view}: {most}");
        for before in &seen {
            let (_, many) = apart(&shown, before);
            assert!(many > PIXELS.area() / 10, "{view}: {many} pixels differ");
        }
        seen.push(shown);
    }
    choose(&mut window, "Pixels are", "Linear Rec.709 (sRGB)");
    // The next session looks through the same.
    let shown = screen(&mut window);
    let choice = window.state_mut().look_mut().color.clone();
    assert_eq!(choice.space.as_deref(), Some("Linear Rec.709 (sRGB)"));
    eframe::App::on_exit(window.state_mut());
    drop(window);
    let mut window = open_with(None, Some(session), None);
    assert_eq!(window.state_mut().look_mut().color, choice);
    assert_eq!(apart(&screen(&mut window), &shown).0, 0);
}

fn a_bad_config_is_a_sentence_and_srgb() {
    let folder = tempfile::tempdir().unwrap();
    let path = frame(folder.path());
    let mut window = open_with(Some(&path), None, None);
    let srgb = screen(&mut window);
    let bad = folder.path().join("config.ocio");
    std::fs::write(&bad, "displays: [").unwrap();
    window.state_mut().open_path(&bad);
    settle(&mut window);
    let message = window.state().message().unwrap_or_default().to_owned();
    assert!(message.contains("config.ocio") && message.contains("sRGB"), "{message}");
    // At the bottom for a while, and beside the controls as long as it is so.
    assert_eq!(window.query_all_by_label(&message).count(), 2);
    let look = window.state_mut().look_mut();
    assert_eq!((look.transform, &look.color.config), (Transform::Ocio, &Source::File(bad.clone())));
    assert_eq!(apart(&screen(&mut window), &srgb).0, 0);
    // What is seen is what is written here too.
    let png = folder.path().join("seen.png");
    assert!(apart(&written(&mut window, &png), &srgb).0 <= 2);
    // Put right, it is read again.
    std::fs::write(&bad, SWAPPED).unwrap();
    window.state_mut().open_path(&bad);
    settle(&mut window);
    assert!(window.state().table().is_some(), "{:?}", window.state().message());
}

/// Its view shows the numbers as they are, with red and blue exchanged.
const SWAPPED: &str = "ocio_profile_version: 2
roles: {scene_linear: lin, default: lin}
displays:
  Cinema:
    - !<View> {name: Film, colorspace: out}
colorspaces:
  - !<ColorSpace> {name: lin}
  - !<ColorSpace> {name: out, from_scene_reference: !<MatrixTransform> {matrix: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1]}}
";

fn the_config_that_ocio_names_is_the_usual_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = frame(folder.path());
    let config = folder.path().join("studio.ocio");
    std::fs::write(&config, SWAPPED).unwrap();
    let mut window = open_with(Some(&path), None, Some(config.display().to_string()));
    look_through_a_config(&mut window);
    let shown = screen(&mut window);
    for (i, shown) in shown.iter().enumerate().filter(|(i, _)| i % 96 < 90) {
        for (channel, &shown) in shown.iter().enumerate() {
            let expected = 255.0 * light(i % 96, i / 96, 2 - channel).clamp(0.0, 1.0);
            // Straight lines between points are exact here, and white is no corner: points go beyond. Halves and rounding are left.
            assert!((f32::from(shown) - expected).abs() <= 1.5, "{i}: {shown} {expected}");
        }
    }
    // The built-in one stays to be had.
    choose(&mut window, "Colour config", "Built-in (ACES)");
    assert_eq!(window.state_mut().look_mut().color.config, Source::BuiltIn);
    assert!(apart(&screen(&mut window), &shown).1 > PIXELS.area() / 10);
}
