//! Layers through the whole depth, out of one picture.
//!
//! # Theory
//! A single picture has foregrounds and backgrounds, too. It is taken apart into layers by the circle of confusion
//! ([`pullfocus_core::split`]); each layer is filled where nearer ones hide it, blurred on its own with its premultiplied
//! colour and its coverage, and laid over the farther ones. The farthest covers everything: alpha is a colour
//! like the others, coverage is another thing.
//!
//! - *Coverage.* Where a layer is seen it covers as much as is seen of it; where a nearer one hides it, it goes on as
//!   far as its visible share around suggests.
//! - *Edges.* A pixel on an edge holds two colours and one depth. Its share of the near one is found from
//!   its colour between those of the two fills, as far as they differ by more than they vary; else from
//!   its depth. Where that depth lies in a third layer, between those of the edge, the pixel is a thin thing's:
//!   as any pixel, it belongs to the layer of its depth.
//! - *Exactness.* What the unblurred layers put together lack of the picture is given to them in proportion to
//!   how much is seen of each, so that without blur the composite is the picture.
//!
//! # Practice
//! One pass over the picture does all of the last three, in blocks small enough for the nearest cache.

use super::alone::{even, lay_alone};
use super::edges::{self, Edges};
use super::fill::{Sources, enlarge_row, fill};
use super::{census, over};
use crate::bokeh::Shown;
use crate::rows::rows_of;
use crate::wide;
use crate::work::Work;
use pullfocus_core::layers::fill::finest_step;
use pullfocus_core::layers::general::{COLOR_NOISE, EDGE_TRUST, LEADING, LEAST_SHARE, OWN_FROM, VARIANCE};
use pullfocus_core::split::{Ramps, Split, smoothstep};
use pullfocus_core::{Picture, Plane, Result, Show};
use rayon::prelude::*;

/// Pixels that go through the joint pass at a time; some 60 rows of this fit the nearest cache.
const BLOCK: usize = 128;

/// One layer's fills, on the finest grid.
struct Filled {
    /// Which of the split's layers.
    layer: usize,
    /// Colour planes, alpha where there is one.
    colors: Vec<Plane>,
    /// Absolute diameter.
    circle: Plane,
    /// Mean of the squared brightness.
    squares: Plane,
    /// Coverage where it is hidden; none for the farthest, which covers everything.
    coverage: Option<Plane>,
}

