//! The spreading methods against their f64 references, and what each keeps.

use super::*;
use pullfocus_core::ApertureShape;
use pullfocus_core::aperture::Mask;
use pullfocus_testkit::reference::spreading::{Shape, Spreading, normalised};
use pullfocus_testkit::{Grid, scenes};
use std::time::Duration;

pub const SIZE: Size = Size { width: 61, height: 43 };

/// Apertures of every kind.
fn apertures() -> Vec<Aperture> {
    let ramp = (0..12).map(|i| if i == 3 { 0.0 } else { i as f32 }).collect();
    let image = ApertureShape::Image(Mask::new(4, 3, ramp).unwrap());
    vec![
        Aperture::DISC,
        Aperture::blades(5, 10.0),
        Aperture { roundness: 0.3, squeeze: 1.7, ..Aperture::blades(8, 0.0) },
        Aperture { squeeze: 0.6, ..Aperture::DISC },
        Aperture { shape: image.clone(), ..Aperture::DISC },
        Aperture { shape: image, rotation_degrees: 70.0, squeeze: 1.3, ..Aperture::DISC },
    ]
}

/// With a disc, where the method takes the aperture.
pub fn of<'a>(method: Method, psf: Psf, circle: &'a Plane, gamma: Option<&'a Plane>) -> Spread<'a> {
    Spread {
        method,
        psf,
        aperture: &Aperture::DISC,
        quality: Quality::Standard,
        mipmap: Mipmap::Linear,
        tensor: Tensor::default(),
        circle,
        gamma,
        vertical_scale: 1.0,
    }
}

/// Every method with every PSF that it has.
fn all() -> impl Iterator<Item = (Method, Psf)> {
    let methods = Method::ALL.into_iter().filter(|method| *method != Method::Diffusion);
    methods.flat_map(|method| {
        let psfs = [Psf::Gaussian, Psf::Aperture].into_iter();
        psfs.filter(move |psf| psf.check(method).is_ok()).map(move |psf| (method, psf))
    })
}

pub fn blurred(plane: &Plane, spreading: &Spread<'_>) -> Plane {
    let mut plane = plane.clone();
    spread(&mut [&mut plane], spreading, &mut SpreadBuffers::default(), &Cancel::new()).unwrap();
    plane
}

/// The sums before they are divided, and the weight.
pub fn sums(plane: &Plane, spreading: &Spread<'_>) -> [Plane; 2] {
    let mut outputs = [plane.clone(), plane.clone()];
    let [sum, weight] = &mut outputs;
    add_up(&[plane], spreading, &mut [sum, weight], &mut MethodBuffers::default(), &Cancel::new()).unwrap();
    outputs
}

pub fn bits(plane: &Plane) -> Vec<u32> {
    plane.data().iter().map(|value| value.to_bits()).collect()
}

/// Naive spreading and gathering beside their reference; the largest error, in parts of the values' range.
fn brute_error(shape: Shape<'_>, vertical_scale: f32, gamma: Option<&Plane>) -> f64 {
    let circle =
        scenes::plane(SIZE, |x, y| if (x / 9 + y / 7) % 3 == 0 { 0.3 } else { 0.25 * x as f32 - 3.0 });
    let values = scenes::noise(SIZE, 0.0, 3.0, 4);
    let (diameter, x) = (Grid::from_plane(&circle), Grid::from_plane(&values));
    let reference = Spreading { shape, diameter: &diameter, vertical_scale: f64::from(vertical_scale) };
    let weights = gamma.map(Grid::from_plane);
    let spread = normalised(&x, weights.as_ref(), |values| reference.spread(values));
    let gathered = normalised(&x, weights.as_ref(), |values| reference.gather(values));
    let (psf, aperture) = match shape {
        Shape::Aperture(aperture) => (Psf::Aperture, aperture),
        _ => (Psf::Gaussian, &Aperture::DISC),
    };
    let error = |method, expected: &Grid| {
        let spreading = Spread { vertical_scale, aperture, ..of(method, psf, &circle, gamma) };
        expected.distance_to(&blurred(&values, &spreading)) / 3.0
    };
    error(Method::Naive, &spread).max(error(Method::Gather, &gathered))
}

