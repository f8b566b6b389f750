//! Checks of a backend's diffusion. Each panics with what differs.

use super::{DiffusionSubject, Medium, bits, on_threads};
use crate::grid::Grid;
use crate::random::Random;
use crate::reference;
use crate::scenes;
use pullfocus_core::diffusion::{Calibration, Diffusion, Integrator, JacobiStop, Solver};
use pullfocus_core::response::Rational;
use pullfocus_core::{Cancel, Error, Plane, Size};
use std::time::{Duration, Instant};

/// Largest error of an exact solver in f32, in parts of the largest value: elimination by row sums has no
/// subtraction, so each value carries a few dozen roundings of 6e-8 whatever the length; measured 3.5e-6 and less
/// over 1920 pixels, and up to 16 steps follow each other.
pub const EXACT: f64 = 2e-5;

/// The same for [`Integrator::Disc`]: its terms are some 14 times as large as their sum.
pub const EXACT_DISC: f64 = 8e-5;

/// The bound that belongs to these settings.
pub fn exact(settings: &Diffusion) -> f64 {
    if settings.integrator == Integrator::Disc { EXACT_DISC } else { EXACT }
}

/// Backward Euler once and four times, the rational integrator, the disc.
const INTEGRATORS: [Integrator; 4] = [
    Integrator::BackwardEuler { steps: 1 },
    Integrator::BackwardEuler { steps: 4 },
    Integrator::Rational(Rational::GAUSSIAN),
    Integrator::Disc,
];

/// The solvers that are exact.
const EXACT_SOLVERS: [Solver; 4] =
    [Solver::Lu, Solver::CyclicReduction, Solver::ParallelCyclicReduction, Solver::Hybrid];

fn exact_settings() -> impl Iterator<Item = Diffusion> {
    INTEGRATORS.into_iter().flat_map(|integrator| {
        EXACT_SOLVERS.map(|solver| Diffusion { integrator, solver, ..Diffusion::default() })
    })
}

fn all_settings() -> impl Iterator<Item = Diffusion> {
    let jacobi = INTEGRATORS.map(|integrator| Diffusion {
        integrator,
        solver: Solver::Jacobi(JacobiStop::Sweeps(7)),
        ..Diffusion::default()
    });
    exact_settings().chain(jacobi)
}

fn run(
    subject: &mut impl DiffusionSubject,
    planes: &[Plane],
    medium: Medium<'_>,
    settings: &Diffusion,
) -> Vec<Plane> {
    let mut planes = planes.to_vec();
    subject.diffuse(&mut planes, medium, settings, &Cancel::new()).expect("the diffusion runs");
    planes
}

/// Circles of -20 to 30 px, a quarter of them 0, and edges between.
fn circles(size: Size, seed: u64) -> Plane {
    let mut random = Random::new(seed);
    let mut current = 0.0;
    scenes::plane(size, |_, _| {
        if random.unit() < 0.15 {
            current = if random.unit() < 0.25 { 0.0 } else { random.between(-20.0, 30.0) };
        }
        current as f32
    })
}

/// Compares with the reference and panics with the settings.
fn compare(
    subject: &mut impl DiffusionSubject,
    planes: &[Plane],
    medium: Medium<'_>,
    settings: &Diffusion,
    tolerance: f64,
) {
    let result = run(subject, planes, medium, settings);
    let diameter = Grid::from_plane(medium.diameter);
    let gamma = medium.gamma.map(Grid::from_plane);
    for (before, after) in planes.iter().zip(&result) {
        let x = Grid::from_plane(before);
        let scale = f64::from(medium.vertical_scale);
        let expected = reference::diffuse(&x, &diameter, gamma.as_ref(), scale, settings);
        let error = expected.distance_to(after) / x.largest().max(1e-30);
        assert!(error <= tolerance, "{} with {settings:?} errs by {error:e}", before.size());
    }
}

