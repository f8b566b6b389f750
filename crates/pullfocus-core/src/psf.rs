//! Formulas of the spreading methods: what a point of light becomes. All of them are matched to the uniform disc's variance
//! ([`variance`]), and all of them are the pixel itself where there is no blur.

/// The most that a circle of confusion counts, in parts of the picture's longer side: from there on the PSF is nearly even
/// over the whole picture, wherever it is.
pub const MOST_DIAMETER: f32 = 4.0;

/// The diameter, 0 or more and in pixels, that a signed circle of confusion of `c` pixels counts as in a picture whose
/// longer side has `longer` pixels. NaN counts as 0.
pub fn diameter(c: f32, longer: usize) -> f32 {
    let most = MOST_DIAMETER * longer as f32;
    // The comparison is false for NaN.
    if c.abs() <= most {
        c.abs()
    } else if c.is_nan() {
        0.0
    } else {
        most
    }
}

/// The variance along each axis of a uniform disc of `diameter` pixels, in square pixels.
pub fn variance(diameter: f64) -> f64 {
    diameter * diameter / 16.0
}

/// Standard deviations at which a Gaussian is cut: 6e-5 of a wide one lie beyond.
pub const CUT: f64 = 4.0;

/// How many pixels a Gaussian of `variance` square pixels reaches to each side: [`CUT`] deviations, rounded up, and one pixel
/// more for the lattice's narrow ones, whose tails are longer.
pub fn gaussian_reach(variance: f64) -> usize {
    (CUT * variance.sqrt()).ceil() as usize + 1
}

/// The Gaussian on a lattice, `exp(-t) I_n(t)` for n from 0 to `reach`, t = `variance` in square pixels (Lindeberg 1990,
/// "Scale-Space for Discrete Signals"). Unlike a sampled Gaussian it has exactly this variance and the sum 1 (over n and -n, without the
/// cut), down to the pixel itself at t = 0; it is what the heat equation makes of a pixel.
///
/// Computed by the recurrence `I_{n-1} = I_{n+1} + 2 n / t I_n` downwards, which is stable.
pub fn discrete_gaussian(variance: f64, reach: usize) -> Vec<f64> {
    let mut values = vec![0.0; reach + 1];
    // Below this the neighbour's share, t / 2, is no number beside 1 in f32.
    if variance.is_nan() || variance < 1e-9 {
        values[0] = 1.0;
        return values;
    }
    // Far enough that what is left out is below f64's precision: nine deviations, and the tail of narrow ones.
    let first = reach.max((9.0 * variance.sqrt()).ceil() as usize) + 24;
    let (mut next, mut this) = (0.0, 1e-300);
    let mut sum = 0.0;
    for n in (0..=first).rev() {
        if let Some(value) = values.get_mut(n) {
            *value = this;
        }
        sum += if n == 0 { this } else { 2.0 * this };
        let before = next + 2.0 * n as f64 / variance * this;
        (next, this) = (this, before);
        // Narrow ones grow beyond all numbers on the way.
        if this > 1e200 {
            for value in values.iter_mut().chain([&mut sum, &mut next, &mut this]) {
                *value *= 1e-300;
            }
        }
    }
    values.iter_mut().for_each(|value| *value /= sum);
    values
}

/// The box whose pixels have exactly this variance along one axis, in square pixels: k and f for a row of `2 k - 1` whole pixels and
/// the share f, 0 to 1, of one more on either side ("extended box", Gwosdek, Grewenig, Bruhn, Weickert 2011). Its side, `2 k - 1 + 2 f`,
/// tends to `c sqrt(3) / 2` for a disc of diameter c, grows with the variance without a jump, and is one pixel at 0.
pub fn extended_box(variance: f64) -> (u32, f64) {
    // 2 k - 1 whole pixels have the variance ((2 k - 1)^2 - 1) / 12.
    let k = (0.5 * (1.0 + (1.0 + 12.0 * variance).sqrt())).floor();
    let whole = 2.0 * k - 1.0;
    let inner = (k - 1.0) * k * whole / 3.0;
    let f = (variance * whole - inner) / (2.0 * (k * k - variance));
    (k as u32, f.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lattice_s_gaussian_has_its_sum_and_variance() {
        for t in [1e-10, 1e-6, 0.01, 0.3, 1.0, 7.0, 100.0, 15_625.0] {
            let reach = (10.0 * f64::sqrt(t)).ceil() as usize + 12;
            let values = discrete_gaussian(t, reach);
            let two = |n: usize| if n == 0 { 1.0 } else { 2.0 };
            let sum: f64 = values.iter().enumerate().map(|(n, v)| two(n) * v).sum();
            let variance: f64 = values.iter().enumerate().map(|(n, v)| 2.0 * (n * n) as f64 * v).sum();
            // f64 rounding; the least counts as none.
            assert!(
                (sum - 1.0).abs() < 1e-12 && (variance - t).abs() < 1e-9 * t + 1e-9,
                "{t}: {sum} {variance}"
            );
            assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
        }
        assert_eq!(discrete_gaussian(0.0, 2), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn boxes_have_their_variance_and_grow_evenly() {
        let mut last = 0.0;
        for i in 0..4000 {
            let variance = 0.01 * f64::from(i);
            let (k, f) = extended_box(variance);
            let inner: f64 = (1..k).map(|n| 2.0 * f64::from(n * n)).sum();
            let side = f64::from(2 * k - 1) + 2.0 * f;
            let found = (inner + 2.0 * f * f64::from(k * k)) / side;
            assert!((found - variance).abs() < 1e-9, "{variance}: {found}");
            // Quickest just before a side of 3, by 1 / (1 - v)^2 = 9 at v = 2/3.
            assert!(i == 0 || (side > last && side - last < 0.0901), "{variance}: {side}");
            last = side;
        }
        assert_eq!(extended_box(0.0), (1, 0.0));
        let (k, f) = extended_box(variance(1000.0));
        assert!((2.0 * (f64::from(k) + f) - 1.0 - 1000.0 * 0.75f64.sqrt()).abs() < 1e-2);
    }

    #[test]
    fn every_circle_counts_as_something() {
        assert_eq!(diameter(-3.0, 10), 3.0);
        assert_eq!(diameter(f32::NAN, 10), 0.0);
        assert_eq!(diameter(f32::NEG_INFINITY, 10), 40.0);
        assert_eq!(gaussian_reach(variance(8.0)), 9);
    }
}
