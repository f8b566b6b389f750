//! Bokeh highlights: which light leaves the picture to be spread as discs, and where the discs are seen.
//!
//! Source: Beck-Norén, Valter, Kinner, *Depth of Field by Simulated Heat Diffusion* (2012), 2.4.3: a pixel brighter than a threshold
//! whose circle of confusion is larger than another gets the shape of the aperture.

use crate::error::{Error, Result};
use crate::frame::Frame;
use crate::layers::general::LEADING;
use crate::split::{smoothstep, unit};
use serde::{Deserialize, Serialize};

/// Which light is spread as sprites, and what they look like; their shape is [`crate::Settings::aperture`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct Bokeh {
    /// Brightness from which light is a highlight, above 0: the largest of a pixel's first three colours, linear and premultiplied.
    /// What is above it is spread, what is below stays.
    pub threshold: f64,
    /// Factor on the light that is spread, 0 to 1000; 1 keeps energy.
    pub gain: f64,
    /// How softly light becomes a highlight, 0 to 1: the part of the threshold by which the transition reaches below and above it.
    pub knee: f64,
    /// Diameter of the circle of confusion, in pixels at a width of 960, from which light is spread; from twice that on all of it
    /// is. 0 to 1000.
    pub least_diameter: f64,
    /// Optical vignetting, 0 to 1: in the picture's corners the aperture is cut by a second disc that lies by this part of its radius
    /// farther out.
    pub cats_eye: f64,
}

impl Default for Bokeh {
    fn default() -> Self {
        Self { threshold: 1.0, gain: 1.0, knee: 0.5, least_diameter: 2.0, cats_eye: 0.0 }
    }
}

/// The largest gain.
pub const MOST_GAIN: f64 = 1000.0;
/// The largest least diameter.
pub const MOST_LEAST_DIAMETER: f64 = 1000.0;

impl Bokeh {
    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        let refuse = |name, value, reason| Err(Error::Setting { name, value, reason });
        if !(self.threshold.is_finite() && self.threshold > 0.0) {
            return refuse("highlights' threshold", self.threshold, "must be above 0");
        }
        if !(0.0..=MOST_GAIN).contains(&self.gain) {
            return refuse("highlights' gain", self.gain, "must lie between 0 and 1000");
        }
        if !(0.0..=1.0).contains(&self.knee) {
            return refuse("highlights' knee", self.knee, "must lie between 0 and 1");
        }
        if !(0.0..=MOST_LEAST_DIAMETER).contains(&self.least_diameter) {
            let reason = "must lie between 0 and 1000 pixels at a width of 960";
            return refuse("highlights' least diameter", self.least_diameter, reason);
        }
        if !(0.0..=1.0).contains(&self.cats_eye) {
            return refuse("cat's eye", self.cats_eye, "must lie between 0 and 1");
        }
        Ok(())
    }

    /// The formulas for a picture whose display window is so wide.
    pub fn curve(&self, display_width: f32) -> Curve {
        let (threshold, knee) = (self.threshold as f32, self.knee as f32);
        Curve {
            threshold,
            low: threshold * (1.0 - knee),
            high: threshold * (1.0 + knee),
            bend: 1.0 / (4.0 * threshold * knee),
            least: self.least_diameter as f32 * unit(display_width),
        }
    }
}

/// Which part of a pixel's light is a highlight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Brightness t above which all is a highlight.
    pub threshold: f32,
    /// `t (1 - k)`: none is, up to here.
    pub low: f32,
    /// `t (1 + k)`: the end of the knee.
    pub high: f32,
    /// `1 / (4 t k)`.
    pub bend: f32,
    /// The least diameter in pixels of this picture.
    pub least: f32,
}

impl Curve {
    /// The part, 0 to 1, of the light of a pixel of this brightness and circle of confusion (of either sign, in pixels) that
    /// is spread. All its colours give the same part, so hue is kept; what stays is 0 where there is no blur.
    ///
    /// With t the threshold, k the knee and b the brightness, the light that leaves is 0 up to `t (1 - k)`, then
    /// `(b - t (1 - k))^2 / (4 t k)`, and `b - t` from `t (1 + k)` on: continuous with its slope. Over the circle of confusion it is
    /// `3 x^2 - 2 x^3` between the least diameter and twice that.
    #[inline(always)]
    pub fn share(&self, brightness: f32, circle: f32) -> f32 {
        let over = brightness - self.low;
        let diameter = circle.abs();
        // Both comparisons are false for NaN.
        if !(over > 0.0 && diameter > self.least) {
            return 0.0;
        }
        let excess =
            if brightness < self.high { over * over * self.bend } else { brightness - self.threshold };
        let ramp = if self.least > 0.0 { smoothstep(diameter / self.least - 1.0) } else { 1.0 };
        ramp * excess / brightness
    }
}