/// Every exact setting against the f64 reference, with and without gamma, square pixels and others.
pub fn matches_the_f64_reference(subject: &mut impl DiffusionSubject) {
    let size = Size::new(101, 67);
    let planes = [scenes::noise(size, -0.5, 4.0, 1), scenes::checker(size, 7), scenes::point(size, 100.0)];
    let diameter = circles(size, 2);
    let gamma = scenes::noise(size, 0.05, 1.0, 3);
    for settings in exact_settings() {
        for calibration in [Calibration::Variance, Calibration::Kass, Calibration::Beck] {
            let settings = Diffusion { calibration, ..settings };
            compare(subject, &planes, Medium::plain(&diameter), &settings, exact(&settings));
            let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 0.5 };
            compare(subject, &planes, medium, &settings, exact(&settings));
        }
    }
}

/// Jacobi is the same approximation as in f64 at the same count, far from the solution as it may be.
pub fn matches_f64_jacobi_sweep_by_sweep(subject: &mut impl DiffusionSubject) {
    let size = Size::new(61, 40);
    let planes = [scenes::checker(size, 5), scenes::noise(size, 0.0, 3.0, 4)];
    let diameter = circles(size, 5);
    let gamma = scenes::noise(size, 0.05, 1.0, 6);
    for sweeps in [1, 2, 3, 10, 41] {
        for integrator in INTEGRATORS {
            let solver = Solver::Jacobi(JacobiStop::Sweeps(sweeps));
            let settings = Diffusion { integrator, solver, calibration: Calibration::Beck };
            let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 1.0 };
            // Each sweep is a weighted mean: errors do not grow, so the exact solvers' bound holds here too.
            compare(subject, &planes, medium, &settings, exact(&settings));
        }
    }
}

/// With a tolerance Jacobi ends near the solution.
pub fn jacobi_reaches_its_tolerance(subject: &mut impl DiffusionSubject) {
    let size = Size::new(48, 31);
    let planes = [scenes::checker(size, 6)];
    let diameter = scenes::constant(size, 5.0);
    let solver = Solver::Jacobi(JacobiStop::Tolerance(1e-6));
    for integrator in INTEGRATORS {
        let settings = Diffusion { integrator, solver, ..Diffusion::default() };
        let result = run(subject, &planes, Medium::plain(&diameter), &settings);
        let exact = Diffusion { integrator, ..Diffusion::default() };
        let expected = reference::diffuse(
            &Grid::from_plane(&planes[0]),
            &Grid::from_plane(&diameter),
            None,
            1.0,
            &exact,
        );
        // beta = 25/32: a sweep leaves 0.61 of the error, so the last change, 1e-6, is followed by 1.6e-6 more per axis
        // and step (4 steps at most); the complex systems' rates are alike, the disc's terms 14 times their sum. Twice
        // that for f32.
        let error = expected.distance_to(&result[0]);
        assert!(error < 1e-4, "{integrator:?} ends {error:e} from the solution");
    }
}

/// All sizes from 1 x 1 to 9 x 9, and widths around the blocks that vectors and threads make.
pub fn every_small_size_matches(subject: &mut impl DiffusionSubject) {
    let small = (1..=9).flat_map(|w| (1..=9).map(move |h| Size::new(w, h)));
    let around = [15, 16, 17, 31, 32, 33, 63, 64, 65, 127, 129];
    let wide = around.into_iter().flat_map(|n| [Size::new(n, 3), Size::new(3, n), Size::new(n, 1)]);
    for size in small.chain(wide) {
        let planes = [scenes::noise(size, 0.0, 1.0, 8), scenes::noise(size, 0.0, 1.0, 9)];
        let diameter = circles(size, (size.width * 1000 + size.height) as u64);
        for settings in all_settings() {
            compare(subject, &planes, Medium::plain(&diameter), &settings, exact(&settings));
        }
    }
}

