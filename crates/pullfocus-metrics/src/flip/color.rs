//! Colour spaces of FLIP and the distance between colours.

/// Linear sRGB (D65) to XYZ, from the primaries' exact chromaticities.
const TO_XYZ: [[f64; 3]; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];

/// XYZ of linear white (1, 1, 1).
const WHITE: [f64; 3] = {
    let mut white = [0.0; 3];
    let mut i = 0;
    while i < 3 {
        white[i] = TO_XYZ[i][0] + TO_XYZ[i][1] + TO_XYZ[i][2];
        i += 1;
    }
    white
};

/// Linear sRGB to XYZ over white.
const TO_RELATIVE: [[f32; 3]; 3] = {
    let mut m = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 9 {
        m[i / 3][i % 3] = (TO_XYZ[i / 3][i % 3] / WHITE[i / 3]) as f32;
        i += 1;
    }
    m
};

/// XYZ over white to linear sRGB: the inverse of [`TO_RELATIVE`].
const FROM_RELATIVE: [[f32; 3]; 3] = {
    let m = TO_XYZ;
    let mut inverse = [[0.0; 3]; 3];
    let (a, b, c) = (m[0], m[1], m[2]);
    let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    let mut i = 0;
    while i < 9 {
        // The cofactor of the transposed place, with cyclic indices instead of signs.
        let (row, column) = (i % 3, i / 3);
        let (r1, r2, c1, c2) = ((row + 1) % 3, (row + 2) % 3, (column + 1) % 3, (column + 2) % 3);
        let cofactor = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
        inverse[i / 3][i % 3] = (cofactor / determinant * WHITE[i % 3]) as f32;
        i += 1;
    }
    inverse
};

fn times(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

/// Linear sRGB to Y, Cx, Cz: L*a*b* without its cube root.
#[inline]
pub(super) fn to_opponent(linear: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = times(&TO_RELATIVE, linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// L*a*b*'s cube root with its straight part near black.
fn lightness(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// Hunt's effect: colours look weaker in the dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn lab([x, y, z]: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = [x, y, z].map(lightness);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Y, Cx, Cz to L*a*b* with Hunt's adjustment; colours that no screen has are clipped first (section 4.1.1).
#[inline]
pub(super) fn to_lab([luminance, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (luminance + 16.0) / 116.0;
    let linear = times(&FROM_RELATIVE, [y + cx / 500.0, y, y - cz / 200.0]);
    hunt(lab(times(&TO_RELATIVE, linear.map(|v| v.clamp(0.0, 1.0)))))
}

/// HyAB: city block in lightness, Euclid in colour.
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let [l, a, b]: [f32; 3] = std::array::from_fn(|i| p[i] - q[i]);
    l.abs() + (a * a + b * b).sqrt()
}

/// Exponent of the distance (section 4.1.2).
const Q: f32 = 0.7;
/// Distances up to this part of the largest one ...
const KNEE: f32 = 0.4;
/// ... are spread over this part of the result.
const KNEE_AT: f32 = 0.95;

/// Difference of two colours of [`to_lab`], 0 to 1 (section 4.1.3).
#[inline]
pub(super) fn color_difference(reference: [f32; 3], test: [f32; 3]) -> f32 {
    let distance = hyab(reference, test).powf(Q);
    let largest = LARGEST;
    let knee = KNEE * largest;
    if distance < knee {
        distance * (KNEE_AT / knee)
    } else {
        KNEE_AT + (distance - knee) / (largest - knee) * (1.0 - KNEE_AT)
    }
}

/// HyAB between green and blue, the colours farthest apart, to the power [`Q`]; a test computes it.
const LARGEST: f32 = 41.276_096;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_distance_is_that_of_green_and_blue() {
        let lab = |linear| hunt(lab(times(&TO_RELATIVE, linear)));
        let largest = hyab(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])).powf(Q);
        // f32 rounding of numbers around 200.
        assert!((largest - LARGEST).abs() < 1e-4, "{largest}");
        assert!((color_difference(lab([0.0, 1.0, 0.0]), lab([0.0, 0.0, 1.0])) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn opponent_colours_come_back() {
        for linear in [[0.2, 0.5, 0.9], [1.0, 0.0, 0.0], [0.0; 3], [1.0; 3]] {
            let [luminance, cx, cz] = to_opponent(linear);
            let y = (luminance + 16.0) / 116.0;
            let back = times(&FROM_RELATIVE, [y + cx / 500.0, y, y - cz / 200.0]);
            for c in 0..3 {
                // f32 rounding, times the inverse's largest factor of 3.
                assert!((back[c] - linear[c]).abs() < 2e-6, "{back:?}");
            }
        }
    }

    #[test]
    fn grey_has_no_colour() {
        let [l, a, b] = to_lab(to_opponent([0.18; 3]));
        assert!((l - 49.496).abs() < 1e-2 && a.abs() < 1e-3 && b.abs() < 1e-3, "{l} {a} {b}");
    }
}
