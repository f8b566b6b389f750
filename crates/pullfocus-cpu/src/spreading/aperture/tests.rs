//! The aperture at constant cost: what it is, and how close to naive spreading of the same shape.

use super::Shapes;
use crate::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_core::{Aperture, Cancel, Error, Method, Plane, Psf, Size};
use pullfocus_testkit::reference::spreading::{Shape, Spreading, normalised};
use pullfocus_testkit::{Grid, scenes};

fn of<'a>(method: Method, aperture: &'a Aperture, circle: &'a Plane) -> Spread<'a> {
    let psf = if method == Method::Aperture { Psf::Gaussian } else { Psf::Aperture };
    Spread { aperture, ..crate::spreading::tests::of(method, psf, circle, None) }
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
    let buffers = &mut Shapes::default();
    super::add_up(&[plane], spreading, &mut [sum, weight], buffers, &Cancel::new()).unwrap();
    outputs
}

/// PSNR in dB beside the largest value of the second.
fn decibels(a: &Plane, b: &Plane) -> f64 {
    let peak = b.data().iter().fold(0.0f32, |most, value| most.max(*value));
    let pairs = a.data().iter().zip(b.data());
    let squares: f64 = pairs.map(|(a, b)| f64::from((a - b) / peak).powi(2)).sum();
    -10.0 * (squares / a.data().len() as f64 + 1e-20).log10()
}

fn apertures() -> [Aperture; 5] {
    [
        Aperture::DISC,
        Aperture::blades(3, 20.0),
        Aperture::blades(5, 0.0),
        Aperture { roundness: 0.4, ..Aperture::blades(6, 11.0) },
        Aperture { squeeze: 2.0, ..Aperture::DISC },
    ]
}

#[test]
fn it_is_the_area_of_the_aperture_on_each_pixel() {
    let size = Size::new(37, 27);
    let values = scenes::noise(size, 0.0, 3.0, 4);
    let matte = scenes::plane(size, |x, y| (x.abs_diff(18) + y) as f32 / 60.0);
    let circle =
        scenes::plane(size, |x, y| if (x / 9 + y / 7) % 3 == 0 { 0.3 } else { 0.5 * x as f32 - 9.0 });
    for aperture in &apertures() {
        for vertical_scale in [0.6, 1.0, 1.5] {
            for gamma in [None, Some(&matte)] {
                let (diameter, x) = (Grid::from_plane(&circle), Grid::from_plane(&values));
                let scale = f64::from(vertical_scale);
                let shape = Shape::Covered(aperture);
                let reference = Spreading { shape, diameter: &diameter, vertical_scale: scale };
                let weights = gamma.map(Grid::from_plane);
                let expected = normalised(&x, weights.as_ref(), |values| reference.spread(values)).to_plane();
                let spreading = Spread { vertical_scale, gamma, ..of(Method::Aperture, aperture, &circle) };
                let found = decibels(&blurred(&values, &spreading), &expected);
                // In a row, light ends at the mean of where it ends over the row's height: where the rim is flat, at the top and
                // the bottom and in sharp corners, pixels have more or less of it than they should (a disc: 52 dB, a triangle: 36
                // to 45). White noise shows all of that.
                assert!(found > 34.0, "{aperture:?} {vertical_scale}: {found}");
            }
        }
    }
}

#[test]
fn it_is_the_naive_aperture() {
    let size = Size::new(200, 150);
    let pictures = [
        ("noise", scenes::noise(size, 0.0, 1.0, 3)),
        ("checks", scenes::plane(size, |x, y| if (x / 20 + y / 20) % 2 == 0 { 1.0 } else { 0.1 })),
        ("lights", scenes::plane(size, |x, y| if x % 67 == 30 && y % 59 == 25 { 50.0 } else { 0.5 })),
    ];
    // The naive rim falls over a pixel along its own direction, this one is what of a pixel is covered: below some 10 pixels these
    // are two shapes.
    let mut circles: Vec<(f64, Plane)> = [(1.5, 26.0), (4.0, 43.0), (7.0, 41.0), (11.0, 44.0)]
        .into_iter()
        .chain([20.0, 47.0, 49.0, 95.0, 100.0].map(|c| (c, 47.0)))
        .map(|(c, least)| (least, scenes::constant(size, c)))
        .collect();
    circles.push((45.0, scenes::plane(size, |x, _| 0.35 * x as f32 - 5.0)));
    for aperture in [Aperture::DISC, Aperture { roundness: 0.4, ..Aperture::blades(6, 11.0) }] {
        for (name, picture) in &pictures {
            for (least, circle) in &circles {
                let naive = blurred(picture, &of(Method::Naive, &aperture, circle));
                let found = decibels(&blurred(picture, &of(Method::Aperture, &aperture, circle)), &naive);
                assert!(found > *least, "{aperture:?} {name} {}: {found}", circle.at(199, 75));
            }
        }
    }
}

