//! Where one layer ends and the next begins, on the scale of the signed circle of confusion.
//!
//! # Theory
//! Layers are cut along `u = asinh(c / knee)`: linear through focus, logarithmic far from it, so that a pull of
//! focus moves things evenly. The knee is a part of the picture's width, so a proxy is cut as the full frame is.
//! Cuts belong where nothing is: a thing that lies across a cut turns half transparent. So the centres of the layers
//! are found by k-means on the diameters at the picture's own depth edges (what must lie in different layers
//! is what stands in front of each other), with a little of all pixels; each cut then goes to the emptiest
//! place between two centres that lie far enough apart, weighed by how many edges span it. A cut may wander fast where nothing lies; where
//! something lies, it moves as that does.
//!
//! At a cut, layers overlap: in the ramp the nearer layer's coverage fades while the farther one already covers
//! wholly, so the unblurred layers put together are the picture, and nothing is half transparent.

/// Histogram bins over `u` in [-`U_MAX`, `U_MAX`].
pub const BINS: usize = 560;
/// Half the histogram's range; `3 sinh(7)` is 1600 pixels at a width of 960, more than the width.
pub const U_MAX: f64 = 7.0;
/// Width of a bin.
pub const BIN: f64 = 2.0 * U_MAX / BINS as f64;

/// The knee of the scale: a diameter of 3 pixels at a width of 960.
pub fn knee(display_width: f32) -> f32 {
    3.0 * unit(display_width)
}

/// Pixels that look as one pixel does at a width of 960, the width at which the constants were found.
pub fn unit(display_width: f32) -> f32 {
    display_width / 960.0
}

/// `asinh(x)` with an error below 1e-6, in a form that vectorises.
#[inline(always)]
pub fn fast_asinh(x: f32) -> f32 {
    let size = x.abs();
    // Above 1e18 the square would overflow; no circle is that large.
    let size = if size > 1e18 { 1e18 } else { size };
    let y = size + (size * size + 1.0).sqrt();
    // ln(y), y >= 1: exponent, and the series of atanh for the mantissa in [1/sqrt 2, sqrt 2).
    let bits = y.to_bits();
    let shifted = bits.wrapping_add(0x3f80_0000 - 0x3f35_04f3);
    let exponent = (shifted >> 23) as i32 - 127;
    let mantissa = f32::from_bits((shifted & 0x007f_ffff).wrapping_add(0x3f35_04f3));
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    let w = z * z;
    let ln = 2.0 * z * (1.0 + w * (1.0 / 3.0 + w * (0.2 + w * (1.0 / 7.0 + w / 9.0))))
        + exponent as f32 * std::f32::consts::LN_2;
    // Near 0 the logarithm of 1 + x has lost x's last digits; the series has not.
    let small = size - size * size * size / 6.0;
    (if size < 0.02 { small } else { ln }).copysign(x)
}

/// `3 x^2 - 2 x^3` between 0 and 1, constant outside.
#[inline(always)]
pub fn smoothstep(x: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < 1.0 { x } else { 1.0 };
    x * x * (3.0 - 2.0 * x)
}

/// One cut between two layers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Where, in u.
    pub at: f32,
    /// Half the width of the ramp.
    pub half: f32,
    /// Width of the ramp over which the nearer side stops to be known.
    pub overlap: f32,
}

/// The cuts of a picture, from near to far.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Split {
    /// One fewer than there are layers.
    pub cuts: Vec<Cut>,
    /// See [`knee`].
    pub knee: f32,
}

/// How much a layer has to do with a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Membership {
    /// Coverage of the layer where nothing nearer hides it.
    pub seen: f32,
    /// 1 where all that is seen lies in this layer or farther; 0 where a nearer one hides it.
    pub behind: f32,
}

impl Split {
    /// How many layers there are; layer 0 is the nearest.
    pub fn layers(&self) -> usize {
        self.cuts.len() + 1
    }

