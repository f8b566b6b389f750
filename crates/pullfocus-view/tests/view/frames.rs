//! Frames whose pixels are not all that a camera sees, and depth that depends on its lens.

use crate::window::*;
use eframe::egui::{Key, Pos2};
use egui_kittest::kittest::Queryable;
use pullfocus_core::{Frame, Plane, Size, Window as PixelWindow};
use pullfocus_io::{Limits, SampleType, images, write_exr};
use pullfocus_job::config::Options;
use pullfocus_job::options::DepthForm;
use pullfocus_view::engine::Choice;
use pullfocus_view::export::{Order, What};
use pullfocus_view::look::View;
use pullfocus_view::ui::Start;
use std::fs;
use std::path::Path;

pub const TESTS: &[(&str, fn())] = &[
    ("cropped_frames_stay_in_place", cropped_frames_stay_in_place),
    ("a_frame_has_an_outline_where_it_is_not_whole", a_frame_has_an_outline_where_it_is_not_whole),
    ("cropped_frames_are_written_in_place", cropped_frames_are_written_in_place),
    ("one_reference_lies_beside_frames_of_any_crop", one_reference_lies_beside_frames_of_any_crop),
    ("what_is_written_is_called_the_result", what_is_written_is_called_the_result),
    ("distances_along_rays_are_of_the_lens_of_now", distances_along_rays_are_of_the_lens_of_now),
    #[cfg(unix)]
    ("a_movie_says_what_its_pixels_are", a_movie_says_what_its_pixels_are),
];

const fn window(x: i32, y: i32, width: usize, height: usize) -> PixelWindow {
    PixelWindow { x, y, size: Size { width, height } }
}

/// An encoder that writes what it is given: the last argument is where it goes.
#[cfg(unix)]
const KEEPS: &str = "for last; do :; done; cat > \"$last\"";

/// What the camera sees.
const DISPLAY: PixelWindow = window(10, 20, 192, 96);
/// What the frames hold: all of that, the part with something in it, more.
const DATA: [PixelWindow; 3] = [DISPLAY, window(105, 45, 70, 50), window(-14, 12, 240, 112)];
/// Something bright, and the middle of it.
const THING: PixelWindow = window(120, 60, 24, 24);
const INSIDE: [i32; 2] = [132, 72];
/// How far away it is, and the rest, in metres.
const METRES: [f32; 2] = [2.0, 5.0];

fn is_thing(x: i64, y: i64) -> bool {
    let inside = |at: i64, from: i32, length: usize| (0..length as i64).contains(&(at - i64::from(from)));
    inside(x, THING.x, THING.size.width) && inside(y, THING.y, THING.size.height)
}

fn write(path: &Path, frame: &Frame, values: [[f32; 2]; 2]) {
    let plane = |[there, else_]: [f32; 2]| {
        let at = |at: usize, from: i32| at as i64 + i64::from(from);
        let value = |x, y| if is_thing(at(x, frame.data.x), at(y, frame.data.y)) { there } else { else_ };
        Plane::from_fn(frame.data.size, value).unwrap()
    };
    let (color, depth) = (plane(values[0]), plane(values[1]));
    let planes = [("R", &color), ("G", &color), ("B", &color), ("Z", &depth)];
    let planes = planes.map(|(name, plane)| (name, plane, SampleType::Float));
    write_exr(fs::File::create(path).unwrap(), frame, &planes, &[]).unwrap();
}

fn cropped() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (i, data) in DATA.into_iter().enumerate() {
        let frame = Frame { display: DISPLAY, data, ..Frame::full(data.size) };
        write(&folder.path().join(format!("f.{:04}.exr", i + 1)), &frame, [[0.8, 0.02], METRES]);
    }
    folder
}

