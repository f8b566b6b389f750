//! Highlights against the path tracer's lights, and pictures of their shapes.

use crate::data::{DevScene, Reference};
use crate::panels::Panel;
use crate::place::{Output, provenance, workspace};
use anyhow::{Context, Result};
use clap::Args;
use pullfocus::aperture::Mask;
use pullfocus::{
    Aperture, ApertureShape, Bokeh, Cancel, Distance, Element, Frame, Layering, Method, Picture, Plane,
    Preset, Renderer, Scene, Settings, Size,
};
use serde::Deserialize;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::PathBuf;

/// Options of `bokeh`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    /// Folder of the scene with lights; the 480 x 270 one that ships with the project where none is given.
    #[arg(long, value_name = "DIR")]
    scene: Option<PathBuf>,
    /// Brightness from which light is a highlight.
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    threshold: f64,
    /// Write whole pictures (PNG) into this folder, to be looked at.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
}

#[derive(Deserialize)]
struct Lights {
    #[serde(rename = "pixels_per_unit_tangent_K")]
    tangent: f64,
    lights: Vec<Light>,
}

/// A light of the scene; distances in metres.
#[derive(Deserialize)]
struct Light {
    z_m: f64,
    radius_m: f64,
    radiance: [f64; 3],
    px: [f64; 2],
}

/// A light's image: place, diameter of its circle of confusion and of itself, in pixels.
#[derive(Clone, Copy)]
struct Spot {
    at: [f64; 2],
    circle: f64,
    own: f64,
    /// All of its light, colours added up.
    light: f64,
}

impl Spot {
    fn reach(&self) -> f64 {
        0.5 * (self.circle + self.own) + 3.0
    }

    fn distance(&self, [x, y]: [f64; 2]) -> f64 {
        (x - self.at[0]).hypot(y - self.at[1])
    }
}

/// Energy above what is around, and diameter: of the disc that has this energy at the brightness of the middle.
#[derive(Clone, Copy)]
struct Measured {
    energy: f64,
    diameter: f64,
}

/// The median; 0 of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn measure(picture: &Picture, spot: &Spot) -> Measured {
    let Size { width, height } = picture.size();
    let reach = spot.reach();
    let (mut ring, mut middle, mut inside) = (vec![], vec![], vec![]);
    for y in 0..height {
        for x in 0..width {
            let away = spot.distance([x as f64 + 0.5, y as f64 + 0.5]);
            let value = picture.colors.iter().map(|plane| f64::from(plane.at(x, y))).sum::<f64>();
            if away < reach {
                inside.push(value);
                if away < 0.6 * 0.5 * (spot.circle - spot.own) {
                    middle.push(value);
                }
            } else if away < reach + 3.0 {
                ring.push(value);
            }
        }
    }
    let around = median(ring);
    let energy = inside.iter().map(|value| value - around).sum::<f64>();
    let plateau = median(middle) - around;
    Measured { energy, diameter: 2.0 * (energy / (PI * plateau)).max(0.0).sqrt() }
}

/// Lights whose discs lie apart from each other and from the border, and are larger than the lights.
fn apart(file: &Lights, reference: &Reference, size: Size) -> Vec<Spot> {
    let lens = reference.camera.circle_of_confusion(&Frame::full(size));
    let spot = |light: &Light| Spot {
        at: light.px,
        circle: lens.diameter(light.z_m),
        own: 2.0 * light.radius_m * file.tangent / light.z_m,
        light: light.radiance.iter().sum::<f64>() * PI * (light.radius_m * file.tangent / light.z_m).powi(2),
    };
    let all: Vec<Spot> = file.lights.iter().map(spot).collect();
    let alone = |(i, spot): &(usize, &Spot)| {
        let margin = spot.reach() + 4.0;
        let within = |p: f64, side: usize| p > margin && p < side as f64 - margin;
        spot.circle > 2.0 * spot.own.max(2.0)
            && within(spot.at[0], size.width)
            && within(spot.at[1], size.height)
            && all.iter().enumerate().all(|(j, other)| {
                j == *i
                    || spot.distance(other.at) > spot.reach() + 3.0 + 0.5 * (other.circle.abs() + other.own)
            })
    };
    all.iter().enumerate().filter(alone).map(|(_, spot)| *spot).collect()
}

fn render(mut scene: Scene, reference: &Reference, settings: &Settings) -> Result<(Picture, usize)> {
    scene.base.picture.alpha = None;
    let report = Renderer::new().render(&mut scene, Some(&reference.camera), settings, &Cancel::new())?;
    Ok((scene.base.picture, report.highlights.unwrap_or(0)))
}