#[test]
fn naive_and_gather_match_the_f64_reference() {
    let matte = scenes::plane(SIZE, |x, y| (x.abs_diff(30) + y) as f32 / 60.0);
    let apertures = apertures();
    let shapes: Vec<_> = [Shape::Gaussian].into_iter().chain(apertures.iter().map(Shape::Aperture)).collect();
    for shape in shapes {
        for vertical_scale in [0.6, 1.0, 1.5] {
            for gamma in [None, Some(&matte)] {
                let error = brute_error(shape, vertical_scale, gamma);
                // Gaussians are mixed from a table: 5e-4 of the peak for each axis. Others have f32's rounding.
                let least = if shape == Shape::Gaussian { 1e-3 } else { 2e-5 };
                assert!(error < least, "{shape:?}, {vertical_scale}: {error:e}");
            }
        }
    }
}

#[test]
fn square_matches_the_f64_reference() {
    let values = scenes::noise(SIZE, 0.0, 3.0, 4);
    let matte = scenes::plane(SIZE, |x, y| (x.abs_diff(30) + y) as f32 / 60.0);
    let circles = [
        scenes::plane(SIZE, |x, y| if (x / 9 + y / 7) % 3 == 0 { 0.3 } else { 0.5 * x as f32 - 3.0 }),
        // From nothing to far beyond the picture, pixel by pixel.
        scenes::noise(SIZE, 0.0, 90.0, 5),
    ];
    for circle in &circles {
        for vertical_scale in [0.6, 1.0, 1.5] {
            for gamma in [None, Some(&matte)] {
                let (diameter, x) = (Grid::from_plane(circle), Grid::from_plane(&values));
                let scale = f64::from(vertical_scale);
                let reference =
                    Spreading { shape: Shape::Square, diameter: &diameter, vertical_scale: scale };
                let weights = gamma.map(Grid::from_plane);
                let expected = normalised(&x, weights.as_ref(), |values| reference.spread(values));
                let square = Spread { vertical_scale, ..of(Method::Square, Psf::Gaussian, circle, gamma) };
                let error = expected.distance_to(&blurred(&values, &square)) / 3.0;
                // Sides and results are rounded to f32.
                assert!(error < 5e-6, "{vertical_scale}: {error:e}");
            }
        }
    }
}

/// Lights of half's largest, in a black picture: beyond their squares running sums come back to nothing.
#[test]
fn lights_leave_no_streaks_behind_squares() {
    let size = Size::new(900, 300);
    let light = |x: usize, y: usize| x % 200 == 77 && y % 90 == 41;
    let lights = scenes::plane(size, |x, y| if light(x, y) { 65504.0 } else { 0.0 });
    let circle = scenes::plane(size, |x, _| 0.37 + (x % 7) as f32 * 2.9);
    let [sum, weight] = sums(&lights, &of(Method::Square, Psf::Gaussian, &circle, None));
    // 17.8 px of circle have a side of 15.4.
    let far = |x: usize, y: usize| (x % 200).abs_diff(77) > 9 || (y % 90).abs_diff(41) > 9;
    let pixels = (0..size.area()).map(|i| (i % size.width, i / size.width));
    let worst = pixels.filter(|(x, y)| far(*x, *y)).map(|(x, y)| (sum.at(x, y) / weight.at(x, y)).abs());
    let worst = worst.fold(0.0, f32::max);
    // 1e-16 of 65504 for each of the running sum's steps; f32 would leave hundredths.
    assert!(worst < 1e-7, "{worst:e}");
}

/// 20 log10 of the reference's largest value over the root of the mean square of the difference.
pub fn decibels(a: &Plane, b: &Plane) -> f64 {
    let (a, b) = (Grid::from_plane(a), Grid::from_plane(b));
    let difference = a.zip(&b, |a, b| (a - b).powi(2)).sum() / a.data.len() as f64;
    10.0 * (a.largest().powi(2) / difference).log10()
}

