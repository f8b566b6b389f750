//! The spreading methods against their f64 references, and what each keeps.

use super::*;
use pullfocus_testkit::reference::spreading::{Spreading, normalised};
use pullfocus_testkit::{Grid, scenes};
use std::time::Duration;

const SIZE: Size = Size { width: 61, height: 43 };

const SHAPES: [Psf; 4] = [
    Psf::Gaussian,
    Psf::Disc,
    Psf::Blades { count: 5, rotation_degrees: 10.0 },
    Psf::Blades { count: 8, rotation_degrees: 0.0 },
];

fn of<'a>(method: Method, psf: Psf, circle: &'a Plane, gamma: Option<&'a Plane>) -> Spread<'a> {
    Spread { method, psf, circle, gamma, vertical_scale: 1.0 }
}

/// Every method with every shape that it has.
fn all() -> impl Iterator<Item = (Method, Psf)> {
    let methods = Method::ALL.into_iter().filter(|method| *method != Method::Diffusion);
    methods.flat_map(|method| {
        SHAPES.into_iter().filter(move |psf| psf.check(method).is_ok()).map(move |psf| (method, psf))
    })
}

fn blurred(plane: &Plane, spreading: &Spread<'_>) -> Plane {
    let mut plane = plane.clone();
    spread(&mut [&mut plane], spreading, &mut SpreadBuffers::default(), &Cancel::new()).unwrap();
    plane
}

/// The sums before they are divided, and the weight.
fn sums(plane: &Plane, spreading: &Spread<'_>) -> [Plane; 2] {
    let mut outputs = [plane.clone(), plane.clone()];
    let [sum, weight] = &mut outputs;
    add_up(&[plane], spreading, &mut [sum, weight], &Cancel::new()).unwrap();
    outputs
}

fn bits(plane: &Plane) -> Vec<u32> {
    plane.data().iter().map(|value| value.to_bits()).collect()
}

#[test]
fn naive_and_gather_match_the_f64_reference() {
    let circle =
        scenes::plane(SIZE, |x, y| if (x / 9 + y / 7) % 3 == 0 { 0.3 } else { 0.25 * x as f32 - 3.0 });
    let values = scenes::noise(SIZE, 0.0, 3.0, 4);
    let matte = scenes::plane(SIZE, |x, y| (x.abs_diff(30) + y) as f32 / 60.0);
    for psf in SHAPES {
        for vertical_scale in [0.6, 1.0, 1.5] {
            for gamma in [None, Some(&matte)] {
                let (diameter, x) = (Grid::from_plane(&circle), Grid::from_plane(&values));
                let scale = f64::from(vertical_scale);
                let reference = Spreading { psf, diameter: &diameter, vertical_scale: scale };
                let weights = gamma.map(Grid::from_plane);
                let spread = normalised(&x, weights.as_ref(), |values| reference.spread(values));
                let gathered = normalised(&x, weights.as_ref(), |values| reference.gather(values));
                for (method, expected) in [(Method::Naive, spread), (Method::Gather, gathered)] {
                    let spreading = Spread { method, psf, circle: &circle, gamma, vertical_scale };
                    let error = expected.distance_to(&blurred(&values, &spreading)) / 3.0;
                    // Gaussians are mixed from a table: 5e-4 of the peak for each axis. Others have f32's rounding.
                    let least = if psf == Psf::Gaussian { 1e-3 } else { 2e-5 };
                    assert!(error < least, "{method:?} {psf:?}, {vertical_scale}: {error:e}");
                }
            }
        }
    }
}

#[test]
fn gathering_is_the_transpose_of_spreading() {
    let circle = scenes::ramp(SIZE, -4.0, 15.0);
    let (a, b) = (scenes::noise(SIZE, 0.0, 1.0, 1), scenes::noise(SIZE, 0.0, 1.0, 2));
    let product = |a: &Plane, b: &Plane| Grid::from_plane(a).zip(&Grid::from_plane(b), |a, b| a * b).sum();
    for psf in SHAPES {
        let [spread, _] = sums(&a, &of(Method::Naive, psf, &circle, None));
        let [gathered, _] = sums(&b, &of(Method::Gather, psf, &circle, None));
        let (one, other) = (product(&spread, &b), product(&a, &gathered));
        // Sums of some thousand f32.
        assert!((one / other - 1.0).abs() < 1e-5, "{psf:?}: {one} {other}");
    }
}

/// Spreading keeps energy before the division; gathering keeps constants before it (away from borders). Varying blur cannot
/// have both: see the table in the conformance suite.
#[test]
fn before_the_division_each_keeps_its_own() {
    let inner =
        scenes::plane(
            SIZE,
            |x, y| if x.abs_diff(30) < 9 && y.abs_diff(21) < 9 { 1.0 + x as f32 } else { 0.0 },
        );
    // Nothing that has a value reaches the border.
    let circle = scenes::plane(SIZE, |x, y| ((x * 7 + y * 3) % 11) as f32 - 2.0);
    for (method, psf) in all() {
        let [sum, weight] = sums(&inner, &of(method, psf, &circle, None));
        let kept = Grid::from_plane(&sum).sum() / Grid::from_plane(&inner).sum();
        let even = (0..20).all(|i| (weight.at(20 + i, 21) - 1.0).abs() < 1e-4);
        // f32 sums; what is not kept is off by far more.
        let keeps_energy = (kept - 1.0).abs() < 1e-4;
        let expected = method != Method::Gather;
        assert_eq!((keeps_energy, even), (expected, !expected), "{method:?} {psf:?}: {kept}");
    }
}

