//! Sprites against their f64 reference.

use super::*;
use pullfocus_core::aperture::Mask;
use pullfocus_core::{ApertureShape, Cancel, Size};
use pullfocus_testkit::reference::bokeh as reference;
use pullfocus_testkit::{Grid as Values, scenes};

const SIZE: Size = Size { width: 61, height: 43 };

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

/// One light in the middle of what would be dark, of 900 and half of that.
fn light(x: usize, y: usize) -> [Plane; 3] {
    [900.0, 450.0, 90.0].map(|value| scenes::plane(SIZE, |i, j| if (i, j) == (x, y) { value } else { 0.25 }))
}

/// What is left of `planes`, and the sprites.
fn spread(planes: &[Plane], circle: &Plane, look: &Look<'_>, seen: Shown<'_>) -> (Vec<Plane>, Vec<Plane>) {
    let mut stays = planes.to_vec();
    let mut lights = Lights::default();
    let cancel = Cancel::new();
    let mut colors: Vec<&mut Plane> = stays.iter_mut().collect();
    lights.take_out(&mut colors, circle, &look.bokeh, look.display_width, &cancel).unwrap();
    let mut sprites = vec![scenes::constant(circle.size(), 0.0); planes.len()];
    lights.add(&mut sprites.iter_mut().collect::<Vec<_>>(), look, seen, &cancel).unwrap();
    (stays, sprites)
}

fn sum(plane: &Plane) -> f64 {
    plane.data().iter().map(|v| f64::from(*v)).sum()
}

#[test]
fn sprites_match_the_f64_reference() {
    for aperture in apertures() {
        for (pixel_aspect, cats_eye) in [(1.0, 0.0), (1.0, 1.0), (1.6, 0.5), (0.5, 0.0)] {
            for (x, y, c) in
                // Points in the last and the first row of a band among them.
                [
                    (30, 21, 12.3),
                    (50, 8, -9.0),
                    (4, 40, 21.0),
                    (33, 20, 2.2),
                    (28, 30, -0.7),
                    (28, 31, 0.4),
                    (28, 32, -0.4),
                    (0, 0, 5.0),
                ]
            {
                let frame = Frame { pixel_aspect, ..Frame::full(SIZE) };
                let bokeh = Bokeh { cats_eye, ..Bokeh::default() };
                let look = Look::new(&frame, bokeh, &aperture);
                let circle = scenes::constant(SIZE, c);
                let planes = light(x, y);
                let (stays, sprites) = spread(&planes, &circle, &look, Shown::All);
                let colors: Vec<Values> = planes.iter().map(Values::from_plane).collect();
                let circles = Values::from_plane(&circle);
                let (left, excess) = reference::take_out(&colors, &circles, &bokeh, &frame);
                let expected = reference::sprites(&excess, &circles, &bokeh, &aperture, &frame, None);
                for p in 0..3 {
                    assert!(left[p].distance_to(&stays[p]) < 1e-4 * 900.0);
                    let peak = expected[p].largest();
                    let error = expected[p].distance_to(&sprites[p]) / peak;
                    // Counting 24 x 24 points errs by a twentieth where a rim runs along them; a slice's ends are a parabola's,
                    // and around a corner of an iris or of a cat's eye off by as much.
                    assert!(error < 0.1, "{aperture:?}, {pixel_aspect}, {cats_eye}, {c}: {error}");
                    let (found, light) = (sum(&sprites[p]), expected[p].sum());
                    // Few points lie across small sprites, and a pixel of a picture that is cut counts as even.
                    let within = if f32::abs(c) < 6.0 { 0.05 } else { 0.02 };
                    let off = (found / light - 1.0).abs();
                    assert!(off < within, "{aperture:?}, {cats_eye}, {c}: {found} {light}");
                }
            }
        }
    }
}

#[test]
fn energy_is_kept() {
    for aperture in apertures() {
        for c in [0.2, 1.0, 1.9, 2.5, -7.7, 20.0] {
            let look =
                Look::new(&Frame::full(SIZE), Bokeh { least_diameter: 0.1, ..Bokeh::default() }, &aperture);
            let planes = light(30, 21);
            let (stays, sprites) = spread(&planes, &scenes::constant(SIZE, c), &look, Shown::All);
            for p in 0..3 {
                let (before, after) = (sum(&planes[p]), sum(&stays[p]) + sum(&sprites[p]));
                // Each of up to 1000 values is rounded to f32, and the factor.
                assert!((after / before - 1.0).abs() < 2e-6, "{aperture:?}, {c}: {}", after / before - 1.0);
            }
        }
    }
}

/// A sprite that grows by a hundredth of a pixel changes no pixel by more than its rim can: nothing pops.
#[test]
fn sprites_grow_evenly() {
    for aperture in apertures() {
        let of = |c: f32| {
            let look =
                Look::new(&Frame::full(SIZE), Bokeh { least_diameter: 0.0, ..Bokeh::default() }, &aperture);
            spread(&light(30, 21)[..1], &scenes::constant(SIZE, c), &look, Shown::All).1.swap_remove(0)
        };
        let mut last = of(0.3);
        for i in 1..500 {
            let next = of(0.3 + 0.01 * i as f32);
            let peak = last.data().iter().copied().fold(0.0, f32::max);
            let step = last.data().iter().zip(next.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // A rim moves by 0.005 times its shape's reach, squeezed, and the brightness by 2 / c of a hundredth.
            assert!(step / peak < 0.03, "{aperture:?}: {step} of {peak} at {i}");
            last = next;
        }
    }
}

#[test]
fn one_layer_hides_what_is_behind_sharper_things() {
    let frame = Frame::full(SIZE);
    let look = Look::new(&frame, Bokeh { least_diameter: 0.5, ..Bokeh::default() }, &Aperture::DISC);
    let circle = scenes::plane(SIZE, |x, y| match x {
        0..22 => -18.0,
        22..28 => 0.1 * y as f32,
        _ => 17.0 - 0.1 * x as f32,
    });
    let planes = light(31, 21);
    let mut front = circle.clone();
    front.data_mut()[21 * 61 + 31] = -15.0;
    for circle in [circle, front] {
        let (_, sprites) = spread(&planes, &circle, &look, Shown::ByCircle(&circle));
        let colors: Vec<Values> = planes.iter().map(Values::from_plane).collect();
        let own = Values::from_plane(&circle);
        let circles = reference::circles(&colors, &own);
        let (_, excess) = reference::take_out(&colors, &circles, &look.bokeh, &frame);
        let expected =
            reference::sprites(&excess, &circles, &look.bokeh, &Aperture::DISC, &frame, Some(&own));
        for (expected, sprites) in expected.iter().zip(&sprites) {
            let error = expected.distance_to(sprites) / expected.largest();
            // As above.
            assert!(error < 0.1, "{error}");
        }
    }
}

#[test]
fn nothing_is_left_beside_a_light() {
    let size = Size::new(300, 20);
    let planes = [scenes::plane(size, |x, y| if (x, y) == (100, 9) { 65504.0 } else { 0.0 })];
    let circle = scenes::constant(size, 33.0);
    let look = Look::new(&Frame::full(size), Bokeh::default(), &Aperture::DISC);
    let (_, sprites) = spread(&planes, &circle, &look, Shown::All);
    for y in 0..20 {
        assert!((0..300).filter(|x| !(83..=117).contains(x)).all(|x| sprites[0].at(x, y).to_bits() == 0));
        assert!((89..=111).all(|x| sprites[0].at(x, y) > 1.0));
    }
}