/// Two crops beside a picture of all that the camera sees.
fn one_reference_lies_beside_frames_of_any_crop() {
    let folder = cropped();
    fs::remove_file(folder.path().join("f.0003.exr")).unwrap();
    let all = folder.path().join("all.exr");
    fs::copy(folder.path().join("f.0001.exr"), &all).unwrap();
    let mut window = open(&folder.path().join("f.####.exr"), Choice::Cpu, None);
    // All of it is in focus.
    window.state_mut().set_f_stop(1e6);
    window.state_mut().open_reference(&all);
    for key in [Key::Home, Key::ArrowRight, Key::ArrowLeft] {
        window.key_press(key);
        settle(&mut window);
        let flip = window.state().flip();
        // Halves on one side, floats on the other.
        assert!(flip.is_some_and(|flip| flip < 0.01), "{flip:?}: {:?}", window.state().message());
    }
}

/// Where a pixel of the camera's view is in the window.
fn point_of(window: &Window, frame: usize, [x, y]: [i32; 2]) -> Pos2 {
    let data = DATA[frame];
    point(window, [(x - data.x) as f32, (y - data.y) as f32])
}

/// Green of the window's pixel there.
fn green(window: &mut Window, at: Pos2) -> u8 {
    window.render().unwrap().get_pixel(at.x as u32, at.y as u32).0[1]
}

fn cropped_frames_stay_in_place() {
    let folder = cropped();
    for (device, is_zoomed, views) in [
        (Choice::Cpu, false, [View::Result, View::Depth].as_slice()),
        (Choice::Gpu, true, [View::Result].as_slice()),
    ] {
        let mut window = open(folder.path(), device, None);
        // All in focus, so that what is bright ends where it ends.
        window.state_mut().set_f_stop(1e6);
        if is_zoomed {
            window.key_press(Key::Num0);
        }
        settle(&mut window);
        let rect = window.state().place().unwrap().rect;
        let corners = [[THING.x, THING.y], [THING.x + 24, THING.y + 24]];
        let wanted = corners.map(|corner| point_of(&window, 0, corner));
        let inside = point_of(&window, 0, INSIDE);
        let beside = wanted[0] - eframe::egui::Vec2::splat(6.0);
        // The middle of the camera's view is in the middle.
        let middle = point_of(&window, 0, [DISPLAY.x + 96, DISPLAY.y + 48]);
        assert!((middle - rect.center()).length() < 0.01, "{middle} {rect}");
        for view in views {
            window.state_mut().look_mut().left = *view;
            for frame in [2, 1, 0] {
                window.state_mut().go_to(frame as i64 + 1);
                // What is shown at once may be the frame before.
                for at_rest in [false, true] {
                    if at_rest {
                        settle(&mut window);
                    } else {
                        window.run_steps(2);
                    }
                    let image = window.render().unwrap();
                    let [there, not] =
                        [inside, beside].map(|at| image.get_pixel(at.x as u32, at.y as u32).0[1]);
                    let text = format!("{device:?} {view:?} {frame} {at_rest}");
                    assert!(there > 200 && not < 120, "{text}: {there} {not}");
                }
                let found = corners.map(|corner| point_of(&window, frame, corner));
                for (found, wanted) in found.into_iter().zip(wanted) {
                    assert!((found - wanted).length() < 0.01, "{frame}: {found} for {wanted}");
                }
                window.hover_at(inside);
                settle(&mut window);
                let [x, y] = INSIDE;
                assert!(window.query_by_label(&format!("{x}, {y}")).is_some(), "{frame}");
                // Else the cursor is in the window's picture.
                window.hover_at(rect.left_top());
            }
        }
    }
}

fn a_frame_has_an_outline_where_it_is_not_whole() {
    let folder = cropped();
    let mut window = open(folder.path(), Choice::Cpu, None);
    let edge = |window: &mut Window, frame: usize| {
        window.state_mut().go_to(frame as i64 + 1);
        settle(window);
        // Rows around the lower edge, and one in the picture or where nothing is.
        let at = point_of(window, frame, [DISPLAY.x + 12, DISPLAY.y + 96]);
        let mut row = |by: f32| i32::from(green(window, Pos2::new(at.x, at.y + by)));
        [(-2..=1).map(|by| row(by as f32)).max().unwrap(), row(-8.0)]
    };
    let [line, above] = edge(&mut window, 0);
    assert!((line - above).abs() < 8, "no line around a whole frame: {line} {above}");
    for frame in [1, 2] {
        let [line, above] = edge(&mut window, frame);
        assert!(line > above + 20, "{frame}: {line} {above}");
    }
}

