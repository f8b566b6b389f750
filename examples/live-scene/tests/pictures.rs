//! The scene through the lens, pixel by pixel: run where there is an adapter, ignored where there is none.
//!
//! `PULLFOCUS_TEST_ADAPTER=NAME` picks an adapter; with `PULLFOCUS_TEST_GPU=required` none is a failure.

use image::RgbImage;
use libtest_mimic::{Arguments, Trial};
use pullfocus_core::Size;
use pullfocus_example_live_scene::{Live, blur, camera::Shot};
use pullfocus_gpu::{Choice, Host, adapters};
use std::ops::RangeInclusive;
use std::sync::{Mutex, PoisonError};

const SIZE: Size = Size::new(384, 216);
/// Processors do the tests: the quickest look, but for the one test that takes all.
const DIFFUSION: usize = blur::LOOKS.len() - 1;

static LIVE: Mutex<Option<Live>> = Mutex::new(None);

fn with_live<T>(work: impl FnOnce(&mut Live) -> T) -> T {
    work(LIVE.lock().unwrap_or_else(PoisonError::into_inner).as_mut().expect("ignored without an adapter"))
}

fn shoot(shot: &Shot) -> RgbImage {
    shoot_at(shot, SIZE)
}

fn shoot_at(shot: &Shot, size: Size) -> RgbImage {
    with_live(|live| {
        live.frame(shot, size).expect("it renders");
        live.picture().expect("it reads back")
    })
}

fn shot() -> Shot {
    Shot { look: DIFFUSION, ..Shot::default() }
}

/// A part of the picture: columns and rows.
type Part = (RangeInclusive<u32>, RangeInclusive<u32>);

/// Around a point of an object, `up` metres above where it stands; `reach` pixels to either side.
fn around(name: &str, up: f32, reach: u32) -> Part {
    with_live(|live| {
        let object = live.scene.objects.iter().find(|object| object.name == name);
        let foot = object.expect("it is in the scene").look.place.w_axis.truncate();
        let shot = Shot::default();
        let at = (shot.projection(SIZE) * shot.view()).project_point3(foot + glam::Vec3::Y * up);
        let x = ((0.5 + 0.5 * at.x) * SIZE.width as f32) as u32;
        let y = ((0.5 - 0.5 * at.y) * SIZE.height as f32) as u32;
        let span = |at: u32, end: usize| at.saturating_sub(reach)..=(at + reach).min(end as u32 - 2);
        (span(x, SIZE.width), span(y, SIZE.height))
    })
}

/// The largest step from a pixel to the next one, of green.
fn sharpness(picture: &RgbImage, (columns, rows): &Part) -> i32 {
    let green = |x, y| i32::from(picture.get_pixel(x, y).0[1]);
    let steps = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
    steps
        .map(|(x, y)| (green(x, y) - green(x + 1, y)).abs().max((green(x, y) - green(x, y + 1)).abs()))
        .max()
        .unwrap_or(0)
}

