//! The aperture at constant cost beside naive spreading of the same shape.

use crate::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_core::{Aperture, Cancel, Method, Plane, Psf, Quality, Size};
use pullfocus_testkit::scenes;

fn blurred(plane: &Plane, method: Method, aperture: &Aperture, circle: &Plane, vertical_scale: f32) -> Plane {
    let mut plane = plane.clone();
    let psf = if method == Method::Aperture { Psf::Gaussian } else { Psf::Aperture };
    let quality = Quality::Standard;
    let spreading = Spread { method, psf, aperture, quality, circle, gamma: None, vertical_scale };
    spread(&mut [&mut plane], &spreading, &mut SpreadBuffers::default(), &Cancel::new()).unwrap();
    plane
}

/// PSNR in dB beside the largest value of the second.
fn psnr(a: &Plane, b: &Plane) -> f64 {
    let peak = b.data().iter().fold(0.0f32, |most, value| most.max(*value));
    let pairs = a.data().iter().zip(b.data());
    let squares: f64 = pairs.map(|(a, b)| f64::from((a - b) / peak).powi(2)).sum();
    -10.0 * (squares / a.data().len() as f64 + 1e-20).log10()
}

fn apertures() -> [(&'static str, Aperture); 5] {
    [
        ("disc", Aperture::DISC),
        ("triangle", Aperture::blades(3, 20.0)),
        ("pentagon", Aperture::blades(5, 0.0)),
        ("bent hexagon", Aperture { roundness: 0.4, ..Aperture::blades(6, 11.0) }),
        ("anamorphic", Aperture { squeeze: 2.0, ..Aperture::DISC }),
    ]
}

#[test]
fn it_is_the_naive_aperture() {
    let size = Size::new(200, 150);
    let pictures = [
        ("noise", scenes::noise(size, 0.0, 1.0, 3)),
        ("checks", scenes::plane(size, |x, y| if (x / 20 + y / 20) % 2 == 0 { 1.0 } else { 0.1 })),
        ("lights", scenes::plane(size, |x, y| if x % 67 == 30 && y % 59 == 25 { 50.0 } else { 0.5 })),
        ("point", scenes::plane(size, |x, y| if (x, y) == (101, 72) { 1.0 } else { 0.0 })),
    ];
    let mut circles: Vec<(String, Plane)> = [0.7f32, 1.5, 2.5, 4.0, 7.0, 11.0, 20.0, 47.0, 49.0, 95.0, 100.0]
        .into_iter()
        .map(|c| (format!("{c}"), scenes::constant(size, c)))
        .collect();
    circles.push(("growing".into(), scenes::plane(size, |x, _| 0.35 * x as f32 - 5.0)));
    circles.push((
        "patches".into(),
        scenes::plane(size, |x, y| if (x / 40 + y / 50) % 2 == 0 { -3.0 } else { 30.0 }),
    ));
    let mut worst = (f64::INFINITY, String::new());
    for (shape, aperture) in &apertures() {
        for (name, picture) in &pictures {
            for (of, circle) in &circles {
                let naive = blurred(picture, Method::Naive, aperture, circle, 1.0);
                let found = blurred(picture, Method::Aperture, aperture, circle, 1.0);
                let db = psnr(&found, &naive);
                eprintln!("{shape:12} {name:8} {of:8} {db:.1}");
                if db < worst.0 {
                    worst = (db, format!("{shape}, {name}, {of}"));
                }
            }
        }
    }
    assert!(worst.0 > 45.0, "{worst:?}");
}
