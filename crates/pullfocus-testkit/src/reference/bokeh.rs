//! Highlights in f64: every excess as a sprite, covered pixels found by counting points.

use super::spreading::{beyond_iris, corners, on_pixel};
use crate::grid::Grid;
use pullfocus_core::aperture::Mask;
use pullfocus_core::{Aperture, ApertureShape, Bokeh, Frame};

/// Points along each side of a pixel.
const POINTS: usize = 24;

/// The circles of highlights: weighted by the eighth power of brightness over 3 x 3 pixels.
pub fn circles(colors: &[Grid], circle: &Grid) -> Grid {
    let (width, height) = (circle.width, circle.height);
    let bright = |x: usize, y: usize| colors.iter().take(3).map(|color| color.at(x, y)).fold(0.0, f64::max);
    Grid::from_fn(width, height, |x, y| {
        let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let around = || near(y, height).flat_map(|j| near(x, width).map(move |i| (i, j)));
        let most = around().map(|(i, j)| bright(i, j)).fold(0.0, f64::max);
        let weight = |i, j| if most > 0.0 { f64::powi(bright(i, j) / most, 8) } else { 1.0 };
        let sum: f64 = around().map(|(i, j)| weight(i, j) * circle.at(i, j)).sum();
        sum / around().map(|(i, j)| weight(i, j)).sum::<f64>()
    })
}

/// What stays of `colors`, and what leaves them, by the circles of highlights ([`circles`]).
pub fn take_out(colors: &[Grid], circle: &Grid, bokeh: &Bokeh, frame: &Frame) -> (Vec<Grid>, Vec<Grid>) {
    let (t, k) = (bokeh.threshold, bokeh.knee);
    let least = bokeh.least_diameter * frame.display_width() / 960.0;
    let share: Vec<f64> = (0..circle.data.len())
        .map(|i| {
            let b = colors.iter().take(3).map(|color| color.data[i]).fold(0.0, f64::max);
            let excess = if b <= t * (1.0 - k) {
                0.0
            } else if b < t * (1.0 + k) {
                (b - t * (1.0 - k)).powi(2) / (4.0 * t * k)
            } else {
                b - t
            };
            let c = circle.data[i].abs();
            let x =
                if least > 0.0 { (c / least - 1.0).clamp(0.0, 1.0) } else { f64::from(u8::from(c > 0.0)) };
            if excess > 0.0 { x * x * (3.0 - 2.0 * x) * excess / b } else { 0.0 }
        })
        .collect();
    let part = |color: &Grid, f: fn(f64) -> f64| {
        Grid::from_fn(color.width, color.height, |x, y| color.at(x, y) * f(share[y * color.width + x]))
    };
    let stays = colors.iter().map(|color| part(color, |share| 1.0 - share)).collect();
    (stays, colors.iter().map(|color| part(color, |share| share)).collect())
}

/// What is seen at a pixel of signed diameter `own` of a light of signed diameter `c`, where there is one layer.
pub fn seen(c: f64, own: f64, frame: &Frame) -> f64 {
    if c < 0.0 {
        return 1.0;
    }
    let unit = frame.display_width() / 960.0;
    let octaves = (c / unit).max(1.0).log2().min(12.0);
    let first = octaves.floor().min(11.0);
    let at = |octave: f64| {
        let x = (4.0 * own.abs() / (unit * 2f64.powf(octave)) - 1.0).clamp(0.0, 1.0);
        x * x * (3.0 - 2.0 * x)
    };
    at(first) * (1.0 - (octaves - first)) + at(first + 1.0) * (octaves - first)
}