/// Each way of rendering that is measured, with and without highlights.
fn ways(bokeh: Bokeh) -> Vec<(&'static str, bool, Settings)> {
    let with = |layering, method, bokeh| Settings { layering, method, bokeh, ..Settings::default() };
    let (single, general) = (Layering::Single, Layering::default());
    vec![
        ("final", false, with(general, Method::Aperture, None)),
        ("final, highlights", false, with(general, Method::Aperture, Some(bokeh))),
        ("final of foreground and behind", true, with(general, Method::Aperture, None)),
        ("final of foreground and behind, highlights", true, with(general, Method::Aperture, Some(bokeh))),
        ("general layers, diffusion", false, with(general, Method::Diffusion, None)),
        ("general layers, diffusion, highlights", false, with(general, Method::Diffusion, Some(bokeh))),
        ("one layer", false, with(single, Method::Diffusion, None)),
        ("one layer, highlights", false, with(single, Method::Diffusion, Some(bokeh))),
        ("one layer, pyramid", false, with(single, Method::Pyramid, None)),
        ("one layer, pyramid, highlights", false, with(single, Method::Pyramid, Some(bokeh))),
        ("background, highlights", false, with(Layering::PAPER, Method::Diffusion, Some(bokeh))),
    ]
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let folder = options.scene.clone().unwrap_or_else(|| workspace().join("data/dev480/S4_lights"));
    let scene = DevScene::read(&folder)?;
    let path = folder.join("camera.json");
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let file: Lights = serde_json::from_str(&text)?;
    let bokeh = Bokeh { threshold: options.threshold, ..Bokeh::default() };
    let mut text = format!(
        "# Highlights\n\n{}\n\nThe lights of {} ({}) that stand apart and are seen whole, beside the path-traced reference: the energy of a light's disc above what is around it, \
         and the diameter of the disc that has this energy at the brightness of its middle. Medians over the lights, and in \
         brackets how many of them are within 5 % of the energy and within 2 % or a pixel of the diameter. PSNR and FLIP as in \
         [quality.md](quality.md).\n\n",
        provenance(),
        scene.name,
        scene.size
    );
    for reference in &scene.references {
        of_reference(options, &scene, reference, &file, bokeh, &mut text)?;
    }
    shapes(options, &scene)?;
    options.output.write("results/bokeh.md", &text)
}

fn of_reference(
    options: &Options,
    scene: &DevScene,
    reference: &Reference,
    file: &Lights,
    bokeh: Bokeh,
    text: &mut String,
) -> Result<()> {
    // Nearly all of their light arrives: nothing stands before them.
    let (spots, truth): (Vec<Spot>, Vec<Measured>) = apart(file, reference, scene.size)
        .into_iter()
        .map(|spot| (spot, measure(&reference.picture, &spot)))
        .filter(|(spot, measured)| measured.energy > 0.8 * spot.light)
        .unzip();
    let judge = crate::quality::score::Truth::new(scene, reference)?;
    writeln!(text, "## {}\n\n{} lights.\n", reference.name, spots.len())?;
    writeln!(text, "| | energy | diameter | highlights | PSNR | FLIP |\n|---|---|---|---|---|---|")?;
    for (name, layered, settings) in ways(bokeh) {
        let layers = if layered { scene.layered() } else { scene.single() };
        let (picture, count) = render(layers, reference, &settings)?;
        if let Some(folder) = &options.pictures {
            let file = format!("{}-{name}.png", reference.name).replace(['/', ' ', ','], "_");
            crate::place::write_whole(&folder.join(file), &Panel::of(&picture)?.to_png()?)?;
        }
        let found: Vec<Measured> = spots.iter().map(|spot| measure(&picture, spot)).collect();
        let pairs = || found.iter().zip(&truth);
        let energies: Vec<f64> = pairs().map(|(a, b)| a.energy / b.energy).collect();
        let diameters: Vec<f64> = pairs().map(|(a, b)| a.diameter / b.diameter).collect();
        let right_energy = energies.iter().filter(|e| (*e - 1.0).abs() <= 0.05).count();
        let right = |(a, b): &(&Measured, &Measured)| {
            (a.diameter - b.diameter).abs() <= f64::max(1.0, 0.02 * b.diameter)
        };
        let right_diameter = pairs().filter(right).count();
        if options.pictures.is_some() {
            for (spot, (a, b)) in spots.iter().zip(pairs()) {
                eprintln!(
                    "{name}: {:.0?}, circle {:.1}, own {:.1}: energy {:.0} of {:.0} ({:.3}), diameter {:.2} of {:.2}",
                    spot.at,
                    spot.circle,
                    spot.own,
                    a.energy,
                    b.energy,
                    a.energy / b.energy,
                    a.diameter,
                    b.diameter
                );
            }
        }
        let score = judge.score(&picture)?;
        writeln!(
            text,
            "| {name} | {:.3} ({right_energy}) | {:.3} ({right_diameter}) | {count} | {:.2} | {:.4} |",
            median(energies),
            median(diameters),
            score.psnr,
            score.flip
        )?;
    }
    text.push('\n');
    Ok(())
}