fn cropped_frames_are_written_in_place() {
    let folder = cropped();
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.state_mut().set_f_stop(1e6);
    settle(&mut window);
    let mut run = |order: Order| {
        window.state_mut().start_export(order).unwrap();
        settle(&mut window);
        window.state().export().unwrap().progress().end.unwrap().unwrap();
    };
    run(order(What::Pictures, folder.path().join("p.####.png")));
    // Black where no pixels are; dark elsewhere; bright there.
    let check = |frame: usize, at: &dyn Fn(usize, usize) -> u8| {
        for (x, y) in [(2, 2), (100, 30), (109, 50), (122, 52), (150, 60), (190, 94)] {
            let (column, row) = (x as i64 + i64::from(DISPLAY.x), y as i64 + i64::from(DISPLAY.y));
            let data = DATA[frame];
            let has =
                |at: i64, from: i32, length: usize| (0..length as i64).contains(&(at - i64::from(from)));
            let there = has(column, data.x, data.size.width) && has(row, data.y, data.size.height);
            let found = at(x, y);
            match (there, is_thing(column, row)) {
                (false, _) => assert_eq!(found, 0, "{frame}: {x} {y}"),
                (true, true) => assert!(found > 200, "{frame}: {x} {y}: {found}"),
                (true, false) => assert!((20..60).contains(&found), "{frame}: {x} {y}: {found}"),
            }
        }
    };
    for frame in 0..3 {
        let path = folder.path().join(format!("p.{:04}.png", frame + 1));
        let picture = images::read_picture(&path, &Limits::default()).unwrap();
        assert_eq!(picture.size(), DISPLAY.size);
        let code = |linear: f32| (pullfocus_core::srgb::encode(linear) * 255.0).round() as u8;
        check(frame, &|x, y| code(picture.colors[1].at(x, y)));
    }
    #[cfg(unix)]
    {
        let encoder = script(folder.path(), "keeps", KEEPS);
        let output = folder.path().join("m.mp4");
        run(Order { encoder, ..order(What::Movie, output.clone()) });
        let bytes = fs::read(output).unwrap();
        assert_eq!(bytes.len(), 3 * 3 * DISPLAY.size.area());
        for (frame, bytes) in bytes.chunks(3 * DISPLAY.size.area()).enumerate() {
            check(frame, &|x, y| bytes[3 * (x + y * DISPLAY.size.width) + 1]);
        }
    }
}

/// It is a take, whatever view or overlay is chosen.
fn what_is_written_is_called_the_result() {
    let folder = cropped();
    let mut window = open(folder.path(), Choice::Cpu, None);
    window.get_by_label("Render…").click();
    settle(&mut window);
    for name in ["The result, as pictures", "The result, as a movie"] {
        assert!(window.query_by_label(name).is_some(), "{name}");
    }
}

/// A wall across the view of a lens of 24 mm, in metres.
const WALL: f64 = 0.4;
/// Its distances are along rays; a pixel near a corner, and the sensor in millimetres.
const CORNER: [f32; 2] = [6.0, 6.0];
const SENSOR: f64 = 36.0;

/// Planar depth of the wall in the corner, for who takes its distances for those of a lens of so many millimetres.
fn wall(millimetres: f64) -> f64 {
    let length = |millimetres: f64| {
        let [across, up] = Frame::full(SIZE).ray_tangents(0.5 * SENSOR / millimetres, 6, 6);
        (1.0 + across * across + up * up).sqrt()
    };
    WALL * length(24.0) / length(millimetres)
}

