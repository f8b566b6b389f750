//! The first paper's midground and background (section 3.1).
//!
//! # Theory
//! Sharp things insulate: what is blurred far behind them cannot spread beneath. So the blurred background is
//! made a second time without them. A matte alpha ramps from 0 to 1 with the circle of confusion up to a threshold;
//! circles of confusion diffuse with gamma = alpha and a constant beta set from the threshold, colours with gamma =
//! alpha and the new circles, and the two pictures are mixed by alpha.
//!
//! # Changes from the paper
//! - Only diameters behind the plane in focus make the matte: a blurred near object is no background.
//! - Weights blend, `mid (1 - alpha) + background alpha`; they are no coverages, so no light is lost.
//! - Where alpha is 0 all along a line the paper's system is singular; see `crate::diffusion` for what is
//!   done there.
//!
//! # Practice
//! With several layers the thresholds double from one to the next, and each layer's matte ramps from the
//! threshold before it to its own. So no more than one of them is between 0 and 1 at a pixel, and in the order of depth, the midground over
//! all others, each layer's coverage is what the next nearer threshold leaves: `1 - alpha`. Planes are taken a few at a time, so that a picture of any size needs
//! no more than a few planes beside itself.

use super::alone::even;
use crate::rows::for_each_row;
use crate::work::Work;
use pullfocus_core::{Layering, Method, Picture, Plane, Result};

/// Planes that share one factorisation; larger pictures take one at a time, to save memory.
const TOGETHER: usize = 4;
/// From this many pixels on planes go one at a time.
const LARGE: usize = 1 << 26;

/// Blurs `picture` as a midground over `layers` background layers; `threshold` is in pixels.
pub fn blur_over_background(
    work: &mut Work<'_>,
    picture: &mut Picture,
    coc: &Plane,
    layers: u32,
    threshold: f32,
) -> Result<()> {
    let size = picture.size();
    let mut planes: Vec<&mut Plane> = picture.planes_mut().collect();
    let together = if size.area() > LARGE { 1 } else { TOGETHER };
    let mut matte = work.memory.planes.take(size)?;
    let mut circle = work.memory.planes.take(size)?;
    for group in planes.chunks_mut(together) {
        let mut behind = Vec::with_capacity(group.len());
        let mut originals = Vec::new();
        for plane in group.iter() {
            behind.push(work.memory.planes.copy(plane)?);
            if layers > 1 {
                originals.push(work.memory.planes.copy(plane)?);
            }
        }
        work.stage("midground", |work| work.blur(group, coc, None))?;
        for layer in 0..layers {
            let ramp = Layering::background_ramp(layer, threshold);
            if layer > 0 {
                for (plane, original) in behind.iter_mut().zip(&originals) {
                    plane.data_mut().copy_from_slice(original.data());
                }
            }
            work.stage("background", |work| {
                let mut planes: Vec<&mut Plane> = behind.iter_mut().collect();
                blur_background(work, &mut planes, coc, ramp, [&mut matte, &mut circle])
            })?;
            work.stage("composite", |work| {
                for (mid, far) in group.iter_mut().zip(&behind) {
                    for_each_row(mid, work.cancel, |y, row| {
                        for ((mid, &far), &alpha) in row.iter_mut().zip(far.row(y)).zip(matte.row(y)) {
                            // Exactly the midground where alpha is 0.
                            *mid += (far - *mid) * alpha;
                        }
                    })?;
                }
                Ok(())
            })?;
        }
        work.memory.planes.give(behind.into_iter().chain(originals));
    }
    work.memory.planes.give([matte, circle]);
    Ok(())
}

