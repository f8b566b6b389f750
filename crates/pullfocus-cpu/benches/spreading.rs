//! What the spreading methods cost, by the size of the circle: `cargo bench -p pullfocus-cpu --bench spreading`. Throughput is in
//! pixels of three planes; `RAYON_NUM_THREADS=1` for one core.

// `criterion_group!` makes a public function without a page.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pullfocus_core::tensor::{Gathering, Sites, Spreading};
use pullfocus_core::{Aperture, Cancel, Method, Mipmap, Plane, Psf, Quality, Size, Tensor};
use pullfocus_cpu::spreading::{Spread, SpreadBuffers, spread};
use std::time::Duration;

/// Every method that can be waited for, with a name and the largest circle for it.
const METHODS: [(&str, Method, Quality, Mipmap, f32); 6] = [
    ("aperture", Method::Aperture, Quality::Standard, Mipmap::Linear, 500.0),
    ("square", Method::Square, Quality::Standard, Mipmap::Linear, 500.0),
    ("pyramid", Method::Pyramid, Quality::Standard, Mipmap::Linear, 500.0),
    ("pyramid, nearest", Method::Pyramid, Quality::Standard, Mipmap::Nearest, 500.0),
    ("pyramid, fine", Method::Pyramid, Quality::Fine, Mipmap::Linear, 500.0),
    ("naive", Method::Naive, Quality::Standard, Mipmap::Linear, 5.0),
];

fn circles(c: &mut Criterion) {
    for size in [Size::new(1920, 1080), Size::new(256, 256)] {
        in_size(c, size);
    }
}

fn in_size(c: &mut Criterion, size: Size) {
    let mut planes =
        [3, 5, 7].map(|k| Plane::from_fn(size, |x, y| ((x * k) ^ (y * 3)) as f32 % 17.0 / 17.0).unwrap());
    let even = |c: f32| Plane::filled(size, c).unwrap();
    // The last one grows from nothing to 500 px across the picture.
    let last = (size.width - 1) as f32;
    let growing = Plane::from_fn(size, |x, _| x as f32 * 500.0 / last).unwrap();
    let circles = [
        ("5", even(5.0), 5.0),
        ("50", even(50.0), 50.0),
        ("500", even(500.0), 500.0),
        ("0 to 500", growing, 500.0),
    ];
    let mut group = c.benchmark_group(size.to_string().replace(' ', ""));
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements(size.area() as u64));
    for (name, method, quality, mipmap, most) in METHODS {
        for (width, circle, _) in circles.iter().filter(|(_, _, largest)| *largest <= most) {
            let spreading = Spread {
                method,
                psf: Psf::Gaussian,
                aperture: &Aperture::DISC,
                quality,
                mipmap,
                tensor: Tensor::default(),
                circle,
                gamma: None,
                vertical_scale: 1.0,
            };
            let mut buffers = SpreadBuffers::default();
            group.bench_function(BenchmarkId::new(name, width), |b| {
                b.iter(|| {
                    let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
                    spread(&mut planes, &spreading, &mut buffers, &Cancel::new()).unwrap();
                });
            });
        }
    }
    // The tensor filter by its steps; the paper's own are the second.
    let quadtree = Tensor::default();
    let naive = Tensor { gather: Gathering::Naive, spread: Spreading::Naive, ..quadtree };
    let repeated = Tensor { gather: Gathering::RepeatedIntegration, ..quadtree };
    let skip = Tensor { sites: Sites::Skip, ..quadtree };
    let choices =
        [("", quadtree), (", naive", naive), (", repeated integration", repeated), (", skip", skip)];
    for (name, tensor) in choices {
        for (width, circle, _) in &circles {
            let (psf, quality) = (Psf::Gaussian, Quality::Standard);
            let method = Method::Tensor;
            let (aperture, mipmap) = (&Aperture::DISC, Mipmap::Linear);
            let spreading = Spread {
                method,
                psf,
                aperture,
                quality,
                mipmap,
                tensor,
                circle,
                gamma: None,
                vertical_scale: 1.0,
            };
            let mut buffers = SpreadBuffers::default();
            group.bench_function(BenchmarkId::new(format!("tensor{name}"), width), |b| {
                b.iter(|| {
                    let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
                    spread(&mut planes, &spreading, &mut buffers, &Cancel::new()).unwrap();
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, circles);
criterion_main!(benches);