fn distances_along_rays_are_of_the_lens_of_now() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rays.exr");
    let frame = Frame::full(SIZE);
    let depth = Plane::from_fn(SIZE, |x, y| {
        let [across, up] = frame.ray_tangents(0.5 * SENSOR / 24.0, x, y);
        (WALL * (1.0 + across * across + up * up).sqrt()) as f32
    });
    let (color, depth) = (Plane::filled(SIZE, 0.5).unwrap(), depth.unwrap());
    let planes = [("R", &color), ("G", &color), ("B", &color), ("Z", &depth)];
    let planes = planes.map(|(name, plane)| (name, plane, SampleType::Float));
    write_exr(fs::File::create(&path).unwrap(), &frame, &planes, &[]).unwrap();
    for device in [Choice::Cpu, Choice::Gpu] {
        let mut options = Options::default();
        options.depth.depth = Some(DepthForm::Ray);
        let mut window = with(Start { device, ..start(Some(&path), options) });
        let check = |window: &mut Window, millimetres: f64| {
            click(window, CORNER);
            let (found, wanted) = (focus(window), wall(millimetres));
            // Of nine pixels the one in the middle.
            assert!((found / wanted - 1.0).abs() < 5e-3, "{device:?} {millimetres} mm: {found} for {wanted}");
        };
        // Assumed, as nobody says another.
        check(&mut window, 50.0);
        window.state_mut().set_f_stop(0.7);
        window.state_mut().set_focal_length(24.0);
        settle(&mut window);
        check(&mut window, 24.0);
        // All of the wall is in focus, on the screen too.
        window.state_mut().look_mut().left = View::Coc;
        settle(&mut window);
        for pixel in [CORNER, MIDDLE, [186.0, 90.0]] {
            let at = point(&window, pixel);
            let [red, green, blue, _] = window.render().unwrap().get_pixel(at.x as u32, at.y as u32).0;
            assert!(green > 200 && red < 40 && blue < 40, "{device:?} {pixel:?}: {red} {green} {blue}");
        }
        // Take B has a lens of its own.
        window.state_mut().look_mut().left = View::Other;
        window.state_mut().set_focal_length(35.0);
        settle(&mut window);
        check(&mut window, 35.0);
        window.state_mut().look_mut().left = View::Result;
        settle(&mut window);
        check(&mut window, 24.0);
    }
}

#[cfg(unix)]
fn a_movie_says_what_its_pixels_are() {
    let folder = tempfile::tempdir().unwrap();
    let encoder = script(folder.path(), "tells", &format!("echo \"$@\" > \"$0.txt\"; {KEEPS}"));
    for (i, (aspect, told)) in [(1.0, "1"), (2.0, "2"), (0.0, "1"), (1e9, "1")].into_iter().enumerate() {
        let picture = folder.path().join(format!("{i}.exr"));
        let frame = Frame { pixel_aspect: aspect, ..Frame::full(Size::new(40, 30)) };
        write(&picture, &frame, [[0.8, 0.02], METRES]);
        let mut window = open(&picture, Choice::Cpu, None);
        let order =
            Order { encoder: encoder.clone(), ..order(What::Movie, folder.path().join(format!("{i}.mp4"))) };
        window.state_mut().start_export(order).unwrap();
        settle(&mut window);
        window.state().export().unwrap().progress().end.unwrap().unwrap();
        let arguments = fs::read_to_string(folder.path().join("tells.txt")).unwrap();
        let sar = format!(",setsar={told}:max=1000 ");
        // The matrix that converts, and what players are told, are the same.
        for wanted in [
            "-s 40x30 ",
            &sar,
            ",scale=out_color_matrix=bt709:out_range=tv,",
            "-pix_fmt yuv420p",
            "-colorspace bt709 -color_primaries bt709 -color_trc bt709 -color_range tv",
        ] {
            assert!(arguments.contains(wanted), "{aspect}: {wanted}: {arguments}");
        }
    }
}
