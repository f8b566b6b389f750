//! The layers' steps one by one.

use crate::device::with_host;
use pullfocus_core::split::{Census, Split, fast_asinh, knee, smoothstep, unit};
use pullfocus_core::{Plane, Size};
use pullfocus_gpu::Storage;
use pullfocus_gpu::inside::{self, Apart};
use pullfocus_testkit::random::Random;
use pullfocus_testkit::scenes;

/// Name and test.
pub fn tests() -> Vec<(&'static str, fn())> {
    vec![
        ("cuts_are_cores", cuts_are_cores),
        (
            "the_unblurred_layers_put_together_are_the_picture",
            the_unblurred_layers_put_together_are_the_picture,
        ),
        ("a_picture_in_focus_keeps_its_bits", a_picture_in_focus_keeps_its_bits),
        ("halves_blur_as_f32_does", halves_blur_as_f32_does),
        ("halves_keep_constants", halves_keep_constants),
    ]
}

/// Bars before a textured ramp: planes and diameters.
fn busy(size: Size, planes: usize) -> (Vec<Plane>, Plane) {
    let scene = scenes::fence_over_ramp(size, -14.0, 9.0);
    let mut all = scene.base.picture.colors;
    let mut random = Random::new(5);
    while all.len() < planes {
        all.push(Plane::from_fn(size, |_, _| random.between(0.0, 2.0) as f32).unwrap());
    }
    all.truncate(planes);
    (all, scene.base.distance.plane().clone())
}

/// The ramps that a split comes with are those of its cuts.
fn same_ramps(split: &Split, ramps: &[[f32; 4]]) {
    assert_eq!(ramps.len(), split.layers());
    for (layer, there) in ramps.iter().enumerate() {
        for u in [-3.0f32, -0.4, 0.0, 0.3, 2.0] {
            let step = |start: f32, slope: f32| smoothstep((u - start) * slope);
            let behind = step(there[0], there[1]);
            let seen = behind * (1.0 - step(there[2], there[3]));
            let expected = split.membership(layer, u);
            // A ramp's ends are sums of three f32 below 8, and its slope is at most some hundreds.
            assert!((seen - expected.seen).abs() < 1e-3 && (behind - expected.behind).abs() < 1e-3);
        }
    }
}

/// As the CPU's `layers::census` counts.
fn core_census(coc: &Plane, display_width: f32) -> Census {
    let Size { width, height } = coc.size();
    let position = |c: f32| fast_asinh(c / knee(display_width));
    let per_step = 1.0 / unit(display_width);
    let mut census = Census::default();
    for y in 0..height {
        for x in 0..width {
            let c = coc.at(x, y);
            census.pixel(position(c));
            let right = (x + 1 < width).then(|| coc.at(x + 1, y));
            let below = (y + 1 < height).then(|| coc.at(x, y + 1));
            for other in [right, below].into_iter().flatten() {
                census.pair(position(c), position(other), (c - other).abs() * per_step);
            }
        }
    }
    census
}

fn cuts_are_cores() {
    let context = with_host(|host| host.context().clone());
    let mut random = Random::new(11);
    let (mut worst, mut layers_seen) = (0.0f32, 0);
    for turn in 0..6 {
        let size = Size::new(130 + 41 * turn, 97 + 20 * turn);
        // Rectangles at depths of their own on a ramp, some of them rough.
        let (low, high) = (random.between(-60.0, 0.0), random.between(0.0, 40.0));
        let mut coc =
            Plane::from_fn(size, |x, _| (low + (high - low) * x as f64 / size.width as f64) as f32).unwrap();
        for _ in 0..2 + 2 * turn {
            let at = random.between(-80.0, 60.0);
            let rough = if random.unit() < 0.5 { 0.0 } else { 3.0 };
            let (x0, y0) = (random.between(0.0, size.width as f64), random.between(0.0, size.height as f64));
            let (x1, y1) = (x0 + random.between(3.0, 80.0), y0 + random.between(3.0, 80.0));
            for y in y0 as usize..(y1 as usize).min(size.height) {
                for x in x0 as usize..(x1 as usize).min(size.width) {
                    coc.row_mut(y)[x] = (at + random.between(-rough, rough)) as f32;
                }
            }
        }
        let census = core_census(&coc, size.width as f32);
        for layers in [1, 2, 3, 5, 9, 16] {
            let expected = census.split(layers, size.width as f32);
            let (split, ramps) = inside::split(&context, &coc, layers as u32).expect("it is cut");
            same_ramps(&split, &ramps);
            assert_eq!(split.layers(), expected.layers(), "{turn} {layers}: {split:?} {expected:?}");
            assert_eq!(split.knee, expected.knee);
            layers_seen += split.layers();
            for (cut, expected) in split.cuts.iter().zip(&expected.cuts) {
                let off = [cut.at - expected.at, cut.half - expected.half, cut.overlap - expected.overlap];
                worst = off.iter().fold(worst, |worst, off| worst.max(off.abs()));
                // A few parts in 1e7 of u (below 8) in positions and weights; k-means makes them larger.
                assert!(off.iter().all(|off| off.abs() < 1e-5), "{turn} {layers}: {cut:?} {expected:?}");
            }
        }
    }
    assert!(layers_seen > 100, "{layers_seen}");
    eprintln!("cuts differ by at most {worst:e} in u");
}

