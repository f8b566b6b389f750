//! What sprites look like: an aperture as shaders read it.

use crate::recorder::Recorder;
use crate::shader::{Part, part};
use pullfocus_core::aperture::{Mask, Outline, Side};
use pullfocus_core::bokeh::LEAST_CUT;
use pullfocus_core::{Aperture, ApertureShape, Result};

/// Steps by which tips are found, and lines by which areas are: beyond f32's sight.
const STEPS: usize = 40;
const LINES: usize = 4096;
/// The sum of a picture's whole numbers: their differences have a sign.
const WHOLE: f64 = 2_147_000_000.0;

/// An aperture on the device.
#[derive(Debug, Clone)]
pub struct Shape {
    /// `outline.wgsl` or `picture.wgsl`.
    pub part: Part,
    /// See there.
    pub buffer: wgpu::Buffer,
    /// A diameter in pixels across and down.
    pub unit: [f32; 2],
    /// The farthest that it reaches from its middle, in diameters.
    pub reach: f32,
    /// Diameters below this lie within their own pixel.
    pub point: f32,
    /// An outline's area in squared diameters; the sum of a picture's numbers.
    pub area: f32,
    /// Sides of an outline.
    pub sides: u32,
    /// Corners of a picture's pixels, across and down.
    pub corners: [u32; 2],
    /// Pixels of a picture's longer side, before it is turned.
    pub longer_side: f32,
}

/// What a [`Shape`] was made of.
#[derive(Debug, PartialEq)]
pub struct ShapeOf {
    aperture: Aperture,
    vertical_scale: f32,
    cut: bool,
}

impl Shape {
    /// The shape of an aperture, made once for as long as it stays; `cut` is whether a cat's eye cuts it.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLimit`] for a picture that is too large, [`pullfocus_core::Error::OutOfMemory`].
    pub fn of(
        recorder: &mut Recorder<'_>,
        aperture: &Aperture,
        vertical_scale: f32,
        cut: bool,
    ) -> Result<Self> {
        let of = ShapeOf { aperture: aperture.clone(), vertical_scale, cut };
        if let Some((known, shape)) = &recorder.memory.shape
            && *known == of
        {
            return Ok(shape.clone());
        }
        let shape = Self::new(recorder, &of)?;
        recorder.memory.shape = Some((of, shape.clone()));
        Ok(shape)
    }

    fn new(recorder: &mut Recorder<'_>, of: &ShapeOf) -> Result<Self> {
        let unit = [1.0 / of.aperture.squeeze, f64::from(of.vertical_scale)];
        let point = |reach: f64| {
            let within = 0.5 / (reach * unit[0].max(unit[1]));
            (if of.cut { LEAST_CUT.min(within) } else { within }) as f32
        };
        let Recorder { context, memory, .. } = recorder;
        let unit32 = unit.map(|unit| unit as f32);
        if let ApertureShape::Image(mask) = &of.aperture.shape {
            let turned = mask.turned(of.aperture.rotation_degrees);
            let (sums, total) = whole_sums(&turned);
            let (width, height) = (mask.width() as f64, mask.height() as f64);
            let reach = 0.5 * width.hypot(height) / width.max(height);
            return Ok(Self {
                part: part!("bokeh/picture"),
                buffer: memory.keep(context, bytemuck::cast_slice(&sums))?,
                unit: unit32,
                reach: reach as f32,
                point: point(reach),
                area: total as f32,
                sides: 0,
                corners: [turned.width() as u32 + 1, turned.height() as u32 + 1],
                longer_side: width.max(height) as f32,
            });
        }
        let outline = of.aperture.outline().unwrap_or(Outline { sides: Vec::new() });
        let reach = outline.reach();
        let both = [outline.clone(), outline.turned_over()];
        let mut values: Vec<[f32; 4]> = both.iter().map(|outline| extent(outline, reach)).collect();
        values.extend(both.iter().flat_map(|outline| outline.sides.iter().map(side)));
        Ok(Self {
            part: part!("bokeh/outline"),
            buffer: memory.keep(context, bytemuck::cast_slice(&values))?,
            unit: unit32,
            reach: reach as f32,
            point: point(reach),
            area: area(&outline, reach) as f32,
            sides: outline.sides.len() as u32,
            corners: [0; 2],
            longer_side: 0.0,
        })
    }
}