#[test]
fn points_have_their_moments() {
    for aperture in &apertures() {
        for (c, vertical_scale) in
            [(3.0, 1.0), (30.0, 1.0), (49.0, 1.0), (-93.0, 1.0), (410.0, 1.0), (40.0, 0.5), (40.0, 2.0)]
        {
            let side = 2 * f32::abs(c) as usize * f32::max(vertical_scale, 1.0) as usize + 41;
            let size = Size::new(side, side);
            // Not where cells of any level begin.
            let (px, py) = (side / 2 + 1, side / 2 - 2);
            let point = scenes::plane(size, |x, y| if (x, y) == (px, py) { 1.0 } else { 0.0 });
            let circle = scenes::constant(size, c);
            let spreading = Spread { vertical_scale, ..of(Method::Aperture, aperture, &circle) };
            let [found, _] = sums(&point, &spreading);
            let moment = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
                let of = |i: usize| f((i % side) as f64 - px as f64, (i / side) as f64 - py as f64);
                found.data().iter().enumerate().map(|(i, v)| f64::from(*v) * of(i)).sum()
            };
            let energy = moment(&|_, _| 1.0);
            let (x, y) = (moment(&|x, _| x), moment(&|_, y| y));
            let (across, down) = (moment(&|x, _| x * x), moment(&|_, y| y * y));
            let wanted = f64::from(c * c) / 16.0;
            let (wide, high) =
                (wanted / aperture.squeeze.powi(2), wanted * f64::from(vertical_scale).powi(2));
            let what = format!("{aperture:?} {c} {vertical_scale}: {energy} {x} {y} {across} {down}");
            // Nothing leaves the picture; f32 adds up.
            assert!((energy - 1.0).abs() < 1e-4, "{what}");
            // A sixteenth of a cell at worst, in cells of 1/24 of the diameter; and what a corner within one row is mistaken for.
            let off = f64::from(c.abs()) / 24.0 / 16.0 + 0.15;
            assert!(x.abs() < off && y.abs() < off, "{what}");
            // Pixels add a twelfth of a squared pixel, or as much as that of small ones; a squeezed one's width is corrected for the
            // height.
            let near = |found: f64, wanted: f64| (found - wanted).abs() < 0.05 * wanted + 0.12;
            assert!(near(across, wide) && near(down, high), "{what}");
        }
    }
}

/// In front of focus a triangle points the other way.
#[test]
fn in_front_of_focus_the_aperture_is_turned_over() {
    let size = Size::new(121, 121);
    let point = scenes::plane(size, |x, y| if (x, y) == (60, 60) { 1.0 } else { 0.0 });
    let aperture = Aperture::blades(3, 17.0);
    for method in [Method::Aperture, Method::Naive] {
        let [front, back] =
            [-40.0, 40.0].map(|c| blurred(&point, &of(method, &aperture, &scenes::constant(size, c))));
        let turned = scenes::plane(size, |x, y| back.at(120 - x, 120 - y));
        let apart = |a: &Plane, b: &Plane| Grid::from_plane(a).distance_to(b);
        // A pixel of 40 px has a weight of 1 / 1000; f32.
        assert!(apart(&turned, &front) < 1e-8, "{method:?}: {:e}", apart(&turned, &front));
        assert!(apart(&back, &front) > 1e-4, "{method:?}");
    }
}

/// From level to level nothing steps: a point's image grows as evenly as its circle.
#[test]
fn levels_follow_each_other_without_a_jump() {
    let size = Size::new(260, 260);
    let picture = scenes::plane(size, |x, y| ((x as f32 * 0.21).sin() * (y as f32 * 0.17).cos()) * 0.5 + 0.5);
    let at = |c: f32| blurred(&picture, &of(Method::Aperture, &Aperture::DISC, &scenes::constant(size, c)));
    for level in [48.0f32, 96.0] {
        let step = 0.02 * level;
        let [a, b, c] = [level - step, level, level + step].map(at);
        let apart = |a: &Plane, b: &Plane| Grid::from_plane(a).distance_to(b);
        // As far as to the other side, and what the rim's softness makes of a waves' blur: an eye sees steps of 1e-3.
        assert!(apart(&b, &c) < apart(&a, &b) + 1e-3, "{level}: {:e} {:e}", apart(&b, &c), apart(&a, &b));
    }
}

#[test]
fn pictures_of_apertures_are_refused() {
    let mask = pullfocus_core::aperture::Mask::new(1, 1, vec![1.0]).unwrap();
    let aperture = Aperture { shape: pullfocus_core::ApertureShape::Image(mask), ..Aperture::DISC };
    let circle = scenes::constant(Size::new(4, 4), 2.0);
    let mut plane = circle.clone();
    let spreading = of(Method::Aperture, &aperture, &circle);
    let refused = spread(&mut [&mut plane], &spreading, &mut SpreadBuffers::default(), &Cancel::new());
    assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");
}

/// More planes than are drawn at a time.
#[test]
fn any_number_of_planes_is_blurred() {
    let size = Size::new(40, 30);
    let circle = scenes::ramp(size, -4.0, 15.0);
    let aperture = Aperture::blades(5, 3.0);
    let mut planes: Vec<Plane> = (0..19).map(|i| scenes::noise(size, 0.0, 2.0, i)).collect();
    let alone: Vec<Plane> =
        planes.iter().map(|plane| blurred(plane, &of(Method::Aperture, &aperture, &circle))).collect();
    let mut together: Vec<&mut Plane> = planes.iter_mut().collect();
    let spreading = of(Method::Aperture, &aperture, &circle);
    spread(&mut together, &spreading, &mut SpreadBuffers::default(), &Cancel::new()).unwrap();
    assert!(planes == alone);
}