/// Blurs `picture` in at most `layers` layers. Returns how many there are, whichever of them are shown.
pub fn blur_layers(work: &mut Work<'_>, picture: &mut Picture, coc: &Plane, layers: u32) -> Result<usize> {
    let size = picture.size();
    if size.area() == 0 {
        return Ok(0);
    }
    let leading = picture.colors.len().min(LEADING);
    let colors = picture.colors.len();
    let mut planes: Vec<&mut Plane> = picture.planes_mut().collect();
    let mut lights = work.take_lights(&mut planes[..colors], coc)?;

    let (split, scale) = work.stage("layers", |work| census::split(work, coc, layers as usize))?;
    let found = split.layers();
    if work.show.alone().is_some_and(|number| number as usize >= found) {
        work.give_lights(lights);
        work.memory.planes.give([scale]);
        even(planes, 0.0, work.cancel)?;
        return Ok(found);
    }
    let (edges, filled) = work.stage("layers", |work| {
        let edges = edges::find(work, coc, &split)?;
        let mut filled = Vec::with_capacity(found);
        // From far to near.
        for layer in (0..found).rev() {
            let farthest = layer + 1 == found;
            // The farthest covers everything: there is nothing to find out about its coverage.
            let values = planes.len() + 2;
            let groups: &[usize] = if farthest { &[values] } else { &[values, 1] };
            let (planes, split, scale, edges) = (&planes[..], &split, &scale, &edges);
            let seen = Seen { planes, leading, coc, split, scale, edges, layer, groups };
            let mut colors = fill(work, size, &seen)?;
            let coverage = if farthest { None } else { colors.pop() };
            let squares = colors.pop().unwrap_or_default();
            let circle = colors.pop().unwrap_or_default();
            filled.push(Filled { layer, colors, circle, squares, coverage });
        }
        Ok((edges, filled))
    })?;

    let count = planes.len();
    let mut blurred = Vec::new();
    for _ in 0..filled.len() * (count + 2) {
        // New memory is written once before it is used, which takes a while for a large picture.
        work.cancel.check()?;
        blurred.push(work.memory.planes.take(size)?);
    }
    work.stage("layers", |work| {
        let inputs: Vec<&Plane> = planes.iter().map(|plane| &**plane).collect();
        let joint = Joint {
            inputs: &inputs,
            leading,
            coc,
            scale: &scale,
            split: &split,
            edges: &edges,
            filled: &filled,
            step: finest_step(work.display_width),
        };
        joint.run(work, &mut blurred)
    })?;
    edges.give_back(work);
    work.memory.planes.give([scale]);
    for layer in filled {
        work.memory
            .planes
            .give(layer.colors.into_iter().chain([layer.circle, layer.squares]).chain(layer.coverage));
    }

    let mut shown_lights = lights.as_mut().filter(|_| !work.show.is_matte());
    if let Some(lights) = &mut shown_lights {
        let coverages: Vec<&Plane> = blurred.chunks_exact(count + 2).map(|layer| &layer[count]).collect();
        work.stage("highlights", |work| lights.share_out(&coverages, work.cancel))?;
    }
    for (i, layer) in blurred.chunks_exact_mut(count + 2).enumerate() {
        let Some((circle, values)) = layer.split_last_mut() else { continue };
        // The farthest covers everything, and that needs no blur.
        let all = if i == 0 { count } else { count + 1 };
        let used = match work.show {
            Show::Result => 0..all,
            Show::Layer(number) if i == number as usize => 0..all,
            // Highlights are made up for what these take away.
            Show::Layer(number) if i > number as usize && shown_lights.is_some() => count..all,
            Show::Matte(number) if i == number as usize => count..all,
            Show::Layer(_) | Show::Matte(_) => continue,
        };
        let mut used: Vec<&mut Plane> = values[used].iter_mut().collect();
        if !used.is_empty() {
            work.stage("blur", |work| work.blur(&mut used, circle, None))?;
        }
    }
    if let Some(lights) = &mut shown_lights {
        let coverages: Vec<&Plane> = blurred.chunks_exact(count + 2).map(|layer| &layer[count]).collect();
        work.stage("highlights", |work| lights.make_up(&coverages, work.cancel))?;
    }
    for (i, layer) in blurred.chunks_exact(count + 2).enumerate() {
        if work.show.alone().is_some_and(|number| i != number as usize) {
            continue;
        }
        work.stage("composite", |work| {
            let coverage = if i == 0 { None } else { Some(&layer[count]) };
            if work.show != Show::Result {
                let planes = planes.iter_mut().map(|plane| &mut **plane);
                return lay_alone(planes, &layer[..count], coverage, work.show, work.cancel);
            }
            for (plane, layer) in planes.iter_mut().zip(&layer[..count]) {
                over(plane, layer, coverage, work.cancel)?;
            }
            Ok(())
        })?;
        if !work.show.is_matte() {
            work.add_lights(&mut lights, &mut planes[..colors], Shown::InLayer(i))?;
        }
    }
    work.give_lights(lights);
    work.memory.planes.give(blurred);
    Ok(found)
}

/// What one layer is filled from: the picture's planes, the diameter and the squared brightness where the layer
/// is seen; its coverage where nothing nearer hides it.
struct Seen<'a> {
    planes: &'a [&'a mut Plane],
    leading: usize,
    coc: &'a Plane,
    split: &'a Split,
    scale: &'a Plane,
    edges: &'a Edges,
    layer: usize,
    groups: &'a [usize],
}

