//! The sentence, in code: image + depth + camera → circle of confusion → layers → method → composite.

use crate::bokeh::{Lights, Shown};
use crate::layers;
use crate::planes::Group;
use crate::work::Work;
use pullfocus_core::{Layering, Result, Settings};

/// A picture and its circles of confusion, on the device.
#[derive(Debug)]
pub struct Element {
    /// Colour planes, then alpha, in the groups of [`layout`]; the slot after the last plane is spare.
    pub groups: Vec<Group>,
    /// How many colour planes there are.
    pub colors: usize,
    /// How many planes there are, alpha included.
    pub planes: usize,
    /// Signed diameters, f32.
    pub coc: wgpu::Buffer,
}

/// Into which groups a picture of `planes` planes goes: with room for one more, which is a layer's coverage.
pub fn layout(planes: usize) -> Vec<u32> {
    crate::planes::groups(planes + 1)
}

impl Element {
    /// The groups that hold planes.
    pub fn used(&self) -> &[Group] {
        &self.groups[..self.planes.div_ceil(4).min(self.groups.len())]
    }
}

/// Blurs `base` in place, and lays `foreground`, blurred, over it: its last plane is alpha.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn render(
    work: &mut Work<'_, '_>,
    base: &Element,
    foreground: Option<&Element>,
    settings: &Settings,
) -> Result<()> {
    let picture: Vec<&Group> = base.used().iter().collect();
    match settings.layering {
        Layering::Single => {
            let lights = work.take_lights(&picture, base.colors, [&base.coc; 2])?;
            work.recorder.stage("blur");
            work.blur(&picture, &base.coc, None)?;
            bring_back(work, lights, &picture, Shown::ByCircle(&base.coc))?;
        }
        Layering::Background { layers, threshold } => {
            let threshold = threshold as f32 * work.display_width;
            let lights = work.take_lights(&picture, base.colors, [&base.coc; 2])?;
            layers::blur_over_background(work, &picture, &base.coc, layers, threshold)?;
            bring_back(work, lights, &picture, Shown::ByCircle(&base.coc))?;
        }
        Layering::General { layers } => {
            layers::blur_layers(work, &base.groups, [base.colors, base.planes], &base.coc, layers)?;
        }
    }
    if let Some(element) = foreground {
        let coc = (&element.coc, &base.coc);
        layers::blur_element_over(work, element.used(), element.planes - 1, coc, &picture)?;
    }
    Ok(())
}

/// Adds lights that were taken out, and gives their memory back.
///
/// # Errors
/// As [`Work::take_lights`].
pub fn bring_back(
    work: &mut Work<'_, '_>,
    lights: Option<Lights>,
    groups: &[&Group],
    shown: Shown<'_>,
) -> Result<()> {
    if let Some(lights) = lights {
        lights.add(work, groups, shown)?;
        lights.give_back(work.recorder);
    }
    Ok(())
}
