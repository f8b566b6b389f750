//! The solvers against a plain f64 elimination, and against what must hold whatever the numbers.

use super::*;
use pullfocus_core::Error;
use pullfocus_core::Integrator;
use pullfocus_core::diffusion::{Calibration, HYBRID_REST, JacobiStop};
use pullfocus_core::response::{DiscResponse, Rational};

/// Numbers in 0..1 that look random and are the same everywhere.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn plane(&mut self, size: Size, scale: f32) -> Plane {
        Plane::from_fn(size, |_, _| scale * self.next()).unwrap()
    }
}

const RATIONAL: Diffusion = Diffusion {
    calibration: Calibration::Variance,
    integrator: Integrator::Rational(Rational::GAUSSIAN),
    solver: Solver::Lu,
};
const DISC: Diffusion = Diffusion { integrator: Integrator::Disc, ..RATIONAL };
const EULER: Diffusion = Diffusion { integrator: Integrator::BackwardEuler { steps: 1 }, ..RATIONAL };

fn run(settings: &Diffusion, medium: &Medium<'_>, planes: &[Plane]) -> Vec<Plane> {
    run_with(settings, medium, planes, &mut DiffusionBuffers::new(), false)
}

fn run_with(
    settings: &Diffusion,
    medium: &Medium<'_>,
    planes: &[Plane],
    buffers: &mut DiffusionBuffers,
    floor: bool,
) -> Vec<Plane> {
    let mut out = planes.to_vec();
    let mut refs: Vec<&mut Plane> = out.iter_mut().collect();
    diffuse(&mut refs, medium, settings, floor, buffers, &Cancel::new()).unwrap();
    out
}

fn circle(plane: &Plane) -> Medium<'_> {
    Medium { conductivity: Conductivity::Circle(plane), gamma: None, vertical_scale: 1.0 }
}

type C = [f64; 2];
fn mul(a: C, b: C) -> C {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}
fn add(a: C, b: C) -> C {
    [a[0] + b[0], a[1] + b[1]]
}
fn div(a: C, b: C) -> C {
    let n = b[0] * b[0] + b[1] * b[1];
    let q = mul(a, [b[0], -b[1]]);
    [q[0] / n, q[1] / n]
}

/// `(K - p Gamma) v = Gamma x` by elimination with row sums, in complex f64.
fn resolvent(x: &[C], c: &[f64], gamma: &[f64], k: f64, p: C) -> Vec<C> {
    let n = x.len();
    let beta: Vec<f64> = (0..n.max(1) - 1).map(|i| k * c[i].abs().min(c[i + 1].abs()).powi(2)).collect();
    let own = |i: usize| [-p[0] * gamma[i], -p[1] * gamma[i]];
    let known = |i: usize| [gamma[i] * x[i][0], gamma[i] * x[i][1]];
    let (mut e, mut z): (Vec<C>, Vec<C>) = (vec![own(0)], vec![known(0)]);
    for i in 1..n {
        let b = beta[i - 1];
        let part = div([b, 0.0], [e[i - 1][0] + b, e[i - 1][1]]);
        e.push(add(own(i), mul(part, e[i - 1])));
        z.push(add(known(i), mul(part, z[i - 1])));
    }
    let mut y = vec![[0.0; 2]; n];
    for i in (0..n).rev() {
        let b = if i + 1 < n { beta[i] } else { 0.0 };
        let after = if i + 1 < n { y[i + 1] } else { [0.0; 2] };
        y[i] = div([z[i][0] + b * after[0], z[i][1] + b * after[1]], [e[i][0] + b, e[i][1]]);
    }
    y
}