/// The sprite of a pixel: distance across and down, and weight. The sum is 1, less what the cat's eye takes.
pub fn sprite(
    aperture: &Aperture,
    c: f64,
    vertical_scale: f64,
    displacement: [f64; 2],
) -> Vec<(isize, isize, f64)> {
    let turned = match &aperture.shape {
        ApertureShape::Image(mask) => Some((mask.turned(aperture.rotation_degrees), mask)),
        _ => None,
    };
    let outer = match (&aperture.shape, &turned) {
        (_, Some((_, mask))) => {
            0.5 * (mask.width() as f64).hypot(mask.height() as f64) / mask.width().max(mask.height()) as f64
        }
        (ApertureShape::Blades(count), _) => corners(*count, aperture.roundness),
        _ => 0.5,
    };
    let (sign, diameter) = (if c < 0.0 { -1.0 } else { 1.0 }, c.abs());
    let reach = |scale: f64| (outer * diameter * scale) as isize + 2;
    let (wide, high) = (reach(1.0 / aperture.squeeze), reach(vertical_scale));
    let mut pixels = Vec::new();
    let (mut sum, mut points) = (0.0, 0.0);
    for y in -high..=high {
        for x in -wide..=wide {
            let (mut all, mut kept) = (0.0, 0.0);
            let of_mask = |(turned, mask): &(Mask, &Mask)| {
                let unit = mask.width().max(mask.height()) as f64 / diameter;
                let unit = [unit * aperture.squeeze, unit / vertical_scale];
                let (x, y) = if c < 0.0 { (-x, -y) } else { (x, y) };
                on_pixel(turned, unit, x, y)
            };
            let light = turned.as_ref().map(of_mask);
            for i in 0..POINTS * POINTS {
                let place = |k: usize| (k as f64 + 0.5) / POINTS as f64 - 0.5;
                // In diameters, as light passes behind focus.
                let u = sign * (x as f64 + place(i % POINTS)) * aperture.squeeze / diameter;
                let v = sign * (y as f64 + place(i / POINTS)) / vertical_scale / diameter;
                let within = light.unwrap_or_else(|| {
                    let turn = aperture.rotation_degrees.to_radians();
                    let beyond = match aperture.shape {
                        ApertureShape::Blades(count) => {
                            beyond_iris(count, aperture.roundness, turn, u / outer, v / outer)
                        }
                        _ => u.hypot(v) - 0.5,
                    };
                    f64::from(u8::from(beyond <= 0.0))
                });
                let second = (u - displacement[0]).hypot(v - displacement[1]) <= outer;
                all += within;
                kept += if second || displacement == [0.0; 2] { within } else { 0.0 };
            }
            sum += all;
            points += 1.0;
            if kept > 0.0 {
                pixels.push((x, y, kept));
            }
        }
    }
    // Smaller than the distance of points.
    if sum == 0.0 && points > 0.0 {
        return vec![(0, 0, 1.0)];
    }
    pixels.into_iter().map(|(x, y, kept)| (x, y, kept / sum)).collect()
}

/// What `excess` ([`take_out`]) comes to as sprites of the circles `circle`; hidden where a pixel's own surface is nearer and sharper
/// where `own` has its circles.
pub fn sprites(
    excess: &[Grid],
    circle: &Grid,
    bokeh: &Bokeh,
    aperture: &Aperture,
    frame: &Frame,
    own: Option<&Grid>,
) -> Vec<Grid> {
    let (width, height) = (circle.width, circle.height);
    let scale = f64::from(frame.vertical_scale());
    let outer = match &aperture.shape {
        ApertureShape::Image(mask) => {
            0.5 * (mask.width() as f64).hypot(mask.height() as f64) / mask.width().max(mask.height()) as f64
        }
        ApertureShape::Blades(count) => corners(*count, aperture.roundness),
        ApertureShape::Disc => 0.5,
    };
    let mut sums: Vec<Grid> = excess.iter().map(|_| Grid::filled(width, height, 0.0)).collect();
    for i in 0..width * height {
        if excess.iter().all(|color| color.data[i] == 0.0) {
            continue;
        }
        // The axis of these frames is the middle.
        let (w, h) = (width as f64, height as f64 / scale);
        let from_axis = [(i % width) as f64 + 0.5 - 0.5 * w, ((i / width) as f64 + 0.5) / scale - 0.5 * h];
        let displacement = from_axis.map(|d| bokeh.cats_eye * outer * d / (0.5 * w.hypot(h)));
        for (dx, dy, weight) in sprite(aperture, circle.data[i], scale, displacement) {
            let to = (i % width).checked_add_signed(dx).zip((i / width).checked_add_signed(dy));
            let Some((x, y)) = to.filter(|(x, y)| *x < width && *y < height) else { continue };
            let seen = own.map_or(1.0, |own| seen(circle.data[i], own.at(x, y), frame));
            for (sum, color) in sums.iter_mut().zip(excess) {
                sum.data[y * width + x] += bokeh.gain * weight * seen * color.data[i];
            }
        }
    }
    sums
}
