//! A foreground that was given on its own, with alpha, over the picture behind it (first paper, 3.2).
//!
//! # Theory
//! A near object out of focus turns transparent at its edges, and what is behind shows through. The element's
//! circles of confusion are carried beyond it (averages weighted by alpha, and by 1 where light covers nothing, at several
//! scales); then its alpha and its premultiplied colour are blurred with the carried circles, and the result is laid over what is
//! behind.
//!
//! # Changes from the paper
//! The paper diffuses colour and alpha with gamma = alpha, too. Where gamma is 0 the initial value counts for
//! nothing, so for a matte of 0 and 1 the constant 1 solves the system: the element would cover everything.
//! Here gamma is 1 in the last step, so coverage is conserved: what alpha loses inside it gains outside.
//! The conformance tests keep the letter beside this form.

use super::alone::lay_alone;
use super::fill::{Sources, enlarge_row, fill};
use super::over;
use crate::bokeh::Shown;
use crate::rows::for_each_row;
use crate::work::Work;
use pullfocus_core::bokeh::brightness;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::layers::fill::finest_step;
use pullfocus_core::{Picture, Plane, Result, Show};

/// An element, and what tells where its depth can be believed: where it lies in front of what is behind. An anti-aliased edge pixel
/// whose centre missed the element carries the depth of whatever is farther away.
pub struct Near<'a> {
    /// Its colours.
    pub picture: &'a Picture,
    /// Its coverage.
    pub alpha: &'a Plane,
    /// Its circles as the lens alone makes them.
    pub coc: &'a Plane,
    /// Those of what is behind it. Farther away is a larger signed diameter, whatever the focus; not so once settings have cut it.
    pub behind: &'a Plane,
    /// What the settings make of its circles.
    pub curve: CocCurve,
}

/// Blurs `near` and lays it over `picture`, or over nothing where it is shown alone. Both have the same colour planes.
pub fn blur_element_over(work: &mut Work<'_>, near: &Near<'_>, picture: &mut Picture) -> Result<()> {
    let Near { alpha, coc, .. } = *near;
    let circle = work.stage("foreground", |work| extend(work, near))?;
    let mut planes = Vec::new();
    // Light changes no matte.
    let matte = work.show.is_matte();
    let colors = if matte { &[] } else { &near.picture.colors[..] };
    for plane in colors.iter().chain([alpha]) {
        planes.push(work.memory.planes.copy(plane)?);
    }
    let mut lights = None;
    if work.look.is_some() && !matte {
        // The carried circles, on the element's own side of focus.
        let mut signed = work.memory.planes.copy(&circle)?;
        for_each_row(&mut signed, work.cancel, |y, row| {
            row.iter_mut().zip(coc.row(y)).for_each(|(circle, c)| *circle = circle.copysign(*c));
        })?;
        lights = work.take_lights(&mut planes[..colors.len()].iter_mut().collect::<Vec<_>>(), &signed)?;
        work.memory.planes.give([signed]);
    }
    work.stage("foreground", |work| {
        let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
        work.blur(&mut planes, &circle, None)
    })?;
    work.stage("composite", |work| {
        let Some((coverage, _)) = planes.split_last() else { return Ok(()) };
        let behind = picture.planes_mut();
        if work.show != Show::Result {
            return lay_alone(behind, &planes, Some(coverage), work.show, work.cancel);
        }
        for (front, behind) in planes.iter().zip(behind) {
            over(behind, front, Some(coverage), work.cancel)?;
        }
        Ok(())
    })?;
    let mut colors: Vec<&mut Plane> = picture.colors.iter_mut().collect();
    work.add_lights(&mut lights, &mut colors, Shown::All)?;
    work.give_lights(lights);
    work.memory.planes.give(planes.into_iter().chain([circle]));
    Ok(())
}

impl Near<'_> {
    /// How much the depth of a pixel says about the element.
    #[inline(always)]
    fn weight(&self, x: usize, y: usize) -> f32 {
        let alpha = self.alpha.at(x, y);
        if self.coc.at(x, y) >= self.behind.at(x, y) {
            0.0
        } else if alpha > 0.0 {
            alpha.min(1.0)
        } else {
            // Light that covers nothing, as of sparks, has a depth, too.
            let light = brightness(self.picture.colors.iter().map(|plane| plane.at(x, y)));
            if light > 0.0 { 1.0 } else { 0.0 }
        }
    }

    /// The circle of a pixel, with the settings on top.
    #[inline(always)]
    fn circle(&self, x: usize, y: usize) -> f32 {
        self.curve.shape(f64::from(self.coc.at(x, y)))
    }
}

/// The element's diameters, weighted.
impl Sources for Near<'_> {
    fn groups(&self) -> &[usize] {
        &[1]
    }

    #[inline(always)]
    fn weighted_rows(&self, y: usize, rows: &mut [Vec<f32>]) {
        let [circles, weights] = rows else { return };
        for (x, (circle, weight)) in circles.iter_mut().zip(weights).enumerate() {
            *weight = self.weight(x, y);
            *circle = self.circle(x, y).abs() * *weight;
        }
    }
}

/// Diameters: the element's own where they can be believed, carried on from there where not, without their sign.
fn extend(work: &mut Work<'_>, near: &Near<'_>) -> Result<Plane> {
    let size = near.coc.size();
    let mut filled = fill(work, size, near)?;
    let step = finest_step(work.display_width);
    let mut circle = work.memory.planes.take(size)?;
    for_each_row(&mut circle, work.cancel, |y, row| {
        if let Some(filled) = filled.first() {
            enlarge_row(filled, step, y, 0, row);
        }
        for (x, circle) in row.iter_mut().enumerate() {
            if near.weight(x, y) > 0.0 {
                *circle = near.circle(x, y);
            }
        }
    })?;
    work.memory.planes.give(filled.drain(..));
    Ok(circle)
}