/// [`resolvent`] along every row or column of a picture.
fn resolvents(x: &[C], size: Size, vertical: bool, medium: &Medium<'_>, k: f64, p: C) -> Vec<C> {
    let c: Vec<f64> = match medium.conductivity {
        Conductivity::Circle(plane) => plane.data().iter().map(|v| f64::from(*v)).collect(),
        Conductivity::Uniform(d) => vec![f64::from(d); size.area()],
    };
    let gamma: Vec<f64> = match medium.gamma {
        Some(plane) => plane.data().iter().map(|v| f64::from(v.max(1e-15))).collect(),
        None => vec![1.0; size.area()],
    };
    let (lines, n) = if vertical { (size.width, size.height) } else { (size.height, size.width) };
    let k = if vertical { k * f64::from(medium.vertical_scale).powi(2) } else { k };
    let mut out = vec![[0.0; 2]; x.len()];
    for line in 0..lines {
        let at = |i: usize| if vertical { i * size.width + line } else { line * size.width + i };
        let take = |from: &[f64]| (0..n).map(|i| from[at(i)]).collect::<Vec<_>>();
        let known: Vec<C> = (0..n).map(|i| x[at(i)]).collect();
        for (i, v) in resolvent(&known, &take(&c), &take(&gamma), k, p).into_iter().enumerate() {
            out[at(i)] = v;
        }
    }
    out
}

/// The whole of [`diffuse`] in f64, without solvers' approximations.
fn reference(settings: &Diffusion, medium: &Medium<'_>, plane: &Plane) -> Vec<f64> {
    let size = plane.size();
    let mut data: Vec<C> = plane.data().iter().map(|v| [f64::from(*v), 0.0]).collect();
    let k = f64::from(settings.calibration.factor());
    let (steps, pole, residue) = match settings.integrator {
        Integrator::BackwardEuler { steps } => (steps, [-1.0, 0.0], [0.5, 0.0]),
        Integrator::Rational(r) => r.pole().map(|p| (1, p.pole, p.residue)).unwrap(),
        Integrator::Disc => {
            let DiscResponse { poles, a, b } = DiscResponse::LENS;
            let fields = poles.map(|p| resolvents(&data, size, false, medium, k, p));
            let mut sum = vec![0.0; size.area()];
            for j in 0..2 {
                let mixed: Vec<C> = (0..size.area())
                    .map(|at| {
                        let term = |i: usize| {
                            let u: C = fields[i][at];
                            add(mul(a[i][j], u), mul(b[i][j], [u[0], -u[1]]))
                        };
                        add(term(0), term(1))
                    })
                    .collect();
                let solved = resolvents(&mixed, size, true, medium, k, poles[j]);
                sum.iter_mut().zip(solved).for_each(|(sum, v)| *sum += 2.0 * v[0]);
            }
            return sum;
        }
    };
    for _ in 0..steps {
        for vertical in [false, true] {
            data = resolvents(&data, size, vertical, medium, k / f64::from(steps), pole);
            data.iter_mut().for_each(|v| *v = [2.0 * mul(residue, *v)[0], 0.0]);
        }
    }
    data.into_iter().map(|v| v[0]).collect()
}

/// Largest difference, as a part of the largest value.
fn error(found: &Plane, expected: &[f64]) -> f64 {
    let largest = expected.iter().fold(0.0, |a: f64, b| a.max(b.abs())).max(1e-30);
    let worst = found
        .data()
        .iter()
        .zip(expected)
        .map(|(a, b)| (f64::from(*a) - b).abs())
        .fold(0.0, |a, b| if b.is_nan() { f64::INFINITY } else { f64::max(a, b) });
    worst / largest
}

/// The exact ones.
fn solvers() -> [Solver; 4] {
    [Solver::Lu, Solver::CyclicReduction, Solver::ParallelCyclicReduction, Solver::Hybrid]
}

fn solvers_and(jacobi: JacobiStop) -> impl Iterator<Item = Solver> {
    solvers().into_iter().chain([Solver::Jacobi(jacobi)])
}

fn integrators() -> [Integrator; 3] {
    [
        Integrator::BackwardEuler { steps: 1 },
        Integrator::BackwardEuler { steps: 3 },
        Integrator::Rational(Rational::GAUSSIAN),
    ]
}

/// Some tens of roundings of f32 (6e-8 each) add up along a line; numerics measured 3.5e-6 at 1920.
const CLOSE: f64 = 1e-5;