/// What is measured: an object, a height on it in metres, and how many pixels around.
type Thing = (&'static str, f32, u32);
/// The king's collar, so far within him that nothing else is near.
const IN_FOCUS: Thing = ("white king e4", 0.066, 6);
const NEAR: [Thing; 2] = [("white queen d1", 0.085, 9), ("white rook f1", 0.05, 9)];
const FAR: Thing = ("black king g8", 0.085, 9);

fn measured(picture: &RgbImage, (name, up, reach): Thing) -> i32 {
    sharpness(picture, &around(name, up, reach))
}

fn what_is_in_focus_is_sharp_and_nothing_else() {
    let sharp = shoot(&Shot { blur: false, ..shot() });
    for look in 0..blur::LOOKS.len() {
        let blurred = shoot(&Shot { look, ..shot() });
        let [before, after] = [&sharp, &blurred].map(|picture| measured(picture, IN_FOCUS));
        assert!(before > 30 && after * 10 >= before * 9, "in focus, look {look}: {before} to {after}");
        for thing in NEAR.into_iter().chain([FAR]) {
            let [before, after] = [&sharp, &blurred].map(|picture| measured(picture, thing));
            assert!(after * 2 < before, "{thing:?}, look {look}: {before} to {after}");
        }
    }
}

fn a_foreground_is_soft_over_what_is_behind_it() {
    let one = shoot(&Shot { foreground: false, ..shot() });
    let layers = shoot(&shot());
    for thing in NEAR {
        let [one, layers] = [&one, &layers].map(|picture| measured(picture, thing));
        // No step of a quarter of white is left, where one picture keeps nearly all.
        assert!(layers < 64 && layers * 3 < one, "{thing:?}: {one} in one picture, {layers} in layers");
    }
}

/// What a click meets in a picture of this size; drawn and asked in one go, since other tests draw too.
fn distance_at(size: Size, x: usize, y: usize) -> f64 {
    with_live(|live| {
        live.frame(&shot(), size).expect("it renders");
        live.distance_at(x, y).expect("an answer")
    })
}

fn distance_of(name: &str) -> f64 {
    let (columns, rows) = around(name, 0.03, 0);
    distance_at(SIZE, *columns.start() as usize, *rows.start() as usize)
}

fn the_focus_follows_a_click() {
    let first = shoot(&shot());
    let far_m = distance_of(FAR.0);
    assert!((0.6..0.9).contains(&far_m), "the black king is {far_m} m away");
    let second = shoot(&Shot { focus_m: far_m, ..shot() });
    let [before, after] = [&first, &second].map(|picture| measured(picture, FAR));
    assert!(after * 2 > before * 3, "the far king: {before} to {after}");
    let [before, after] = [&first, &second].map(|picture| measured(picture, IN_FOCUS));
    assert!(after * 2 < before, "the king: {before} to {after}");
}

fn a_click_on_the_foreground_meets_it() {
    let near_m = distance_of(NEAR[0].0);
    assert!((0.25..0.45).contains(&near_m), "the white queen is {near_m} m away");
}

fn it_stands_upright_and_is_no_black_picture() {
    let picture = shoot(&shot());
    let mean = |rows: std::ops::Range<u32>| {
        let count = rows.len() as f64 * f64::from(picture.width());
        let sum: f64 = (rows.flat_map(|y| (0..picture.width()).map(move |x| (x, y))))
            .map(|(x, y)| f64::from(picture.get_pixel(x, y).0[0]))
            .sum();
        sum / count
    };
    // The hedge is dark, the board in the sun is not.
    let (above, below) = (mean(0..60), mean(156..216));
    assert!(above > 10.0 && below > above + 50.0, "above {above}, below {below}");
}

fn sizes_come_and_go() {
    let before = shoot(&shot());
    for size in
        [Size::new(100, 60), Size::new(1, 1), Size::new(131, 77), Size::new(3, 257), Size::new(257, 1)]
    {
        for foreground in [false, true] {
            let picture = shoot_at(&Shot { foreground, ..shot() }, size);
            assert_eq!((picture.width() as usize, picture.height() as usize), (size.width, size.height));
            // The dark hedge, the board in the sun, or both: never nothing.
            let brightest = picture.as_raw().iter().max();
            assert!(brightest > Some(&10), "a black picture of {size}");
        }
        // A click outside meets the edge.
        let distance = distance_at(size, 9999, 9999);
        assert!(distance > 0.1, "{distance} m at {size}");
    }
    // A small picture shows the same as a large one: nearer to it than to one from three pixels beside.
    let small = shoot_at(&shot(), Size::new(131, 74));
    let off = |picture: &RgbImage| -> u64 {
        let whole = image::imageops::resize(picture, 131, 74, image::imageops::FilterType::Triangle);
        small.as_raw().iter().zip(whole.as_raw()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum()
    };
    let turned = off(&shoot(&Shot { yaw: shot().yaw + 0.02, ..shot() }));
    let same = off(&before);
    assert!(2 * same < turned, "{same} off the same view, {turned} off another");
    assert!(shoot(&shot()) == before, "the same picture again");
}

fn keys_change_the_picture() {
    let first = shoot(&shot());
    let after = |keys: &[&str]| {
        let mut shot = shot();
        keys.iter().for_each(|key| shot.key(key));
        shoot(&shot)
    };
    // From diffusion round to the first method, to the second, and on to diffusion.
    let mut turned = shot();
    let looks = [(); 3].map(|()| {
        turned.key("m");
        turned.look
    });
    assert_eq!(looks, [0, 1, DIFFUSION]);
    let methods = [after(&["m"]), after(&["M", "m"])];
    assert!(
        methods[0] != first && methods[1] != first && methods[0] != methods[1],
        "each method has its own"
    );
    assert!(after(&["m"; blur::LOOKS.len()]) == first, "all the way round");
    for key in [" ", "f", "[", "]"] {
        assert!(after(&[key]) != first, "{key} changes the picture");
    }
    assert!(after(&[" ", " ", "f", "F", "[", "]", "x", ""]) == first, "there and back");
    // A dial has ends.
    let stop = |key| {
        let mut shot = shot();
        (0..50).for_each(|_| shot.key(key));
        shot.f_stop
    };
    assert_eq!((stop("["), stop("]")), (1.4, 22.0));
}

fn a_focus_pull_arrives() {
    for (from, to) in [(0.3, 2.0), (2.0, 0.3), (0.5, f64::INFINITY)] {
        let mut shot = Shot { focus_m: from, ..shot() };
        shot.pull(to, 0.02);
        assert!((from.min(to)..from.max(to)).contains(&shot.focus_m) && shot.focus_m != from, "on its way");
        (0..100).for_each(|_| shot.pull(to, 0.02));
        assert_eq!(shot.focus_m, to);
    }
}

fn choose() -> Option<Choice> {
    let name = std::env::var("PULLFOCUS_TEST_ADAPTER").unwrap_or_default().to_lowercase();
    let found = adapters().into_iter().find(|info| info.name.to_lowercase().contains(&name))?;
    Some(Choice::Named(found.name))
}

fn main() {
    let arguments = Arguments::from_args();
    let choice = choose();
    let required = std::env::var("PULLFOCUS_TEST_GPU").is_ok_and(|value| value == "required");
    assert!(choice.is_some() || !required, "PULLFOCUS_TEST_GPU=required, and no adapter was found");
    let there = choice.is_some();
    if let Some(choice) = choice.filter(|_| !arguments.list) {
        let host = Host::open(&choice).expect("the adapter opens");
        let (device, queue) = (host.context().device(), host.context().queue());
        let live = Live::new(device, queue, SIZE).expect("the scene is there");
        *LIVE.lock().unwrap_or_else(PoisonError::into_inner) = Some(live);
    }
    let tests: [(&str, fn()); 8] = [
        ("what_is_in_focus_is_sharp_and_nothing_else", what_is_in_focus_is_sharp_and_nothing_else),
        ("a_foreground_is_soft_over_what_is_behind_it", a_foreground_is_soft_over_what_is_behind_it),
        ("the_focus_follows_a_click", the_focus_follows_a_click),
        ("a_click_on_the_foreground_meets_it", a_click_on_the_foreground_meets_it),
        ("it_stands_upright_and_is_no_black_picture", it_stands_upright_and_is_no_black_picture),
        ("sizes_come_and_go", sizes_come_and_go),
        ("keys_change_the_picture", keys_change_the_picture),
        ("a_focus_pull_arrives", a_focus_pull_arrives),
    ];
    let trials = tests.map(|(name, test)| {
        let run = move || {
            test();
            Ok(())
        };
        Trial::test(name, run).with_ignored_flag(!there)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}
