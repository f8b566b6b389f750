//! What is scored: this project's methods and settings, and brute-force baselines.

use crate::data::{DevScene, Reference, circles};
use anyhow::Result;
use pullfocus::diffusion::Calibration;
use pullfocus::response::Rational;
use pullfocus::{Bokeh, Cancel, Diffusion, Integrator, Layering, Picture, Plane, Preset, Renderer, Settings};
use pullfocus::{Method as Blur, Psf};
use pullfocus_testkit::reference::layers::extend;
use pullfocus_testkit::spread::{self, Shape};
use pullfocus_testkit::{Grid, scenes};

/// What a method gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// One picture with depth.
    Single,
    /// Foreground, and what is behind it.
    Layered,
}

/// One row of the table.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "a table of some thirty rows")]
pub enum Method {
    /// The pinhole picture itself.
    Unblurred,
    /// This project's renderer.
    Ours(&'static str, Input, Settings),
    /// Each pixel spread alike, the result divided by the weight.
    Spread(Shape),
    /// Spread in depth order.
    ByDepth(Shape),
    /// Foreground and behind, each spread; coverage conserved.
    SpreadLayers(Shape),
}

impl Method {
    /// The row's name.
    pub fn name(&self) -> String {
        let shape = |shape: &Shape| match shape {
            Shape::Disc => "disc",
            Shape::Gaussian => "Gaussian",
        };
        match self {
            Self::Unblurred => "the input itself".to_owned(),
            Self::Ours(name, _, _) => (*name).to_owned(),
            Self::Spread(s) => format!("brute force: {}", shape(s)),
            Self::ByDepth(s) => format!("brute force: {} by depth", shape(s)),
            Self::SpreadLayers(s) => format!("brute force: {} on the layers", shape(s)),
        }
    }

    /// What it gets.
    pub fn input(&self) -> Input {
        match self {
            Self::Ours(_, input, _) => *input,
            Self::SpreadLayers(_) => Input::Layered,
            _ => Input::Single,
        }
    }

    /// Whether it takes seconds a picture.
    pub fn brute_force(&self) -> bool {
        match self {
            Self::Spread(_) | Self::ByDepth(_) | Self::SpreadLayers(_) => true,
            Self::Ours(_, _, settings) => settings.method.has_psf(),
            Self::Unblurred => false,
        }
    }