/// The brightness of a pixel: the largest of its first three colours, at least 0.
#[inline(always)]
pub fn brightness(colors: impl Iterator<Item = f32>) -> f32 {
    colors.take(LEADING).fold(0.0, |most, value| if value > most { value } else { most })
}

/// How much a neighbour's circle of confusion counts for a highlight, where `part` is its brightness in parts of the brightest one's.
///
/// A light's edge pixels hold its light and the depth of what is behind it, so a highlight's circle is the mean over its 3 x 3
/// pixels, weighted by the eighth power of their brightness: nearly that of the brightest, and no jump as one outshines another.
#[inline(always)]
pub fn trust(part: f32) -> f32 {
    let square = part * part;
    square * square * square * square
}

/// Less of a layer left by nearer ones is not made up for.
pub const LEAST_CLEAR: f32 = 0.02;

/// Diameters in pixels below which a cat's eye takes nothing away.
pub const LEAST_CUT: f64 = 1.0 / 16.0;

/// How many [`node`]s there are: up to four widths of the picture, the largest circle.
pub const NODES: usize = 13;

/// Diameter in pixels of node `k`, from which on the light behind focus is told apart by its circle where there is one layer.
pub fn node(k: usize, display_width: f32) -> f32 {
    unit(display_width) * (1u32 << k.min(NODES - 1)) as f32
}

/// The two nodes that a light behind focus of this diameter, in pixels, belongs to: the first one's number, and the second's share.
#[inline(always)]
pub fn nodes(diameter: f32, display_width: f32) -> (usize, f32) {
    let octaves = (diameter / unit(display_width)).max(1.0).log2().min((NODES - 1) as f32);
    let first = (octaves as usize).min(NODES - 2);
    (first, octaves - first as f32)
}

/// What is seen of a light behind focus at a pixel, 0 to 1, where there is one layer: nothing where that pixel's own
/// surface is nearer and much sharper. `node` is the light's diameter and `own` the pixel's signed one; a quarter of the light's
/// circle hides, from half of it on the light is seen. A light in front of focus is seen wherever it reaches.
///
/// A ray from the pixel to the light, q + (p - q) at the light's depth, passes the pixel's depth at `q + (p - q) own / node`: for a
/// sharp pixel where that itself is, for one as blurred as the light where the light is, which nothing hides there.
#[inline(always)]
pub fn seen(node: f32, own: f32) -> f32 {
    smoothstep(4.0 * own.abs() / node - 1.0)
}

/// Where pixels lie beside the optical axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// The axis' column and row; a pixel's centre is a whole number.
    pub axis: [f64; 2],
    /// From the axis to a corner, in pixels of width.
    pub half_diagonal: f64,
    /// Pixels of height for one of width.
    pub vertical_scale: f64,
}

impl Field {
    /// The field of a frame.
    pub fn new(frame: &Frame) -> Self {
        let (width, height) = (frame.display_width(), frame.display.size.height.max(1) as f64);
        let vertical_scale = f64::from(frame.vertical_scale());
        // Units of the screen window are widths of the display window over its own width.
        let unit = width / f64::from(frame.screen_window_width).max(f64::MIN_POSITIVE);
        let offset = frame.screen_window_center.map(|centre| f64::from(centre) * unit);
        let axis = [
            f64::from(frame.display.x) - f64::from(frame.data.x) + 0.5 * width - offset[0] - 0.5,
            f64::from(frame.display.y) - f64::from(frame.data.y) + 0.5 * height + offset[1] * vertical_scale
                - 0.5,
        ];
        Self { axis, half_diagonal: 0.5 * width.hypot(height / vertical_scale), vertical_scale }
    }

