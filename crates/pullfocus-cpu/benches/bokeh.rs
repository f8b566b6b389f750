//! What highlights cost: 100,000 of them in three planes of 1920 x 1080, taken out and added as sprites, by shape and size;
//! `cargo bench -p pullfocus-cpu --bench bokeh`. `RAYON_NUM_THREADS=1` for one core.

// `criterion_group!` makes a public function without a page.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pullfocus_core::aperture::Mask;
use pullfocus_core::{Aperture, ApertureShape, Bokeh, Cancel, Frame, Plane, Size};
use pullfocus_cpu::bokeh::{Lights, Look, Shown};
use std::time::Duration;

/// Every how many pixels there is a light: 103,680 of them.
const EVERY: usize = 20;

fn highlights(c: &mut Criterion) {
    let size = Size::new(1920, 1080);
    let light = |x: usize, y: usize| (y * size.width + x) % EVERY == y % EVERY;
    let colors = [40.0, 30.0, 20.0]
        .map(|value| Plane::from_fn(size, |x, y| if light(x, y) { value } else { 0.1 }).unwrap());
    let even = |c: f32| Plane::filled(size, c).unwrap();
    // No two neighbours have one size.
    let about = |c: f32| {
        Plane::from_fn(size, |x, y| c * (0.8 + 0.4 * ((x * 37 + y * 101) % 997) as f32 / 997.0)).unwrap()
    };
    let circles = [("10", even(10.0)), ("50", even(50.0)), ("40 to 60", about(50.0)), ("200", even(200.0))];
    let mask = (0..64 * 64).map(|i| if (i / 64 + i % 64) % 16 < 8 { 1.0 } else { 0.5 }).collect();
    let image = ApertureShape::Image(Mask::new(64, 64, mask).unwrap());
    let looks = [
        ("disc", Aperture::DISC, 0.0),
        ("six blades", Aperture::blades(6, 10.0), 0.0),
        ("cat's eye", Aperture::DISC, 0.7),
        ("image", Aperture { shape: image, ..Aperture::DISC }, 0.0),
    ];
    let frame = Frame::full(size);
    let mut group = c.benchmark_group("1920x1080");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    group.throughput(Throughput::Elements((size.area() / EVERY) as u64));
    for (name, aperture, cats_eye) in &looks {
        for (width, circle) in &circles {
            // The area's cost can be seen from one size.
            if *name == "image" && *width != "50" {
                continue;
            }
            let bokeh = Bokeh { cats_eye: *cats_eye, ..Bokeh::default() };
            let look = Look::new(&frame, bokeh, aperture);
            let (mut lights, mut planes) = (Lights::default(), colors.clone());
            group.bench_function(BenchmarkId::new(*name, width), |b| {
                b.iter(|| {
                    planes
                        .iter_mut()
                        .zip(&colors)
                        .for_each(|(to, from)| to.data_mut().copy_from_slice(from.data()));
                    let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
                    let cancel = Cancel::new();
                    lights.take_out(&mut planes, circle, &bokeh, look.display_width, &cancel).unwrap();
                    assert_eq!(lights.count(), size.area() / EVERY);
                    lights.add(&mut planes, &look, Shown::ByCircle(circle), &cancel).unwrap();
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, highlights);
criterion_main!(benches);
