//! One backend's picture beside another's.

use pullfocus_core::Picture;

/// Panics unless every value of every plane of `picture` is close to `expected`'s: `|a - b| <= relative * max(|b|, floor)`,
/// which nothing fulfils that is not a number. The message tells which value is the farthest from that, and `name`.
///
/// # Panics
/// If values are too far apart, or if the pictures differ in size or in planes.
pub fn compare_pictures(name: &str, picture: &Picture, expected: &Picture, relative: f32, floor: f32) {
    let layout = |p: &Picture| (p.size(), p.colors.len(), p.alpha.is_some());
    assert_eq!(layout(picture), layout(expected), "{name}: size, colours and alpha");
    // How many times the bound, then where.
    let mut worst = (0.0, None);
    for (index, (plane, other)) in picture.planes().zip(expected.planes()).enumerate() {
        assert_eq!(plane.size(), other.size(), "{name}: the size of plane {index}");
        for (at, (&a, &b)) in plane.data().iter().zip(other.data()).enumerate() {
            let (difference, bound) = ((a - b).abs(), relative * b.abs().max(floor));
            // Also where one of the two is NaN.
            let within = difference <= bound;
            let times = if within { 0.0 } else { difference / bound };
            if !within && (worst.1.is_none() || times.is_nan() || times > worst.0) {
                let times = if times.is_nan() { f32::INFINITY } else { times };
                worst = (times, Some((index, at, a, b)));
            }
        }
    }
    if let (times, Some((index, at, a, b))) = worst {
        let width = picture.size().width;
        let (x, y) = (at % width, at / width);
        panic!("{name}: {a} instead of {b} in plane {index} at ({x}, {y}), {times} times what is allowed");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::{Plane, Size};
    use std::panic::catch_unwind;

    /// What a comparison of two pictures panics with; nothing where it passes.
    fn message(a: &Picture, b: &Picture) -> Option<String> {
        let result = catch_unwind(|| compare_pictures("noise", a, b, 0.01, 0.1));
        result.err().map(|panic| *panic.downcast::<String>().expect("a message"))
    }

    #[test]
    fn the_worst_value_is_named() {
        let plane = |f: fn(usize, usize) -> f32| Plane::from_fn(Size::new(5, 4), f).unwrap();
        let of = |f| Picture { colors: vec![plane(|_, _| 0.0)], alpha: Some(plane(f)) };
        let even = of(|_, _| 2.0);
        assert_eq!(message(&even, &even), None);
        // 0.01 of 2 are 0.02.
        assert_eq!(message(&of(|x, _| if x == 3 { 2.019 } else { 2.0 }), &even), None);
        let far = message(&of(|x, y| if x == 3 { 2.1 + y as f32 } else { 2.0 }), &even).expect("too far");
        assert!(far.starts_with("noise: 5.1 instead of 2 in plane 1 at (3, 3)"), "{far}");
        let none = message(&of(|x, y| if (x, y) == (4, 1) { f32::NAN } else { 9.0 }), &even).expect("NaN");
        assert!(none.contains("plane 1 at (4, 1)"), "{none}");
        // Below the floor a thousandth is allowed.
        assert_eq!(message(&of(|_, _| 9e-4), &of(|_, _| 0.0)), None);
        assert!(message(&of(|_, _| 2e-3), &of(|_, _| 0.0)).is_some());
        assert!(message(&even, &Picture::opaque(even.colors.clone())).is_some(), "alpha is missing");
    }
}
