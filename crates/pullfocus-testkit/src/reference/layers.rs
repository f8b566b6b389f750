//! The papers' layers in f64: the background (first paper, 3.1), and the foreground in two forms: the paper's letter (3.2),
//! which fails, and the one that conserves coverage.

use super::diffusion::{diffuse, diffuse_evenly};
use crate::grid::Grid;
use pullfocus_core::diffusion::Diffusion;
use pullfocus_core::layers::general::LEADING;

/// The least specific heat in a diffusion whose gamma is a matte: where a whole line has none, its system would be
/// singular (the second paper did the same).
pub const LEAST_GAMMA: f64 = 1e-6;

/// An element with coverage: premultiplied colours, alpha, signed diameters in pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Premultiplied colour planes.
    pub colors: Vec<Grid>,
    /// Coverage, 0 to 1.
    pub alpha: Grid,
    /// Signed diameters.
    pub diameter: Grid,
}

/// The background's matte: 0 at a diameter of 0 and in front of focus, 1 from `threshold` pixels behind it on.
pub fn matte(diameter: &Grid, threshold: f64) -> Grid {
    diameter.map(|c| (c / threshold).clamp(0.0, 1.0))
}

/// Diameters where `weight` is, carried on to where it is not: diffused with gamma = weight and a constant beta of a
/// filter of `size` pixels. Absolute values, since signed ones would pass through a false zero between two signs.
pub fn extend(diameter: &Grid, weight: &Grid, size: f64, settings: &Diffusion) -> Grid {
    let gamma = weight.map(|w| w.max(LEAST_GAMMA));
    let beta = f64::from(settings.calibration.factor()) * size * size;
    diffuse_evenly(&diameter.map(f64::abs), beta, Some(&gamma), settings).map(|c| c.max(0.0))
}

/// One background layer: diameters extended with gamma = alpha, then colours diffused with gamma = alpha.
pub fn background_layer(colors: &[Grid], diameter: &Grid, threshold: f64, settings: &Diffusion) -> Vec<Grid> {
    let alpha = matte(diameter, threshold);
    let extended = extend(diameter, &alpha, threshold, settings);
    let gamma = alpha.map(|a| a.max(LEAST_GAMMA));
    colors.iter().map(|x| diffuse(x, &extended, Some(&gamma), 1.0, settings)).collect()
}

/// The first paper's picture: the whole diffused as one layer, and over it the background of each threshold in ascending
/// order, `mid (1 - alpha) + background alpha`. The mattes are weights of a blend, not coverages.
pub fn midground_and_background(
    colors: &[Grid],
    diameter: &Grid,
    thresholds: &[f64],
    settings: &Diffusion,
) -> Vec<Grid> {
    let mut picture: Vec<Grid> = colors.iter().map(|x| diffuse(x, diameter, None, 1.0, settings)).collect();
    for &threshold in thresholds {
        let alpha = matte(diameter, threshold);
        let layer = background_layer(colors, diameter, threshold, settings);
        for (mid, back) in picture.iter_mut().zip(&layer) {
            let weighted = back.zip(&alpha, |b, a| b * a);
            *mid = mid.zip(&alpha, |m, a| m * (1.0 - a)).zip(&weighted, |m, b| m + b);
        }
    }
    picture
}

/// Thresholds on a logarithmic scale: each twice the one before.
pub fn thresholds(first: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| first * 2f64.powi(k as i32)).collect()
}

/// `front` over `behind`, colours premultiplied.
pub fn over(front: &[Grid], alpha: &Grid, behind: &[Grid]) -> Vec<Grid> {
    front
        .iter()
        .zip(behind)
        .map(|(f, b)| {
            let seen = b.zip(alpha, |b, a| b * (1.0 - a));
            f.zip(&seen, |f, b| f + b)
        })
        .collect()
}

/// A filter size to extend an element's diameters with: its largest.
fn reach(diameter: &Grid, weight: &Grid) -> f64 {
    diameter
        .data
        .iter()
        .zip(&weight.data)
        .filter(|(_, a)| **a > 0.0)
        .fold(1.0, |most, (c, _)| most.max(c.abs()))
}

/// The foreground as the first paper's 3.2 has it: diameters, colours and alpha all diffused with gamma = alpha.
/// Returns colours and coverage. **The coverage becomes 1 everywhere for a binary matte** (where the object is in every row
/// and column; where it is not, in the rows and columns through it).
pub fn foreground_letter(element: &Element, settings: &Diffusion) -> (Vec<Grid>, Grid) {
    let reach = reach(&element.diameter, &element.alpha);
    let extended = extend(&element.diameter, &element.alpha, reach, settings);
    let gamma = element.alpha.map(|a| a.max(LEAST_GAMMA));
    let blur = |x: &Grid| diffuse(x, &extended, Some(&gamma), 1.0, settings);
    (element.colors.iter().map(blur).collect(), blur(&element.alpha))
}