#[test]
fn every_small_size_agrees_with_f64() {
    let mut noise = Noise(1);
    for width in 1..=35 {
        for height in [1, 2, 3, 15, 16, 17, 33] {
            for (w, h) in [(width, height), (height, width), (2 * width, height)] {
                let size = Size::new(w, h);
                let c = noise.plane(size, 12.0);
                let gamma = noise.plane(size, 1.0);
                let plane = noise.plane(size, 1.0);
                let medium = Medium { gamma: Some(&gamma), vertical_scale: 1.5, ..circle(&c) };
                for integrator in integrators() {
                    for solver in solvers() {
                        let settings = Diffusion { integrator, solver, ..RATIONAL };
                        let out = run(&settings, &medium, std::slice::from_ref(&plane));
                        let error = error(&out[0], &reference(&settings, &medium, &plane));
                        assert!(error < CLOSE, "{size} {settings:?}: {error}");
                    }
                }
            }
        }
    }
}

#[test]
fn the_hybrid_is_parallel_for_what_is_left_and_halves_above() {
    let mut noise = Noise(12);
    for width in [HYBRID_REST, HYBRID_REST + 1] {
        let size = Size::new(width, 20);
        let (c, plane) = (noise.plane(size, 12.0), noise.plane(size, 1.0));
        let by = |solver| {
            run(&Diffusion { solver, ..RATIONAL }, &circle(&c), std::slice::from_ref(&plane)).swap_remove(0)
        };
        let hybrid = by(Solver::Hybrid);
        assert_eq!(hybrid == by(Solver::ParallelCyclicReduction), width == HYBRID_REST);
        assert_ne!(hybrid, by(Solver::CyclicReduction), "{width}");
    }
}

#[test]
fn any_number_of_planes_gives_what_each_gives_alone() {
    let mut noise = Noise(2);
    let size = Size::new(37, 29);
    let c = noise.plane(size, 30.0);
    let planes: Vec<Plane> = (0..9).map(|_| noise.plane(size, 1.0)).collect();
    for solver in solvers_and(JacobiStop::Sweeps(5)) {
        for integrator in integrators() {
            let settings = Diffusion { integrator, solver, ..RATIONAL };
            for count in 0..=9 {
                let out = run(&settings, &circle(&c), &planes[..count]);
                for (p, plane) in out.iter().enumerate() {
                    assert_eq!(*plane, run(&settings, &circle(&c), &planes[p..=p])[0], "{count} {p}");
                }
            }
        }
    }
}

