//! A foreground that was given on its own, with alpha, over the picture behind it (first paper, 3.2); the CPU's
//! `layers::foreground` has the theory.

use super::alone::{Count, clear, take_place};
use super::fill::fill;
use super::over::{cover_part, over};
use crate::bokeh::Shown;
use crate::pipeline::{Near, bring_back};
use crate::planes::{Group, Storage, workgroups};
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::Result;
use pullfocus_core::layers::fill::{finest_step, grid_size};
use pullfocus_core::layers::general::LEADING;

uniform! {
    /// See `element.wgsl`.
    ExtendParams {
        width: u32,
        height: u32,
        grid_width: u32,
        grid_height: u32,
        step: u32,
        coverage: u32,
        leading: u32,
        protect: u32,
        near: f32,
        far: f32,
        front: f32,
        back: f32,
        largest: f32,
    }
}

/// Blurs `near`, in place, and lays it over `picture`. Planes stand in the same groups in both.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn blur_element_over(work: &mut Work<'_, '_>, near: &Near<'_>, picture: &[&Group]) -> Result<()> {
    let (element, alpha) = (near.element.used(), near.element.planes - 1);
    work.recorder.stage("foreground");
    let circle = extend(work, near)?;
    let groups: Vec<&Group> = element.iter().collect();
    // The carried circles, on the element's own side of focus.
    let lights = work.take_lights(&groups, alpha, [&circle, &near.element.coc])?;
    work.recorder.stage("foreground");
    work.blur(&groups, &circle, None)?;
    work.recorder.stage("composite");
    over(work, element, alpha, picture)?;
    bring_back(work, lights, picture, Some(Shown::All))?;
    work.recorder.give([circle]);
    Ok(())
}

/// Shows `near`, the last layer, or its matte, in the place of `picture`, if that is what is asked for behind `farther` layers. For the rest
/// see [`blur_element_over`].
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn show_element(
    work: &mut Work<'_, '_>,
    near: &Near<'_>,
    picture: &[&Group],
    farther: Count,
) -> Result<()> {
    let (element, alpha) = (near.element.used(), near.element.planes - 1);
    let Some(number) = work.show.alone() else { return Ok(()) };
    let may_be = match farther {
        Count::Known(count) => number == count,
        Count::Found(most) => (1..=most).contains(&number),
    };
    if !may_be {
        return Ok(());
    }
    let asked = (number, farther);
    let covering = (&element[alpha / 4], (alpha % 4) as u32);
    work.recorder.stage("foreground");
    let circle = extend(work, near)?;
    let groups: Vec<&Group> = element.iter().collect();
    if work.show.is_matte() {
        // Light changes no matte, and no other plane is looked at.
        work.blur(&groups[alpha / 4..=alpha / 4], &circle, None)?;
        work.recorder.stage("composite");
        take_place(work, &groups, covering, picture, asked)?;
        work.recorder.give([circle]);
        return Ok(());
    }
    let lights = work.take_lights(&groups, alpha, [&circle, &near.element.coc])?;
    work.recorder.stage("foreground");
    work.blur(&groups, &circle, None)?;
    work.recorder.stage("composite");
    // Whether it is asked for may be known to the device alone, so it is laid over nothing aside from the picture.
    let mut alone = Vec::new();
    for group in picture {
        alone.push(Group::take(work.recorder, work.size, group.planes, group.storage)?);
    }
    let alone: Vec<&Group> = alone.iter().collect();
    clear(work, &alone);
    over(work, element, alpha, &alone)?;
    bring_back(work, lights, &alone, Some(Shown::All))?;
    take_place(work, &alone, covering, picture, asked)?;
    work.recorder.give(alone.into_iter().map(|group| group.buffer.clone()).chain([circle]));
    Ok(())
}

/// Diameters: the element's own where they can be believed, carried on from there, without their sign, where not.
fn extend(work: &mut Work<'_, '_>, near: &Near<'_>) -> Result<wgpu::Buffer> {
    let Near { element, behind, curve } = *near;
    let alpha = element.planes - 1;
    let covering = &element.groups[alpha / 4];
    let [near, far] = curve.protect.unwrap_or_default();
    let size = work.size;
    let step = finest_step(work.display_width);
    let grid = grid_size(size, step);
    let params = ExtendParams {
        width: size.width as u32,
        height: size.height as u32,
        grid_width: grid.width as u32,
        grid_height: grid.height as u32,
        step: step as u32,
        coverage: (alpha % 4) as u32,
        leading: element.colors.min(LEADING) as u32,
        protect: curve.protect.is_some().into(),
        near: near as f32,
        far: far as f32,
        front: curve.front as f32,
        back: curve.back as f32,
        largest: curve.max as f32,
    };
    // The first group, with the leading colours.
    let light = &element.groups[0];
    let [lane, px] = light.parts();
    let parts = [lane, px, cover_part(covering), part!("shape"), part!("layers/element")];
    let cells = Group::take(work.recorder, grid, 4, Storage::Full)?;
    let believed = Spec::new(&[&parts[..], &[part!("layers/believed")]].concat(), &[]);
    let buffers = [&light.buffer, &covering.buffer, &element.coc, behind, &cells.buffer];
    work.recorder.run(&believed, &params, &buffers, workgroups(grid))?;
    let filled = fill(work, grid, vec![cells])?;
    let circle = work.recorder.take_plane(size)?;
    let extend = Spec::new(&[&parts[..], &[part!("layers/enlarge"), part!("layers/extend")]].concat(), &[]);
    let buffers = [&light.buffer, &covering.buffer, &element.coc, behind, &filled[0].buffer, &circle];
    work.recorder.run(&extend, &params, &buffers, workgroups(size))?;
    work.recorder.give(filled.into_iter().map(|group| group.buffer));
    Ok(circle)
}
