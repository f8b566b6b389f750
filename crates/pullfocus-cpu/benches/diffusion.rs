//! What a blur costs, beside a copy of the bytes that it must touch.
//!
//! `cargo bench -p pullfocus-cpu`; a filter may follow `--`, such as `1920x1080` or `copy`. Throughput is in unknowns:
//! pixels x planes x 2 axes. Runs on all cores; `RAYON_NUM_THREADS=1` for one.

// `criterion_group!` makes a public function without a page.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pullfocus_core::diffusion::{Calibration, JacobiStop};
use pullfocus_core::response::Rational;
use pullfocus_core::{Cancel, Diffusion, Integrator, Plane, Size, Solver};
use pullfocus_cpu::diffusion::{Conductivity, DiffusionBuffers, Medium, diffuse};
use rayon::prelude::*;
use std::time::Duration;

const SIZES: [Size; 5] = [
    Size::new(256, 256),
    Size::new(512, 512),
    Size::new(1024, 1024),
    Size::new(1920, 1080),
    Size::new(3840, 2160),
];

const EULER: Diffusion = Diffusion {
    calibration: Calibration::Variance,
    integrator: Integrator::BackwardEuler { steps: 1 },
    solver: Solver::Lu,
};

fn methods() -> [(&'static str, Diffusion); 7] {
    let rational = Integrator::Rational(Rational::GAUSSIAN);
    [
        ("backward-euler", EULER),
        ("rational", Diffusion { integrator: rational, ..EULER }),
        ("disc", Diffusion { integrator: Integrator::Disc, ..EULER }),
        ("backward-euler, cyclic reduction", Diffusion { solver: Solver::CyclicReduction, ..EULER }),
        (
            "backward-euler, parallel cyclic reduction",
            Diffusion { solver: Solver::ParallelCyclicReduction, ..EULER },
        ),
        ("backward-euler, hybrid", Diffusion { solver: Solver::Hybrid, ..EULER }),
        ("backward-euler, 10 sweeps", Diffusion { solver: Solver::Jacobi(JacobiStop::Sweeps(10)), ..EULER }),
    ]
}

/// A picture with detail everywhere.
fn picture(size: Size) -> [Plane; 3] {
    [3, 5, 7].map(|k| Plane::from_fn(size, |x, y| ((x * k) ^ (y * 3)) as f32 % 17.0 / 17.0).unwrap())
}

/// Diameters from 0 to `most`, with an edge in the middle.
fn circles(size: Size, most: f32) -> Plane {
    Plane::from_fn(size, |x, y| {
        let t = x as f32 / size.width as f32;
        let edge = if y > size.height / 2 { 1.0 } else { 0.3 };
        most * edge * (t * 9.0).sin().abs()
    })
    .unwrap()
}

fn single_layer(c: &mut Criterion) {
    let mut group = c.benchmark_group("rgb");
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for size in SIZES {
        group.throughput(Throughput::Elements(size.area() as u64 * 6));
        let circle = circles(size, 50.0);
        let medium = Medium { conductivity: Conductivity::Circle(&circle), gamma: None, vertical_scale: 1.0 };
        for (name, settings) in methods() {
            let mut planes = picture(size);
            let mut buffers = DiffusionBuffers::new();
            group.bench_function(BenchmarkId::new(name, size.to_string().replace(' ', "")), |b| {
                b.iter(|| run(&mut planes, &medium, &settings, &mut buffers));
            });
        }
    }
    group.finish();
}

fn blur_sizes(c: &mut Criterion) {
    let mut group = c.benchmark_group("1920x1080 by largest circle");
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    let size = Size::new(1920, 1080);
    for most in [5.0, 50.0, 500.0] {
        let circle = circles(size, most);
        let medium = Medium { conductivity: Conductivity::Circle(&circle), gamma: None, vertical_scale: 1.0 };
        for (name, settings) in &methods()[..3] {
            let mut planes = picture(size);
            let mut buffers = DiffusionBuffers::new();
            group.bench_function(BenchmarkId::new(*name, most), |b| {
                b.iter(|| run(&mut planes, &medium, settings, &mut buffers));
            });
        }
    }
    group.finish();
}

/// The first paper's two layers at its size: the picture; its diameters diffused in the matte, then its colours; both
/// blended.
fn two_layers(c: &mut Criterion) {
    let mut group = c.benchmark_group("two layers");
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for size in [Size::new(256, 256), Size::new(512, 512), Size::new(1024, 1024)] {
        group.throughput(Throughput::Elements(1));
        let circle = circles(size, 20.0);
        let matte = Plane::from_fn(size, |x, y| (circle.at(x, y) / 10.0).min(1.0)).unwrap();
        let source = picture(size);
        let (mut middle, mut behind, mut wide) = (picture(size), picture(size), circle.clone());
        let mut buffers = DiffusionBuffers::new();
        group.bench_function(BenchmarkId::new("backward-euler", size.to_string().replace(' ', "")), |b| {
            b.iter(|| {
                let copies = middle.iter_mut().chain(&mut behind).chain([&mut wide]);
                for (to, from) in copies.zip(source.iter().chain(&source).chain([&circle])) {
                    to.data_mut().copy_from_slice(from.data());
                }
                let sharp =
                    Medium { conductivity: Conductivity::Circle(&circle), gamma: None, vertical_scale: 1.0 };
                run(&mut middle, &sharp, &EULER, &mut buffers);
                let fill = Medium {
                    conductivity: Conductivity::Uniform(10.0),
                    gamma: Some(&matte),
                    vertical_scale: 1.0,
                };
                diffuse(&mut [&mut wide], &fill, &EULER, false, &mut buffers, &Cancel::new()).unwrap();
                let blurred = Medium {
                    conductivity: Conductivity::Circle(&wide),
                    gamma: Some(&matte),
                    vertical_scale: 1.0,
                };
                run(&mut behind, &blurred, &EULER, &mut buffers);
                for (to, from) in middle.iter_mut().zip(&behind) {
                    let rows = to.data_mut().par_chunks_mut(1 << 14).zip(from.data().par_chunks(1 << 14));
                    rows.zip(matte.data().par_chunks(1 << 14)).for_each(|((to, from), matte)| {
                        for ((to, from), a) in to.iter_mut().zip(from).zip(matte) {
                            *to += a * (from - *to);
                        }
                    });
                }
            });
        });
    }
    group.finish();
}

/// The same bytes as backward Euler, 28 a pixel and axis, only copied: on all cores, 56 bytes a pixel in all (14 f32
/// read as much as written), from arrays at least as large as the picture's own.
fn copy(c: &mut Criterion) {
    let mut group = c.benchmark_group("copy");
    group.sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for size in SIZES {
        let length = size.area() * 7;
        let from = vec![1.0f32; length];
        let mut to = vec![0.0f32; length];
        group.throughput(Throughput::Bytes(8 * length as u64));
        group.bench_function(BenchmarkId::new("copy", size.to_string().replace(' ', "")), |b| {
            b.iter(|| {
                let piece = length.div_ceil(rayon::current_num_threads());
                to.par_chunks_mut(piece).zip(from.par_chunks(piece)).for_each(|(a, b)| a.copy_from_slice(b));
            });
        });
    }
    group.finish();
}

fn run(planes: &mut [Plane; 3], medium: &Medium<'_>, settings: &Diffusion, buffers: &mut DiffusionBuffers) {
    let [r, g, b] = planes;
    diffuse(&mut [r, g, b], medium, settings, false, buffers, &Cancel::new()).unwrap();
}

criterion_group!(benches, single_layer, blur_sizes, two_layers, copy);
criterion_main!(benches);
