//! A window in memory, and frames to look at.

use eframe::egui::{Event, Modifiers, PointerButton, Pos2, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use pullfocus_core::{Cancel, Frame, Plane, Size};
use pullfocus_io::{SampleType, write_exr};
use pullfocus_job::config::Options;
use pullfocus_view::engine::Choice;
use pullfocus_view::export::{ENCODER, Order, What};
use pullfocus_view::loader::ROOM;
use pullfocus_view::ui::{App, Start};
use pullfocus_view::window::setup;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub type Window = Harness<'static, App>;

/// Width and height of the frames.
pub const SIZE: Size = Size { width: 192, height: 96 };
/// Distances of the thirds of a frame, from left to right, in metres.
pub const DEPTHS: [f64; 3] = [1.0, 3.0, 20.0];
/// The middle of each third.
pub const NEAR: [f32; 2] = [32.0, 48.0];
pub const MIDDLE: [f32; 2] = [96.0, 48.0];
pub const FAR: [f32; 2] = [160.0, 48.0];

/// Writes a frame: three things side by side, near, in the middle and far, each a fine pattern.
pub fn write_frame(path: &Path) {
    write_bright_frame(path, 1.0);
}

/// The same, so many times as bright.
pub fn write_bright_frame(path: &Path, brightness: f32) {
    let pattern = |x: usize, y: usize| if (x / 2 + y / 2).is_multiple_of(2) { 0.8 } else { 0.1 };
    let plane = |factor: f32| Plane::from_fn(SIZE, |x, y| brightness * factor * pattern(x, y)).unwrap();
    let depth = Plane::from_fn(SIZE, |x, _| DEPTHS[3 * x / SIZE.width] as f32).unwrap();
    let planes = [("R", plane(1.0)), ("G", plane(0.9)), ("B", plane(0.7)), ("Z", depth)];
    let planes: Vec<_> = planes.iter().map(|(name, plane)| (*name, plane, SampleType::Float)).collect();
    let mut file = BufWriter::new(File::create(path).unwrap());
    write_exr(&mut file, &Frame::full(SIZE), &planes, &[]).unwrap();
}

/// Frames in a folder, from 1 on.
pub fn sequence(frames: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for frame in 1..=frames {
        write_frame(&folder.path().join(format!("f.{frame:04}.exr")));
    }
    folder
}

/// What is to be written, as the window asks for it.
pub fn order(what: What, output: PathBuf) -> Order {
    Order {
        what,
        output,
        overwrite: false,
        transform: Default::default(),
        table: None,
        gain: 1.0,
        fps: 24.0,
        sharp_px: 2.0,
        side: 0,
        show: None,
        encoder: ENCODER.into(),
    }
}

/// How a window is started: on the CPU, without a session.
pub fn start(path: Option<&Path>, options: Options) -> Start {
    Start {
        path: path.map(Path::to_owned),
        options,
        device: Choice::Cpu,
        session: None,
        ocio: None,
        frame_memory: ROOM,
        quit: Cancel::new(),
    }
}

/// A window on a path.
pub fn open(path: &Path, device: Choice, session: Option<&Path>) -> Window {
    let session = session.map(Path::to_owned);
    with(Start { device, session, ..start(Some(path), Options::default()) })
}

pub fn with(start: Start) -> Window {
    let mut window = Harness::builder()
        .with_size(Vec2::new(1280.0, 800.0))
        .wgpu_setup(setup())
        .build_eframe(move |cc| App::new(cc, start).unwrap());
    settle(&mut window);
    window
}

/// Goes on until everything that was asked for is on the screen.
pub fn settle(window: &mut Window) {
    let start = Instant::now();
    let mut calm = 0;
    // Twice calm: what a step asks for may only be under way after it.
    while calm < 3 {
        window.step();
        calm = if window.state().is_settled() { calm + 1 } else { 0 };
        std::thread::sleep(Duration::from_millis(2));
        assert!(start.elapsed() < Duration::from_secs(60), "the window does not come to rest");
    }
}

/// Goes on until something is called so.
pub fn wait_for(window: &mut Window, label: &str) {
    let start = Instant::now();
    while window.query_by_label(label).is_none() {
        settle(window);
        assert!(start.elapsed() < Duration::from_secs(20), "nothing is called {label}");
    }
}

/// Where a pixel of the picture is in the window.
pub fn point(window: &Window, pixel: [f32; 2]) -> Pos2 {
    window.state().place().expect("a picture").point(pixel)
}

/// Clicks on a pixel of the picture.
pub fn click(window: &mut Window, pixel: [f32; 2]) {
    let at = point(window, pixel);
    window.hover_at(at);
    window.step();
    window.drag_at(at);
    window.step();
    window.drop_at(at);
    settle(window);
}

/// Presses at one pixel and lets go at another.
pub fn drag(window: &mut Window, from: [f32; 2], to: [f32; 2], modifiers: Modifiers) {
    let (from, to) = (point(window, from), point(window, to));
    window.hover_at(from);
    window.step();
    let button =
        |pos, pressed| Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
    window.event(Event::ModifiersChanged(modifiers));
    window.event(button(from, true));
    window.step();
    for i in 1..=4 {
        window.event(Event::PointerMoved(from + (to - from) * (i as f32 / 4.0)));
        window.step();
    }
    window.event(button(to, false));
    window.step();
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    settle(window);
}

/// How strong the pattern is around a pixel, as the window shows it: the spread of its brightness.
pub fn contrast(window: &mut Window, pixel: [f32; 2]) -> f64 {
    let image = window.render().unwrap();
    let center = point(window, pixel);
    let values: Vec<f64> = (-20..=20)
        .flat_map(|dy| (-20..=20).map(move |dx| (dx, dy)))
        .map(|(dx, dy)| {
            f64::from(image.get_pixel((center.x as i32 + dx) as u32, (center.y as i32 + dy) as u32).0[1])
        })
        .collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// The distance in focus.
pub fn focus(window: &Window) -> f64 {
    window.state().lens_values().expect("a lens").focus_m
}

/// A program in the encoder's place.
#[cfg(unix)]
pub fn script(folder: &Path, name: &str, text: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let path = folder.join(name);
    std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}
