//! FLIP's filters, one axis at a time.

use std::ops::Range;

/// Values that are filtered together; the compiler makes vectors of them.
pub(super) const LANES: usize = 16;

/// An odd number of weights about a centre, folded: even ones have equal sides, odd ones opposite sides.
#[derive(Debug, Clone)]
pub(super) struct Taps {
    center: f32,
    /// Weights of the values after the centre, nearest first.
    side: Vec<f32>,
    odd: bool,
}

/// All filters for one viewing distance.
#[derive(Debug)]
pub(super) struct Filters {
    /// Contrast sensitivity of luminance.
    pub y: Taps,
    /// Contrast sensitivity of red against green.
    pub cx: Taps,
    /// Contrast sensitivity of blue against yellow: two Gaussians whose sum is normalised.
    pub cz: [Taps; 2],
    /// The feature detector's Gaussian.
    pub smooth: Taps,
    /// Its first derivative.
    pub edge: Taps,
    /// Its second derivative.
    pub point: Taps,
}

/// Table 1 of the paper: a and b of the contrast sensitivity functions, as `a sqrt(pi / b) exp(-pi^2 x^2 / b)`.
const B_Y: f64 = 0.0047;
const B_CX: f64 = 0.0053;
const CZ: [[f64; 2]; 2] = [[34.1, 0.04], [13.5, 0.025]];
/// Width of the feature detector in degrees (section 4.2).
const FEATURE_WIDTH: f64 = 0.082;

impl Filters {
    pub fn new(pixels_per_degree: f32) -> Self {
        use std::f64::consts::PI;
        let ppd = f64::from(pixels_per_degree);
        let widest = CZ[0][1];
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * ppd).ceil() as usize;
        let gauss = |b: f64| -> Vec<f64> {
            (0..=radius).map(|x| (-(PI * x as f64 / ppd).powi(2) / b).exp()).collect()
        };
        // In two dimensions the sum is sum_i a_i sqrt(pi / b_i) g_i(x) g_i(y); each axis takes a square root.
        let cz = CZ.map(|[a, b]| {
            let scale = (a * (PI / b).sqrt()).sqrt();
            gauss(b).into_iter().map(|g| g * scale).collect::<Vec<_>>()
        });
        let norm = cz.iter().map(|g| total(g).powi(2)).sum::<f64>().sqrt();

        let sigma = 0.5 * FEATURE_WIDTH * ppd;
        let reach = (3.0 * sigma).ceil() as usize;
        let smooth: Vec<f64> = (0..=reach).map(|x| (-0.5 * (x as f64 / sigma).powi(2)).exp()).collect();
        let edge: Vec<f64> = smooth.iter().enumerate().map(|(x, g)| -(x as f64) * g).collect();
        let one_side = -edge.iter().sum::<f64>();
        let point = smooth.iter().enumerate().map(|(x, g)| ((x as f64 / sigma).powi(2) - 1.0) * g);
        let point: Vec<f64> = point.collect();
        // Positive weights sum to 1, negative ones to -1.
        let part = |sign: f64| total(&point.iter().map(|w| (w * sign).max(0.0)).collect::<Vec<_>>());
        let (positive, negative) = (part(1.0), part(-1.0));

        let normalised = |weights: Vec<f64>| {
            let sum = total(&weights);
            Taps::new(&weights, |w| w / sum, false)
        };
        Self {
            y: normalised(gauss(B_Y)),
            cx: normalised(gauss(B_CX)),
            cz: cz.map(|g| Taps::new(&g, |w| w / norm, false)),
            smooth: normalised(smooth),
            edge: Taps::new(&edge, |w| w / one_side, true),
            point: Taps::new(&point, |w| if w > 0.0 { w / positive } else { w / negative }, false),
        }
    }

    /// How far the widest filter reaches from its centre, in pixels.
    pub fn reach(&self) -> usize {
        self.y.side.len().max(self.smooth.side.len())
    }
}

/// Sum over both sides of a filter given by its centre and one side.
fn total(half: &[f64]) -> f64 {
    half.first().map_or(0.0, |center| 2.0 * half.iter().sum::<f64>() - center)
}

/// Rows of filtered values, for the pass down columns: row by row, then channel by channel.
pub(super) struct Window<'a> {
    pub data: &'a [f32],
    /// Which rows of the picture are there.
    pub held: Range<usize>,
    pub stride: usize,
    /// Channels in a row.
    pub per_row: usize,
}

impl Window<'_> {
    /// A channel of a row; rows beyond the picture are its border.
    fn row(&self, channel: usize, y: isize) -> &[f32] {
        let y = y.clamp(self.held.start as isize, self.held.end as isize - 1) as usize - self.held.start;
        &self.data[(y * self.per_row + channel) * self.stride..][..self.stride]
    }
}

