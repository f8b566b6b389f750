//! A display transform as a table: three shapers and a cube, which the screen's shader and the exports read alike.

use std::fmt;

/// Points along a side. Of ACES 2.0 on an sRGB display, for colours of 2^-12 to 60 in ACEScg, 65 points are 0.13 of 255 off in the
/// mean and 2.4 for one in a hundred; 81 are 0.09 and 1.3, in 8.5 MB that are filled in a third of a second.
pub const SIDE: usize = 81;

/// Below this light the shaper is nearly linear, so that black is a point, and logarithmic above. A larger toe misses the dark end of
/// displays with a pure power (2.4: 1.3 of 255 at the worst 1 % of dark colours by a toe of 1/64, 0.6 by this one), a smaller one spends
/// points there that saturated colours need.
const TOE: f32 = 1.0 / 256.0;

/// Light that is not told apart from what is brighter: ACES 2.0 reaches white at 128, and renders for HDR displays at 4000 nits have
/// 98 % of their highest code there.
const MOST: f32 = 128.0;

/// Red, green, blue of each point, red running fastest; a fourth number, since textures have four.
pub struct Table {
    points: Vec<[f32; 4]>,
}

impl fmt::Debug for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Table").field("side", &SIDE).finish_non_exhaustive()
    }
}

/// Factor on light before 1 is added, and on the logarithm to base 2 of the sum: from light to a place of 0 to 1.
pub fn shaper() -> [f32; 2] {
    [1.0 / TOE, 1.0 / (MOST / TOE + 1.0).log2()]
}

/// Where light stands along a side, 0 to `SIDE - 1`. What is no number is black.
fn place(light: f32) -> f32 {
    let [factor, scale] = shaper();
    let light = if light > 0.0 { light.min(MOST) } else { 0.0 };
    (light * factor + 1.0).log2() * scale * (SIDE - 1) as f32
}

/// The light of a point.
fn light(point: usize) -> f32 {
    let most = f64::from(MOST) / f64::from(TOE) + 1.0;
    let part = point as f64 / (SIDE - 1) as f64;
    ((most.powf(part) - 1.0) * f64::from(TOE)) as f32
}

impl Table {
    /// Fills the table by a transform of red, green, blue and 1 for many colours at once.
    pub fn bake(mut transform: impl FnMut(&mut [[f32; 4]])) -> Self {
        let lights: Vec<f32> = (0..SIDE).map(light).collect();
        let mut points = Vec::with_capacity(SIDE * SIDE * SIDE);
        for &blue in &lights {
            for &green in &lights {
                points.extend(lights.iter().map(|&red| [red, green, blue, 1.0]));
            }
        }
        transform(&mut points);
        for point in &mut points {
            // Beyond white and black on purpose: what lies between two points is clipped after the way between them.
            *point = point.map(|value| if value.is_nan() { 0.0 } else { value.clamp(-64.0, 64.0) });
        }
        Self { points }
    }

    /// Red, green, blue and one more of each point, red running fastest.
    pub fn points(&self) -> &[[f32; 4]] {
        &self.points
    }

    /// What the shader does: linear light to encoded values of 0 to 1, between points by tetrahedra as OpenColorIO does.
    pub fn apply(&self, light: [f32; 3]) -> [f32; 3] {
        let at = light.map(place);
        let low = at.map(|at| (at as usize).min(SIDE - 2));
        let part = [0, 1, 2].map(|i| at[i] - low[i] as f32);
        let strides = [1, SIDE, SIDE * SIDE];
        let first: usize = (0..3).map(|i| low[i] * strides[i]).sum();
        // From the low corner to the high one, along the axis with the largest part first.
        let [r, g, b] = part;
        let order = match (r >= g, g >= b, r >= b) {
            (true, true, _) => [0, 1, 2],
            (true, false, true) => [0, 2, 1],
            (true, false, false) => [2, 0, 1],
            (false, true, true) => [1, 0, 2],
            (false, true, false) => [1, 2, 0],
            (false, false, _) => [2, 1, 0],
        };
        let mut index = first;
        let mut color = self.points[index];
        let mut before = color;
        for axis in order {
            index += strides[axis];
            let corner = self.points[index];
            for i in 0..4 {
                color[i] += (corner[i] - before[i]) * part[axis];
            }
            before = corner;
        }
        [color[0], color[1], color[2]].map(|value| value.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(light: f32) -> f32 {
        light / (light + 0.2)
    }

    #[test]
    fn points_are_exact_and_between_them_it_is_near() {
        let table = Table::bake(|colors| {
            for [r, g, b, _] in colors {
                (*r, *g, *b) = (curve(*g), curve(*b), curve(*r));
            }
        });
        for point in [0, 1, 7, 40, SIDE - 1] {
            let [r, g, b] = table.apply([light(point), light(SIDE - 1 - point), light(point / 2)]);
            // The logarithm and its inverse in f32: a few units in the last place of a place of up to 80.
            assert!((r - curve(light(SIDE - 1 - point))).abs() < 1e-5);
            assert!((g - curve(light(point / 2))).abs() < 1e-5);
            assert!((b - curve(light(point))).abs() < 1e-5);
        }
        for i in 0..500 {
            let light = [1, 2, 3].map(|k: u32| ((i * 7919 * k) % 1000) as f32 * 0.013);
            let [r, g, b] = table.apply(light);
            for (found, light) in [(r, light[1]), (g, light[2]), (b, light[0])] {
                // Points are 0.13 apart in the logarithm, and the curve bends by 0.1 there at most: an eighth of 0.13² times 0.1 on
                // each of three axes.
                assert!((found - curve(light)).abs() < 1e-3, "{light}: {found}");
            }
        }
    }

    #[test]
    fn what_is_no_number_is_finite() {
        let table = Table::bake(|colors| {
            for (i, color) in colors.iter_mut().enumerate() {
                if i % 3 == 0 {
                    *color = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.0];
                }
            }
        });
        for light in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 1e-40, 1e38] {
            for other in [0.0, 0.3, light] {
                for color in [[light, other, other], [other, light, 1.0], [other, 0.1, light]] {
                    let found = table.apply(color);
                    assert!(found.iter().all(|value| (0.0..=1.0).contains(value)), "{color:?}: {found:?}");
                }
            }
        }
    }
}
