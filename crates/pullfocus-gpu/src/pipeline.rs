//! The sentence, in code: image + depth + camera → circle of confusion → layers → method → composite.

use crate::bokeh::{Lights, Shown};
use crate::layers::{self, Count};
use crate::planes::Group;
use crate::work::Work;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::{Layering, Result, Settings, Show};

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

/// What lies over a picture, and what tells where it does.
#[derive(Debug, Clone, Copy)]
pub struct Near<'a> {
    /// Its last plane is alpha; its circles are as the lens alone makes them.
    pub element: &'a Element,
    /// Those of what is behind it, as the lens alone makes them, too.
    pub behind: &'a wgpu::Buffer,
    /// What the settings make of its circles.
    pub curve: &'a CocCurve,
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

/// Blurs `base` in place, and lays `foreground`, blurred, over it. What is shown of that may be one layer alone.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn render(
    work: &mut Work<'_, '_>,
    base: &Element,
    foreground: Option<&Near<'_>>,
    settings: &Settings,
) -> Result<()> {
    let picture: Vec<&Group> = base.used().iter().collect();
    let layers = match settings.layering {
        Layering::Single => {
            blur_picture(work, &picture, base)?;
            Count::Known(1)
        }
        Layering::Background { layers, threshold } => {
            let threshold = threshold as f32 * work.display_width;
            let lights = work.take_lights(&picture, base.colors, [&base.coc; 2])?;
            match work.show.alone() {
                None => layers::blur_over_background(work, &picture, &base.coc, layers, threshold)?,
                Some(number) => {
                    layers::one_over_background(work, &picture, &base.coc, [layers, number], threshold)?;
                }
            }
            // They are laid down after the last of these layers, the midground.
            let shown = matches!(work.show, Show::Result) || work.show == Show::Layer(layers);
            bring_back(work, lights, &picture, shown.then_some(Shown::ByCircle(&base.coc)))?;
            Count::Known(1 + layers)
        }
        Layering::General { layers } => {
            layers::blur_layers(work, &base.groups, [base.colors, base.planes], &base.coc, layers)?;
            Count::Found(layers)
        }
    };
    let Some(near) = foreground else { return Ok(()) };
    match work.show {
        Show::Result => layers::blur_element_over(work, near, &picture),
        _ => layers::show_element(work, near, &picture, layers),
    }
}

/// One layer, and nothing else.
fn blur_picture(work: &mut Work<'_, '_>, picture: &[&Group], base: &Element) -> Result<()> {
    match work.show {
        Show::Result | Show::Layer(0) => {
            let lights = work.take_lights(picture, base.colors, [&base.coc; 2])?;
            work.recorder.stage("blur");
            work.blur(picture, &base.coc, None)?;
            bring_back(work, lights, picture, Some(Shown::ByCircle(&base.coc)))
        }
        Show::Matte(0) => layers::leave(work, picture, None),
        Show::Layer(_) | Show::Matte(_) => {
            layers::clear(work, picture);
            Ok(())
        }
    }
}

/// Adds lights that were taken out, where they are shown, and gives their memory back.
///
/// # Errors
/// As [`Work::take_lights`].
pub fn bring_back(
    work: &mut Work<'_, '_>,
    lights: Option<Lights>,
    groups: &[&Group],
    shown: Option<Shown<'_>>,
) -> Result<()> {
    if let Some(lights) = lights {
        if let Some(shown) = shown {
            lights.add(work, groups, shown)?;
        }
        lights.give_back(work.recorder);
    }
    Ok(())
}
