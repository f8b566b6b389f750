//! The tensor filter against its f64 reference, and what is its own.

use crate::spreading::tests::{SIZE, bits, blurred, decibels, of, sums};
use crate::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_core::tensor::{Gathering, Sites, Spreading, gathered};
use pullfocus_core::{Cancel, Error, Method, Plane, Psf, Size, Tensor};
use pullfocus_testkit::reference::spreading::normalised;
use pullfocus_testkit::reference::tensor::TensorFilter;
use pullfocus_testkit::{Grid, scenes};

const NAIVE: Tensor =
    Tensor { sites: Sites::Quadtree, spacing: 0.6, gather: Gathering::Naive, spread: Spreading::Naive };

/// Every choice of sites and steps.
fn all() -> impl Iterator<Item = Tensor> {
    [Sites::Quadtree, Sites::Skip].into_iter().flat_map(|sites| {
        let gathers = [Gathering::Naive, Gathering::Pyramid, Gathering::RepeatedIntegration];
        gathers.into_iter().flat_map(move |gather| {
            [Spreading::Naive, Spreading::Pyramid].map(|spread| Tensor {
                sites,
                gather,
                spread,
                ..Tensor::default()
            })
        })
    })
}

fn tensor<'a>(tensor: Tensor, circle: &'a Plane) -> Spread<'a> {
    Spread { tensor, ..of(Method::Tensor, Psf::Gaussian, circle, None) }
}

#[test]
fn every_choice_matches_the_f64_reference() {
    let values = scenes::noise(SIZE, 0.0, 3.0, 4);
    let matte = scenes::plane(SIZE, |x, y| (x.abs_diff(30) + y) as f32 / 60.0);
    let circles = [
        scenes::constant(SIZE, 27.0),
        scenes::plane(SIZE, |x, y| if (x / 9 + y / 7) % 3 == 0 { 0.3 } else { 0.71 * x as f32 - 3.0 }),
    ];
    for circle in &circles {
        for (vertical_scale, gamma) in [(0.6, None), (1.0, None), (1.0, Some(&matte)), (1.5, Some(&matte))] {
            for sites in [Sites::Quadtree, Sites::Skip] {
                let (diameter, x) = (Grid::from_plane(circle), Grid::from_plane(&values));
                let (settings, scale) = (Tensor { sites, ..Tensor::default() }, f64::from(vertical_scale));
                let filter = TensorFilter { settings, diameter: &diameter, vertical_scale: scale };
                let weights = gamma.map(Grid::from_plane);
                let expected = normalised(&x, weights.as_ref(), |values| filter.apply(values));
                for settings in all().filter(|settings| settings.sites == sites) {
                    let found =
                        blurred(&values, &Spread { vertical_scale, gamma, ..tensor(settings, circle) });
                    let error = expected.distance_to(&found) / 3.0;
                    let least = match (settings.gather, settings.spread, settings.sites) {
                        // Gaussians are cut at four deviations, 6e-5 of them.
                        (Gathering::Naive, Spreading::Naive, _) => 1e-4,
                        // Three boxes of 1 to 3 pixels are no Gaussian yet, and noise is made of such waves.
                        (Gathering::RepeatedIntegration, _, Sites::Skip) => 0.02,
                        (Gathering::RepeatedIntegration, _, Sites::Quadtree) => 0.006,
                        // The pyramid's Gaussians have their moments, not each value.
                        _ => 5e-3,
                    };
                    assert!(error < least, "{settings:?} {vertical_scale}: {error:e}");
                }
            }
        }
    }
}