/// The side as `outline.wgsl` has it: k, m dx, m dy, a.
fn side(side: &Side) -> [f32; 4] {
    let (bend, m) = if side.radius.is_finite() {
        (0.5 / side.radius, 1.0 - side.apothem / side.radius)
    } else {
        (0.0, 1.0)
    };
    [bend, m * side.direction[0], m * side.direction[1], side.apothem].map(|value| value as f32)
}

/// Top, bottom, and the columns of both tips.
fn extent(outline: &Outline, reach: f64) -> [f32; 4] {
    let tip = |mut outside: f64| {
        let mut inside = 0.0;
        for _ in 0..STEPS {
            let middle = 0.5 * (inside + outside);
            if outline.span(middle).is_some() { inside = middle } else { outside = middle }
        }
        (inside, outline.span(inside).map_or(0.0, |[low, high]| 0.5 * (low + high)))
    };
    let ((top, above), (bottom, below)) = (tip(-reach - 1e-9), tip(reach + 1e-9));
    [top, bottom, above, below].map(|value| value as f32)
}

/// In squared diameters, by lines that are closer where ends slope most.
fn area(outline: &Outline, reach: f64) -> f64 {
    let [top, bottom, ..] = extent(outline, reach).map(f64::from);
    let width = |y: f64| outline.span(y).map_or(0.0, |[low, high]| high - low);
    let line = |i: usize| {
        let angle = std::f64::consts::PI * (i as f64 + 0.5) / LINES as f64;
        let y = 0.5 * (top + bottom) - 0.5 * (bottom - top) * angle.cos();
        width(y) * 0.5 * (bottom - top) * angle.sin()
    };
    (0..LINES).map(line).sum::<f64>() * std::f64::consts::PI / LINES as f64
}

/// [`Mask::summed`] in whole numbers, and the sum of all: differences of these are exact, however large a picture is.
fn whole_sums(mask: &Mask) -> (Vec<u32>, u32) {
    let sum: f64 = mask.data().iter().map(|&value| f64::from(value)).sum();
    // Room for what rounding up adds.
    let scale = (WHOLE - mask.data().len() as f64) / sum;
    let columns = mask.width() + 1;
    let mut sums = vec![0u32; columns * (mask.height() + 1)];
    for (y, values) in mask.data().chunks_exact(mask.width()).enumerate() {
        let mut row = 0u32;
        for (x, &value) in values.iter().enumerate() {
            row += (f64::from(value) * scale).round() as u32;
            sums[(y + 1) * columns + x + 1] = sums[y * columns + x + 1] + row;
        }
    }
    let total = sums.last().copied().unwrap_or(1).max(1);
    (sums, total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn areas_and_extents_are_the_outlines() {
        let disc = Aperture::DISC.outline().unwrap();
        assert!((area(&disc, 0.5) / (PI / 4.0) - 1.0).abs() < 1e-6);
        assert_eq!(extent(&disc, 0.5), [-0.5, 0.5, 0.0, 0.0]);
        // A triangle with a corner to the right: corners at R^2 = 12/16 / (2 + cos 120).
        let triangle = Aperture::blades(3, 0.0).outline().unwrap();
        let corners = (0.75f64 / 1.5).sqrt();
        let exact = 0.75 * 3f64.sqrt() * corners * corners;
        // The corner is between two lines.
        assert!((area(&triangle, corners) / exact - 1.0).abs() < 1e-5);
        let [top, bottom, above, below] = extent(&triangle, corners).map(f64::from);
        let half = 0.5 * 3f64.sqrt() * corners;
        assert!((top + half).abs() < 1e-6 && (bottom - half).abs() < 1e-6);
        assert!((above + 0.5 * corners).abs() < 1e-5 && (below + 0.5 * corners).abs() < 1e-5);
    }

    #[test]
    fn sums_of_a_picture_fit_and_are_its_own() {
        for value in [1e-20, 1.0, 1e20] {
            let mask = Mask::new(64, 3, (0..192).map(|i| value * (i % 7) as f32).collect()).unwrap();
            let (sums, total) = whole_sums(&mask);
            assert!((2_146_000_000..1 << 31).contains(&total));
            let exact = mask.summed();
            let scale = f64::from(total) / exact[exact.len() - 1];
            for (sum, exact) in sums.iter().zip(&exact) {
                // Each pixel is rounded.
                assert!((f64::from(*sum) - exact * scale).abs() < 192.0);
            }
        }
    }
}