/// Replaces `picture` by one of its layers alone, or by its matte: number 0 is the last of `layers` background layers, number `layers`
/// the midground.
pub fn one_over_background(
    work: &mut Work<'_>,
    picture: &mut Picture,
    coc: &Plane,
    [layers, number]: [u32; 2],
    threshold: f32,
) -> Result<()> {
    if number > layers {
        return even(picture.planes_mut(), 0.0, work.cancel);
    }
    let size = picture.size();
    let together = if size.area() > LARGE { 1 } else { TOGETHER };
    let mut matte = work.memory.planes.take(size)?;
    let mut circle = work.memory.planes.take(size)?;
    let mut planes: Vec<&mut Plane> = picture.planes_mut().collect();
    if work.show.is_matte() {
        even(planes.iter_mut().map(|plane| &mut **plane), 1.0, work.cancel)?;
    } else if number == layers {
        for group in planes.chunks_mut(together) {
            work.stage("midground", |work| work.blur(group, coc, None))?;
        }
    } else {
        let ramp = Layering::background_ramp(layers - 1 - number, threshold);
        for group in planes.chunks_mut(together) {
            work.stage("background", |work| {
                let mut unseen = Vec::new();
                if work.method != Method::Diffusion {
                    for plane in group.iter() {
                        unseen.push(work.memory.planes.copy(plane)?);
                    }
                }
                blur_background(work, group, coc, ramp, [&mut matte, &mut circle])?;
                fill_unseen(work, group, unseen, ramp[1], &matte)
            })?;
        }
    }
    if number > 0 {
        work.stage("composite", |work| {
            make_matte(work, coc, Layering::background_ramp(layers - number, threshold), &mut matte)?;
            for plane in planes {
                for_each_row(plane, work.cancel, |y, row| {
                    row.iter_mut().zip(matte.row(y)).for_each(|(value, alpha)| *value *= 1.0 - alpha);
                })?;
            }
            Ok(())
        })?;
    }
    work.memory.planes.give([matte, circle]);
    Ok(())
}

/// Fills a background layer where it is not seen at all, from `unseen`, the picture before the blur. Diffusion has done that, and needs
/// none; a spread knows nothing beyond the circles of what is seen, and its sums there are what rounding left.
fn fill_unseen(
    work: &mut Work<'_>,
    layer: &mut [&mut Plane],
    mut unseen: Vec<Plane>,
    diameter: f32,
    matte: &Plane,
) -> Result<()> {
    if unseen.is_empty() {
        return Ok(());
    }
    work.fill(&mut unseen.iter_mut().collect::<Vec<_>>(), diameter, matte)?;
    for (plane, unseen) in layer.iter_mut().zip(&unseen) {
        for_each_row(plane, work.cancel, |y, row| {
            for ((value, unseen), &alpha) in row.iter_mut().zip(unseen.row(y)).zip(matte.row(y)) {
                *value = if alpha > 0.0 { *value } else { *unseen };
            }
        })?;
    }
    work.memory.planes.give(unseen);
    Ok(())
}

/// Writes where a background layer is seen.
fn make_matte(work: &Work<'_>, coc: &Plane, [low, high]: [f32; 2], matte: &mut Plane) -> Result<()> {
    for_each_row(matte, work.cancel, |y, row| {
        for (alpha, &c) in row.iter_mut().zip(coc.row(y)) {
            *alpha = ((c - low) / (high - low)).clamp(0.0, 1.0);
        }
    })
}

/// Blurs `planes` as a background layer, without what is nearer than its ramp. Leaves its matte.
fn blur_background(
    work: &mut Work<'_>,
    planes: &mut [&mut Plane],
    coc: &Plane,
    ramp: [f32; 2],
    [matte, circle]: [&mut Plane; 2],
) -> Result<()> {
    make_matte(work, coc, ramp, matte)?;
    for_each_row(circle, work.cancel, |y, row| {
        for (circle, &c) in row.iter_mut().zip(coc.row(y)) {
            *circle = c.max(0.0);
        }
    })?;
    work.fill(&mut [&mut *circle], ramp[1], matte)?;
    work.blur(planes, circle, Some(matte))
}