/// Third paper, figure 6: with one size of circle, an average for every cell of a smaller picture, enlarged again.
#[test]
fn an_even_blur_is_down_sampling_and_up_sampling() {
    let size = Size::new(96, 64);
    let values = scenes::noise(size, 0.0, 1.0, 8);
    let circle = scenes::constant(size, 70.0);
    // 0.6 of a deviation of 17.5 px, rounded down to a power of two.
    let (distance, variance) = (8usize, 306.25);
    let steps = [gathered(variance, 8.0), variance - gathered(variance, 8.0)];
    // One axis of the smaller picture, with eight cells beyond either end: rows of weights over pixels.
    let axis = |length: usize, variance: f64| -> Vec<Vec<f64>> {
        let cells = length as isize / distance as isize;
        let norm = (2.0 * std::f64::consts::PI * variance).sqrt();
        let weight = |cell: isize, x: usize| {
            let d = x as f64 - (cell as f64 + 0.5) * distance as f64 + 0.5;
            (-0.5 * d * d / variance).exp() / norm
        };
        (-8..cells + 8).map(|cell| (0..length).map(|x| weight(cell, x)).collect()).collect()
    };
    let [down, up] = steps.map(|variance| (axis(size.width, variance), axis(size.height, variance)));
    let resample = |values: &Grid| {
        let small: Vec<Vec<f64>> = down
            .1
            .iter()
            .map(|wy| {
                let row =
                    |x: usize| (0..size.height).map(|y| wy[y] * values.data[y * size.width + x]).sum::<f64>();
                let row: Vec<f64> = (0..size.width).map(row).collect();
                down.0.iter().map(|wx| wx.iter().zip(&row).map(|(w, v)| w * v).sum()).collect()
            })
            .collect();
        Grid::from_fn(size.width, size.height, |x, y| {
            let row = |(row, wy): (&Vec<f64>, &Vec<f64>)| {
                wy[y] * row.iter().zip(&up.0).map(|(v, wx)| v * wx[x]).sum::<f64>()
            };
            small.iter().zip(&up.1).map(row).sum()
        })
    };
    let expected = normalised(&Grid::from_plane(&values), None, resample);
    for (settings, least) in [(NAIVE, 1e-4), (Tensor::default(), 2e-3)] {
        let error = expected.distance_to(&blurred(&values, &tensor(settings, &circle)));
        // The cut at four deviations; the pyramid's own Gaussians.
        assert!(error < least, "{settings:?}: {error:e}");
    }
}

/// The variance of a point's blur is that of every other method, whatever it lies beside.
#[test]
fn points_have_the_disc_s_variance() {
    let size = Size::new(260, 250);
    for (settings, vertical_scale, c) in
        all().flat_map(|s| [(s, 1.0, 30.0), (s, 1.0, 44.0), (s, 0.7, 44.0), (s, 1.4, 22.0)])
    {
        let circle = scenes::constant(size, c);
        let mut found = [0.0; 3];
        // A cell's worth of places: one alone sees the sites' pattern.
        let places: Vec<(usize, usize)> = (0..4).map(|i| (124 + 3 * i, 121 + 5 * i)).collect();
        for &(x, y) in &places {
            let point = scenes::plane(size, |px, py| if (px, py) == (x, y) { 1.0 } else { 0.0 });
            let [sum, _] = sums(&point, &Spread { vertical_scale, ..tensor(settings, &circle) });
            for (i, value) in sum.data().iter().enumerate() {
                let at = [(i % size.width) as f64 - x as f64, (i / size.width) as f64 - y as f64];
                for (found, moment) in found.iter_mut().zip([1.0, at[0] * at[0], at[1] * at[1]]) {
                    *found += f64::from(*value) * moment / places.len() as f64;
                }
            }
        }
        let t = f64::from(c * c) / 16.0;
        let down = t * f64::from(vertical_scale).powi(2);
        // Four places are not all of a cell's; the cut at four deviations takes 1e-3. Two boxes' mixture ripples.
        let least = if settings.gather == Gathering::RepeatedIntegration { 0.1 } else { 0.02 };
        let errors = [found[0] - 1.0, found[1] / t - 1.0, found[2] / down - 1.0];
        assert!(errors.iter().all(|e| e.abs() < least), "{settings:?} {vertical_scale} {c}: {errors:?}");
    }
}

#[test]
fn an_even_blur_is_the_naive_gaussian_to_the_borders() {
    let size = Size::new(200, 140);
    let hdr = scenes::plane(size, |x, y| if (x * 31 + y * 17) % 997 == 0 { 2000.0 } else { 0.5 });
    let pictures = [scenes::noise(size, 0.0, 1.0, 3), scenes::checker(size, 20), hdr];
    for c in [0.7, 3.4, 7.3, 11.0, 13.4, 19.0, 23.0, 50.0, 120.0] {
        let circle = scenes::constant(size, c);
        for picture in &pictures {
            let naive = blurred(picture, &of(Method::Naive, Psf::Gaussian, &circle, None));
            // The pyramid's 50 dB, and what two halves of it leave.
            let found = decibels(&naive, &blurred(picture, &tensor(Tensor::default(), &circle)));
            assert!(found > 50.0, "{c}: {found} dB");
            let found = decibels(&naive, &blurred(picture, &tensor(NAIVE, &circle)));
            // Beside the largest of the result, where naive spreading's lattice and a sampled Gaussian differ by 1 / 8 v of the peak.
            assert!(found > 54.0, "{c}, naive steps: {found} dB");
        }
    }
}