#[test]
fn constants_and_pixels_without_blur_keep_every_bit() {
    let circle = scenes::plane(SIZE, |x, y| ((x * 7 + y * 3) % 40) as f32 - 9.0);
    let matte = scenes::plane(SIZE, |x, _| if x < 20 { 0.0 } else { 0.01 * x as f32 });
    let zero = scenes::constant(SIZE, 0.0);
    let values = scenes::noise(SIZE, -2.0, 900.0, 9);
    for (method, psf) in all() {
        for value in [0.0, 0.7, 65504.0] {
            let even = scenes::constant(SIZE, value);
            for gamma in [None, Some(&matte)] {
                assert_eq!(blurred(&even, &of(method, psf, &circle, gamma)), even, "{method:?} {psf:?}");
            }
        }
        assert_eq!(
            bits(&blurred(&values, &of(method, psf, &zero, None))),
            bits(&values),
            "{method:?} {psf:?}"
        );
        for odd in [f32::NAN, f32::INFINITY, 1e30] {
            let spread = blurred(&values, &of(method, psf, &scenes::constant(SIZE, odd), None));
            assert!(spread.data().iter().all(|v| v.is_finite()), "{method:?} {psf:?}, circles of {odd}");
        }
    }
}

/// What a matte leaves out has no share in what it lets in.
#[test]
fn a_matte_is_the_weight_of_a_pixel() {
    let circle = scenes::constant(SIZE, 12.0);
    let inside = |x: usize| x < 30;
    let values = scenes::plane(SIZE, |x, _| if inside(x) { 0.25 } else { 7.0 });
    let matte = scenes::plane(SIZE, |x, _| if inside(x) { 1.0 } else { 0.0 });
    for (method, psf) in all() {
        let spread = blurred(&values, &of(method, psf, &circle, Some(&matte)));
        // Within reach of what has a weight. The floor of 1e-15 is out of f32's sight.
        let error = (0..33).map(|x| (spread.at(x, 20) - 0.25).abs()).fold(0.0, f32::max);
        assert!(error < 1e-5, "{method:?} {psf:?}: {error}");
    }
}

/// A circle that grows by a thousandth of a pixel moves nothing by more than a few thousandths.
#[test]
fn nothing_jumps_where_a_circle_grows() {
    let values = scenes::checker(SIZE, 5);
    for (method, psf) in all() {
        for c in [0.0, 0.49, 0.99, 1.0, 1.5, 1.99, 3.3, 4.0, 7.99, 11.3, 17.0, 26.0] {
            let at = |c: f32| blurred(&values, &of(method, psf, &scenes::constant(SIZE, c), None));
            let error = Grid::from_plane(&at(c)).distance_to(&at(c + 1e-3));
            // A rim that moves by half of that over a circle of a pixel changes a third of it in the worst place.
            assert!(error < 5e-3, "{method:?} {psf:?} jumps by {error} at {c}");
        }
    }
}

#[test]
fn large_circles_are_cancelled_soon() {
    let size = Size::new(1500, 800);
    let (mut plane, circle) = (scenes::constant(size, 1.0), scenes::constant(size, 900.0));
    for (method, psf) in all().filter(|(method, _)| matches!(method, Method::Naive | Method::Gather)) {
        let cancel = Cancel::new();
        let flag = cancel.clone();
        let raised = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(30));
            flag.cancel();
            std::time::Instant::now()
        });
        let spreading = of(method, psf, &circle, None);
        let result = spread(&mut [&mut plane], &spreading, &mut SpreadBuffers::default(), &cancel);
        let late = raised.join().unwrap().elapsed();
        assert_eq!(result, Err(Error::Cancelled));
        // The promise is 50 ms; a loaded machine may hold the thread itself back, so ten times that are allowed.
        assert!(late < Duration::from_millis(500), "{method:?} {psf:?} went on for {late:?}");
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    let (circle, other) = (scenes::constant(SIZE, 2.0), scenes::constant(Size::new(3, 3), 1.0));
    let refused = |spreading: Spread<'_>, mut plane: Plane| {
        spread(&mut [&mut plane], &spreading, &mut SpreadBuffers::default(), &Cancel::new()).unwrap_err()
    };
    let naive = of(Method::Naive, Psf::Gaussian, &circle, None);
    assert!(matches!(refused(naive, other.clone()), Error::SizeMismatch { .. }));
    let weighted = Spread { gamma: Some(&other), ..naive };
    assert!(matches!(refused(weighted, circle.clone()), Error::SizeMismatch { .. }));
    let none = Spread { method: Method::Diffusion, ..naive };
    assert!(matches!(refused(none, circle.clone()), Error::Unsupported { .. }));
}
