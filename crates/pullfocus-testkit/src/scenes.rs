//! Pictures whose right answer is known: test patterns with circles of confusion or with depth.

use crate::grid::Grid;
use crate::random::Random;
use pullfocus_core::{Camera, DepthDecoding, Distance, Element, Frame, Lens, Picture, Plane, Scene, Size};

/// A plane of `size` by formula; tests have the memory.
pub fn plane(size: Size, f: impl FnMut(usize, usize) -> f32) -> Plane {
    Plane::from_fn(size, f).expect("memory for a test picture")
}

/// Squares of `cell` pixels, 0 and 1.
pub fn checker(size: Size, cell: usize) -> Plane {
    plane(size, |x, y| ((x / cell + y / cell) % 2) as f32)
}

/// `left` up to the middle column, `right` from there.
pub fn step_edge(size: Size, left: f32, right: f32) -> Plane {
    plane(size, |x, _| if x < size.width / 2 { left } else { right })
}

/// One pixel of `value` in the middle of black.
pub fn point(size: Size, value: f32) -> Plane {
    plane(size, |x, y| if (x, y) == (size.width / 2, size.height / 2) { value } else { 0.0 })
}

/// From `first` in the left column to `last` in the right one.
pub fn ramp(size: Size, first: f32, last: f32) -> Plane {
    let end = size.width.saturating_sub(1).max(1) as f32;
    plane(size, |x, _| first + (last - first) * x as f32 / end)
}

/// The same value everywhere.
pub fn constant(size: Size, value: f32) -> Plane {
    plane(size, |_, _| value)
}

/// Values between `low` and `high` without any pattern.
pub fn noise(size: Size, low: f64, high: f64, seed: u64) -> Plane {
    let mut random = Random::new(seed);
    plane(size, |_, _| random.between(low, high) as f32)
}

/// A lattice of bars `bar` pixels wide every `spacing` pixels, both ways: 1 on a bar.
pub fn lattice(size: Size, bar: usize, spacing: usize) -> Plane {
    plane(size, |x, y| if x % spacing < bar || y % spacing < bar { 1.0 } else { 0.0 })
}

/// A picture of three colour planes given by circles of confusion.
pub fn by_circle(colors: Vec<Plane>, alpha: Option<Plane>, circle: Plane) -> Scene {
    let frame = Frame::full(circle.size());
    Scene::new(frame, Element { picture: Picture { colors, alpha }, distance: Distance::Coc(circle) })
}

/// A picture of planar depth in metres.
pub fn by_depth(colors: Vec<Plane>, depth: Plane) -> Scene {
    let frame = Frame::full(depth.size());
    let distance = Distance::Depth { plane: depth, decoding: DepthDecoding::default() };
    Scene::new(frame, Element { picture: Picture::opaque(colors), distance })
}

/// A picture like those that come: a textured ramp from sharp to `far` pixels, and before it a lattice at `near`
/// (negative: in front of focus).
pub fn fence_over_ramp(size: Size, near: f32, far: f32) -> Scene {
    let spacing = (size.width / 6).max(3);
    let fence = lattice(size, (spacing / 5).max(1), spacing);
    let texture = noise(size, 0.05, 0.6, 17);
    let checks = checker(size, (size.width / 20).max(1));
    let depth = ramp(size, 0.0, far);
    let pick = |bar: f32, gain: f32| {
        plane(size, |x, y| {
            if fence.at(x, y) > 0.0 { bar } else { gain * (texture.at(x, y) + 0.4 * checks.at(x, y)) }
        })
    };
    let circle = plane(size, |x, y| if fence.at(x, y) > 0.0 { near } else { depth.at(x, y) });
    by_circle(vec![pick(0.8, 1.0), pick(0.7, 0.8), pick(0.2, 0.5)], None, circle)
}

/// Three things side by side, the middle one a sliver along a slanted border: colour is the mean over each pixel, depth that
/// of its middle.
#[derive(Debug, Clone, Copy)]
pub struct Sliver {
    /// Width and height.
    pub size: Size,
    /// How far the border goes to the right from row to row.
    pub slope: f32,
    /// The sliver's width along a row, in pixels.
    pub wide: f32,
    /// Signed diameters, from left to right.
    pub diameters: [f32; 3],
    /// The colour of each.
    pub colors: [f32; 3],
}

impl Sliver {
    /// Which of the three is seen at a point.
    fn thing(&self, x: f32, y: f32) -> usize {
        let [width, height] = [self.size.width as f32, self.size.height as f32];
        let beyond = x - 0.5 * width - self.slope * (y - 0.5 * height);
        usize::from(beyond >= 0.0) + usize::from(beyond >= self.wide)
    }

    /// The picture, a part of one 960 pixels wide.
    pub fn scene(&self) -> Scene {
        const SAMPLES: usize = 4;
        let part = |i: usize| (i as f32 + 0.5) / SAMPLES as f32;
        let color = plane(self.size, |x, y| {
            let seen = (0..SAMPLES * SAMPLES)
                .map(|i| self.thing(x as f32 + part(i % SAMPLES), y as f32 + part(i / SAMPLES)));
            seen.map(|thing| self.colors[thing]).sum::<f32>() / (SAMPLES * SAMPLES) as f32
        });
        let circle = plane(self.size, |x, y| self.diameters[self.thing(x as f32 + 0.5, y as f32 + 0.5)]);
        let mut scene = by_circle(vec![color], None, circle);
        scene.frame.display.size = Size::new(960, 540);
        scene
    }
}