/// A heart, as a picture of an aperture.
fn heart() -> Result<Mask> {
    let side = 128;
    let value = |i: usize| {
        let of = |k: usize| (k as f64 + 0.5) / side as f64 * 2.6 - 1.3;
        let (x, y) = (of(i % side), 0.1 - of(i / side));
        let inside = (x * x + y * y - 1.0).powi(3) - x * x * y * y * y;
        if inside <= 0.0 { 1.0 } else { 0.0 }
    };
    Ok(Mask::new(side, side, (0..side * side).map(value).collect())?)
}

/// Lights on a dark ground, in rows; the circle grows downwards from in front of focus.
fn lights() -> Result<Scene> {
    let size = Size::new(320, 200);
    let plane = |values: [f32; 3]| {
        Plane::from_fn(size, |x, y| if x % 40 == 20 && y % 40 == 20 { values[x / 40 % 3] } else { 0.02 })
    };
    let colors =
        vec![plane([900.0, 500.0, 200.0])?, plane([600.0, 500.0, 400.0])?, plane([200.0, 450.0, 900.0])?];
    let circle = Plane::from_fn(size, |_, y| [-36.0, -18.0, 8.0, 24.0, 38.0][y / 40])?;
    let element = Element { picture: Picture::opaque(colors), distance: Distance::Coc(circle) };
    Ok(Scene::new(Frame::full(size), element))
}

/// Pictures of every shape, and of the scene without and with highlights beside its reference.
fn shapes(options: &Options, scene: &DevScene) -> Result<()> {
    let bokeh = Bokeh { threshold: options.threshold, least_diameter: 0.5, ..Bokeh::default() };
    let blades = Aperture::blades;
    let image = ApertureShape::Image(heart()?);
    let looks = [
        (Aperture::DISC, 0.0),
        (blades(6, 0.0), 0.0),
        (Aperture { roundness: 0.6, ..blades(5, 18.0) }, 0.0),
        (Aperture { squeeze: 2.0, ..Aperture::DISC }, 0.0),
        (Aperture::DISC, 0.9),
        (Aperture { shape: image, ..Aperture::DISC }, 0.0),
    ];
    let mut panels = vec![];
    for (aperture, cats_eye) in looks {
        let bokeh = Some(Bokeh { cats_eye, ..bokeh });
        let settings = Settings { layering: Layering::Single, aperture, bokeh, ..Settings::default() };
        let mut scene = lights()?;
        Renderer::new().render(&mut scene, None, &settings, &Cancel::new())?;
        panels.push(Panel::of(&scene.base.picture)?);
    }
    options.output.write_bytes("pictures/bokeh/shapes.png", &Panel::grid(&panels, 3)?.to_png()?)?;
    let Some(reference) = scene.references.first() else { return Ok(()) };
    let (plain, _) = render(scene.single(), reference, &Settings::preset(Preset::Final))?;
    let with = Settings {
        bokeh: Some(Bokeh { threshold: options.threshold, ..Bokeh::default() }),
        ..Settings::preset(Preset::Final)
    };
    let (with, _) = render(scene.single(), reference, &with)?;
    let panels =
        [&plain, &with, &reference.picture].map(Panel::of).into_iter().collect::<Result<Vec<_>>>()?;
    let part = |panel: &Panel| panel.crop([0, 0, panel.width * 5 / 8, panel.height]);
    let panels: Vec<Panel> = panels.iter().map(part).collect();
    options.output.write_bytes("pictures/bokeh/lights.jpg", &Panel::grid(&panels, 3)?.to_jpeg()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disc_is_measured() {
        let spot = Spot { at: [30.0, 20.0], circle: 16.0, own: 2.0, light: 0.0 };
        let plane = Plane::from_fn(Size::new(60, 40), |x, y| {
            1.0 + (8.5 - spot.distance([x as f64 + 0.5, y as f64 + 0.5])).clamp(0.0, 1.0) as f32
        });
        let measured = measure(&Picture::opaque(vec![plane.unwrap()]), &spot);
        // The rim's own area.
        assert!((measured.diameter - 16.0).abs() < 0.1, "{}", measured.diameter);
        assert!((measured.energy - 64.0 * PI).abs() < 3.0, "{}", measured.energy);
    }

    #[test]
    fn a_quick_run_writes_all() {
        let folder = tempfile::tempdir().unwrap();
        let output = Output { out: Some(folder.path().to_path_buf()), quick: true };
        run(&Options { output, scene: None, threshold: 1.0, pictures: None }).unwrap();
        let text = std::fs::read_to_string(folder.path().join("results/bokeh.md")).unwrap();
        assert!(text.contains("highlights |") && !text.contains("NaN"), "{text}");
        assert!(folder.path().join("pictures/bokeh/shapes.png").is_file());
        assert!(folder.path().join("pictures/bokeh/lights.jpg").is_file());
    }
}