/// Lines of 1920 with circles of up to 7680 px, where plain elimination in f32 errs by parts in a hundred.
pub fn long_lines_with_large_circles_stay_exact(subject: &mut impl DiffusionSubject) {
    for size in [Size::new(1920, 5), Size::new(5, 1920)] {
        for (c, heat) in [(50.0, 1e-3), (500.0, 1.0), (7680.0, 1.0)] {
            let diameter = scenes::constant(size, c);
            let gamma = scenes::plane(size, |x, y| if (x + y) % 400 < 40 { 1.0 } else { heat });
            for settings in exact_settings() {
                let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 1.0 };
                compare(subject, &[scenes::constant(size, 0.7)], medium, &settings, exact(&settings));
                compare(subject, &[scenes::checker(size, 100)], medium, &settings, 4.0 * exact(&settings));
            }
        }
    }
}

/// A constant stays, whatever the circles and heats: every row of the system sums to gamma.
pub fn constants_are_kept(subject: &mut impl DiffusionSubject) {
    let size = Size::new(77, 50);
    let diameter = circles(size, 10);
    let gamma = scenes::noise(size, 0.001, 1.0, 11);
    for settings in all_settings() {
        for gamma in [None, Some(&gamma)] {
            let medium = Medium { diameter: &diameter, gamma, vertical_scale: 1.3 };
            let result = run(subject, &[scenes::constant(size, 0.7)], medium, &settings);
            let error = Grid::filled(77, 50, f64::from(0.7f32)).distance_to(&result[0]);
            assert!(error < exact(&settings), "{settings:?} moves a constant by {error:e}");
        }
    }
}

/// The sum of gamma times the picture stays: borders are insulated.
pub fn heat_is_kept(subject: &mut impl DiffusionSubject) {
    let size = Size::new(83, 59);
    let x = scenes::noise(size, 0.0, 3.0, 12);
    let diameter = circles(size, 13);
    let gamma = scenes::noise(size, 0.05, 1.0, 14);
    let heat = |plane: &Plane| Grid::from_plane(plane).zip(&Grid::from_plane(&gamma), |y, g| y * g).sum();
    for settings in exact_settings() {
        let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 1.0 };
        let result = run(subject, std::slice::from_ref(&x), medium, &settings);
        let (before, after) = (heat(&x), heat(&result[0]));
        // The mean of 4897 values, each within the bound.
        assert!((after / before - 1.0).abs() < exact(&settings), "{settings:?}: {before} became {after}");
    }
}

/// In the gamma-weighted product one axis is self-adjoint: `<A x, y> = <x, A y>`, along rows and along columns.
pub fn one_axis_is_self_adjoint(subject: &mut impl DiffusionSubject) {
    for size in [Size::new(150, 1), Size::new(1, 150)] {
        let (x, y) = (scenes::noise(size, -1.0, 1.0, 15), scenes::noise(size, -1.0, 1.0, 16));
        let diameter = circles(size, 17);
        let gamma = scenes::noise(size, 0.05, 1.0, 18);
        let product = |a: &Plane, b: &Plane| {
            let values = a.data().iter().zip(b.data()).zip(gamma.data());
            values.map(|((a, b), g)| f64::from(*a) * f64::from(*b) * f64::from(*g)).sum::<f64>()
        };
        for settings in exact_settings() {
            let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 1.0 };
            let result = run(subject, &[x.clone(), y.clone()], medium, &settings);
            let (left, right) = (product(&result[0], &y), product(&x, &result[1]));
            // Sums of 150 values of size 0.3, each within the bound.
            assert!(
                (left - right).abs() < 50.0 * exact(&settings),
                "{size} {settings:?}: {left} and {right}"
            );
        }
    }
}

/// Left and right, top and bottom are alike.
pub fn mirrored_in_mirrored_out(subject: &mut impl DiffusionSubject) {
    let size = Size::new(70, 45);
    let x = scenes::noise(size, 0.0, 1.0, 19);
    let diameter = circles(size, 20);
    let flipped = |p: &Plane| scenes::plane(size, |x, y| p.at(size.width - 1 - x, size.height - 1 - y));
    for settings in all_settings() {
        let plain = run(subject, std::slice::from_ref(&x), Medium::plain(&diameter), &settings);
        let mirrored = run(subject, &[flipped(&x)], Medium::plain(&flipped(&diameter)), &settings);
        let error = Grid::from_plane(&plain[0]).distance_to(&flipped(&mirrored[0]));
        assert!(error < exact(&settings), "{settings:?} differs by {error:e}");
    }
}

