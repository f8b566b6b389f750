//! How much of a picture is how far away.

use pullfocus_core::Plane;
use rayon::prelude::*;

/// Pixels that a thread counts at a time.
const CHUNK: usize = 1 << 16;

/// Bars of a histogram.
pub const BARS: usize = 128;

/// Pixels by distance, on a logarithmic scale.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Histogram {
    /// Nearest and farthest distance in metres; none where there is no distance.
    pub range: Option<[f64; 2]>,
    /// Pixels in each part of the range, from near to far.
    pub bars: Vec<u32>,
    /// Pixels where nothing is.
    pub nothing: u32,
}

impl Histogram {
    /// Counts depths in metres.
    pub fn of(depth: &Plane) -> Self {
        let chunks = || depth.data().par_chunks(CHUNK);
        let (near, far, count) = chunks()
            .map(|chunk| {
                let one = |(near, far, n): (f32, f32, usize), z| (near.min(z), far.max(z), n + 1);
                there(chunk).fold((f32::INFINITY, 0.0, 0), one)
            })
            .reduce(|| (f32::INFINITY, 0.0, 0), |a, b| (a.0.min(b.0), a.1.max(b.1), a.2 + b.2));
        let nothing = depth.data().len() - count;
        if far <= 0.0 {
            return Self { nothing: nothing as u32, ..Self::default() };
        }
        // Room on both sides, and a width where all is one distance.
        let range = [f64::from(near) / 1.05, f64::from(far) * 1.05];
        let (start, scale) = (range[0].ln(), BARS as f64 / (range[1] / range[0]).ln());
        let count = |chunk: &[f32]| {
            let mut bars = [0; BARS];
            for z in there(chunk) {
                let at = (f64::from(z).ln() - start) * scale;
                bars[(at as usize).min(BARS - 1)] += 1;
            }
            bars
        };
        let sum = |a: [u32; BARS], b: [u32; BARS]| std::array::from_fn(|i| a[i] + b[i]);
        let bars = chunks().map(count).reduce(|| [0; BARS], sum).to_vec();
        Self { range: Some(range), bars, nothing: nothing as u32 }
    }

    /// Where a distance stands, 0 at the near end to 1 at the far end; outside these it is beyond them.
    pub fn place(&self, metres: f64) -> Option<f64> {
        let [near, far] = self.range?;
        Some((metres / near).ln() / (far / near).ln())
    }

    /// The distance at a place.
    pub fn distance(&self, place: f64) -> Option<f64> {
        let [near, far] = self.range?;
        Some(near * (far / near).powf(place))
    }
}

/// Where something is.
fn there(depth: &[f32]) -> impl Iterator<Item = f32> {
    depth.iter().copied().filter(|z| z.is_finite() && *z > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Size;

    #[test]
    fn every_pixel_is_counted_once() {
        let depth =
            Plane::from_fn(
                Size::new(100, 2),
                |x, y| {
                    if y == 0 && x < 10 { f32::INFINITY } else { 1.0 + x as f32 }
                },
            )
            .unwrap();
        let histogram = Histogram::of(&depth);
        assert_eq!(histogram.nothing, 10);
        assert_eq!(histogram.bars.iter().sum::<u32>(), 190);
        let place = histogram.place(10.0).unwrap();
        assert!((histogram.distance(place).unwrap() - 10.0).abs() < 1e-9);
        assert!(histogram.place(1.0).unwrap() > 0.0 && histogram.place(100.0).unwrap() < 1.0);
    }

    #[test]
    fn no_distance_is_no_histogram() {
        let histogram = Histogram::of(&Plane::filled(Size::new(3, 3), f32::INFINITY).unwrap());
        assert_eq!((histogram.range, histogram.nothing), (None, 9));
        assert_eq!(Histogram::of(&Plane::filled(Size::new(2, 1), 4.0).unwrap()).bars.iter().sum::<u32>(), 2);
    }
}