    /// Without the layers of which no bin of `pixels` shows anything.
    fn without_empty(mut self, pixels: &[f64]) -> Self {
        let seen = |split: &Self, layer: usize| {
            (0..BINS).any(|bin| {
                let u = bin_centre(bin);
                // A bin's pixels may lie one bin to either side.
                let near = |by: f64| split.membership(layer, (u + by) as f32).seen > 0.0;
                pixels[bin] > 0.0 && (near(-BIN) || near(0.0) || near(BIN))
            })
        };
        let mut layer = 0;
        while layer < self.layers() && self.layers() > 1 {
            if seen(&self, layer) {
                layer += 1;
            } else {
                // What lies on either side of an empty layer is cut by its far side, or by its near side where it is
                // the farthest.
                self.cuts.remove(layer.min(self.cuts.len() - 1));
            }
        }
        self
    }

    /// The position of a diameter on the scale.
    #[inline(always)]
    pub fn position(&self, c: f32) -> f32 {
        fast_asinh(c / self.knee)
    }

    /// Whether a layer lies in front of focus, with all that it has.
    pub fn in_front(&self, layer: usize) -> bool {
        self.cuts.get(layer).is_some_and(|cut| cut.at <= 0.0)
    }

    /// What layer `layer` has to do with a pixel at position `u`.
    #[inline(always)]
    pub fn membership(&self, layer: usize, u: f32) -> Membership {
        self.ramps(layer).at(u)
    }

    /// The ramps of layer `layer`, for loops over pixels.
    pub fn ramps(&self, layer: usize) -> Ramps {
        /// Farther than any position.
        const FAR: f32 = 1e30;
        let behind = match layer.checked_sub(1) {
            Some(nearer) => {
                let cut = self.cuts[nearer];
                [cut.at - cut.half - cut.overlap, 1.0 / cut.overlap]
            }
            None => [-FAR, 1.0],
        };
        let beyond = match self.cuts.get(layer) {
            Some(cut) => [cut.at - cut.half, 0.5 / cut.half],
            None => [FAR, 1.0],
        };
        Ramps { behind, beyond }
    }
}

/// Where one layer begins and ends: each ramp's start in u, and its steepness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramps {
    behind: [f32; 2],
    beyond: [f32; 2],
}

impl Ramps {
    /// What the layer has to do with a pixel at position `u`.
    #[inline(always)]
    pub fn at(&self, u: f32) -> Membership {
        let behind = smoothstep((u - self.behind[0]) * self.behind[1]);
        let beyond = smoothstep((u - self.beyond[0]) * self.beyond[1]);
        Membership { seen: behind * (1.0 - beyond), behind }
    }
}

/// What a picture's diameters look like, for [`Census::split`]. All over u.
#[derive(Debug, Clone, PartialEq)]
pub struct Census {
    /// Pixels in each bin.
    pub pixels: Vec<f64>,
    /// Both ends of each depth edge.
    pub ends: Vec<f64>,
    /// Depth edges that span each bin, as differences from bin to bin.
    pub spans: Vec<f64>,
    /// How many pixels were counted.
    pub count: f64,
}

impl Default for Census {
    fn default() -> Self {
        Self { pixels: vec![0.0; BINS], ends: vec![0.0; BINS], spans: vec![0.0; BINS], count: 0.0 }
    }
}

/// Puts `weight` into the two bins beside `u`.
fn splat(bins: &mut [f64], u: f32, weight: f64) {
    let x = ((f64::from(u) + U_MAX) / BIN - 0.5).clamp(0.0, BINS as f64 - 1.001);
    let (bin, part) = (x as usize, x.fract());
    bins[bin] += weight * (1.0 - part);
    bins[bin + 1] += weight * part;
}

impl Census {
    /// Counts a pixel at position `u`.
    pub fn pixel(&mut self, u: f32) {
        splat(&mut self.pixels, u, 1.0);
        self.count += 1.0;
    }

    /// Counts a pair of neighbours at positions `a` and `b`, whose diameters differ by `step` units
    /// ([`unit()`]): steps below 1 are no edge, from 4 on they count wholly.
    pub fn pair(&mut self, a: f32, b: f32, step: f32) {
        let weight = f64::from(((step - EDGE_FROM) / (EDGE_TO - EDGE_FROM)).clamp(0.0, 1.0));
        if weight > 0.0 {
            splat(&mut self.ends, a, weight);
            splat(&mut self.ends, b, weight);
            splat(&mut self.spans, a.min(b), weight);
            splat(&mut self.spans, a.max(b), -weight);
        }
    }