#[test]
fn no_blur_is_the_identity_to_the_bit() {
    let mut noise = Noise(3);
    let size = Size::new(45, 38);
    let plane =
        Plane::from_fn(size, |_, _| (noise.next() - 0.5) * 10f32.powf(40.0 * noise.next() - 20.0)).unwrap();
    let gamma = Plane::from_fn(size, |x, _| if x % 3 == 0 { 0.0 } else { 0.3 }).unwrap();
    // Alone among sharp pixels, a blurred one has no link that conducts.
    let c = Plane::from_fn(size, |x, y| if (x + y) % 2 == 0 { 40.0 } else { 0.0 }).unwrap();
    for gamma in [None, Some(&gamma)] {
        for integrator in integrators() {
            for solver in solvers_and(JacobiStop::default()) {
                let settings = Diffusion { integrator, solver, ..RATIONAL };
                let medium = Medium { gamma, ..circle(&c) };
                let out = run(&settings, &medium, std::slice::from_ref(&plane));
                assert!(out[0].data().iter().zip(plane.data()).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
        }
    }
}

#[test]
fn constants_stay_in_wide_blurs_and_in_mattes() {
    let size = Size::new(1920, 3);
    let plane = Plane::filled(size, 0.7).unwrap();
    let hole = |floor: f32| Plane::from_fn(size, |x, _| if (300..1500).contains(&x) { floor } else { 1.0 });
    let mattes = [None, Some(hole(1e-3).unwrap()), Some(hole(1e-5).unwrap()), Some(hole(0.0).unwrap())];
    for c in [5.0, 50.0, 500.0] {
        for matte in &mattes {
            let medium =
                Medium { conductivity: Conductivity::Uniform(c), gamma: matte.as_ref(), vertical_scale: 1.0 };
            for integrator in integrators() {
                for solver in solvers() {
                    let settings = Diffusion { integrator, solver, ..RATIONAL };
                    let out = run(&settings, &medium, std::slice::from_ref(&plane));
                    // Means of equal values are those values.
                    assert!(out[0].data().iter().all(|v| (v - 0.7).abs() < 1e-6), "{c} {settings:?}");
                }
            }
        }
    }
}

#[test]
fn long_lines_agree_with_f64() {
    let mut noise = Noise(4);
    let size = Size::new(1920, 18);
    let plane = noise.plane(size, 1.0);
    let hole =
        Plane::from_fn(size, |x, _| if (300..1500).contains(&x) { 0.0 } else { noise.next() }).unwrap();
    for c in [0.5, 5.0, 50.0, 500.0, 5000.0] {
        for gamma in [None, Some(&hole)] {
            let medium = Medium { conductivity: Conductivity::Uniform(c), gamma, vertical_scale: 1.0 };
            for integrator in integrators() {
                for solver in solvers() {
                    let settings = Diffusion { integrator, solver, ..RATIONAL };
                    let out = run(&settings, &medium, std::slice::from_ref(&plane));
                    let error = error(&out[0], &reference(&settings, &medium, &plane));
                    // Across the hole the widest blur is a straight ramp of 1200 steps, each rounded by up to
                    // 3e-8 and all alike, in up to three integration steps.
                    let close = if c > 1000.0 { 1e-4 } else { CLOSE };
                    assert!(error < close, "{c} {} {settings:?}: {error}", gamma.is_some());
                }
            }
        }
    }
}

#[test]
fn light_is_conserved_where_gamma_is_one() {
    let mut noise = Noise(5);
    let size = Size::new(200, 60);
    let plane = noise.plane(size, 1.0);
    let c = noise.plane(size, 80.0);
    let sum = |p: &Plane| p.data().iter().map(|v| f64::from(*v)).sum::<f64>();
    for integrator in integrators() {
        for solver in solvers() {
            let settings = Diffusion { integrator, solver, ..RATIONAL };
            let out = run(&settings, &circle(&c), std::slice::from_ref(&plane));
            assert!((sum(&out[0]) / sum(&plane) - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn along_one_axis_the_operator_is_its_own_adjoint() {
    // <a, gamma S b> = <S a, gamma b> on single lines, where no second axis follows.
    let mut noise = Noise(6);
    for size in [Size::new(150, 1), Size::new(1, 150)] {
        let (a, b) = (noise.plane(size, 1.0), noise.plane(size, 1.0));
        let (c, gamma) = (noise.plane(size, 20.0), noise.plane(size, 1.0));
        let medium = Medium { gamma: Some(&gamma), ..circle(&c) };
        let dot = |a: &Plane, b: &Plane| -> f64 {
            (0..150)
                .map(|i| f64::from(a.data()[i]) * f64::from(gamma.data()[i]) * f64::from(b.data()[i]))
                .sum()
        };
        for settings in [EULER, RATIONAL, DISC] {
            let out = run(&settings, &medium, &[a.clone(), b.clone()]);
            let (left, right) = (dot(&a, &out[1]), dot(&out[0], &b));
            assert!((left / right - 1.0).abs() < 1e-6, "{left} {right}");
        }
    }
}

#[test]
fn a_value_without_weight_leaves_no_trace() {
    // A light of 6e4 in pixels that do not count: 1e-7 of it would already be 6e-3.
    let size = Size::new(600, 20);
    let hidden = |x: usize| x < 40 || (200..400).contains(&x);
    let gamma = Plane::from_fn(size, |x, _| if hidden(x) { 0.0 } else { 1.0 }).unwrap();
    let with = |value: f32| Plane::from_fn(size, |x, _| if hidden(x) { value } else { 0.01 }).unwrap();
    let medium =
        Medium { conductivity: Conductivity::Uniform(30.0), gamma: Some(&gamma), vertical_scale: 1.0 };
    for settings in [EULER, RATIONAL, DISC] {
        let out = run(&settings, &medium, &[with(6e4)]);
        let worst = out[0].data().iter().map(|v| (v - 0.01).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-7, "{settings:?} {worst}");
    }
}

#[test]
fn lines_without_any_weight_are_finite() {
    let size = Size::new(70, 40);
    let mut noise = Noise(7);
    let plane = noise.plane(size, 1.0);
    let gamma = Plane::from_fn(size, |x, y| if y < 20 && x > 3 { 0.0 } else { f32::from(y >= 20) }).unwrap();
    for c in [0.0, 1e-20, 1.0, 1e3, 1e6, 1e30] {
        let medium =
            Medium { conductivity: Conductivity::Uniform(c), gamma: Some(&gamma), vertical_scale: 1.0 };
        for integrator in integrators() {
            for solver in solvers_and(JacobiStop::Sweeps(9)) {
                let settings = Diffusion { integrator, solver, ..RATIONAL };
                let out = run(&settings, &medium, std::slice::from_ref(&plane));
                assert!(out[0].data().iter().all(|v| v.abs() < 3.0), "{c} {settings:?}");
            }
        }
    }
}

#[test]
fn jacobi_follows_equation_2_13_sweep_by_sweep() {
    let mut noise = Noise(8);
    let n = 90;
    let size = Size::new(n, 1);
    let (plane, c) = (noise.plane(size, 1.0), noise.plane(size, 9.0));
    for sweeps in [1, 2, 7] {
        let settings = Diffusion { solver: Solver::Jacobi(JacobiStop::Sweeps(sweeps)), ..EULER };
        let out = run(&settings, &circle(&c), std::slice::from_ref(&plane));
        let x: Vec<f64> = plane.data().iter().map(|v| f64::from(*v)).collect();
        let beta = |i: usize| f64::from(c.data()[i].min(c.data()[i + 1])).powi(2) / 32.0;
        let mut y = x.clone();
        for _ in 0..sweeps {
            y = (0..n)
                .map(|i| {
                    let (mut over, mut under) = (x[i], 1.0);
                    if i > 0 {
                        over += beta(i - 1) * y[i - 1];
                        under += beta(i - 1);
                    }
                    if i + 1 < n {
                        over += beta(i) * y[i + 1];
                        under += beta(i);
                    }
                    over / under
                })
                .collect();
        }
        assert!(error(&out[0], &y) < 1e-6, "{sweeps}");
    }
}

#[test]
fn jacobi_reaches_the_solution_with_a_tolerance() {
    let mut noise = Noise(9);
    let size = Size::new(60, 40);
    let (plane, c) = (noise.plane(size, 1.0), noise.plane(size, 10.0));
    for integrator in integrators() {
        let settings =
            Diffusion { integrator, solver: Solver::Jacobi(JacobiStop::Tolerance(1e-7)), ..RATIONAL };
        let out = run(&settings, &circle(&c), std::slice::from_ref(&plane));
        // 2 beta / (1 + 2 beta) <= 0.86 here, so what is left is at most 7 times the last change, per axis and step.
        let error = error(&out[0], &reference(&settings, &circle(&c), &plane));
        assert!(error < 5e-6, "{settings:?} {error}");
    }
}

#[test]
fn the_floor_keeps_the_lobe_out() {
    let size = Size::new(120, 90);
    let plane = Plane::from_fn(size, |x, y| f32::from(x == 60 && y == 45) * 100.0).unwrap();
    let medium = Medium { conductivity: Conductivity::Uniform(20.0), gamma: None, vertical_scale: 1.0 };
    let least = |p: &Plane| p.data().iter().fold(0.0f32, |a, b| a.min(*b));
    for solver in solvers() {
        let settings = Diffusion { solver, ..RATIONAL };
        let mut buffers = DiffusionBuffers::new();
        let run =
            |p: &Plane, floor, b: &mut _| run_with(&settings, &medium, std::slice::from_ref(p), b, floor);
        assert!(least(&run(&plane, false, &mut buffers)[0]) < 0.0);
        assert_eq!(least(&run(&plane, true, &mut buffers)[0]), 0.0);
        // A colour that is negative to begin with stays so.
        let negative = Plane::from_fn(size, |x, y| plane.at(x, y) - 2.0).unwrap();
        let out = run(&negative, true, &mut buffers);
        assert_eq!(least(&out[0]), -2.0);
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let mut noise = Noise(10);
    let size = Size::new(333, 217);
    let (c, gamma) = (noise.plane(size, 30.0), noise.plane(size, 1.0));
    let planes: Vec<Plane> = (0..5).map(|_| noise.plane(size, 1.0)).collect();
    let medium = Medium { gamma: Some(&gamma), ..circle(&c) };
    for solver in solvers_and(JacobiStop::Tolerance(1e-3)) {
        let settings = Diffusion { solver, ..RATIONAL };
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run_with(&settings, &medium, &planes, &mut DiffusionBuffers::new(), true))
        };
        let one = with(1);
        for threads in [2, 3, 8] {
            assert_eq!(one, with(threads), "{threads}");
        }
    }
}

#[test]
fn every_width_of_machine_agrees() {
    let mut noise = Noise(11);
    let size = Size::new(101, 83);
    let (c, gamma, plane) = (noise.plane(size, 60.0), noise.plane(size, 1.0), noise.plane(size, 1.0));
    let medium = Medium { gamma: Some(&gamma), ..circle(&c) };
    for instructions in Instructions::ALL.into_iter().filter(|i| i.available()) {
        for integrator in integrators() {
            for solver in solvers() {
                let settings = Diffusion { integrator, solver, ..RATIONAL };
                let mut buffers = DiffusionBuffers::with_instructions(instructions);
                assert_eq!(buffers.instructions(), instructions);
                let out = run_with(&settings, &medium, std::slice::from_ref(&plane), &mut buffers, false);
                let error = error(&out[0], &reference(&settings, &medium, &plane));
                assert!(error < CLOSE, "{instructions:?} {settings:?} {error}");
            }
        }
    }
}

#[test]
fn cancelling_stops_before_and_during() {
    let size = Size::new(64, 64);
    let mut plane = Plane::filled(size, 1.0).unwrap();
    let medium = Medium { conductivity: Conductivity::Uniform(9.0), gamma: None, vertical_scale: 1.0 };
    let cancel = Cancel::new();
    cancel.cancel();
    let mut buffers = DiffusionBuffers::new();
    let out = diffuse(&mut [&mut plane], &medium, &EULER, false, &mut buffers, &cancel);
    assert_eq!(out, Err(Error::Cancelled));
    cancel.reset();
    // Twenty thousand steps take much longer than it takes to cancel them.
    let settings = Diffusion { integrator: Integrator::BackwardEuler { steps: u32::MAX }, ..EULER };
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            cancel.cancel();
        });
        let out = diffuse(&mut [&mut plane], &medium, &settings, false, &mut buffers, &cancel);
        assert_eq!(out, Err(Error::Cancelled));
    });
}

#[test]
fn empty_pictures_and_wrong_sizes() {
    let (settings, cancel, mut buffers) = (EULER, Cancel::new(), DiffusionBuffers::new());
    let uniform = Medium { conductivity: Conductivity::Uniform(9.0), gamma: None, vertical_scale: 1.0 };
    for size in [Size::new(0, 0), Size::new(0, 7), Size::new(7, 0)] {
        let mut plane = Plane::filled(size, 0.0).unwrap();
        diffuse(&mut [&mut plane], &uniform, &settings, true, &mut buffers, &cancel).unwrap();
    }
    let (mut plane, other) =
        (Plane::filled(Size::new(4, 5), 0.0).unwrap(), Plane::filled(Size::new(5, 4), 0.0).unwrap());
    for medium in [circle(&other), Medium { gamma: Some(&other), ..uniform }] {
        let out = diffuse(&mut [&mut plane], &medium, &settings, true, &mut buffers, &cancel);
        assert!(matches!(out, Err(Error::SizeMismatch { .. })));
    }
}