#[test]
fn the_pyramid_is_the_naive_gaussian() {
    let size = Size::new(200, 140);
    let hdr = scenes::plane(size, |x, y| if (x * 31 + y * 17) % 997 == 0 { 2000.0 } else { 0.5 });
    let pictures = [scenes::noise(size, 0.0, 1.0, 3), scenes::checker(size, 20), hdr];
    let mut circles: Vec<Plane> =
        [0.7, 2.0, 3.4, 5.0, 7.3, 11.0, 16.0, 23.0, 50.0, 120.0].map(|c| scenes::constant(size, c)).into();
    circles.push(scenes::ramp(size, 0.0, 40.0));
    circles.push(scenes::plane(size, |x, y| if (x / 50 + y / 35) % 2 == 0 { 2.0 } else { 30.0 }));
    for (i, circle) in circles.iter().enumerate() {
        for picture in &pictures {
            let naive = blurred(picture, &of(Method::Naive, Psf::Gaussian, circle, None));
            for (quality, least) in [(Quality::Standard, 50.0), (Quality::Fine, 55.0)] {
                let pyramid = Spread { quality, ..of(Method::Pyramid, Psf::Gaussian, circle, None) };
                let found = decibels(&naive, &blurred(picture, &pyramid));
                // Beside the largest value of the result, not of the picture.
                assert!(found > least, "{quality:?}, circles {i}: {found} dB");
            }
        }
    }
}

/// Sum, place and variance of one point's PSF, wherever it lies in the cells and whichever levels share it.
#[test]
fn the_pyramid_s_points_have_their_moments() {
    let size = Size::new(230, 210);
    for vertical_scale in [1.0, 0.7, 1.4] {
        for c in [0.0, 0.6, 2.0, 4.3, 6.1, 8.0, 9.7, 13.0, 17.0, 25.0, 39.0] {
            for (x, y) in [(115, 105), (116, 99), (121, 110)] {
                let point = scenes::plane(size, |px, py| if (px, py) == (x, y) { 1.0 } else { 0.0 });
                let circle = scenes::constant(size, c);
                let pyramid = Spread { vertical_scale, ..of(Method::Pyramid, Psf::Gaussian, &circle, None) };
                let [sum, weight] = sums(&point, &pyramid);
                let moment = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
                    let at =
                        |i: usize| ((i % size.width) as f64 - x as f64, (i / size.width) as f64 - y as f64);
                    sum.data().iter().enumerate().map(|(i, v)| f64::from(*v) * f(at(i).0, at(i).1)).sum()
                };
                let t = f64::from(c * c) / 16.0;
                let down = t * f64::from(vertical_scale).powi(2);
                let errors = [
                    moment(&|_, _| 1.0) - 1.0,
                    moment(&|x, _| x),
                    moment(&|_, y| y),
                    (moment(&|x, _| x * x) - t) / (t + 0.01),
                    (moment(&|_, y| y * y) - down) / (down + 0.01),
                    f64::from(weight.at(x, y)) - 1.0,
                ];
                // Weights are f32, some thousand of them; the last is the lattice's ripple, 2e-5 for each axis.
                assert!(errors.iter().all(|e| e.abs() < 2e-4), "{c} at {x}, {y}: {errors:?}");
            }
        }
    }
}

/// A blur that grows smoothly across an even slope shows no grid and no step: second differences stay those of the naive
/// Gaussian.
#[test]
fn the_pyramid_shows_no_grid_and_no_steps() {
    let size = Size::new(420, 150);
    let waves = scenes::plane(size, |x, y| 0.5 + 0.4 * (0.02 * x as f32).sin() + 0.001 * y as f32);
    let circle = scenes::ramp(size, 0.0, 60.0);
    let naive = blurred(&waves, &of(Method::Naive, Psf::Gaussian, &circle, None));
    let pyramid = blurred(&waves, &of(Method::Pyramid, Psf::Gaussian, &circle, None));
    let second = |plane: &Plane| {
        let rows = (0..size.height).map(|y| plane.row(y));
        let across = rows.flat_map(|row| row.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()));
        let columns = (1..size.height - 1).flat_map(|y| (0..size.width).map(move |x| (x, y)));
        let down =
            columns.map(|(x, y)| (plane.at(x, y - 1) - 2.0 * plane.at(x, y) + plane.at(x, y + 1)).abs());
        across.chain(down).fold(0.0, f32::max)
    };
    let (smooth, found) = (second(&naive), second(&pyramid));
    // The waves' own curvature is 1.6e-4; an eye sees steps of 1e-3.
    assert!(found < smooth + 1e-4, "{found:e} beside {smooth:e}");
}