impl Sources for Seen<'_> {
    fn groups(&self) -> &[usize] {
        self.groups
    }

    #[inline(always)]
    fn weighted_rows(&self, y: usize, rows: &mut [Vec<f32>]) {
        let (values, coverage) = rows.split_at_mut(self.groups[0] + 1);
        let [values @ .., weight] = values else { return };
        let edges = self.edges.strength.row(y);
        let ramps = self.split.ramps(self.layer);
        let trust = |edge: f32| 1.0 - edge * (1.0 - EDGE_TRUST);
        for ((weight, &u), &edge) in weight.iter_mut().zip(self.scale.row(y)).zip(edges) {
            *weight = ramps.at(u).seen * trust(edge);
        }
        if let [seen, behind] = coverage {
            for (((seen, behind), &u), &edge) in seen.iter_mut().zip(behind).zip(self.scale.row(y)).zip(edges)
            {
                let membership = ramps.at(u);
                *behind = membership.behind * trust(edge);
                *seen = membership.seen * *behind;
            }
        }
        let [values @ .., circle, squares] = values else { return };
        squares.fill(0.0);
        let share = 1.0 / self.leading.max(1) as f32;
        for (p, (out, plane)) in values.iter_mut().zip(self.planes).enumerate() {
            let row = plane.row(y);
            for ((out, value), weight) in out.iter_mut().zip(row).zip(weight.iter()) {
                *out = value * weight;
            }
            if p < self.leading {
                for (square, value) in squares.iter_mut().zip(row) {
                    *square += share * value;
                }
            }
        }
        for (square, weight) in squares.iter_mut().zip(weight.iter()) {
            *square = *square * *square * weight;
        }
        for ((circle, c), weight) in circle.iter_mut().zip(self.coc.row(y)).zip(weight.iter()) {
            *circle = c.abs() * weight;
        }
    }
}

/// The pass that makes every layer's premultiplied colour, coverage and diameter.
struct Joint<'a> {
    inputs: &'a [&'a Plane],
    leading: usize,
    coc: &'a Plane,
    scale: &'a Plane,
    split: &'a Split,
    edges: &'a Edges,
    filled: &'a [Filled],
    step: usize,
}

type Row = [f32; BLOCK];
const ZERO: Row = [0.0; BLOCK];

/// What the joint pass knows of one layer in one block.
struct LayerRows {
    fills: Vec<Row>,
    circle: Row,
    variance: Row,
    /// Coverage where the layer is hidden.
    hidden: Row,
    /// Coverage in the end.
    coverage: Row,
    seen: Row,
    behind: Row,
    /// At the nearest and the farthest diameter around.
    at_near: [Row; 2],
    at_far: [Row; 2],
    weight: Row,
}

impl LayerRows {
    fn new(planes: usize) -> Self {
        Self {
            fills: vec![ZERO; planes],
            circle: ZERO,
            variance: ZERO,
            hidden: ZERO,
            coverage: ZERO,
            seen: ZERO,
            behind: ZERO,
            at_near: [ZERO; 2],
            at_far: [ZERO; 2],
            weight: ZERO,
        }
    }
}

/// The memberships of a layer at positions `u`.
#[inline(always)]
fn members(ramps: &Ramps, u: &Row, seen: &mut Row, behind: &mut Row) {
    for i in 0..BLOCK {
        let membership = ramps.at(u[i]);
        seen[i] = membership.seen;
        behind[i] = membership.behind;
    }
}

/// Takes from the strength of edges what a pixel's own depth has to do with neither side.
#[inline(always)]
fn without_between(layers: &[LayerRows], edge: &mut Row) {
    let (mut from_near, mut from_far) = (ZERO, ZERO);
    for layer in layers {
        for i in 0..BLOCK {
            from_near[i] += (layer.seen[i] - layer.at_near[0][i]).abs();
            from_far[i] += (layer.seen[i] - layer.at_far[0][i]).abs();
        }
    }
    for i in 0..BLOCK {
        // Both what one layer shows less and what another shows more is counted.
        edge[i] *= 1.0 - (0.5 * from_near[i].min(from_far[i])).min(1.0);
    }
}

/// One row of the joint pass.
struct JointRow<'a, 'b> {
    joint: &'a Joint<'a>,
    y: usize,
    width: usize,
    layers: &'a mut [LayerRows],
    out: &'a mut [&'b mut [f32]],
}

impl wide::Work for JointRow<'_, '_> {
    #[inline(always)]
    fn run(self) {
        for x in (0..self.width).step_by(BLOCK) {
            self.joint.block(self.y, x, BLOCK.min(self.width - x), self.layers, self.out);
        }
    }
}

