//! Figures of the second paper.

use super::{Figure, grids, one_step, panels, picture, reference, render, scene, settings};
use crate::data::{DevScene, Reference, circles};
use crate::quality::score::Truth;
use anyhow::{Context, Result};
use pullfocus::diffusion::Calibration;
use pullfocus::{Diffusion, Layering, Picture, Settings};
use pullfocus_testkit::Grid;
use pullfocus_testkit::reference::diffuse;
use pullfocus_testkit::reference::layers::{LEAST_GAMMA, midground_and_background};

/// A third of the leaves' picture each way, where one layer errs most.
fn place(scene: &DevScene, lens: &Reference, single: &Picture) -> Result<[f64; 4]> {
    let (width, height) = (scene.size.width, scene.size.height);
    let [x, y, w, h] = Truth::new(scene, lens)?.worst_place(single, width / 3, height / 3)?;
    let part = |pixels: usize, whole: usize| pixels as f64 / whole as f64;
    Ok([part(x, width), part(y, height), part(w, width), part(h, height)])
}

/// The part with the cow.
const COW: [f64; 4] = [0.0, 0.5, 0.4, 0.45];

/// A sharp midground insulates the background.
pub fn figure_2_1_a(scenes: &[DevScene]) -> Result<Figure> {
    let leaves = scene(scenes, "S2")?;
    let lens = reference(leaves, 0)?;
    let single = render(leaves.single(), lens, &settings(Layering::Single, one_step()))?;
    let last = render(leaves.single(), lens, &Settings::default())?;
    Ok(Figure {
        name: "second_2_1_a",
        title: "Second paper, figure 2.1a: the midground insulates the background",
        text: "One layer: between sharp leaves the field behind keeps its own patches, since nothing flows through what is in focus. This \
               project's default; reference."
            .to_owned(),
        panels: panels(&[&single, &last, &lens.picture], Some(place(leaves, lens, &single)?), 2)?,
        columns: 3,
    })
}

/// A blurred foreground ends at a sharp midground.
pub fn figure_2_1_b(scenes: &[DevScene]) -> Result<Figure> {
    let mill = scene(scenes, "S3")?;
    let lens = reference(mill, 0)?;
    let single = render(mill.single(), lens, &settings(Layering::Single, one_step()))?;
    let last = render(mill.single(), lens, &Settings::default())?;
    Ok(Figure {
        name: "second_2_1_b",
        title: "Second paper, figure 2.1b: the foreground ends at the midground",
        text: "One layer: the near cow is out of focus and yet has a hard edge where what is behind it is sharp. This project's default, out of \
               the same picture; reference."
            .to_owned(),
        panels: panels(&[&single, &last, &lens.picture], Some(COW), 2)?,
        columns: 3,
    })
}

/// The authors' foreground: colour and alpha diffused by their own circles, drawn weighted by alpha.
pub fn figure_3_1(scenes: &[DevScene]) -> Result<Figure> {
    let mill = scene(scenes, "S3")?;
    let lens = reference(mill, 0)?;
    let front = &mill.foreground.picture;
    let alpha = Grid::from_plane(front.alpha.as_ref().context("the foreground has alpha")?);
    let own = Grid::from_plane(&circles(&mill.foreground, &lens.camera)?);
    let diameter = own.zip(&alpha, |c, a| if a > 0.0 { c } else { 0.0 });
    let blur = |x: &Grid, diameter: &Grid| diffuse(x, diameter, None, 1.0, &one_step());
    let behind_circles = Grid::from_plane(&circles(&mill.behind, &lens.camera)?);
    let coverage = blur(&alpha, &diameter);
    let mixed: Vec<Grid> = grids(&front.colors)
        .iter()
        .zip(&grids(&mill.behind.picture.colors))
        .map(|(front, behind)| {
            let near = blur(front, &diameter).zip(&coverage, |c, a| c * a);
            let far = blur(behind, &behind_circles).zip(&coverage, |c, a| c * (1.0 - a));
            near.zip(&far, |a, b| a + b)
        })
        .collect();
    let theirs = picture(&mixed);
    let ours = render(mill.layered(), lens, &Settings::default())?;
    Ok(Figure {
        name: "second_3_1",
        title: "Second paper, figure 3.1: the foreground on its own",
        text: "As section 2.4.2 describes it: foreground and the rest rendered apart, each one's colour and alpha diffused by its own circles, drawn \
               \"weighted by the foreground alpha values\". The circles end at the object's outline, so its edge stays hard; and colour that is \
               premultiplied is weighted twice. This project: circles carried on beyond the object, premultiplied colour laid over. \
               Reference."
            .to_owned(),
        panels: panels(&[&theirs, &ours, &lens.picture], Some(COW), 2)?,
        columns: 3,
    })
}

/// The authors' background layer.
pub fn figure_3_2(scenes: &[DevScene]) -> Result<Figure> {
    let leaves = scene(scenes, "S2")?;
    let lens = reference(leaves, 0)?;
    // Their circles have no sign, and beta is the square of the radius.
    let diameter = Grid::from_plane(&lens.circles).map(f64::abs);
    let letter = Diffusion { calibration: Calibration::Beck, ..one_step() };
    let colors = grids(&leaves.input.picture.colors);
    let threshold = 0.01 * leaves.size.width as f64;
    let single = render(leaves.single(), lens, &settings(Layering::Single, one_step()))?;
    let theirs = picture(&midground_and_background(&colors, &diameter, &[threshold], &letter));
    let paper = render(leaves.single(), lens, &settings(Layering::PAPER, one_step()))?;
    let last = render(leaves.single(), lens, &Settings::default())?;
    Ok(Figure {
        name: "second_3_2",
        title: "Second paper, figure 3.2: the background layer",
        text: format!(
            "Section 2.4.2's seven steps: gamma from circles without a sign, {LEAST_GAMMA:e} in place of 0, beta = (d/2)^2. What is near and out of focus \
             counts as background too, and everything is blurred 2.8 times too wide. The first paper's background layer as this project has it, \
             only what is behind focus, calibrated by variance (`--preset preview`); this project's default; reference."
        ),
        panels: panels(&[&theirs, &paper, &last, &lens.picture], Some(place(leaves, lens, &single)?), 2)?,
        columns: 2,
    })
}