impl Taps {
    fn new(half: &[f64], scale: impl Fn(f64) -> f64, odd: bool) -> Self {
        let mut weights = half.iter().map(|&w| scale(w) as f32);
        Self { center: weights.next().unwrap_or(0.0), side: weights.collect(), odd }
    }

    /// `side` times the sum or difference of the values on either side of the centre.
    #[inline(always)]
    fn add(&self, sum: &mut [f32; LANES], weight: f32, before: &[f32; LANES], after: &[f32; LANES]) {
        if self.odd {
            for i in 0..LANES {
                sum[i] += weight * (after[i] - before[i]);
            }
        } else {
            for i in 0..LANES {
                sum[i] += weight * (after[i] + before[i]);
            }
        }
    }

    /// Filters a row whose first value is `source[border]`; `out` has a multiple of [`LANES`] values.
    pub fn along(&self, source: &[f32], border: usize, out: &mut [f32]) {
        for (block, out) in out.as_chunks_mut::<LANES>().0.iter_mut().enumerate() {
            let start = border + block * LANES;
            let mut sum = lanes(source, start).map(|v| v * self.center);
            for (k, &weight) in self.side.iter().enumerate() {
                let (before, after) = (lanes(source, start - k - 1), lanes(source, start + k + 1));
                self.add(&mut sum, weight, before, after);
            }
            *out = sum;
        }
    }

    /// Filters one channel down its columns at row `y` of the picture.
    pub fn down(&self, window: &Window<'_>, channel: usize, y: usize, out: &mut [f32]) {
        let y = y as isize;
        let center = window.row(channel, y);
        for (out, value) in out.iter_mut().zip(center) {
            *out = self.center * value;
        }
        // A few columns at a time stay in the first-level cache while the rows pass.
        const BLOCK: usize = 64 * LANES;
        for start in (0..out.len()).step_by(BLOCK) {
            let end = (start + BLOCK).min(out.len());
            let out = out[start..end].as_chunks_mut::<LANES>().0;
            for (k, &weight) in self.side.iter().enumerate() {
                let step = k as isize + 1;
                let before = window.row(channel, y - step)[start..end].as_chunks::<LANES>().0;
                let after = window.row(channel, y + step)[start..end].as_chunks::<LANES>().0;
                for ((sum, before), after) in out.iter_mut().zip(before).zip(after) {
                    self.add(sum, weight, before, after);
                }
            }
        }
    }
}

/// [`LANES`] values from `start` on; the callers' padding makes sure that they are there.
#[inline(always)]
fn lanes(source: &[f32], start: usize) -> &[f32; LANES] {
    source[start..].first_chunk().expect("rows are padded to whole vectors and their borders")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(taps: &Taps) -> f32 {
        taps.center + 2.0 * taps.side.iter().sum::<f32>()
    }

    #[test]
    fn smoothing_keeps_constants_and_derivatives_remove_them() {
        for ppd in [1.0, 20.0, super::super::DEFAULT_PIXELS_PER_DEGREE, 400.0] {
            let filters = Filters::new(ppd);
            // f32 weights, up to a few hundred of them.
            for taps in [&filters.y, &filters.cx, &filters.smooth] {
                assert!((sum(taps) - 1.0).abs() < 1e-5, "{ppd}");
            }
            let blue = filters.cz.each_ref().map(|taps| sum(taps).powi(2));
            assert!((blue[0] + blue[1] - 1.0).abs() < 1e-5);
            assert!(sum(&filters.point).abs() < 1e-5 && filters.edge.center == 0.0);
        }
    }

    #[test]
    fn both_passes_do_what_the_plain_sum_does() {
        let taps = Taps { center: 0.5, side: vec![0.25, -0.125], odd: true };
        let row: Vec<f32> = (0..LANES + 4).map(|x| ((x * x) % 7) as f32).collect();
        let plain =
            |x: usize| 0.5 * row[x] + 0.25 * (row[x + 1] - row[x - 1]) - 0.125 * (row[x + 2] - row[x - 2]);
        let mut along = vec![0.0; LANES];
        taps.along(&row, 2, &mut along);
        // Small integers times powers of two: exact.
        assert_eq!(along, (2..2 + LANES).map(plain).collect::<Vec<_>>());

        let data: Vec<f32> = row.iter().flat_map(|&v| [v; LANES]).collect();
        let window = Window { data: &data, held: 0..row.len(), stride: LANES, per_row: 1 };
        let mut down = vec![0.0; LANES];
        taps.down(&window, 0, 5, &mut down);
        assert_eq!(down, [plain(5); LANES]);
        taps.down(&window, 0, 0, &mut down);
        assert_eq!(down[0], 0.5 * row[0] + 0.25 * (row[1] - row[0]) - 0.125 * (row[2] - row[0]));
    }
}
