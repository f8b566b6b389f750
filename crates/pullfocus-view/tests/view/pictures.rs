//! What the picture shows.

use crate::window::*;
use pullfocus_core::{Frame, Plane, Size, Window as PixelWindow};
use pullfocus_io::{SampleType, write_exr};
use pullfocus_view::engine::Choice;
use pullfocus_view::look::View;

pub const TESTS: &[(&str, fn())] = &[
    ("views_show_what_they_say", views_show_what_they_say),
    ("a_wipe_has_two_sides", a_wipe_has_two_sides),
    ("exposure_doubles_light", exposure_doubles_light),
    ("a_reference_is_compared", a_reference_is_compared),
    ("a_cropped_picture_is_compared_with_a_whole_one", a_cropped_picture_is_compared_with_a_whole_one),
    ("a_layer_alone_is_less_than_all", a_layer_alone_is_less_than_all),
    ("each_frame_is_its_own_on_the_gpu", each_frame_is_its_own_on_the_gpu),
];

fn frame(device: Choice) -> (tempfile::TempDir, Window) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frame.exr");
    write_frame(&path);
    let window = open(&path, device, None);
    (folder, window)
}

/// Mean colour around a pixel.
fn color(window: &mut Window, pixel: [f32; 2]) -> [f64; 3] {
    let image = window.render().unwrap();
    let center = point(window, pixel);
    let mut sum = [0.0; 3];
    for dy in -16..16 {
        for dx in -16..16 {
            let texel = image.get_pixel((center.x as i32 + dx) as u32, (center.y as i32 + dy) as u32);
            for (sum, &value) in sum.iter_mut().zip(&texel.0) {
                *sum += f64::from(value) / 1024.0;
            }
        }
    }
    sum
}

fn views_show_what_they_say() {
    let (_folder, mut window) = frame(Choice::Cpu);
    window.state_mut().look_mut().left = View::Coc;
    settle(&mut window);
    // Focused on the middle: front is red, in focus green, behind blue.
    for (pixel, channel) in [(NEAR, 0), (MIDDLE, 1), (FAR, 2)] {
        let shown = color(&mut window, pixel);
        let most = (0..3).max_by(|&a, &b| shown[a].total_cmp(&shown[b])).unwrap();
        assert_eq!(most, channel, "{pixel:?}: {shown:?}");
    }
    window.state_mut().look_mut().left = View::Depth;
    settle(&mut window);
    let [near, middle, far] = [NEAR, MIDDLE, FAR].map(|pixel| color(&mut window, pixel)[0]);
    assert!(near > middle && middle > far, "near is bright: {near} {middle} {far}");
    window.state_mut().look_mut().left = View::Pinhole;
    settle(&mut window);
    let [near, far] = [NEAR, FAR].map(|pixel| contrast(&mut window, pixel));
    // The same pattern on both sides, up to where its squares fall on the screen's pixels.
    assert!((near / far - 1.0).abs() < 0.1, "all in focus: {near} {far}");
}

fn a_wipe_has_two_sides() {
    let (_folder, mut window) = frame(Choice::Cpu);
    let look = window.state_mut().look_mut();
    (look.left, look.right, look.wipe) = (View::Result, Some(View::Pinhole), 0.5);
    settle(&mut window);
    // Focused on the middle, so both ends are blurred by the lens; the right one is shown without it.
    let [left, right] = [NEAR, FAR].map(|pixel| contrast(&mut window, pixel));
    assert!(right > 2.0 * left, "{left} {right}");
}

fn exposure_doubles_light() {
    let (_folder, mut window) = frame(Choice::Cpu);
    let decode = |encoded: f64| f64::from(pullfocus_core::srgb::decode(encoded as f32 / 255.0));
    let before = decode(color(&mut window, NEAR)[2]);
    window.state_mut().look_mut().exposure = 0.5;
    settle(&mut window);
    let after = decode(color(&mut window, NEAR)[2]);
    // Half a stop; a mean of encoded values of a pattern that is nearly flat, in 8 bits.
    assert!((after / before / 2f64.sqrt() - 1.0).abs() < 0.05, "{before} {after}");
}