    /// The scene through the reference's lens: three colour planes.
    pub fn blur(&self, scene: &DevScene, reference: &Reference) -> Result<Picture> {
        let colors = || scene.input.picture.colors.iter().collect::<Vec<&Plane>>();
        Ok(match self {
            Self::Unblurred => Picture::opaque(scene.input.picture.colors.clone()),
            Self::Ours(_, input, settings) => {
                let mut layers = match input {
                    Input::Single => scene.single(),
                    Input::Layered => scene.layered(),
                };
                // The pictures are opaque: a viewer sees colour alone.
                layers.base.picture.alpha = None;
                Renderer::new().render(&mut layers, Some(&reference.camera), settings, &Cancel::new())?;
                layers.base.picture
            }
            Self::Spread(shape) => Picture::opaque(spread::normalised(*shape, &colors(), &reference.circles)),
            Self::ByDepth(shape) => Picture::opaque(spread::by_depth(*shape, &colors(), &reference.circles)),
            Self::SpreadLayers(shape) => spread_layers(*shape, scene, reference)?,
        })
    }
}

/// The foreground's diameters carried on beyond it, then its premultiplied colour and alpha spread, over what is behind.
fn spread_layers(shape: Shape, scene: &DevScene, reference: &Reference) -> Result<Picture> {
    let behind_circles = circles(&scene.behind, &reference.camera)?;
    let behind: Vec<&Plane> = scene.behind.picture.colors.iter().collect();
    let behind = spread::by_depth(shape, &behind, &behind_circles);
    let front = &scene.foreground.picture;
    let opaque = scenes::constant(scene.size, 1.0);
    let alpha = front.alpha.as_ref().unwrap_or(&opaque);
    let circles = circles(&scene.foreground, &reference.camera)?;
    let weight = Grid::from_plane(alpha);
    let seen = Grid::from_plane(&circles).zip(&weight, |c, a| if a > 0.0 { c } else { 0.0 });
    let settings = Diffusion { integrator: Integrator::BackwardEuler { steps: 1 }, ..Diffusion::default() };
    let extended = extend(&seen, &weight, 2.0 * seen.largest(), &settings).to_plane();
    let planes: Vec<&Plane> = front.colors.iter().chain([alpha]).collect();
    let spread = spread::normalised(shape, &planes, &extended);
    let (coverage, colors) = spread.split_last().expect("alpha is the last plane");
    let over = colors.iter().zip(&behind).map(|(front, behind)| {
        scenes::plane(scene.size, |x, y| front.at(x, y) + (1.0 - coverage.at(x, y)) * behind.at(x, y))
    });
    Ok(Picture::opaque(over.collect()))
}

fn with(layering: Layering, integrator: Integrator, calibration: Calibration) -> Settings {
    let diffusion = Diffusion { calibration, integrator, ..Diffusion::default() };
    Settings { layering, diffusion, ..Settings::default() }
}

/// The plain method with the default integrator: the first paper's section 3.
pub fn single_layer() -> Method {
    let settings = Settings { layering: Layering::Single, ..Settings::default() };
    Method::Ours("one layer, disc", Input::Single, settings)
}

/// The default of `render`.
pub fn last() -> Method {
    Method::Ours("preset final", Input::Single, Settings::preset(Preset::Final))
}

/// The spreading methods: as one layer and with the layers of `final`, for both inputs.
fn spreading() -> Vec<Method> {
    let with = |layering, (method, psf)| Settings { layering, method, psf, ..Settings::default() };
    let general = Settings::preset(Preset::Final).layering;
    let methods = [
        (Blur::Square, Psf::Gaussian),
        (Blur::Pyramid, Psf::Gaussian),
        (Blur::Naive, Psf::Gaussian),
        (Blur::Naive, Psf::Aperture),
        (Blur::Aperture, Psf::Gaussian),
    ];
    let rows = [
        (
            Input::Single,
            Layering::Single,
            [
                "one layer, square",
                "one layer, pyramid",
                "one layer, naive Gaussian",
                "one layer, naive disc",
                "one layer, aperture",
            ],
        ),
        (
            Input::Single,
            general,
            [
                "general layers, square",
                "general layers, pyramid",
                "general layers, naive Gaussian",
                "general layers, naive disc",
                "general layers, aperture",
            ],
        ),
        (
            Input::Layered,
            Layering::Single,
            [
                "layered: one layer behind, square",
                "layered: one layer behind, pyramid",
                "layered: one layer behind, naive Gaussian",
                "layered: one layer behind, naive disc",
                "layered: one layer behind, aperture",
            ],
        ),
        (
            Input::Layered,
            general,
            [
                "layered: general layers, square",
                "layered: general layers, pyramid",
                "layered: general layers, naive Gaussian",
                "layered: general layers, naive disc",
                "layered: general layers, aperture",
            ],
        ),
    ];
    let row = |(input, layering, names): (Input, Layering, [&'static str; 5])| {
        let methods = names.into_iter().zip(methods);
        methods.map(move |(name, method)| Method::Ours(name, input, with(layering, method)))
    };
    rows.into_iter().flat_map(row).collect()
}

/// The default, and lights above white as sprites.
fn highlights() -> Settings {
    Settings { bokeh: Some(Bokeh::default()), ..Settings::preset(Preset::Final) }
}

/// All rows, in the table's order.
pub fn all() -> Vec<Method> {
    use Calibration::{Beck, Kass, Variance};
    use Input::{Layered, Single};
    use Method::Ours;
    let euler = |steps| Integrator::BackwardEuler { steps };
    let gauss = Integrator::Rational(Rational::GAUSSIAN);
    let disc = Integrator::Disc;
    let background = |layers| Layering::Background { layers, threshold: 0.01 };
    let general = |layers| Layering::General { layers };
    let mut rows = vec![
        Method::Unblurred,
        Ours("preset preview", Single, Settings::preset(Preset::Preview)),
        last(),
        Ours("preset final, highlights", Single, highlights()),
        Ours(
            "one layer, 1 step, beta = d^2 (the first paper's letter)",
            Single,
            with(Layering::Single, euler(1), Kass),
        ),
        Ours(
            "one layer, 1 step, beta = (d/2)^2 (the second's)",
            Single,
            with(Layering::Single, euler(1), Beck),
        ),
        Ours("one layer, 1 step", Single, with(Layering::Single, euler(1), Variance)),
        Ours("one layer, 2 steps", Single, with(Layering::Single, euler(2), Variance)),
        Ours("one layer, 4 steps", Single, with(Layering::Single, euler(4), Variance)),
        Ours("one layer, Gaussian (rational)", Single, with(Layering::Single, gauss, Variance)),
        single_layer(),
        Ours("1 background layer, 1 step", Single, with(background(1), euler(1), Variance)),
        Ours("1 background layer, Gaussian (rational)", Single, with(background(1), gauss, Variance)),
        Ours("1 background layer, disc", Single, with(background(1), disc, Variance)),
        Ours("3 background layers, disc", Single, with(background(3), disc, Variance)),
        Ours("3 general layers, disc", Single, with(general(3), disc, Variance)),
        Ours("5 general layers, 1 step", Single, with(general(5), euler(1), Variance)),
        Ours("5 general layers, Gaussian (rational)", Single, with(general(5), gauss, Variance)),
        Ours("5 general layers, disc", Single, with(general(5), disc, Variance)),
        Ours("8 general layers, disc", Single, with(general(8), disc, Variance)),
        Method::Spread(Shape::Gaussian),
        Method::Spread(Shape::Disc),
        Method::ByDepth(Shape::Gaussian),
        Method::ByDepth(Shape::Disc),
        Ours("layered: preset preview", Layered, Settings::preset(Preset::Preview)),
        Ours("layered: preset final", Layered, Settings::preset(Preset::Final)),
        Ours("layered: one layer behind, 1 step", Layered, with(Layering::Single, euler(1), Variance)),
        Ours(
            "layered: one layer behind, Gaussian (rational)",
            Layered,
            with(Layering::Single, gauss, Variance),
        ),
        Ours("layered: one layer behind, disc", Layered, with(Layering::Single, disc, Variance)),
        Ours("layered: 1 background layer, disc", Layered, with(background(1), disc, Variance)),
        Ours("layered: 5 general layers, Gaussian (rational)", Layered, with(general(5), gauss, Variance)),
        Ours("layered: 5 general layers, disc", Layered, with(general(5), disc, Variance)),
        Method::SpreadLayers(Shape::Gaussian),
        Method::SpreadLayers(Shape::Disc),
    ];
    rows.extend(spreading());
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn rows_have_names_of_their_own_and_legal_settings() {
        let methods = all();
        let names: BTreeSet<String> = methods.iter().map(Method::name).collect();
        assert_eq!(names.len(), methods.len());
        for method in methods {
            if let Method::Ours(name, _, settings) = method {
                assert!(settings.check().is_ok(), "{name}");
            }
        }
    }
}
