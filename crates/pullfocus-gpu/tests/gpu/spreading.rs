//! The aperture's spans: what adding up in whole numbers promises.

use crate::device::with_host;
use pullfocus_core::{Aperture, Cancel, Error, Layering, Method, Plane, Settings, Size};
use pullfocus_gpu::Storage;
use pullfocus_gpu::inside::{self, Apart};
use pullfocus_testkit::scenes;
use std::time::{Duration, Instant};

/// Name and test.
pub fn tests() -> Vec<(&'static str, fn())> {
    vec![
        ("few_planes_at_a_time_are_the_same_bits", few_planes_at_a_time_are_the_same_bits),
        ("nothing_is_left_of_a_light_beyond_its_circle", nothing_is_left_of_a_light_beyond_its_circle),
        ("weights_decide_who_is_seen", weights_decide_who_is_seen),
        ("a_long_draw_hears_a_wish_to_stop", a_long_draw_hears_a_wish_to_stop),
        ("other_methods_and_shapes_are_refused", other_methods_and_shapes_are_refused),
    ]
}

const PLENTY: u64 = 1 << 27;

fn spread(
    planes: &[Plane],
    coc: &Plane,
    gamma: Option<&Plane>,
    aperture: &Aperture,
    most: u64,
) -> Vec<Plane> {
    let context = with_host(|host| host.context().clone());
    let apart = Apart { planes, coc, layers: 1, storage: Storage::Full };
    inside::spread(&context, &apart, gamma, aperture, most).expect("it is spread")
}

/// Buffers that hold five channels, four, three, two, one: the planes go through in other shares.
fn few_planes_at_a_time_are_the_same_bits() {
    let size = Size::new(70, 41);
    let planes: Vec<Plane> = (0..7).map(|seed| scenes::noise(size, -1.0, 3.0, seed)).collect();
    let coc = scenes::ramp(size, -70.0, 130.0);
    let aperture = Aperture::blades(5, 4.0);
    let whole = spread(&planes, &coc, None, &aperture, PLENTY);
    assert!(whole != planes);
    // All levels have somewhat more cells than 4/3 of the pixels.
    let channel = 8 * 2 * size.area() as u64;
    for channels in [5, 4, 2, 1] {
        let parts = spread(&planes, &coc, None, &aperture, channels * channel);
        assert!(parts == whole, "{channels} channels at a time");
    }
}

/// The brightest number of a half beside darkness: where its circle ends there is nothing, to the bit.
fn nothing_is_left_of_a_light_beyond_its_circle() {
    let size = Size::new(200, 120);
    for (circle, reach) in [(9.0, 6.0), (40.0, 22.0), (-60.0, 40.0)] {
        let light = scenes::plane(size, |x, y| if (x, y) == (70, 50) { 65504.0 } else { 0.0 });
        let dim = scenes::plane(size, |x, y| if (x, y) == (70, 50) { 65504.0 } else { 0.25 });
        let coc = scenes::constant(size, circle);
        let found = spread(&[light, dim], &coc, None, &Aperture::DISC, PLENTY);
        let mut lit = 0;
        for y in 0..size.height {
            for x in 0..size.width {
                let away = (x as f32 - 70.0).hypot(y as f32 - 50.0);
                if away > reach {
                    assert_eq!(found[0].at(x, y), 0.0, "{circle}: ({x}, {y})");
                    // A quotient of two f32 that were rounded.
                    assert!((found[1].at(x, y) - 0.25).abs() < 1e-6, "{circle}: {}", found[1].at(x, y));
                }
                lit += usize::from(found[0].at(x, y) > 0.0);
            }
        }
        assert!(lit as f32 > 0.7 * circle * circle, "{circle}: {lit}");
    }
}

/// A pixel without weight is not seen beside those that have some; where none has any, all count the same.
fn weights_decide_who_is_seen() {
    let size = Size::new(90, 40);
    let halves = scenes::plane(size, |x, _| if x < 45 { 2.0 } else { 7.0 });
    let coc = scenes::constant(size, 12.0);
    let right = scenes::plane(size, |x, _| if x < 45 { 0.0 } else { 0.5 });
    let found = spread(std::slice::from_ref(&halves), &coc, Some(&right), &Aperture::DISC, PLENTY).remove(0);
    // Within a circle's reach of the right half all that is seen is the right half's; a quotient's rounding.
    assert!((40..90).all(|x| (found.at(x, 20) - 7.0).abs() < 1e-5), "{:?}", found.row(20));
    assert!(found.data().iter().all(|v| (2.0..=7.0).contains(v)));
    let none = scenes::constant(size, 0.0);
    let found = spread(&[halves], &coc, Some(&none), &Aperture::DISC, PLENTY).remove(0);
    assert!(found.data().iter().all(|v| (2.0..=7.0).contains(v)));
}

/// A software device draws these circles for seconds; a fast one may be done before it is asked.
fn a_long_draw_hears_a_wish_to_stop() {
    let settings = Settings { method: Method::Aperture, layering: Layering::Single, ..Settings::default() };
    let draw = |size: Size, cancel: &Cancel| {
        let colors = vec![scenes::checker(size, 9); 3];
        let mut scene = scenes::by_circle(colors, None, scenes::constant(size, 47.0));
        let start = Instant::now();
        let result = with_host(|host| host.render(&mut scene, None, &settings, cancel));
        (result, start.elapsed())
    };
    // Pipelines are made once.
    let (size, small) = (Size::new(1024, 512), Size::new(128, 64));
    let [_, whole] = [small, size].map(|size| draw(size, &Cancel::new()).1);
    let cancel = Cancel::new();
    let flag = cancel.clone();
    let raise = std::thread::spawn(move || {
        std::thread::sleep(whole / 8);
        flag.cancel();
        Instant::now()
    });
    let (result, _) = draw(size, &cancel);
    let ended = Instant::now();
    let late = ended.saturating_duration_since(raise.join().expect("the flag is raised"));
    assert!(matches!(result, Ok(_) | Err(Error::Cancelled)), "{result:?}");
    // The promise is 50 ms; a loaded machine stretches it as it stretches the whole, of which seven eighths are left.
    assert!(
        late < whole / 2 + Duration::from_millis(50),
        "it went on for {late:?}, the whole takes {whole:?}"
    );
    eprintln!("{} after {late:?} of {whole:?}", if result.is_ok() { "done" } else { "stopped" });
}

fn other_methods_and_shapes_are_refused() {
    let scene = scenes::fence_over_ramp(Size::new(20, 10), -3.0, 4.0);
    let mask = pullfocus_core::aperture::Mask::new(1, 1, vec![1.0]).expect("a mask");
    let picture = pullfocus_core::ApertureShape::Image(mask);
    let picture = Aperture { shape: picture, ..Aperture::DISC };
    let of = |method, aperture| Settings { method, aperture, ..Settings::default() };
    for settings in [of(Method::Naive, Aperture::DISC), of(Method::Aperture, picture)] {
        let mut scene = scene.clone();
        let cancel = Cancel::new();
        let refused = with_host(|host| host.render(&mut scene, None, &settings, &cancel));
        assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");
    }
}