/// A point spreads to the variance of a disc, c^2 / 16 per axis, in every integrator.
pub fn has_the_variance_of_the_disc(subject: &mut impl DiffusionSubject) {
    let (size, c) = (Size::new(161, 161), 10.0f32);
    let diameter = scenes::constant(size, c);
    for settings in exact_settings() {
        let result = run(subject, &[scenes::point(size, 1.0)], Medium::plain(&diameter), &settings);
        let grid = Grid::from_plane(&result[0]);
        let across = Grid::from_fn(161, 161, |x, y| grid.at(x, y) * (x as f64 - 80.0).powi(2)).sum();
        let expected = f64::from(c * c) / 16.0;
        // Far values weigh up to 6400 times theirs: f32 rounding of the tail, which is below 1e-6 of the sum.
        assert!((across / expected - 1.0).abs() < 1e-3, "{settings:?}: {across} instead of {expected}");
    }
}

/// Backward Euler takes weighted means: nothing rises above the largest or falls below the smallest value.
pub fn stays_within_the_range(subject: &mut impl DiffusionSubject) {
    let size = Size::new(90, 64);
    let x = scenes::noise(size, 0.25, 0.75, 21);
    let diameter = circles(size, 22);
    let gamma = scenes::noise(size, 0.0, 1.0, 23);
    let backward_euler = |s: &Diffusion| matches!(s.integrator, Integrator::BackwardEuler { .. });
    for settings in all_settings().filter(backward_euler) {
        let medium = Medium { diameter: &diameter, gamma: Some(&gamma), vertical_scale: 1.0 };
        let result = run(subject, std::slice::from_ref(&x), medium, &settings);
        let within = |v: &f32| (0.25 - EXACT as f32..=0.75 + EXACT as f32).contains(v);
        assert!(result[0].data().iter().all(within), "{settings:?} leaves the range");
    }
}

/// Circles of 0 change nothing at all.
pub fn zero_blur_keeps_every_bit(subject: &mut impl DiffusionSubject) {
    for size in [Size::new(67, 41), Size::new(1, 1), Size::new(2, 3)] {
        let x = scenes::noise(size, -3.0, 1000.0, 24);
        let zero = scenes::constant(size, 0.0);
        for settings in all_settings() {
            let result = run(subject, std::slice::from_ref(&x), Medium::plain(&zero), &settings);
            assert_eq!(bits(&result[0]), bits(&x), "{size} {settings:?}");
        }
    }
}

/// A pixel whose own circle is 0 has no links and keeps its bits amid blurred ones.
pub fn pixels_in_focus_keep_every_bit(subject: &mut impl DiffusionSubject) {
    let size = Size::new(120, 75);
    let x = scenes::noise(size, 0.0, 9.0, 25);
    let diameter = circles(size, 26);
    for settings in all_settings() {
        let result = run(subject, std::slice::from_ref(&x), Medium::plain(&diameter), &settings);
        for ((before, after), c) in x.data().iter().zip(result[0].data()).zip(diameter.data()) {
            assert!(
                *c != 0.0 || before.to_bits() == after.to_bits(),
                "{settings:?}: {before} became {after}"
            );
        }
    }
}