fn a_reference_is_compared() {
    let (folder, mut window) = frame(Choice::Cpu);
    let path = folder.path().join("frame.exr");
    window.state_mut().set_f_stop(0.7);
    window.state_mut().open_reference(&path);
    settle(&mut window);
    assert!(window.state().flip().unwrap() > 0.05, "a blurred picture is not its pinhole picture");
    // With the aperture closed they are alike.
    window.state_mut().set_f_stop(1e6);
    settle(&mut window);
    let flip = window.state().flip().unwrap();
    // Halves on one side, floats on the other.
    assert!(flip < 0.01, "{flip}");
}

/// The picture's pixels are a part of what its camera sees; the reference has all of that.
fn a_cropped_picture_is_compared_with_a_whole_one() {
    let folder = tempfile::tempdir().unwrap();
    let whole = Size::new(SIZE.width + 40, SIZE.height + 24);
    let at = |x: usize, y: usize| if (x / 3 + y / 5).is_multiple_of(2) { 0.7 } else { 0.2 };
    let write = |name: &str, frame: &Frame, color: Plane| {
        let path = folder.path().join(name);
        let depth = Plane::filled(color.size(), 2.0).unwrap();
        let planes = [("R", &color), ("G", &color), ("B", &color), ("Z", &depth)];
        let planes = planes.map(|(name, plane)| (name, plane, SampleType::Float));
        write_exr(std::fs::File::create(&path).unwrap(), frame, &planes, &[]).unwrap();
        path
    };
    let display = PixelWindow { x: 5, y: 7, size: whole };
    let data = PixelWindow { x: 5 + 30, y: 7 + 10, size: SIZE };
    let frame = Frame { display, data, ..Frame::full(SIZE) };
    let part = write("part.exr", &frame, Plane::from_fn(SIZE, |x, y| at(x + 30, y + 10)).unwrap());
    let all = write("all.exr", &Frame::full(whole), Plane::from_fn(whole, at).unwrap());
    // All of it is in focus.
    let mut window = open(&part, Choice::Cpu, None);
    window.state_mut().open_reference(&all);
    settle(&mut window);
    let flip = window.state().flip().unwrap();
    // Halves on one side, floats on the other.
    assert!(flip < 0.01, "{flip}: {:?}", window.state().message());
}

fn a_layer_alone_is_less_than_all() {
    for device in [Choice::Cpu, Choice::Gpu] {
        let (_folder, mut window) = frame(device);
        let all = window.state().rendered_picture().unwrap();
        window.state_mut().look_mut().layer = Some(0);
        settle(&mut window);
        let alone = window.state().rendered_picture().unwrap();
        let at = |picture: &pullfocus_core::Picture, [x, y]: [f32; 2]| {
            picture.colors[0].at(x as usize, y as usize)
        };
        // The farthest layer is the farthest thing; the near one is not in it as it was.
        assert!((at(&all, FAR) - at(&alone, FAR)).abs() < 2e-3, "{device:?}");
        assert!(all != alone, "{device:?}");
    }
}

/// Frames follow one another in the same textures.
fn each_frame_is_its_own_on_the_gpu() {
    let folder = sequence(3);
    write_bright_frame(&folder.path().join("f.0002.exr"), 4.0);
    let mut window = open(folder.path(), Choice::Gpu, None);
    let mut means = Vec::new();
    for frame in [1, 2, 3] {
        window.state_mut().go_to(frame);
        settle(&mut window);
        let picture = window.state().rendered_picture().unwrap();
        let plane = picture.colors[0].data();
        means.push(plane.iter().sum::<f32>() / plane.len() as f32);
    }
    // The blur keeps what there is but for the rounding of halves.
    assert!(
        (means[1] / means[0] - 4.0).abs() < 0.01 && (means[2] / means[0] - 1.0).abs() < 1e-3,
        "{means:?}"
    );
}
