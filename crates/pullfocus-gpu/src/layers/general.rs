//! Layers through the whole depth, out of one picture; the CPU's `layers::general` has the theory.
//!
//! # Practice
//! How many layers there are is known to the device alone (`split.wgsl`). Passes are recorded for as many as were asked for,
//! from far to near; those that are not there are neither made nor blurred nor looked at.

use super::alone::clear;
use super::fill::fill;
use super::joint::{self, Layer};
use super::over::cover_part;
use super::{census, edges, scale_parts};
use crate::planes::{Group, Storage, workgroups};
use crate::shader::{Constant, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::layers::fill::{finest_step, grid_size};
use pullfocus_core::layers::general::LEADING;
use pullfocus_core::{Result, Show, Size};

uniform! {
    /// See `gather.wgsl`.
    GatherParams {
        width: u32,
        height: u32,
        grid_width: u32,
        grid_height: u32,
        step: u32,
        layer: u32,
        planes: u32,
        leading: u32,
    }
}

uniform! {
    /// See `composite.wgsl`.
    CompositeParams { width: u32, height: u32, coverage: u32, layers: u32, first: u32 }
}

/// What all passes of one picture need.
pub struct Parts<'a> {
    /// The picture, in groups with room for one more plane.
    pub picture: &'a [Group],
    /// How many colour planes it has.
    pub colors: usize,
    /// How many planes it has, alpha included.
    pub planes: usize,
    /// Signed diameters.
    pub coc: &'a wgpu::Buffer,
    /// See `scale.wgsl`.
    pub split: wgpu::Buffer,
    /// See `edges.rs`.
    pub edge: wgpu::Buffer,
    /// At most so many layers.
    pub layers: u32,
    /// The grid of the fills, and its step in pixels.
    pub grid: Size,
    pub step: usize,
    /// The most bytes of one buffer.
    pub most_bytes: u64,
}

/// One layer's fills, as `gather.wgsl` has them.
pub struct Filled {
    /// Of each group of the picture that holds planes: three planes; with the first group diameter, squared
    /// brightness and the fourth plane, with others the fourth plane if it is there.
    pub groups: Vec<(Group, Option<Group>)>,
    /// Coverage where the layer is hidden; none for the farthest, which covers everything.
    pub coverage: Option<Group>,
}

impl Parts<'_> {
    /// How many planes of group `group` are the picture's.
    pub fn planes_of(&self, group: usize) -> usize {
        self.planes.saturating_sub(4 * group).min(4)
    }

    /// Groups that hold planes.
    pub fn filled_groups(&self) -> usize {
        self.planes.div_ceil(4)
    }

    /// Whether a group is filled with more than three planes; see [`Filled::groups`].
    fn has_others(&self, group: usize) -> bool {
        group == 0 || self.planes_of(group) == 4
    }

    /// Whether a layer's coverage comes with a group: with the first one, and not for the farthest.
    fn has_coverage(&self, layer: u32, group: usize) -> bool {
        group == 0 && layer > 0
    }

    /// Planes that decide over edges.
    pub fn leading(&self) -> u32 {
        self.colors.min(LEADING) as u32
    }
}

