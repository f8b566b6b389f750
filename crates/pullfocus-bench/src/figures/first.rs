//! Figures of the first paper.

use super::{Figure, grids, one_step, panels, picture, reference, render, scene, settings};
use crate::data::{DevScene, Reference, circles};
use crate::panels::Panel;
use anyhow::{Context, Result};
use pullfocus::{Layering, Picture, Settings};
use pullfocus_testkit::Grid;
use pullfocus_testkit::reference::layers::{
    Element, background_layer, extend, foreground_letter, matte, midground_and_background, over,
};

/// The picture in which thin leaves are sharp before a wide blur.
const LEAVES: &str = "S2";

/// Pinhole and simple depth of field.
pub fn figure_2(scenes: &[DevScene]) -> Result<Figure> {
    let mill = scene(scenes, "S3")?;
    let lens = reference(mill, 0)?;
    let simple = render(mill.single(), lens, &settings(Layering::Single, one_step()))?;
    let last = render(mill.single(), lens, &Settings::default())?;
    Ok(Figure {
        name: "first_2",
        title: "First paper, figure 2: simple depth of field",
        text: "The pinhole picture; one layer of diffusion, one backward-Euler step, as in the paper (but beta = d^2/32: with beta = d^2 \
               everything is blurred 5.7 times too wide); this project's default out of the same picture; reference."
            .to_owned(),
        panels: panels(&[&mill.input.picture, &simple, &last, &lens.picture], None, 1)?,
        columns: 2,
    })
}

/// The circle of confusion, in pixels, from which on these figures count a pixel as background: four fifths of the largest,
/// so that what is only a little out of focus leaves the background layer, too.
fn threshold(lens: &Reference) -> f64 {
    0.8 * lens.largest_circle
}

fn input(scene: &DevScene, lens: &Reference) -> (Vec<Grid>, Grid) {
    (grids(&scene.input.picture.colors), Grid::from_plane(&lens.circles))
}

/// Sharp leaves insulate; the background layer mends it.
pub fn figure_3(scenes: &[DevScene]) -> Result<Figure> {
    let leaves = scene(scenes, LEAVES)?;
    let lens = reference(leaves, 0)?;
    let (colors, diameter) = input(leaves, lens);
    let single = render(leaves.single(), lens, &settings(Layering::Single, one_step()))?;
    let layer = picture(&background_layer(&colors, &diameter, threshold(lens), &one_step()));
    let threshold = threshold(lens);
    let layering = Layering::Background { layers: 1, threshold: threshold / leaves.size.width as f64 };
    let blend = render(leaves.single(), lens, &settings(layering, one_step()))?;
    let last = render(leaves.single(), lens, &Settings::default())?;
    Ok(Figure {
        name: "first_3",
        title: "First paper, figure 3: blurring underneath",
        text: format!(
            "The pinhole picture; one layer, where sharp leaves keep the field behind them from blurring into itself; the background layer \
             alone, leaves taken out by the matte (1 from {threshold:.0} px on) and the gaps filled by diffusion; both blended by the matte; this \
             project's default; reference."
        ),
        panels: panels(&[&leaves.input.picture, &single, &layer, &blend, &last, &lens.picture], None, 1)?,
        columns: 2,
    })
}

/// Circles of confusion before and after matting.
pub fn figure_4(scenes: &[DevScene]) -> Result<Figure> {
    let leaves = scene(scenes, LEAVES)?;
    let lens = reference(leaves, 0)?;
    let (_, diameter) = input(leaves, lens);
    let threshold = threshold(lens);
    let extended = extend(&diameter, &matte(&diameter, threshold), threshold, &one_step()).to_plane();
    let most = lens.largest_circle as f32;
    Ok(Figure {
        name: "first_4",
        title: "First paper, figure 4: circles of confusion",
        text: format!(
            "Sizes of the circles of confusion, black for 0 and white for {most:.0} px: as they come, and after matting and diffusion with \
             gamma = alpha. Leaves in focus are gone, and those a little out of it have left a trace."
        ),
        panels: vec![Panel::of_circles(&lens.circles, most), Panel::of_circles(&extended, most)],
        columns: 2,
    })
}

/// The fence with four cameras.
pub fn figure_6(scenes: &[DevScene]) -> Result<Figure> {
    let fence = scene(scenes, "S1")?;
    let ours = |index: usize| render(fence.layered(), reference(fence, index)?, &Settings::default());
    let (wide, narrow, near) = (ours(0)?, ours(1)?, ours(2)?);
    let truth = |index: usize| Ok::<&Picture, anyhow::Error>(&reference(fence, index)?.picture);
    Ok(Figure {
        name: "first_6",
        title: "First paper, figure 6: a fence and four cameras",
        text: "Left column: the pinhole picture, then out of it (fence and what is behind it, as in the paper) a narrow aperture focused on the \
               flags, a wide aperture focused there, and a wide one focused on the fence. With the wide one the fence all but \
               vanishes, and the stripes behind it are sharp and whole. Right column: the references (beside the pinhole picture what is \
               behind the fence)."
            .to_owned(),
        panels: panels(
            &[
                &fence.input.picture,
                &fence.behind.picture,
                &narrow,
                truth(1)?,
                &wide,
                truth(0)?,
                &near,
                truth(2)?,
            ],
            None,
            1,
        )?,
        columns: 2,
    })
}

/// The foreground by the paper's letter, and by the form that conserves coverage.
pub fn figure_6_failure(scenes: &[DevScene]) -> Result<Figure> {
    let fence = scene(scenes, "S1")?;
    let lens = reference(fence, 0)?;
    let behind = grids(&fence.behind.picture.colors);
    let behind_circles = Grid::from_plane(&circles(&fence.behind, &lens.camera)?);
    let behind = midground_and_background(&behind, &behind_circles, &[threshold(lens)], &one_step());
    let front = &fence.foreground.picture;
    let alpha = Grid::from_plane(front.alpha.as_ref().context("the fence has alpha")?);
    let own = Grid::from_plane(&circles(&fence.foreground, &lens.camera)?);
    let diameter = own.zip(&alpha, |c, a| if a > 0.0 { c } else { 0.0 });
    let element = Element { colors: grids(&front.colors), alpha, diameter };
    let (colors, coverage) = foreground_letter(&element, &one_step());
    let letter = picture(&over(&colors, &coverage, &behind));
    let single = render(fence.single(), lens, &settings(Layering::Single, one_step()))?;
    let ours = render(fence.layered(), lens, &Settings::default())?;
    Ok(Figure {
        name: "first_6_letter",
        title: "First paper, section 3.2: the foreground to the letter",
        text: "One layer: the near fence cannot spread over the sharp flags. The foreground to the letter of section 3.2, alpha diffused with \
               gamma = that alpha: where gamma is 0 the initial alpha of 0 counts for nothing, so coverage becomes 1 and the fence covers the \
               picture. This project: gamma = 1 for alpha and premultiplied colour, with diameters carried on beyond the fence, so that \
               coverage is conserved. Reference."
            .to_owned(),
        panels: panels(&[&single, &letter, &ours, &lens.picture], None, 1)?,
        columns: 2,
    })
}