    /// Where a pixel lies: 0 on the axis, a vector of length 1 (and no more) in the corners; x to the right, y down.
    pub fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let across = (x - self.axis[0]) / self.half_diagonal;
        let down = (y - self.axis[1]) / (self.vertical_scale * self.half_diagonal);
        let beyond = across.hypot(down).max(1.0);
        // Where numbers end there is no direction.
        if beyond.is_finite() && across.is_finite() && down.is_finite() {
            [across / beyond, down / beyond]
        } else {
            [0.0; 2]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::size::Size;

    #[test]
    fn light_leaves_smoothly() {
        let bokeh = Bokeh { threshold: 2.0, knee: 0.5, ..Bokeh::default() };
        let curve = bokeh.curve(960.0);
        assert_eq!(curve.share(1.0, 40.0), 0.0);
        // Above the knee what stays is the threshold.
        for b in [3.0, 10.0, 65504.0] {
            assert!(((1.0 - curve.share(b, 40.0)) * b / 2.0 - 1.0).abs() < 1e-2, "{b}");
        }
        let excess = |b: f32| b * curve.share(b, -40.0);
        for i in 0..400 {
            let b = 0.9 + 0.01 * i as f32;
            let (step, next) = (excess(b + 0.01) - excess(b), excess(b + 0.02) - excess(b + 0.01));
            // The slope is at most 1 and changes by at most 0.01 / (2 t k); rounding.
            assert!((-1e-6..0.0101).contains(&step), "{b}: {step}");
            assert!((next - step).abs() < 1e-4 * 0.5 + 2e-6, "{b}");
        }
        for i in 0..200 {
            let (c, next) = (0.04 * i as f32, 0.04 * (i + 1) as f32);
            let step = curve.share(9.0, next) - curve.share(9.0, c);
            // The steepest slope of the ramp is 1.5 over two pixels.
            assert!((0.0..0.031).contains(&step), "{c}: {step}");
        }
        assert_eq!(curve.share(9.0, 0.0), 0.0);
        for odd in [f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(curve.share(odd, 9.0), 0.0);
        }
        assert_eq!(curve.share(9.0, f32::NAN), 0.0);
        let hard = Bokeh { knee: 0.0, least_diameter: 0.0, ..bokeh }.curve(960.0);
        assert_eq!((hard.share(2.0, 1.0), hard.share(4.0, 1e-3), hard.share(4.0, 0.0)), (0.0, 0.5, 0.0));
    }

    #[test]
    fn nodes_share_a_light() {
        let mut last = 0.0;
        for i in 0..2000 {
            let c = 0.1 * 1.006f32.powi(i);
            let (first, share) = nodes(c, 1920.0);
            assert!((0.0..=1.0).contains(&share) && first < NODES - 1, "{c}");
            let place = first as f32 + share;
            assert!(place >= last && place - last < 0.01, "{c}");
            last = place;
            // A surface as far away as the light does not hide it, one in focus does.
            let at = |own| {
                let of = |k| seen(node(k, 1920.0), own);
                of(first) * (1.0 - share) + of(first + 1) * share
            };
            assert_eq!((at(c.max(2.0)), at(0.0)), (1.0, 0.0), "{c}");
        }
    }

    #[test]
    fn corners_are_one_away() {
        let frame = Frame { pixel_aspect: 2.0, ..Frame::full(Size::new(100, 80)) };
        let field = Field::new(&frame);
        let [x, y] = field.at(-0.5, -0.5);
        assert!((x.hypot(y) - 1.0).abs() < 1e-12 && x < y && y < 0.0, "{x} {y}");
        assert_eq!(field.at(49.5, 39.5), [0.0, 0.0]);
        assert_eq!(field.at(f64::NAN, 3.0), [0.0, 0.0]);
        let [x, y] = field.at(1e300, 3.0);
        assert!((x - 1.0).abs() < 1e-12 && y.abs() < 1e-12);
        // The axis is where rays are not inclined.
        let moved = Frame { screen_window_center: [0.1, -0.2], screen_window_width: 0.8, ..frame };
        let [x, y] = Field::new(&moved).axis;
        let [across, up] = moved.ray_tangents(0.4, 0, 0);
        let per_pixel = 0.8 / 100.0;
        assert!((across + x * per_pixel).abs() < 1e-6 && (up - y * per_pixel / 2.0).abs() < 1e-6);
    }

    #[test]
    fn odd_settings_are_refused() {
        let plain = Bokeh::default();
        assert!(plain.check().is_ok());
        for odd in [
            Bokeh { threshold: 0.0, ..plain },
            Bokeh { threshold: f64::INFINITY, ..plain },
            Bokeh { gain: -1.0, ..plain },
            Bokeh { knee: 1.1, ..plain },
            Bokeh { knee: f64::NAN, ..plain },
            Bokeh { least_diameter: -2.0, ..plain },
            Bokeh { cats_eye: 1.5, ..plain },
        ] {
            assert!(matches!(odd.check(), Err(Error::Setting { .. })), "{odd:?}");
        }
    }
}