/// Blurs `picture` (`planes` planes, of which `colors` are colours, then room for coverage) in place, in at most `layers` layers by the diameters `coc`.
///
/// # Errors
/// As [`crate::diffusion::diffuse`].
pub fn blur_layers(
    work: &mut Work<'_, '_>,
    picture: &[Group],
    [colors, planes]: [usize; 2],
    coc: &wgpu::Buffer,
    layers: u32,
) -> Result<()> {
    if work.size.area() == 0 || planes == 0 {
        return Ok(());
    }
    let limits = work.recorder.context.limits();
    let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let all: Vec<&Group> = picture.iter().collect();
    let mut lights = work.take_lights(&all, colors, [coc; 2])?;
    let layers = layers.clamp(1, MOST_LAYERS);
    if work.show.alone().is_some_and(|number| number >= layers) {
        // How many there are is asked for all the same.
        let split = cut(work, coc, layers)?;
        work.recorder.give([split]);
        clear(work, &all);
        if let Some(lights) = lights {
            lights.give_back(work.recorder);
        }
        return Ok(());
    }
    let apart = take_apart(work, picture, [colors, planes], coc, layers, most_bytes)?;
    let mut shown_lights = lights.as_mut().filter(|_| !work.show.is_matte());
    if let Some(lights) = &mut shown_lights {
        let groups: Vec<&[Group]> = apart.iter().map(|layer| &layer.groups[..]).collect();
        lights.share_out(work, &groups, planes)?;
    }
    work.recorder.stage("blur");
    let mut done = Vec::new();
    for (i, Layer { groups, circle }) in apart.into_iter().enumerate() {
        let layer = i as u32;
        // The farthest covers everything, and that needs no blur.
        let used = if i == 0 { planes.div_ceil(4) } else { groups.len() };
        let coverage = (planes / 4).min(used);
        let used = match work.show {
            Show::Result => 0..used,
            Show::Layer(number) if layer == number => 0..used,
            // Highlights are made up for what these take away.
            Show::Layer(number) if layer > number && shown_lights.is_some() => coverage..used,
            Show::Matte(number) if layer == number => coverage..used,
            Show::Layer(_) | Show::Matte(_) => 0..0,
        };
        let all: Vec<&Group> = groups[used].iter().collect();
        if !all.is_empty() {
            work.blur(&all, &circle, None)?;
        }
        work.recorder.give([circle]);
        done.push(groups);
    }
    if let Some(lights) = shown_lights {
        lights.add_to_layers(work, &done, planes)?;
    }
    if let Some(lights) = lights {
        lights.give_back(work.recorder);
    }
    work.recorder.stage("composite");
    let shown = work.show.alone().map_or(0..done.len(), |number| number as usize..number as usize + 1);
    composite(work, picture, planes, &done[shown.clone()], shown.start as u32)?;
    work.recorder.give(done.into_iter().flatten().map(|group| group.buffer));
    Ok(())
}

/// Cuts the picture whose diameters are `coc` into at most `layers` layers; see [`census::split`].
fn cut(work: &mut Work<'_, '_>, coc: &wgpu::Buffer, layers: u32) -> Result<wgpu::Buffer> {
    work.recorder.stage("layers");
    let split = census::split(work, coc, layers)?;
    // Where the count stands in `scale.wgsl`, and where solvers and hosts look for it.
    work.recorder.encoder().copy_buffer_to_buffer(&split, 4, &work.range, 8, 4);
    Ok(split)
}

/// The layers of a picture, from far to near, not yet blurred.
///
/// # Errors
/// As [`blur_layers`].
pub fn take_apart(
    work: &mut Work<'_, '_>,
    picture: &[Group],
    [colors, planes]: [usize; 2],
    coc: &wgpu::Buffer,
    layers: u32,
    most_bytes: u64,
) -> Result<Vec<Layer>> {
    let layers = layers.clamp(1, MOST_LAYERS);
    let split = cut(work, coc, layers)?;
    let edge = edges::find(work, coc, &split)?;
    let step = finest_step(work.display_width);
    let grid = grid_size(work.size, step);
    let parts = Parts { picture, colors, planes, coc, split, edge, layers, grid, step, most_bytes };
    let filled = fill_layers(work, &parts)?;
    let apart = joint::make(work, &parts, filled)?;
    let Parts { split, edge, .. } = parts;
    work.recorder.give([split, edge]);
    Ok(apart)
}

/// Finds what each layer, counted from far to near, looks like where it is not seen. All of them at once: their passes do
/// not wait for each other.
fn fill_layers(work: &mut Work<'_, '_>, parts: &Parts<'_>) -> Result<Vec<Filled>> {
    let mut weighted = Vec::new();
    for layer in 0..parts.layers {
        for group in 0..parts.filled_groups() {
            let gathered = gather(work, parts, layer, group)?;
            weighted.extend(gathered.into_iter().map(|group| group.of_layer(layer)));
        }
    }
    let mut rest = fill(work, parts.grid, weighted)?.into_iter();
    let mut layers = Vec::new();
    for layer in 0..parts.layers {
        let mut filled = Filled { groups: Vec::new(), coverage: None };
        for group in 0..parts.filled_groups() {
            let Some(colors) = rest.next() else { break };
            let others = if parts.has_others(group) { rest.next() } else { None };
            filled.groups.push((colors, others));
            if parts.has_coverage(layer, group) {
                filled.coverage = rest.next();
            }
        }
        layers.push(filled);
    }
    Ok(layers)
}