/// The foreground with coverage conserved: diameters extended with gamma = alpha, and 1 where light covers nothing; then
/// premultiplied colours and alpha diffused with gamma = 1.
pub fn foreground_conserving(element: &Element, settings: &Diffusion) -> (Vec<Grid>, Grid) {
    let colors = element.colors.iter().take(LEADING);
    let light = colors.fold(element.alpha.map(|_| 0.0), |most, color| most.zip(color, f64::max));
    let weight = element.alpha.zip(&light, |a, light| if a <= 0.0 && light > 0.0 { 1.0 } else { a });
    let extended = extend(&element.diameter, &weight, reach(&element.diameter, &weight), settings);
    let blur = |x: &Grid| diffuse(x, &extended, None, 1.0, settings);
    (element.colors.iter().map(blur).collect(), blur(&element.alpha))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::Diffusion;

    /// A white square of 20 px in the middle of 60, its circles of confusion 8 px.
    fn square() -> Element {
        let inside = |x: usize, y: usize| (20..40).contains(&x) && (20..40).contains(&y);
        let alpha = Grid::from_fn(60, 60, |x, y| f64::from(u8::from(inside(x, y))));
        let diameter = Grid::from_fn(60, 60, |x, y| if inside(x, y) { -8.0 } else { 0.0 });
        Element { colors: vec![alpha.clone()], alpha, diameter }
    }

    /// Why the foreground differs from the paper: where gamma is 0 the initial alpha of 0 is ignored, so the constant 1
    /// solves the system.
    #[test]
    fn the_letter_s_coverage_becomes_one_everywhere() {
        let fence = |x: usize, y: usize| x % 20 < 2 || y % 20 < 2;
        let alpha = Grid::from_fn(60, 60, |x, y| f64::from(u8::from(fence(x, y))));
        let diameter = alpha.map(|a| -8.0 * a);
        let element = Element { colors: vec![alpha.clone()], alpha, diameter };
        let (_, coverage) = foreground_letter(&element, &Diffusion::default());
        // The floor of gamma over the bars' own heat: 18 pixels of 1e-6 beside 2 of 1.
        assert!(coverage.data.iter().all(|a| (a - 1.0).abs() < 1e-3), "a fifth of it is fence");
        // Where an object leaves rows and columns free, those through it become opaque all along, and the corners take
        // the mean of their columns: coverage grows by more than twice.
        let element = square();
        let (_, coverage) = foreground_letter(&element, &Diffusion::default());
        let beside = coverage.at(30, 2).min(coverage.at(30, 57));
        assert!(beside > 0.999, "{beside}");
        let before = element.alpha.sum();
        assert!(coverage.sum() > 2.0 * before, "{} grew from {before}", coverage.sum());
    }

    #[test]
    fn the_conserving_form_keeps_coverage() {
        let element = square();
        let (colors, coverage) = foreground_conserving(&element, &Diffusion::default());
        // The sum is kept by construction; f64 rounding of 3600 values.
        assert!((coverage.sum() - element.alpha.sum()).abs() < 1e-8);
        assert!(coverage.at(3, 30) < 0.01 && coverage.at(30, 30) > 0.99);
        // White over white is white: colour and coverage went through the same filter.
        let white = vec![Grid::filled(60, 60, 1.0)];
        let picture = over(&colors, &coverage, &white);
        assert!(picture[0].data.iter().all(|v| (v - 1.0).abs() < 1e-12));
    }

    #[test]
    fn light_that_covers_nothing_goes_the_same_way() {
        let element = square();
        let glow = Element { alpha: element.alpha.map(|_| 0.0), ..element.clone() };
        let (covering, _) = foreground_conserving(&element, &Diffusion::default());
        let (light, coverage) = foreground_conserving(&glow, &Diffusion::default());
        assert!(light == covering && coverage.data.iter().all(|a| *a == 0.0));
    }

    #[test]
    fn the_background_goes_on_behind_a_sharp_stem() {
        // A sharp bright stem before a dark field with circles of 12 px. In one layer the stem insulates; in the layer
        // behind it the stem is gone.
        let stem = |x: usize| (30..33).contains(&x);
        let color = Grid::from_fn(64, 16, |x, _| if stem(x) { 1.0 } else { 0.2 });
        let diameter = Grid::from_fn(64, 16, |x, _| if stem(x) { 0.0 } else { 12.0 });
        let layer = background_layer(std::slice::from_ref(&color), &diameter, 10.0, &Diffusion::default());
        // The floor lets 1e-6 of three pixels through.
        assert!(layer[0].data.iter().all(|v| (v - 0.2).abs() < 1e-4), "{:?}", layer[0].row(3));
        let picture = midground_and_background(&[color], &diameter, &[10.0, 20.0], &Diffusion::default());
        assert!((picture[0].at(31, 5) - 1.0).abs() < 1e-9 && (picture[0].at(5, 5) - 0.2).abs() < 1e-4);
    }

    #[test]
    fn rows_without_background_give_numbers_between_the_extremes() {
        let color = Grid::from_fn(20, 10, |x, y| ((x + y) % 3) as f64);
        let diameter = Grid::from_fn(20, 10, |_, y| if y < 5 { -4.0 } else { 9.0 });
        let settings = Diffusion {
            integrator: pullfocus_core::Integrator::BackwardEuler { steps: 2 },
            ..Diffusion::default()
        };
        let picture = midground_and_background(&[color], &diameter, &[4.0], &settings);
        assert!(picture[0].data.iter().all(|v| (-1e-9..=2.0 + 1e-9).contains(v)));
    }
}
