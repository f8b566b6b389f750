//! The measures against other people's programs, on small pictures made of whole numbers.
//!
//! FLIP's figures are those of the published tool (Python package flip-evaluator 1.7, its defaults: 67 pixels
//! per degree); PSNR and SSIM are float64 formulas with numpy and scipy. `published_values.py` beside this file
//! makes the pictures again and prints the numbers.

use pullfocus_core::{Plane, Size};
use pullfocus_metrics::{Error, flip, flip_at, psnr, ssim};

/// A pixel's 8-bit value, modulo 256, at column x and row y of channel c.
type Value = fn(i64, i64, i64) -> i64;

fn picture(size: [usize; 2], value: Value) -> [Plane; 3] {
    [0, 1, 2].map(|c| {
        Plane::from_fn(Size::new(size[0], size[1]), |x, y| {
            value(x as i64, y as i64, c).rem_euclid(256) as f32 / 255.0
        })
        .unwrap()
    })
}

fn noise(x: i64, y: i64, c: i64) -> i64 {
    ((x * 7919 + y * 104_729 + c * 1_299_709) ^ (x * y * 31)) >> 3
}

fn scene<const SHIFT: i64>(x: i64, y: i64, c: i64) -> i64 {
    let bars = if (x + SHIFT) / 6 % 2 == 0 { 40 + 50 * c } else { 200 - 60 * c };
    let ramp = (3 * x + 2 * y + 30 * c) % 256;
    let lamp = if (x - 40 - SHIFT).pow(2) + (y - 20).pow(2) < 30 { 255 } else { 0 };
    lamp.max(if y < 24 { bars } else { ramp })
}

struct Pair {
    name: &'static str,
    size: [usize; 2],
    reference: Value,
    test: Value,
    flip_mean: f64,
    /// FLIP at (0, 0), and at (2/3 width, 1/3 height), rounded down.
    flip_at: [f32; 2],
    psnr: f64,
    ssim: Option<f64>,
}

const PAIRS: &[Pair] = &[
    Pair {
        name: "bars, a ramp and a lamp, moved by two pixels",
        size: [64, 48],
        reference: scene::<0>,
        test: scene::<2>,
        flip_mean: 0.236678,
        flip_at: [0.156538, 0.310344],
        psnr: 15.576641,
        ssim: Some(0.592165),
    },
    Pair {
        name: "noise against other noise",
        size: [37, 29],
        reference: noise,
        test: |x, y, c| noise(x + 5, y + 3, c),
        flip_mean: 0.388848,
        flip_at: [0.716173, 0.716793],
        psnr: 7.747541,
        ssim: Some(-0.003566),
    },
    Pair {
        name: "green against blue",
        size: [24, 16],
        reference: |_, _, c| if c == 1 { 255 } else { 0 },
        test: |_, _, c| if c == 2 { 255 } else { 0 },
        flip_mean: 1.0,
        flip_at: [1.0, 1.0],
        psnr: 1.760913,
        ssim: Some(0.20002),
    },
    Pair {
        name: "a dark grey one step apart",
        size: [32, 20],
        reference: |_, _, _| 12,
        test: |_, _, _| 13,
        flip_mean: 0.025607,
        flip_at: [0.025607, 0.025607],
        psnr: 48.130804,
        ssim: Some(0.99687),
    },
    Pair {
        name: "narrower than the filters",
        size: [5, 3],
        reference: noise,
        test: scene::<0>,
        flip_mean: 0.863637,
        flip_at: [0.944073, 0.828903],
        psnr: 9.144198,
        ssim: None,
    },
    Pair {
        name: "two strips of rows",
        size: [20, 700],
        reference: scene::<0>,
        test: |x, y, c| scene::<0>(x, y, c) + (x + y) % 9 - 4,
        flip_mean: 0.088310,
        flip_at: [0.094668, 0.135651],
        psnr: 21.033278,
        ssim: Some(0.860034),
    },
];