/// What layer `layer` is filled from, of one group of planes: in the order of [`Filled`].
fn gather(work: &mut Work<'_, '_>, parts: &Parts<'_>, layer: u32, group: usize) -> Result<Vec<Group>> {
    let (size, grid) = (work.size, parts.grid);
    let (others, coverage) = (parts.has_others(group), parts.has_coverage(layer, group));
    let params = GatherParams {
        width: size.width as u32,
        height: size.height as u32,
        grid_width: grid.width as u32,
        grid_height: grid.height as u32,
        step: parts.step as u32,
        layer,
        planes: parts.planes_of(group) as u32,
        leading: parts.leading(),
    };
    let picture = &parts.picture[group];
    let ([constants, scale], [lane, px]) = (scale_parts(), picture.parts());
    let spec = Spec::new(
        &[constants, scale, lane, px, part!("layers/gather")],
        &[
            ("FIRST", Constant::Flag(group == 0)),
            ("OTHERS", Constant::Flag(others)),
            ("COVERAGE", Constant::Flag(coverage)),
        ],
    );
    let (mut made, mut bound, mut spare) = (Vec::new(), Vec::new(), Vec::new());
    for there in [true, others, coverage] {
        if there {
            let group = Group::take(work.recorder, grid, 4, Storage::Full)?;
            bound.push(group.buffer.clone());
            made.push(group);
        } else {
            // What is not written must still be bound, and nothing twice.
            let nothing = work.recorder.take(Size::new(1, 1), 16)?;
            bound.push(nothing.clone());
            spare.push(nothing);
        }
    }
    let mut buffers = vec![&parts.split, parts.coc, &parts.edge, &picture.buffer];
    buffers.extend(&bound);
    work.recorder.run(&spec, &params, &buffers, workgroups(grid))?;
    work.recorder.worked(4 * size.area() as u64)?;
    work.recorder.give(spare);
    Ok(made)
}

/// Lays the layers, from far to near, over each other, of which the first is number `first`: into `picture`, unless that is all in focus. One
/// that is shown alone is the only one.
///
/// # Errors
/// A host's [`pullfocus_core::Error::Cancelled`].
pub fn composite(
    work: &mut Work<'_, '_>,
    picture: &[Group],
    planes: usize,
    layers: &[Vec<Group>],
    first: u32,
) -> Result<()> {
    let (coverage_group, coverage) = (planes / 4, (planes % 4) as u32);
    let range = work.range.clone();
    let (alone, matte) = (work.show.alone().is_some(), work.show.is_matte());
    let nothing = work.recorder.memory.nothing.clone();
    for (g, group) in picture[..planes.div_ceil(4)].iter().enumerate() {
        let own = g == coverage_group;
        let (fronts, most) = if own { (part!("layers/fronts_5"), 5) } else { (part!("layers/fronts_3"), 3) };
        for (k, some) in layers.chunks(most).enumerate() {
            let [lane, px] = group.parts();
            let mut parts = vec![lane, px];
            if !own {
                parts.push(cover_part(&some[0][coverage_group]));
            }
            parts.extend([fronts, part!("layers/found"), part!("layers/composite")]);
            let constants = [
                ("FARTHEST", Constant::Flag(k == 0)),
                ("ALONE", Constant::Flag(alone)),
                ("MATTE", Constant::Flag(matte)),
            ];
            let spec = Spec::new(&parts, &constants);
            let params = CompositeParams {
                width: work.size.width as u32,
                height: work.size.height as u32,
                coverage,
                layers: some.len() as u32,
                first: first + (k * most) as u32,
            };
            let mut buffers = vec![&range, &group.buffer];
            for from in if own { vec![g] } else { vec![g, coverage_group] } {
                let there = some.iter().map(|groups| &groups[from].buffer);
                buffers.extend(there.chain(std::iter::repeat(&nothing)).take(most));
            }
            work.recorder.run(&spec, &params, &buffers, workgroups(work.size))?;
            work.recorder.worked((work.size.area() * some.len()) as u64)?;
        }
    }
    Ok(())
}