/// Two planes at exact depths: a half plane of one colour in front of another colour everywhere.
#[derive(Debug, Clone)]
pub struct TwoPlanes {
    /// Width and height.
    pub size: Size,
    /// Depth of the half plane, on the left, in metres.
    pub near_m: f64,
    /// Depth of what is behind, in metres.
    pub far_m: f64,
    /// The colour of each.
    pub colors: [f32; 2],
    /// The camera.
    pub camera: Camera,
}

impl TwoPlanes {
    /// Half a picture at 1 m in front of the other at 4 m, focused at `focus_m`, aperture 20 mm, 40 degrees wide.
    pub fn new(size: Size, focus_m: f64) -> Self {
        let lens = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
        let camera = Camera::new(lens, focus_m).expect("a lens that can be");
        Self { size, near_m: 1.0, far_m: 4.0, colors: [0.9, 0.2], camera }
    }

    /// Signed diameters of the two planes.
    pub fn diameters(&self) -> [f64; 2] {
        let coc = self.camera.circle_of_confusion(&Frame::full(self.size));
        [coc.diameter(self.near_m), coc.diameter(self.far_m)]
    }

    /// The pinhole picture with its depth.
    pub fn single(&self) -> Scene {
        let [near, far] = self.colors;
        by_depth(
            vec![step_edge(self.size, near, far)],
            step_edge(self.size, self.near_m as f32, self.far_m as f32),
        )
    }

    /// The same as a foreground and what is behind it.
    pub fn layered(&self) -> Scene {
        let [near, far] = self.colors;
        let mut scene = by_depth(vec![constant(self.size, far)], constant(self.size, self.far_m as f32));
        let depth = constant(self.size, self.near_m as f32);
        scene.foreground = Some(Element {
            picture: Picture {
                colors: vec![step_edge(self.size, near, 0.0)],
                alpha: Some(step_edge(self.size, 1.0, 0.0)),
            },
            distance: Distance::Depth { plane: depth, decoding: DepthDecoding::default() },
        });
        scene
    }

    /// What the lens sees in column `x`: both colours are even, so only the near plane's edge is blurred, whatever
    /// is in focus.
    pub fn exact(&self, x: usize) -> f64 {
        let [near, far] = self.colors.map(f64::from);
        let inside = (self.size.width / 2) as f64 - (x as f64 + 0.5);
        let coverage = half_plane_under_disc(inside, self.diameters()[0].abs());
        near * coverage + far * (1.0 - coverage)
    }
}

/// The part of a disc's area that lies in a half plane, its centre `inside` pixels within the edge.
pub fn half_plane_under_disc(inside: f64, diameter: f64) -> f64 {
    let t = if diameter > 0.0 { inside / (0.5 * diameter) } else { f64::INFINITY.copysign(inside) };
    if t.abs() >= 1.0 {
        return f64::from(u8::from(t > 0.0));
    }
    0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / std::f64::consts::PI
}

/// What an anti-aliasing renderer does to depth (and should not): the mean over `factor` by `factor` pixels.
pub fn box_filtered(large: &Plane, factor: usize) -> Plane {
    let grid = Grid::from_plane(large);
    let size = Size::new(grid.width / factor, grid.height / factor);
    plane(size, |x, y| {
        let sum: f64 =
            (0..factor * factor).map(|i| grid.at(x * factor + i % factor, y * factor + i / factor)).sum();
        (sum / (factor * factor) as f64) as f32
    })
}

/// What a renderer should do: the value at each pixel's centre.
pub fn centre_sampled(large: &Plane, factor: usize) -> Plane {
    let size = Size::new(large.size().width / factor, large.size().height / factor);
    plane(size, |x, y| large.at(x * factor + factor / 2, y * factor + factor / 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_disc_lies_in_a_half_plane_through_its_centre() {
        assert_eq!(half_plane_under_disc(0.0, 5.0), 0.5);
        assert_eq!((half_plane_under_disc(9.0, 5.0), half_plane_under_disc(-9.0, 5.0)), (1.0, 0.0));
        assert_eq!((half_plane_under_disc(0.5, 0.0), half_plane_under_disc(-0.5, 0.0)), (1.0, 0.0));
        // The mean over the disc's width is one half, by symmetry; 1000 midpoints.
        let mean =
            (0..1000).map(|i| half_plane_under_disc(-2.5 + (f64::from(i) + 0.5) / 200.0, 5.0)).sum::<f64>()
                / 1000.0;
        assert!((mean - 0.5).abs() < 1e-9);
    }

    #[test]
    fn the_scenes_are_scenes() {
        let size = Size::new(37, 23);
        let planes = TwoPlanes::new(size, 4.0);
        for scene in [planes.single(), planes.layered(), fence_over_ramp(size, -8.0, 12.0)] {
            scene.check().unwrap();
        }
        assert!(planes.diameters()[0] < -0.5 && planes.diameters()[1].abs() < 1e-12);
        assert!((planes.exact(0) - 0.9).abs() < 1e-6 && (planes.exact(36) - 0.2).abs() < 1e-6);
    }

    #[test]
    fn filtered_depth_lies_between_and_sampled_depth_does_not() {
        let large = step_edge(Size::new(33, 6), 1.0, 4.0);
        let (filtered, sampled) = (box_filtered(&large, 3), centre_sampled(&large, 3));
        assert_eq!(filtered.size(), Size::new(11, 2));
        assert!(filtered.data().iter().any(|v| *v > 1.1 && *v < 3.9));
        assert!(sampled.data().iter().all(|v| *v == 1.0 || *v == 4.0));
    }
}
