//! A foreground that was given on its own, with alpha, over the picture behind it (first paper, 3.2).
//!
//! # Theory
//! A near object out of focus turns transparent at its edges, and what is behind shows through. The element's
//! circles of confusion are carried beyond it (diffused with gamma = alpha); then its alpha and its premultiplied
//! colour are blurred with the carried circles, and the result is laid over what is behind.
//!
//! # Changes from the paper
//! The paper diffuses colour and alpha with gamma = alpha, too. Where gamma is 0 the initial value counts for
//! nothing, so for a matte of 0 and 1 the constant 1 solves the system: the element would cover everything.
//! Here gamma is 1 in the last step, so coverage is conserved: what alpha loses inside it gains outside.
//! The conformance tests keep the letter beside this form.

use super::over;
use crate::rows::{fold_rows, for_each_row};
use crate::work::Work;
use pullfocus_core::{Picture, Plane, Result};

/// Blurs `element` with the circles `coc` and lays it over `picture`. Both have the same colour planes, and
/// `alpha` is the element's coverage.
pub fn blur_element_over(
    work: &mut Work<'_>,
    element: &Picture,
    alpha: &Plane,
    coc: &Plane,
    picture: &mut Picture,
) -> Result<()> {
    let circle = work.stage("foreground", |work| extend(work, alpha, coc))?;
    let mut planes = Vec::new();
    for plane in element.colors.iter().chain([alpha]) {
        planes.push(work.memory.planes.copy(plane)?);
    }
    work.stage("foreground", |work| {
        let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
        work.blur(&mut planes, &circle, None)
    })?;
    work.stage("composite", |work| {
        let Some((coverage, _)) = planes.split_last() else { return Ok(()) };
        let behind = picture.colors.iter_mut().chain(&mut picture.alpha);
        for (front, behind) in planes.iter().zip(behind) {
            over(behind, front, Some(coverage), work.cancel)?;
        }
        Ok(())
    })?;
    work.memory.planes.give(planes.into_iter().chain([circle]));
    work.report.layers += 1;
    Ok(())
}

/// Absolute diameters, the element's own where it is and carried on from there where it is not.
fn extend(work: &mut Work<'_>, alpha: &Plane, coc: &Plane) -> Result<Plane> {
    let size = coc.size();
    let largest = fold_rows(
        size.height,
        work.cancel,
        |y| coc.row(y).iter().zip(alpha.row(y)).fold(0f32, |most, (c, a)| most.max(c.abs() * a)),
        f32::max,
    )?;
    let mut circle = work.memory.planes.take(size)?;
    for_each_row(&mut circle, work.cancel, |y, row| {
        for ((circle, c), a) in row.iter_mut().zip(coc.row(y)).zip(alpha.row(y)) {
            *circle = if *a > 0.0 { c.abs() } else { 0.0 };
        }
    })?;
    // Twice the largest: blurred coverage reaches one circle beyond the edge and fades over another.
    work.fill(&mut [&mut circle], 2.0 * largest.unwrap_or(0.0), alpha)?;
    for_each_row(&mut circle, work.cancel, |y, row| {
        for ((circle, c), a) in row.iter_mut().zip(coc.row(y)).zip(alpha.row(y)) {
            let a = a.clamp(0.0, 1.0);
            *circle = a * c.abs() + (1.0 - a) * *circle;
        }
    })?;
    Ok(circle)
}
