//! Bokeh highlights: bright light out of focus leaves the picture, and comes back as sprites in the aperture's shape.
//!
//! # Theory
//! What a method makes of a light is divided by the weight that arrived, or smoothed; either way a light beside darker things is no
//! disc of even brightness. So the light above a threshold ([`pullfocus_core::bokeh`]) is taken out before layers are made, and
//! each pixel's excess is added again as one sprite that is divided by its own sum and by nothing else. It belongs to the layers
//! that its pixel shows, as much as these are seen there, and is added when its layer has been laid over the farther ones: what is
//! nearer covers it as it covers the layer.
//!
//! # Practice
//! `lights` takes out, `sprites` brings back: `shape` cuts outlines into slices, `stencils` tables what these cover by size, `sums`
//! adds all up by their ends. Rows of the result are cut into bands, each visits the lights that reach it.

mod lights;
mod shape;
mod sprites;
mod stencils;
mod sums;
#[cfg(test)]
mod tests;

pub use lights::Lights;

use crate::work::Work;
use pullfocus_core::bokeh::Field;
use pullfocus_core::{Aperture, Bokeh, Frame, Plane, Result};

/// Rows in one piece of work.
const BAND: usize = 16;

/// Where sprites are seen.
#[derive(Debug, Clone, Copy)]
pub enum Shown<'a> {
    /// Everywhere: a layer of its own.
    All,
    /// What belongs to this layer ([`Lights::share_out`]), everywhere.
    InLayer(usize),
    /// In the only layer, whose circles these are: where nothing nearer and sharper is ([`pullfocus_core::bokeh::seen`]).
    ByCircle(&'a Plane),
}

/// What sprites look like.
#[derive(Debug, Clone, Copy)]
pub struct Look<'a> {
    /// Which light is spread.
    pub bokeh: Bokeh,
    /// The sprites' shape.
    pub aperture: &'a Aperture,
    /// Pixels of height for one of width.
    pub vertical_scale: f32,
    /// Width of the display window in pixels.
    pub display_width: f32,
    /// Where the optical axis is.
    pub field: Field,
}

impl<'a> Look<'a> {
    /// The look in a frame.
    pub fn new(frame: &Frame, bokeh: Bokeh, aperture: &'a Aperture) -> Self {
        Self {
            bokeh,
            aperture,
            vertical_scale: frame.vertical_scale(),
            display_width: frame.display_width() as f32,
            field: Field::new(frame),
        }
    }
}

impl Work<'_> {
    /// Takes highlights out of `colors`, if that was asked for. They are to be given back ([`Work::give_lights`]).
    pub fn take_lights(&mut self, colors: &mut [&mut Plane], circle: &Plane) -> Result<Option<Lights>> {
        let Some(look) = self.look else { return Ok(None) };
        self.stage("highlights", |work| {
            let mut lights = std::mem::take(&mut work.memory.lights);
            lights.take_out(colors, circle, &look.bokeh, look.display_width, work.cancel)?;
            *work.report.highlights.get_or_insert(0) += lights.count();
            Ok(Some(lights))
        })
    }

    /// Adds lights that were taken out, as sprites.
    pub fn add_lights(
        &mut self,
        lights: &mut Option<Lights>,
        colors: &mut [&mut Plane],
        seen: Shown<'_>,
    ) -> Result<()> {
        let (Some(look), Some(lights)) = (self.look, lights) else { return Ok(()) };
        self.stage("highlights", |work| lights.add(colors, &look, seen, work.cancel))
    }

    /// Gives their memory back.
    pub fn give_lights(&mut self, lights: Option<Lights>) {
        if let Some(lights) = lights {
            self.memory.lights = lights;
        }
    }
}