/// Where gamma is 0 the value comes from where it is not; where a whole picture has none, there are numbers still.
pub fn holes_without_heat_are_filled(subject: &mut impl DiffusionSubject) {
    let size = Size::new(64, 48);
    let diameter = scenes::constant(size, 9.0);
    let hole = |x: usize, y: usize| (20..40).contains(&x) && (15..30).contains(&y);
    let x = scenes::plane(size, |x, y| if hole(x, y) { 50.0 } else { 0.25 });
    let gamma = scenes::plane(size, |x, y| if hole(x, y) { 0.0 } else { 1.0 });
    let rows = scenes::plane(size, |_, y| if y < 24 { 0.0 } else { 1.0 });
    let none = scenes::constant(size, 0.0);
    for settings in exact_settings() {
        let medium = |gamma| Medium { diameter: &diameter, gamma: Some(gamma), vertical_scale: 1.0 };
        let filled = run(subject, std::slice::from_ref(&x), medium(&gamma), &settings);
        let error = Grid::filled(64, 48, 0.25).distance_to(&filled[0]);
        // A floor for gamma lets a little of the 50 through; a thousandth of it could be seen.
        assert!(error < 0.05, "{settings:?}: the hole shows by {error}");
        for gamma in [&rows, &none] {
            let result = run(subject, std::slice::from_ref(&x), medium(gamma), &settings);
            let heat = matches!(settings.integrator, Integrator::BackwardEuler { .. });
            let slack = if heat { 0.01 } else { 5.0 };
            // Within the input's range, the negative lobes of the others aside (10 % of the hole's 50).
            let within = |v: &f32| (0.25 - slack..=50.0 + slack).contains(v);
            assert!(result[0].data().iter().all(within), "{settings:?}: rows without heat");
        }
    }
}

/// Large but finite colours over large circles and small ones give finite colours.
pub fn large_values_stay_finite(subject: &mut impl DiffusionSubject) {
    let size = Size::new(40, 30);
    for circle in [1e-30, 1e-6, 3.0, 8192.0] {
        let diameter = scenes::constant(size, circle);
        for value in [65504.0, 1e30] {
            let planes =
                [scenes::point(size, value), scenes::constant(size, -value), scenes::checker(size, 3)];
            for settings in all_settings() {
                let result = run(subject, &planes, Medium::plain(&diameter), &settings);
                let finite = result.iter().all(|plane| plane.data().iter().all(|v| v.is_finite()));
                assert!(finite, "{value} with circles of {circle} px, {settings:?}");
            }
        }
    }
}

/// Several planes in one call give what each gives alone.
pub fn planes_do_not_mix(subject: &mut impl DiffusionSubject) {
    let size = Size::new(53, 38);
    let planes: Vec<Plane> = (0..7).map(|seed| scenes::noise(size, 0.0, 1.0, 30 + seed)).collect();
    let diameter = circles(size, 40);
    for settings in all_settings() {
        let together = run(subject, &planes, Medium::plain(&diameter), &settings);
        for (plane, result) in planes.iter().zip(&together) {
            let alone = run(subject, std::slice::from_ref(plane), Medium::plain(&diameter), &settings);
            assert_eq!(bits(&alone[0]), bits(result), "{settings:?}");
        }
        assert!(run(subject, &[], Medium::plain(&diameter), &settings).is_empty());
    }
}

/// One, two, three and eight threads give the same bytes.
pub fn any_number_of_threads_gives_the_same_bytes(subject: &mut (impl DiffusionSubject + Send)) {
    let size = Size::new(203, 131);
    let planes = [scenes::noise(size, 0.0, 1.0, 41), scenes::noise(size, 0.0, 1.0, 42)];
    let diameter = circles(size, 43);
    for settings in all_settings() {
        let mut results = [1, 2, 3, 8].map(|threads| {
            on_threads(threads, || run(subject, &planes, Medium::plain(&diameter), &settings))
        });
        let first = std::mem::take(&mut results[0]);
        for other in &results[1..] {
            assert!(first.iter().zip(other).all(|(a, b)| bits(a) == bits(b)), "{settings:?}");
        }
    }
}