    /// Adds another part of the same picture.
    pub fn add(&mut self, other: &Self) {
        let both = [
            (&mut self.pixels, &other.pixels),
            (&mut self.ends, &other.ends),
            (&mut self.spans, &other.spans),
        ];
        for (own, other) in both {
            for (own, other) in own.iter_mut().zip(other) {
                *own += other;
            }
        }
        self.count += other.count;
    }

    /// The cuts for at most `layers` layers of a picture `display_width` pixels wide.
    pub fn split(&self, layers: usize, display_width: f32) -> Split {
        let knee = knee(display_width);
        let count = self.count.max(1.0);
        let pixels: Vec<f64> = self.pixels.iter().map(|n| n / count).collect();
        let ends_total = self.ends.iter().sum::<f64>() / count;
        let weights: Vec<f64> = self
            .ends
            .iter()
            .zip(&pixels)
            .map(|(end, pixel)| end / count + ALL_PIXELS * pixel * ends_total.max(LEAST_ENDS))
            .collect();
        let centres = apart(centres(&smooth(&weights, WEIGHTS_DEVIATION), layers.max(1)));

        let mut sum = 0.0;
        let spans: Vec<f64> = self
            .spans
            .iter()
            .map(|step| {
                sum += step / count;
                sum
            })
            .collect();
        let spans = smooth(&spans, PLACE_DEVIATION);
        let most = spans.iter().copied().fold(0.0, f64::max) + 1e-9;
        let density = smooth(&pixels, PLACE_DEVIATION);
        let unit = f64::from(unit(display_width));
        let knee64 = f64::from(knee);
        let mut before = f64::NEG_INFINITY;
        let cuts = centres
            .windows(2)
            .map(|pair| {
                let (a, b) = (pair[0], pair[1]);
                let (middle, width) = (0.5 * (a + b), (b - a).max(LEAST_WINDOW));
                let (mut mass, mut moment) = (0.0, 0.0);
                for bin in 0..BINS {
                    let u = bin_centre(bin);
                    let off = 2.0 * (u - middle) / width;
                    let window = (1.0 - off * off).max(0.0);
                    let weight = window * (spans[bin] / most + NO_SPANS) / (density[bin] / BIN + NO_DENSITY);
                    mass += weight;
                    moment += weight * u;
                }
                let at = (if mass > 1e-12 { moment / mass } else { middle }).max(before);
                before = at;
                // du/dc at the cut: a ramp at least half a unit of diameter wide.
                let slope = 1.0 / (1.0 + at.sinh().powi(2)).sqrt() / knee64;
                let half = (HALF[0] * (b - a)).max(HALF[1] * unit * slope);
                let overlap = (OVERLAP[0] * (b - a)).max(OVERLAP[1] * half);
                Cut { at: at as f32, half: half as f32, overlap: overlap as f32 }
            })
            .collect();
        Split { cuts, knee }.without_empty(&self.pixels)
    }
}

/// Steps between neighbours, in units ([`unit()`]): below the first they are no edge, from the second on they count wholly.
pub const EDGE_FROM: f32 = 1.0;
/// See [`EDGE_FROM`].
pub const EDGE_TO: f32 = 4.0;

/// Standard deviations, over u, of what is smoothed for the centres (without it a group that crosses from one
/// cell to the next pulls its centre along at once).
pub const WEIGHTS_DEVIATION: f64 = 0.15;
/// The same for the places of cuts.
pub const PLACE_DEVIATION: f64 = 0.06;

/// A cut is looked for at least this far around, also where two centres lie in one and the same thing: it then joins the
/// next cut beside that thing instead of going through it.
pub const LEAST_WINDOW: f64 = 1.0;

