//! Rendering on the processor, at fewer pixels where it must be quick.

use super::Take;
use super::worker::Made;
use crate::clip::Plate;
use crate::screen;
use eframe::wgpu;
use pullfocus_core::{Cancel, CocSettings, Layering, Method, Preset, Result, Settings, Show};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A picture within 100 ms feels like the hand's own movement; the window, drawn on the same cores, takes its part of them.
const SOON: Duration = Duration::from_millis(60);
/// What a pixel costs before any was measured.
const FIRST_GUESS: Duration = Duration::from_nanos(900);
/// One pixel stands for so many along each axis: few choices, since each is a picture of its own to make and to keep.
const REDUCTIONS: [usize; 8] = [2, 3, 4, 5, 6, 8, 12, 16];

pub struct CpuBlur {
    renderer: pullfocus::Renderer,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// Nanoseconds a pixel, of the ways to render that were used.
    costs: Vec<((Method, Layering, bool), f64)>,
}

fn way(settings: &Settings) -> (Method, Layering, bool) {
    (settings.method, settings.layering, settings.bokeh.is_some())
}

impl CpuBlur {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let renderer = pullfocus::Renderer::new();
        Self { renderer, device: device.clone(), queue: queue.clone(), costs: Vec::new() }
    }

    /// How far the picture must be reduced to come soon; 1 if it need not be.
    pub fn reduction(&self, plate: &Plate, take: &Take) -> usize {
        let pixels = plate.size().area() as f64;
        // A picture a little late is better than sizes that change while the hand moves.
        let comes_soon = |settings: &Settings, reduction: usize| {
            let way = way(settings);
            let known = self.costs.iter().find(|(known, _)| *known == way).map(|(_, cost)| *cost);
            let cost = known.unwrap_or(FIRST_GUESS.as_nanos() as f64);
            (pixels * cost / SOON.as_nanos() as f64).sqrt() <= 1.15 * reduction as f64
        };
        if comes_soon(&take.settings, 1) {
            return 1;
        }
        let quick = quick(&take.settings);
        REDUCTIONS.into_iter().find(|&reduction| comes_soon(&quick, reduction)).unwrap_or(16)
    }

    pub fn render(
        &mut self,
        plate: &Arc<Plate>,
        take: &Take,
        reduced: usize,
        cancel: &Cancel,
    ) -> Result<Made> {
        let mut scene = if reduced > 1 { (*plate.proxy(reduced)?).clone() } else { plate.scene.clone() };
        // No more than three colours are looked at.
        scene.base.picture.colors.truncate(3);
        if let Some(near) = &mut scene.foreground {
            near.picture.colors.truncate(3);
        }
        let asked = if reduced > 1 { quick(&take.settings) } else { take.settings.clone() };
        let settings = at_size(&asked, reduced);
        let start = Instant::now();
        let report = self.renderer.render(&mut scene, take.camera.as_ref(), &settings, cancel)?;
        self.learn(&asked, start.elapsed(), scene.frame.data.size.area());
        let texture = screen::from_picture(&self.device, &self.queue, &scene.base.picture)?;
        Ok(Made { texture, reduced, report })
    }

    fn learn(&mut self, settings: &Settings, time: Duration, pixels: usize) {
        let (way, cost) = (way(settings), time.as_nanos() as f64 / pixels.max(1) as f64);
        match self.costs.iter_mut().find(|(known, _)| *known == way) {
            // One slow picture, while something else computes, is not the rule; a second one is.
            Some((_, known)) => *known += if cost > *known { 0.5 } else { 0.2 } * (cost - *known),
            None => self.costs.push((way, cost)),
        }
    }
}

/// The settings for a picture that is there for a moment: two layers instead of all cost a quarter, which is twice the pixels
/// along each axis; shape and size of the blur stay.
fn quick(settings: &Settings) -> Settings {
    let layering = match settings.layering {
        Layering::General { .. } if settings.show == Show::Result => {
            Settings::preset(Preset::Preview).layering
        }
        other => other,
    };
    Settings { layering, ..settings.clone() }
}

/// The settings for a picture of fewer pixels: what is in pixels becomes less.
fn at_size(settings: &Settings, reduced: usize) -> Settings {
    let coc = &settings.coc;
    let max_px = coc.max_px.map(|max| max / reduced as f64);
    Settings { coc: CocSettings { max_px, ..coc.clone() }, ..settings.clone() }
}
