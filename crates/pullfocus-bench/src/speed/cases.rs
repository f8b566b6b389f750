//! What is timed.

use anyhow::Result;
use pullfocus::response::Rational;
use pullfocus::{
    Camera, Cancel, DepthDecoding, Diffusion, Distance, Element, Integrator, Layering, Lens, Picture, Plane,
    Preset, Renderer, Scene, Settings, Size,
};
use pullfocus_cpu::diffusion::{Conductivity, DiffusionBuffers, Medium, diffuse};
use pullfocus_testkit::scenes;
use std::time::Instant;

/// The first paper's settings.
pub fn preview() -> Settings {
    Settings::preset(Preset::Preview)
}

/// The default settings.
pub fn last() -> Settings {
    Settings::preset(Preset::Final)
}

/// The same layers by diffusion.
pub fn last_by_diffusion() -> Settings {
    Settings::default()
}

/// The integrators by name.
pub fn integrators() -> [(&'static str, Diffusion); 3] {
    let of = |integrator| Diffusion { integrator, ..Diffusion::default() };
    [
        ("backward Euler, 1 step", of(Integrator::BackwardEuler { steps: 1 })),
        ("rational (Gaussian)", of(Integrator::Rational(Rational::GAUSSIAN))),
        ("disc", of(Integrator::Disc)),
    ]
}

/// The settings of the tables; the first is the single layer that others are a multiple of.
pub fn named() -> Vec<(&'static str, Settings)> {
    let [euler, gauss, disc] = integrators().map(|(_, diffusion)| Settings {
        layering: Layering::Single,
        diffusion,
        ..Settings::default()
    });
    vec![
        ("one layer, backward Euler", euler),
        ("one layer, rational", gauss),
        ("one layer, disc", disc),
        ("`preview`", preview()),
        ("general layers, diffusion", last_by_diffusion()),
        ("`final`", last()),
    ]
}

/// A scene, a renderer and settings.
pub struct Case {
    scene: Scene,
    original: Picture,
    camera: Camera,
    settings: Settings,
    renderer: Renderer,
}

/// A lens that is focused at 4 m and blurs what is half as far or infinitely far away by `largest` pixels.
pub fn lens(size: Size, largest: f64) -> Result<Camera> {
    let fov_x_degrees: f64 = 40.0;
    let pixels_per_tangent = size.width as f64 / (2.0 * (0.5 * fov_x_degrees).to_radians().tan());
    // c = A (z - s) / (z s) K: A K / s at infinity, as much in front at s / 2.
    let aperture_diameter_m = largest * 4.0 / pixels_per_tangent;
    Ok(Camera::new(Lens::Ideal { fov_x_degrees, aperture_diameter_m }, 4.0)?)
}

/// A ground that runs from 2 m to 30 m, posts on it, sky above.
pub fn depth(size: Size) -> Plane {
    let (w, h) = (size.width.max(1) as f32, size.height.max(1) as f32);
    scenes::plane(size, |x, y| {
        let (u, v) = (x as f32 / w, y as f32 / h);
        let post = (u * 7.0).fract() < 0.12;
        match (post, v) {
            (true, v) if v > 0.15 => 2.0 + 3.0 * (u * 7.0).floor(),
            (_, v) if v < 0.35 => f32::INFINITY,
            // 1/z runs evenly, as on flat ground.
            (_, v) => 1.0 / (1.0 / 30.0 + (0.5 - 1.0 / 30.0) * (v - 0.35) / 0.65),
        }
    })
}

/// Noise on the ground; with `layered` a lattice on top as a foreground element, at half the lens's focus.
pub fn scene(size: Size, layered: bool) -> Scene {
    let colors: Vec<Plane> = (0..3).map(|seed| scenes::noise(size, 0.0, 1.0, seed)).collect();
    let mut scene = scenes::by_depth(colors, depth(size));
    if layered {
        let spacing = (size.width / 8).max(2);
        let alpha = scenes::lattice(size, (spacing / 5).max(1), spacing);
        scene.foreground = Some(Element {
            picture: Picture { colors: vec![alpha.clone(); 3], alpha: Some(alpha) },
            distance: Distance::Depth {
                plane: scenes::constant(size, 2.0),
                decoding: DepthDecoding::default(),
            },
        });
    }
    scene
}

/// Every twentieth pixel a light, all infinitely far away.
pub fn lights(size: Size) -> Scene {
    let light = |x: usize, y: usize| (y * size.width + x) % 20 == y % 20;
    let plane = |value: f32| scenes::plane(size, move |x, y| if light(x, y) { value } else { 0.1 });
    scenes::by_depth([40.0, 30.0, 20.0].map(plane).into(), scenes::constant(size, f32::INFINITY))
}

/// Signed diameters of [`depth`] through [`lens`].
pub fn circle(size: Size, largest: f64) -> Result<Plane> {
    let formula = lens(size, largest)?.circle_of_confusion(&pullfocus::Frame::full(size));
    let depth = depth(size);
    Ok(scenes::plane(size, |x, y| formula.diameter(f64::from(depth.at(x, y))) as f32))
}

impl Case {
    /// A scene of `size` whose largest circle is about `largest` pixels; with `layered` a foreground element on top.
    pub fn new(size: Size, largest: f64, layered: bool, settings: Settings) -> Result<Self> {
        let scene = scene(size, layered);
        let original = scene.base.picture.clone();
        Ok(Self { scene, original, camera: lens(size, largest)?, settings, renderer: Renderer::new() })
    }

    /// Renders once; seconds.
    pub fn run(&mut self) -> Result<f64> {
        for (plane, original) in self.scene.base.picture.planes_mut().zip(self.original.planes()) {
            plane.data_mut().copy_from_slice(original.data());
        }
        let start = Instant::now();
        self.renderer.render(&mut self.scene, Some(&self.camera), &self.settings, &Cancel::new())?;
        Ok(start.elapsed().as_secs_f64())
    }
}

/// A diffusion of three planes, without anything else.
pub struct DiffusionCase {
    planes: Vec<Plane>,
    circle: Plane,
    settings: Diffusion,
    buffers: DiffusionBuffers,
}

impl DiffusionCase {
    /// Random colours, circles of up to 50 px.
    pub fn new(size: Size, settings: Diffusion) -> Result<Self> {
        let circle = circle(size, 50.0)?;
        let planes = (0..3).map(|seed| scenes::noise(size, 0.0, 1.0, seed)).collect();
        Ok(Self { planes, circle, settings, buffers: DiffusionBuffers::new() })
    }

    /// Diffuses what the last run left; seconds. Values stay between 0 and 1, so the work is the same.
    pub fn run(&mut self) -> Result<f64> {
        let medium =
            Medium { conductivity: Conductivity::Circle(&self.circle), gamma: None, vertical_scale: 1.0 };
        let mut planes: Vec<&mut Plane> = self.planes.iter_mut().collect();
        let start = Instant::now();
        diffuse(&mut planes, &medium, &self.settings, false, &mut self.buffers, &Cancel::new())?;
        Ok(start.elapsed().as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_circle_is_as_told() {
        let size = Size::new(320, 180);
        let formula = lens(size, 50.0).unwrap().circle_of_confusion(&pullfocus::Frame::full(size));
        let circles =
            depth(size).data().iter().map(|&z| formula.diameter(f64::from(z)).abs()).fold(0.0, f64::max);
        assert!((circles - 50.0).abs() < 0.5, "{circles}");
        let front = depth(size).data().iter().map(|&z| formula.diameter(f64::from(z))).fold(0.0, f64::min);
        assert!(front < -20.0, "some of it lies in front: {front}");
    }
}