/// Centres closer than this are one layer's: far from focus, circles up to 1.65 times as large. The light that passes beside the
/// nearer thing is then nearly the same that misses the farther one, and one layer has that right; two count them apart, so what is filled
/// in behind the nearer shines through its rim.
pub const LEAST_APART: f64 = 0.5;

/// How much all pixels weigh beside those at depth edges.
pub const ALL_PIXELS: f64 = 0.1;
/// For that, there are at least so many ends of edges for each pixel.
pub const LEAST_ENDS: f64 = 1e-4;

/// A place that no edge spans weighs as much as so small a part of the most spanned.
pub const NO_SPANS: f64 = 1e-3;
/// A place where nothing lies weighs as if so much did.
pub const NO_DENSITY: f64 = 0.02;

/// Half a ramp is at least so much of the distance between two centres, and of a unit of diameter.
pub const HALF: [f64; 2] = [0.1, 0.25];
/// The overlap is at least so much of that distance, and of half the ramp.
pub const OVERLAP: [f64; 2] = [0.02, 0.5];

/// Sharpness of the smooth minimum and maximum: quantiles would jump from group to group.
pub const SHARPNESS: f64 = 6.0;
/// Holds an empty cell's centre where it was, and moves it softly once something comes; divided by the number of layers.
pub const INERTIA: f64 = 0.05;
/// Rounds of k-means.
pub const ROUNDS: usize = 6;

fn bin_centre(bin: usize) -> f64 {
    (bin as f64 + 0.5) * BIN - U_MAX
}

/// The means of centres that lie closer than [`LEAST_APART`], from near to far.
fn apart(centres: Vec<f64>) -> Vec<f64> {
    let mut means: Vec<f64> = Vec::with_capacity(centres.len());
    let mut of_last = 1.0;
    for centre in centres {
        match means.last_mut() {
            Some(last) if centre - *last < LEAST_APART => {
                of_last += 1.0;
                *last += (centre - *last) / of_last;
            }
            _ => {
                means.push(centre);
                of_last = 1.0;
            }
        }
    }
    means
}

/// One-dimensional k-means from centres spread evenly over what there is; few rounds, since each makes small changes
/// larger.
fn centres(weights: &[f64], layers: usize) -> Vec<f64> {
    let total: f64 = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    // Integrals of 1 and u from the left up to each bin's border.
    let (mut mass, mut moment) = (vec![0.0], vec![0.0]);
    for (bin, weight) in weights.iter().enumerate() {
        mass.push(mass[bin] + weight / total);
        moment.push(moment[bin] + weight / total * bin_centre(bin));
    }
    let at = |integral: &[f64], u: f64| {
        let x = ((u + U_MAX) / BIN).clamp(0.0, BINS as f64);
        let bin = (x as usize).min(BINS - 1);
        integral[bin] + (integral[bin + 1] - integral[bin]) * (x - bin as f64)
    };
    // The smooth minimum and maximum.
    let extreme = |sign: f64| {
        let sum: f64 = weights
            .iter()
            .enumerate()
            .map(|(bin, weight)| weight / total * (SHARPNESS * (sign * bin_centre(bin) - U_MAX)).exp())
            .sum();
        sign * (sum.max(1e-300).ln() / SHARPNESS + U_MAX)
    };
    let (low, high) = (extreme(-1.0), extreme(1.0));
    let step = if layers > 1 { (high - low) / (layers - 1) as f64 } else { 0.0 };
    let mut centres: Vec<f64> = (0..layers).map(|i| low + step * i as f64).collect();
    let inertia = INERTIA / layers as f64;
    for _ in 0..ROUNDS {
        let cuts: Vec<f64> = centres.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
        for (i, centre) in centres.iter_mut().enumerate() {
            let from = if i == 0 { -U_MAX } else { cuts[i - 1] };
            let to = cuts.get(i).copied().unwrap_or(U_MAX);
            let (m, mm) = (at(&mass, to) - at(&mass, from), at(&moment, to) - at(&moment, from));
            *centre = (mm + inertia * *centre) / (m + inertia);
        }
    }
    centres
}