/// A blur that grows across edges and a chirp: what the default errs by has second differences far below what is seen. With one
/// level alone, a circle that comes to the next one moves the picture at once.
#[test]
fn between_levels_the_default_goes_over_smoothly() {
    let size = Size::new(420, 150);
    let pattern = scenes::plane(size, |x, y| {
        let chirp = 0.5 + 0.4 * (14.0 * (20.0 + x as f32).ln()).sin();
        if y < 75 { chirp } else { f32::from(y < 110) }
    });
    let growing = scenes::ramp(size, 0.0, 60.0);
    fn with(mipmap: Mipmap, circle: &Plane) -> Spread<'_> {
        Spread { mipmap, ..of(Method::Pyramid, Psf::Gaussian, circle, None) }
    }
    let naive = blurred(&pattern, &of(Method::Naive, Psf::Gaussian, &growing, None));
    let second = |mipmap| {
        let pyramid = blurred(&pattern, &with(mipmap, &growing));
        let error = Grid::from_plane(&pyramid).zip(&Grid::from_plane(&naive), |a, b| a - b);
        let rows = error.data.chunks(size.width).flat_map(|row| row.windows(3));
        rows.map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).fold(0.0, f64::max)
    };
    // By how much a picture moves while an even circle grows by a thousandth of itself, where the level changes: variance
    // 0.5625 on the next one.
    let change = |mipmap| {
        let largest = |level: i32| {
            let variance = 4f64.powi(level) * (9.0 / 16.0) + 1.25 * (4f64.powi(level) - 1.0) / 3.0;
            let at = |part: f64| {
                let circle = scenes::constant(size, (part * 4.0 * variance.sqrt()) as f32);
                Grid::from_plane(&blurred(&pattern, &with(mipmap, &circle)))
            };
            at(0.9995).distance_to(&at(1.0005).to_plane())
        };
        (1..4).map(largest).fold(0.0, f64::max)
    };
    // An eye sees second differences of 1e-3; naive spreading's own are larger than that.
    let (smooth, jumping) = (second(Mipmap::Linear), second(Mipmap::Nearest));
    assert!(smooth < 5e-4 && jumping > 1e-3, "{smooth:e} and {jumping:e}");
    // Naive spreading moves by 5e-4 for a thousandth of growth (a wave of 0.4 loses its height within one octave of blur).
    let (smooth, jumping) = (change(Mipmap::Linear), change(Mipmap::Nearest));
    assert!(smooth < 1e-3 && jumping > 5e-3, "{smooth:e} and {jumping:e}");
}

#[test]
fn gathering_is_the_transpose_of_spreading() {
    let circle = scenes::ramp(SIZE, -4.0, 15.0);
    let (a, b) = (scenes::noise(SIZE, 0.0, 1.0, 1), scenes::noise(SIZE, 0.0, 1.0, 2));
    let product = |a: &Plane, b: &Plane| Grid::from_plane(a).zip(&Grid::from_plane(b), |a, b| a * b).sum();
    let mut shapes = vec![(Psf::Gaussian, Aperture::DISC)];
    shapes.extend(apertures().into_iter().map(|aperture| (Psf::Aperture, aperture)));
    for (psf, aperture) in &shapes {
        let spreading = |method| Spread { aperture, ..of(method, *psf, &circle, None) };
        let [spread, _] = sums(&a, &spreading(Method::Naive));
        let [gathered, _] = sums(&b, &spreading(Method::Gather));
        let (one, other) = (product(&spread, &b), product(&a, &gathered));
        // Sums of some thousand f32.
        assert!((one / other - 1.0).abs() < 1e-5, "{psf:?} {aperture:?}: {one} {other}");
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
        // The promise is 50 ms; a loaded machine holds the threads back, and what is not cut goes on for many seconds.
        assert!(late < Duration::from_secs(2), "{method:?} {psf:?} went on for {late:?}");
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