impl Joint<'_> {
    /// Fills `out`: for each layer, far to near, its planes, coverage and diameter.
    fn run(&self, work: &Work<'_>, out: &mut [Plane]) -> Result<()> {
        let width = self.coc.size().width;
        rows_of(out).par_iter_mut().enumerate().with_min_len(4).try_for_each_init(
            || self.filled.iter().map(|_| LayerRows::new(self.inputs.len())).collect::<Vec<_>>(),
            |layers, (y, rows)| {
                work.cancel.check()?;
                wide::run(JointRow { joint: self, y, width, layers, out: rows });
                Ok(())
            },
        )
    }

    #[inline(always)]
    fn block(&self, y: usize, x: usize, n: usize, layers: &mut [LayerRows], out: &mut [&mut [f32]]) {
        let count = self.inputs.len();
        let part = |plane: &'_ Plane| -> Row {
            let mut row = ZERO;
            row[..n].copy_from_slice(&plane.row(y)[x..x + n]);
            row
        };
        let c = part(self.coc);
        let near = part(&self.edges.near);
        let far = part(&self.edges.far);
        let mut edge = part(&self.edges.strength);
        let inputs: Vec<Row> = self.inputs.iter().map(|plane| part(plane)).collect();
        let on_edge = edge[..n].iter().any(|&e| e > 0.0);
        self.load(y, x, n, layers, [&part(self.scale), &near, &far], on_edge);

        if on_edge {
            without_between(layers, &mut edge);
            let share = self.share(layers, &inputs, [&c, &near, &far]);
            for layer in &mut layers[1..] {
                for i in 0..BLOCK {
                    let at = |[seen, behind]: &[Row; 2]| seen[i] + (1.0 - behind[i]) * layer.hidden[i];
                    let mixed = share[i] * at(&layer.at_near) + (1.0 - share[i]) * at(&layer.at_far);
                    layer.coverage[i] += (mixed - layer.coverage[i]) * edge[i];
                }
            }
        }

        // What is seen of each layer, from near to far.
        let mut clear = [1f32; BLOCK];
        let mut squares = ZERO;
        for layer in layers.iter_mut().rev() {
            for i in 0..BLOCK {
                layer.weight[i] = layer.coverage[i] * clear[i];
                clear[i] *= 1.0 - layer.coverage[i];
                squares[i] += layer.weight[i] * layer.weight[i];
            }
        }
        for square in &mut squares {
            *square = 1.0 / square.max(1e-6);
        }
        for (p, input) in inputs.iter().enumerate() {
            let mut sum = ZERO;
            for layer in layers.iter_mut() {
                for i in 0..BLOCK {
                    let own = smoothstep(layer.seen[i] / OWN_FROM) * layer.behind[i] * (1.0 - edge[i]);
                    let fill = layer.fills[p][i];
                    let color = fill + (input[i] - fill) * own;
                    layer.fills[p][i] = color;
                    sum[i] += layer.weight[i] * color;
                }
            }
            // What is missing is added, what is too much taken away as far as no layer becomes negative by it; the rest
            // of that is scaled away.
            let mut rest = ZERO;
            for i in 0..BLOCK {
                rest[i] = (input[i] - sum[i]) * squares[i];
            }
            let (mut part, mut scale) = ([1f32; BLOCK], [1f32; BLOCK]);
            for layer in layers.iter() {
                for i in 0..BLOCK {
                    let taken = -rest[i] * layer.weight[i];
                    let there = layer.fills[p][i].max(0.0);
                    let limit = if taken > there && input[i] >= 0.0 { there / taken } else { 1.0 };
                    part[i] = part[i].min(limit);
                }
            }
            for i in 0..BLOCK {
                let left = sum[i] + (input[i] - sum[i]) * part[i];
                scale[i] = if part[i] < 1.0 && left > input[i] { input[i] / left } else { 1.0 };
                rest[i] *= part[i];
            }
            for (layer, out) in layers.iter().zip(out.chunks_exact_mut(count + 2)) {
                for (i, out) in out[p][x..x + n].iter_mut().enumerate() {
                    let color = (layer.fills[p][i] + rest[i] * layer.weight[i]) * scale[i];
                    *out = color * layer.coverage[i];
                }
            }
        }
        for ((layer, out), filled) in layers.iter().zip(out.chunks_exact_mut(count + 2)).zip(self.filled) {
            out[count][x..x + n].copy_from_slice(&layer.coverage[..n]);
            // What is hidden lies on its layer's side of focus.
            let side = if self.split.in_front(filled.layer) { -1.0 } else { 1.0f32 };
            for (i, circle) in out[count + 1][x..x + n].iter_mut().enumerate() {
                let own = layer.seen[i] * (1.0 - edge[i]);
                let size = layer.circle[i] + (c[i].abs() - layer.circle[i]) * own;
                *circle = size.copysign(if own > 0.0 { c[i] } else { side });
            }
        }
    }

    /// Brings the fills of a block to the picture's own grid, and finds memberships.
    #[inline(always)]
    fn load(
        &self,
        y: usize,
        x: usize,
        n: usize,
        layers: &mut [LayerRows],
        [own, near, far]: [&Row; 3],
        on_edge: bool,
    ) {
        let position = |row: &Row| row.map(|c| self.split.position(c));
        let (near, far) = if on_edge { (position(near), position(far)) } else { (ZERO, ZERO) };
        for (row, filled) in layers.iter_mut().zip(self.filled) {
            for (fill, plane) in row.fills.iter_mut().zip(&filled.colors) {
                enlarge_row(plane, self.step, y, x, &mut fill[..n]);
            }
            enlarge_row(&filled.circle, self.step, y, x, &mut row.circle[..n]);
            let ramps = self.split.ramps(filled.layer);
            members(&ramps, own, &mut row.seen, &mut row.behind);
            match &filled.coverage {
                Some(plane) => {
                    enlarge_row(plane, self.step, y, x, &mut row.hidden[..n]);
                    for i in 0..BLOCK {
                        row.coverage[i] = row.seen[i] + (1.0 - row.behind[i]) * row.hidden[i];
                    }
                }
                None => {
                    row.hidden = [1.0; BLOCK];
                    row.coverage = [1.0; BLOCK];
                }
            }
            if on_edge {
                enlarge_row(&filled.squares, self.step, y, x, &mut row.variance[..n]);
                let share = 1.0 / self.leading.max(1) as f32;
                for i in 0..BLOCK {
                    let mean: f32 = row.fills[..self.leading].iter().map(|fill| fill[i]).sum::<f32>() * share;
                    row.variance[i] = (row.variance[i] - mean * mean).max(0.0) * self.leading as f32;
                }
                let [seen, behind] = &mut row.at_near;
                members(&ramps, &near, seen, behind);
                let [seen, behind] = &mut row.at_far;
                members(&ramps, &far, seen, behind);
            }
        }
    }

    /// How much of each pixel the near side of its edge covers.
    #[inline(always)]
    fn share(&self, layers: &[LayerRows], inputs: &[Row], [c, near, far]: [&Row; 3]) -> Row {
        let mut noise = ZERO;
        for layer in layers {
            for (i, noise) in noise.iter_mut().enumerate() {
                *noise += layer.variance[i] * layer.at_near[0][i].max(layer.at_far[0][i]);
            }
        }
        let (mut along, mut length, mut size) = (ZERO, ZERO, ZERO);
        for (p, input) in inputs.iter().enumerate().take(self.leading) {
            let mut sides = [ZERO; 2];
            for (l, layer) in layers.iter().enumerate() {
                for (side, at) in sides.iter_mut().zip([&layer.at_near, &layer.at_far]) {
                    for i in 0..BLOCK {
                        let coverage =
                            if l == 0 { 1.0 } else { at[0][i] + (1.0 - at[1][i]) * layer.hidden[i] };
                        side[i] += (layer.fills[p][i] - side[i]) * coverage;
                    }
                }
            }
            let [front, back] = sides;
            for i in 0..BLOCK {
                let apart = front[i] - back[i];
                along[i] += (input[i] - back[i]) * apart;
                length[i] += apart * apart;
                size[i] += front[i] * front[i] + back[i] * back[i];
            }
        }
        let mut share = ZERO;
        for i in 0..BLOCK {
            let between = ((far[i] - c[i]) - (c[i] - near[i])) / (far[i] - near[i]).max(1e-6);
            let own = smoothstep(2.0 * between + 0.5);
            let doubt = COLOR_NOISE * COLOR_NOISE * size[i] + VARIANCE * noise[i] + 1e-6;
            let found = (along[i] + doubt * own) / (length[i] + doubt);
            share[i] = found.clamp(LEAST_SHARE * own, 1.0 - LEAST_SHARE * (1.0 - own));
        }
        share
    }
}