fn the_unblurred_layers_put_together_are_the_picture() {
    let context = with_host(|host| host.context().clone());
    for (size, count, layers) in
        [(Size::new(150, 61), 3, 5), (Size::new(67, 40), 4, 3), (Size::new(66, 30), 9, 16)]
    {
        let (planes, coc) = busy(size, count);
        let run = |most_bytes: u64, storage: Storage| {
            let apart = Apart { planes: &planes, coc: &coc, layers, storage };
            inside::apart_and_together(&context, &apart, most_bytes).expect("it is put together")
        };
        let whole = run(1 << 27, Storage::Full);
        // In bands of a few rows it is the same, to the bit: no value depends on what lies beside it in a buffer.
        let row = 16 * u64::from(layers) * (1 + count.div_ceil(4) as u64) * size.width as u64;
        assert!(run(6 * row, Storage::Full) == whole, "{size} {count} {layers}");
        for (storage, result, tolerance) in [
            // Sums of some products of numbers below 2 in f32.
            (Storage::Full, whole, 4e-6),
            // Three roundings to eleven bits: the picture, its layers, their sum.
            (Storage::Half, run(1 << 27, Storage::Half), 3.0 * 2.0f32.powi(-10)),
        ] {
            for (p, (expected, got)) in planes.iter().zip(&result).enumerate() {
                for (i, (x, y)) in expected.data().iter().zip(got.data()).enumerate() {
                    assert!((x - y).abs() <= tolerance, "{storage:?} plane {p} at {i}: {x} {y}");
                }
            }
        }
    }
}

fn a_picture_in_focus_keeps_its_bits() {
    let context = with_host(|host| host.context().clone());
    let size = Size::new(70, 33);
    let (planes, coc) = busy(size, 4);
    for (in_focus, kept) in [(true, true), (false, false)] {
        let apart = Apart { planes: &planes, coc: &coc, layers: 3, storage: Storage::Full };
        let largest = if in_focus { 0.0 } else { 50.0 };
        let result = inside::blurred(&context, &apart, largest).expect("it is blurred");
        assert_eq!(result == planes, kept, "{in_focus}");
    }
}

fn halves_blur_as_f32_does() {
    let context = with_host(|host| host.context().clone());
    let size = Size::new(120, 70);
    let (planes, coc) = busy(size, 4);
    let [full, half] = [Storage::Full, Storage::Half].map(|storage| {
        let apart = Apart { planes: &planes, coc: &coc, layers: 5, storage };
        inside::blurred(&context, &apart, 50.0).expect("it is blurred")
    });
    for (p, (full, half)) in full.iter().zip(&half).enumerate() {
        for (i, (x, y)) in full.data().iter().zip(half.data()).enumerate() {
            // Roundings to eleven bits of numbers below 4: the picture, its layers, two of the fields between rows and
            // columns at a time, the blurred layers.
            assert!((x - y).abs() <= 4.0 * 5.0 * 2.0f32.powi(-12), "plane {p} at {i}: {x} {y}");
        }
    }
}

fn halves_keep_constants() {
    let context = with_host(|host| host.context().clone());
    let size = Size::new(140, 90);
    let (_, coc) = busy(size, 1);
    let values = [0.7, 3.0, 1e-3, 1.0];
    let planes: Vec<Plane> = values.iter().map(|&value| scenes::constant(size, value)).collect();
    let apart = Apart { planes: &planes, coc: &coc, layers: 5, storage: Storage::Half };
    let result = inside::blurred(&context, &apart, 50.0).expect("it is blurred");
    for (value, plane) in values.iter().zip(&result) {
        for x in plane.data() {
            // Roundings to eleven bits, 2^-11 of a value each: of colour and of coverage, before and after the blur.
            assert!((x / value - 1.0).abs() <= 4.0 * 2.0f32.powi(-11), "{value} becomes {x}");
        }
    }
}