/// The known limit of skip levels (third paper, 6.1), and its cure.
#[test]
fn skip_levels_miss_small_things_and_quadtrees_do_not() {
    let size = Size::new(120, 90);
    let thing = |x: usize, y: usize| x.abs_diff(61) < 3 && y.abs_diff(43) < 3;
    let values = scenes::plane(size, |x, y| if thing(x, y) { 1.0 } else { 0.1 });
    // A skip level of 12: no multiple of it lies in rows 41 to 45.
    let circle = scenes::plane(size, |x, y| if thing(x, y) { 80.0 } else { 0.0 });
    let naive = blurred(&values, &of(Method::Naive, Psf::Gaussian, &circle, None));
    let of_sites = |sites| blurred(&values, &tensor(Tensor { sites, ..Tensor::default() }, &circle));
    assert_eq!(
        bits(&of_sites(Sites::Skip)),
        bits(&values),
        "the thing has no site, and stays as sharp as it was"
    );
    // Every pixel of the thing has a site of its own, which spreads as naive spreading does, and beyond it sharp pixels outweigh all that arrives.
    let found = decibels(&naive, &of_sites(Sites::Quadtree));
    assert!(found > 60.0 && naive != values, "{found}");
}

#[test]
fn constants_keep_every_bit_at_any_size_and_with_any_circle() {
    for size in [Size::new(1, 1), Size::new(2, 3), Size::new(33, 1), Size::new(23, 14)] {
        let odd = scenes::plane(size, |x, y| match (x * 5 + y * 3) % 97 {
            0 => f32::NAN,
            1 => f32::NEG_INFINITY,
            2 => 1e30,
            3 => -9.0,
            n => n as f32 * 0.7,
        });
        let matte = scenes::plane(size, |x, y| if (x + y) % 3 == 0 { 0.0 } else { 0.4 });
        let values = scenes::noise(size, -2.0, 65504.0, 3);
        for circle in [&odd, &scenes::constant(size, 31.0), &scenes::constant(size, f32::INFINITY)] {
            for settings in all() {
                for (gamma, vertical_scale) in [(None, 3.0), (Some(&matte), 0.3)] {
                    let spreading = Spread { gamma, vertical_scale, ..tensor(settings, circle) };
                    let even = scenes::constant(size, 0.7);
                    assert_eq!(blurred(&even, &spreading), even, "{settings:?} {size}");
                    let range = |v: &f32| (-2.0..=65504.0).contains(v);
                    assert!(blurred(&values, &spreading).data().iter().all(range), "{settings:?} {size}");
                }
            }
        }
        let zero = scenes::constant(size, 0.0);
        for settings in all() {
            assert_eq!(
                bits(&blurred(&values, &tensor(settings, &zero))),
                bits(&values),
                "{settings:?} {size}"
            );
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let size = Size::new(230, 170);
    let values = scenes::noise(size, 0.0, 1.0, 3);
    let circle = scenes::plane(size, |x, y| if (x / 50 + y / 35) % 2 == 0 { 2.0 } else { 0.2 * x as f32 });
    for settings in all() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            bits(&pool.install(|| blurred(&values, &tensor(settings, &circle))))
        };
        assert!(on(1) == on(3), "{settings:?}");
    }
}

/// A light, black around it: sums of the third order, of 1e15 and more, leave nothing behind.
#[test]
fn repeated_integration_leaves_no_streaks() {
    let size = Size::new(300, 200);
    let light = scenes::plane(size, |x, y| if (x, y) == (77, 41) { 65504.0 } else { 0.0 });
    let circle = scenes::constant(size, 30.0);
    let settings =
        Tensor { gather: Gathering::RepeatedIntegration, spread: Spreading::Naive, ..Tensor::default() };
    let [sum, _] = sums(&light, &tensor(settings, &circle));
    // A blur of 30 px reaches 60 px at most.
    let far =
        (0..size.area()).filter(|i| (i % size.width).abs_diff(77) > 60 || (i / size.width).abs_diff(41) > 60);
    let left: Vec<f32> = far.map(|i| sum.data()[i]).filter(|v| *v != 0.0).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_raised_flag_cancels_and_odd_settings_are_refused() {
    let circle = scenes::constant(SIZE, 20.0);
    let run = |settings, cancel: &Cancel| {
        let mut plane = scenes::noise(SIZE, 0.0, 1.0, 3);
        spread(&mut [&mut plane], &tensor(settings, &circle), &mut SpreadBuffers::default(), cancel)
    };
    let raised = Cancel::new();
    raised.cancel();
    for settings in all() {
        assert_eq!(run(settings, &raised), Err(Error::Cancelled));
        let odd = Tensor { spacing: 0.0, ..settings };
        assert!(matches!(run(odd, &Cancel::new()), Err(Error::Setting { .. })));
    }
}