#[test]
fn flip_agrees_with_the_published_tool() {
    for pair in PAIRS {
        let (reference, test) = (picture(pair.size, pair.reference), picture(pair.size, pair.test));
        let found = flip(&reference, &test).unwrap();
        // Both work in f32, and the tool sums the mean in f32 too: 1e-5 over these few pixels; a single pixel
        // may differ by some 1e-5 where the power of 0.5 or 0.7 is steep.
        assert!((found.mean - pair.flip_mean).abs() < 2e-5, "{}: mean {}", pair.name, found.mean);
        let at = [found.map.at(0, 0), found.map.at(pair.size[0] * 2 / 3, pair.size[1] / 3)];
        for (found, expected) in at.iter().zip(pair.flip_at) {
            assert!((found - expected).abs() < 5e-5, "{}: {at:?}", pair.name);
        }
    }
}

#[test]
fn psnr_and_ssim_agree_with_float64() {
    for pair in PAIRS {
        let (reference, test) = (picture(pair.size, pair.reference), picture(pair.size, pair.test));
        // f32 squares summed in f64: about 1e-7 relative, 4.3 times that in dB.
        assert!((psnr(&reference, &test).unwrap() - pair.psnr).abs() < 1e-5, "{}", pair.name);
        match pair.ssim {
            // f32 moments against C2 = 9e-4: 1e-7 / 9e-4.
            Some(expected) => {
                let found = ssim(&reference, &test).unwrap();
                assert!((found - expected).abs() < 1e-4, "{}: {found}", pair.name);
            }
            None => assert!(matches!(ssim(&reference, &test), Err(Error::TooSmall { .. }))),
        }
    }
}

#[test]
fn equal_pictures_do_not_differ() {
    let one = picture([40, 30], scene::<0>);
    let found = flip(&one, &one).unwrap();
    assert_eq!(found.mean, 0.0);
    assert!(found.map.data().iter().all(|&v| v == 0.0));
    assert_eq!(psnr(&one, &one).unwrap(), f64::INFINITY);
    assert!((ssim(&one, &one).unwrap() - 1.0).abs() < 1e-6);
}

#[test]
fn values_that_are_no_numbers_count_as_the_rule_says() {
    let mut odd = picture([40, 30], scene::<0>);
    let mut plain = odd.clone();
    for (i, value) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 7.0, -3.0].into_iter().enumerate() {
        odd[i % 3].row_mut(7)[11 + i] = value;
        // NaN as 0, all else clipped.
        plain[i % 3].row_mut(7)[11 + i] = [0.0, 1.0, 0.0, 1.0, 0.0][i];
    }
    let reference = picture([40, 30], scene::<2>);
    assert_eq!(flip(&reference, &odd).unwrap(), flip(&reference, &plain).unwrap());
    assert_eq!(psnr(&odd, &reference).unwrap(), psnr(&plain, &reference).unwrap());
    assert_eq!(ssim(&odd, &reference).unwrap(), ssim(&plain, &reference).unwrap());
}

#[test]
fn figures_are_the_same_for_any_number_of_threads() {
    let (a, b) = (picture([70, 600], scene::<0>), picture([70, 600], noise));
    let all = || (flip(&a, &b).unwrap(), psnr(&a, &b).unwrap(), ssim(&a, &b).unwrap());
    let with = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(all);
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let (a, b) = (picture([4, 3], noise), picture([3, 4], noise));
    for error in [flip(&a, &b).unwrap_err(), psnr(&a, &b).unwrap_err(), ssim(&a, &b).unwrap_err()] {
        assert!(matches!(error, Error::Core(pullfocus_core::Error::SizeMismatch { .. })));
    }
    let empty = picture([0, 7], noise);
    assert_eq!(flip(&empty, &empty), Err(Error::Empty));
    assert_eq!(psnr(&empty, &empty), Err(Error::Empty));
    for value in [f32::NAN, 0.0, -67.0, 1e9] {
        assert!(matches!(flip_at(&a, &a, value), Err(Error::PixelsPerDegree { .. })));
    }
}