/// Buffers that stay from one size to the next leave no trace.
pub fn a_second_run_gives_the_same_bytes(subject: &mut impl DiffusionSubject) {
    let (small, large) = (Size::new(31, 57), Size::new(140, 90));
    let (a, b) = (scenes::noise(small, 0.0, 1.0, 44), scenes::noise(large, 0.0, 1.0, 45));
    let (ca, cb) = (circles(small, 46), circles(large, 47));
    for settings in all_settings() {
        let first = run(subject, std::slice::from_ref(&a), Medium::plain(&ca), &settings);
        run(subject, std::slice::from_ref(&b), Medium::plain(&cb), &settings);
        let again = run(subject, std::slice::from_ref(&a), Medium::plain(&ca), &settings);
        assert_eq!(bits(&first[0]), bits(&again[0]), "{settings:?}");
    }
}

/// A flag that is raised before the run stops it.
pub fn a_raised_flag_cancels(subject: &mut impl DiffusionSubject) {
    let size = Size::new(64, 64);
    let cancel = Cancel::new();
    cancel.cancel();
    let circle = scenes::constant(size, 4.0);
    for settings in all_settings() {
        let mut planes = [scenes::checker(size, 4)];
        let result = subject.diffuse(&mut planes, Medium::plain(&circle), &settings, &cancel);
        assert_eq!(result, Err(Error::Cancelled), "{settings:?}");
        assert_eq!(planes[0].size(), size, "the planes stay whole");
    }
}

/// The promise is 50 ms. A loaded machine holds the threads themselves back, by half a second and more where a software device
/// shares two processors with a compiler; what is not cut goes on for many seconds.
pub(super) const CANCELLED_WITHIN: Duration = Duration::from_secs(2);

/// Raises a flag after 30 ms and returns how long after that `work` ended.
pub(super) fn cancelled_after<T>(work: impl FnOnce(&Cancel) -> T) -> (T, Duration) {
    let cancel = Cancel::new();
    let flag = cancel.clone();
    let raised = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(30));
        flag.cancel();
        Instant::now()
    });
    let result = work(&cancel);
    let ended = Instant::now();
    let raised = raised.join().expect("the thread that raises the flag");
    (result, ended.saturating_duration_since(raised))
}

/// A flag raised during a long run stops it soon.
pub fn a_run_is_cancelled_from_outside(subject: &mut impl DiffusionSubject) {
    let size = Size::new(1024, 1024);
    let circle = scenes::constant(size, 60.0);
    let long = Diffusion { solver: Solver::Jacobi(JacobiStop::Sweeps(20_000)), ..Diffusion::default() };
    let many = Diffusion { integrator: Integrator::BackwardEuler { steps: 2000 }, ..Diffusion::default() };
    for settings in [long, many] {
        let mut planes = vec![scenes::checker(size, 16); 3];
        let (result, late) =
            cancelled_after(|cancel| subject.diffuse(&mut planes, Medium::plain(&circle), &settings, cancel));
        assert_eq!(result, Err(Error::Cancelled), "{settings:?}");
        assert!(late < CANCELLED_WITHIN, "{settings:?} went on for {late:?}");
    }
}

/// Settings outside their ranges, and planes that differ in size, are errors.
pub fn odd_settings_are_refused(subject: &mut impl DiffusionSubject) {
    let size = Size::new(8, 6);
    let circle = scenes::constant(size, 4.0);
    let refused = [
        Diffusion { integrator: Integrator::BackwardEuler { steps: 0 }, ..Diffusion::default() },
        Diffusion { integrator: Integrator::Rational(Rational { a: 0.0, b: 0.1 }), ..Diffusion::default() },
        Diffusion { solver: Solver::Jacobi(JacobiStop::Sweeps(0)), ..Diffusion::default() },
    ];
    for settings in refused {
        let mut planes = [scenes::checker(size, 2)];
        let result = subject.diffuse(&mut planes, Medium::plain(&circle), &settings, &Cancel::new());
        assert!(matches!(result, Err(Error::Setting { .. })), "{settings:?}: {result:?}");
    }
    let mut planes = [scenes::checker(Size::new(7, 6), 2)];
    let result = subject.diffuse(&mut planes, Medium::plain(&circle), &Diffusion::default(), &Cancel::new());
    assert!(matches!(result, Err(Error::SizeMismatch { .. })), "{result:?}");
}