/// How many bins to either side the kernel of standard deviation `deviation` has.
pub fn reach(deviation: f64) -> usize {
    (3.0 * deviation / BIN) as usize + 1
}

/// Smooths over the bins with a Gaussian of standard deviation `deviation`.
fn smooth(bins: &[f64], deviation: f64) -> Vec<f64> {
    let reach = reach(deviation) as isize;
    let kernel: Vec<f64> =
        (-reach..=reach).map(|i| (-0.5 * (i as f64 * BIN / deviation).powi(2)).exp()).collect();
    let total: f64 = kernel.iter().sum();
    (0..bins.len() as isize)
        .map(|i| {
            (-reach..=reach)
                .zip(&kernel)
                .filter_map(|(k, weight)| bins.get(usize::try_from(i + k).ok()?).map(|bin| bin * weight))
                .sum::<f64>()
                / total
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_asinh_is_asinh() {
        for i in -4000..4000 {
            let x = (i as f32 * 0.01).sinh() * 1e-3;
            let error = (f64::from(fast_asinh(x)) - f64::from(x).asinh()).abs();
            // f32's last digit of the result, a few times.
            assert!(error <= 1e-6 * f64::from(x).asinh().abs().max(1.0), "{x} {error}");
        }
        assert_eq!(fast_asinh(0.0), 0.0);
        assert!(fast_asinh(f32::MAX).is_finite());
    }

    fn census(groups: &[(f32, usize)]) -> Census {
        let mut census = Census::default();
        let split = Split { cuts: vec![], knee: knee(960.0) };
        for &(c, n) in groups {
            for _ in 0..n {
                census.pixel(split.position(c));
            }
        }
        for pair in groups.windows(2) {
            for _ in 0..50 {
                let (a, b) = (pair[0].0, pair[1].0);
                census.pair(split.position(a), split.position(b), (a - b).abs());
            }
        }
        census
    }

    #[test]
    fn things_at_different_depths_lie_whole_in_different_layers() {
        let groups = [(-40.0, 500), (-1.0, 2000), (15.0, 3000)];
        let split = census(&groups).split(3, 960.0);
        for (layer, (c, _)) in groups.iter().enumerate() {
            let own = split.membership(layer, split.position(*c));
            assert!(own.seen > 0.99 && own.behind > 0.99, "{layer} {own:?} {split:?}");
        }
    }

    #[test]
    fn things_whose_circles_are_alike_share_a_layer() {
        let layers = |groups: &[(f32, usize)]| census(groups).split(5, 960.0).layers();
        assert_eq!(layers(&[(30.0, 900), (36.0, 900), (40.0, 2000)]), 1);
        assert_eq!(layers(&[(30.0, 900), (90.0, 2000)]), 2);
        // On both sides of focus nothing is alike.
        assert_eq!(layers(&[(-30.0, 900), (-36.0, 900), (30.0, 900)]), 2);
    }

    #[test]
    fn the_unblurred_layers_cover_every_diameter_once() {
        let split = census(&[(-40.0, 500), (-1.0, 2000), (3.0, 10), (15.0, 3000)]).split(5, 960.0);
        for i in -600..600 {
            let u = split.position(i as f32 * 0.1);
            let mut clear = 1.0;
            for layer in 0..split.layers() {
                clear *= 1.0 - split.membership(layer, u).seen;
            }
            // Some layer covers wholly, up to the rounding of products.
            assert!(clear < 1e-6, "{i} {clear}");
        }
    }

    #[test]
    fn any_census_gives_finite_ordered_cuts() {
        for census in [Census::default(), census(&[(0.0, 1)]), census(&[(1e6, 3), (-1e6, 2)])] {
            for layers in [1, 2, 5, 16] {
                let split = census.split(layers, 960.0);
                // Layers that nothing lies in are left out.
                assert!((1..=layers).contains(&split.layers()));
                assert!(
                    split.cuts.iter().all(|cut| cut.at.is_finite() && cut.half > 0.0 && cut.overlap > 0.0)
                );
                assert!(split.cuts.windows(2).all(|pair| pair[0].at <= pair[1].at + 1e-3));
            }
        }
    }
}
