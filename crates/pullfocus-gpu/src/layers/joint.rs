//! From fills to layers: premultiplied colour, coverage and diameter of each.
//!
//! # Practice
//! A pass looks at all layers of a pixel at once, so their fills must lie in one buffer. Where that would be larger than a
//! device can bind, the picture goes through in bands of rows.

use super::general::{Filled, Parts};
use super::scale_parts;
use crate::planes::{Group, workgroups};
use crate::shader::{Constant, Part, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::{Error, Result, Size};

uniform! {
    /// See `band.wgsl`.
    BandParams {
        width: u32,
        height: u32,
        first_y: u32,
        end_y: u32,
        grid_width: u32,
        grid_height: u32,
        step: u32,
        first_row: u32,
        rows: u32,
        layers: u32,
        first: u32,
        group: u32,
        planes: u32,
        coverage: u32,
        leading: u32,
        unused: u32,
    }
}

/// Where [`BandParams::coverage`] says that the group has none.
const NO_COVERAGE: u32 = 4;

/// Layers that a pass writes at a time, within eight buffers.
const MOST_OUTS: usize = 3;

/// A layer, ready to be blurred.
pub struct Layer {
    /// In the picture's groups: planes, then coverage.
    pub groups: Vec<Group>,
    /// Signed diameters.
    pub circle: wgpu::Buffer,
}

/// Makes the layers, from far to near, out of their fills.
///
/// # Errors
/// [`Error::DeviceLimit`], [`Error::OutOfMemory`], a host's [`Error::Cancelled`].
pub fn make(work: &mut Work<'_, '_>, parts: &Parts<'_>, filled: Vec<Filled>) -> Result<Vec<Layer>> {
    let mut layers = Vec::new();
    for layer in 0..parts.layers {
        let mut groups = Vec::new();
        for group in parts.picture {
            let taken = Group::take(work.recorder, work.size, group.planes, work.storage)?;
            groups.push(taken.of_layer(layer));
        }
        layers.push(Layer { groups, circle: work.recorder.take_plane(work.size)? });
    }
    let rows = rows_of_a_band(work, parts)?;
    let packed = {
        let rows = (rows + 2).min(parts.grid.height);
        work.recorder.take(work.size, rows as u64 * row_bytes(parts))?
    };
    for first in (0..parts.grid.height).step_by(rows) {
        let mut band = Band::new(work, parts, &packed, first, rows);
        for (layer, filled) in filled.iter().enumerate() {
            band.pack(work, layer, filled)?;
        }
        band.share(work)?;
        band.circles(work, &layers)?;
        for group in 0..parts.picture.len() {
            band.joint(work, group, &layers)?;
        }
    }
    work.recorder.give([packed]);
    for Filled { groups, coverage } in filled {
        let groups = groups.into_iter().flat_map(|(colors, others)| [Some(colors), others]);
        work.recorder.give(groups.chain([coverage]).flatten().map(|group| group.buffer));
    }
    Ok(layers)
}

/// Bytes of one row of all layers' fills.
fn row_bytes(parts: &Parts<'_>) -> u64 {
    16 * u64::from(parts.layers) * (1 + parts.filled_groups() as u64) * parts.grid.width as u64
}

/// How many rows of the fills' grid go through at a time.
fn rows_of_a_band(work: &Work<'_, '_>, parts: &Parts<'_>) -> Result<usize> {
    let (allowed, one) = (parts.most_bytes, row_bytes(parts));
    band_rows(allowed, one, parts.grid.height).ok_or_else(|| Error::DeviceLimit {
        device: work.recorder.context.name().to_owned(),
        what: "bytes in one storage binding",
        needed: 3 * one,
        allowed,
        instead: "ask for fewer layers",
    })
}

/// The most rows of a band, which has one more row on either side, or all of them.
fn band_rows(allowed: u64, row_bytes: u64, height: usize) -> Option<usize> {
    let fit = (allowed.saturating_sub(16) / row_bytes) as usize;
    if fit >= height { Some(height) } else { fit.checked_sub(2).filter(|&rows| rows > 0) }
}

/// One band's passes.
struct Band<'a> {
    parts: &'a Parts<'a>,
    packed: &'a wgpu::Buffer,
    params: BandParams,
}

impl<'a> Band<'a> {
    fn new(
        work: &Work<'_, '_>,
        parts: &'a Parts<'a>,
        packed: &'a wgpu::Buffer,
        first: usize,
        rows: usize,
    ) -> Self {
        let Size { width, height } = work.size;
        let end = (first + rows).min(parts.grid.height);
        let (first_row, end_row) = (first.saturating_sub(1), (end + 1).min(parts.grid.height));
        let params = BandParams {
            width: width as u32,
            height: height as u32,
            first_y: (first * parts.step) as u32,
            end_y: (end * parts.step).min(height) as u32,
            grid_width: parts.grid.width as u32,
            grid_height: parts.grid.height as u32,
            step: parts.step as u32,
            first_row: first_row as u32,
            rows: (end_row - first_row) as u32,
            layers: parts.layers,
            first: 0,
            group: 0,
            planes: 0,
            coverage: NO_COVERAGE,
            leading: parts.leading(),
            unused: 0,
        };
        Self { parts, packed, params }
    }

    /// Workgroups for the band's pixels.
    fn groups(&self) -> [u32; 3] {
        workgroups(Size::new(self.params.width as usize, (self.params.end_y - self.params.first_y) as usize))
    }

    /// Brings a layer's fills beside the others'.
    fn pack(&mut self, work: &mut Work<'_, '_>, layer: usize, filled: &Filled) -> Result<()> {
        let nothing = work.recorder.memory.nothing.clone();
        for (g, (colors, others)) in filled.groups.iter().enumerate() {
            let coverage = filled.coverage.as_ref().filter(|_| g == 0);
            let spec = Spec::new(
                &[part!("layers/band"), part!("layers/pack")],
                &[
                    ("FIRST", Constant::Flag(g == 0)),
                    ("OTHERS", Constant::Flag(others.is_some())),
                    ("COVERAGE", Constant::Flag(coverage.is_some())),
                ],
            );
            let params = BandParams { first: layer as u32, group: g as u32, ..self.params };
            let buffer = |group: Option<&Group>| group.map_or(&nothing, |group| &group.buffer).clone();
            let (others, coverage) = (buffer(others.as_ref()), buffer(coverage));
            let groups = workgroups(Size::new(self.params.grid_width as usize, self.params.rows as usize));
            work.recorder.run(&spec, &params, &[&colors.buffer, &others, &coverage, self.packed], groups)?;
        }
        Ok(())
    }

    /// What every pass from fills to layers begins with.
    fn begin(&self) -> Vec<Part> {
        let [constants, scale] = scale_parts();
        vec![
            constants,
            scale,
            part!("layers/enlarge"),
            part!("layers/band"),
            part!("layers/near_far"),
            part!("layers/layered"),
        ]
    }

    fn share(&self, work: &mut Work<'_, '_>) -> Result<()> {
        let picture = &self.parts.picture[0];
        let mut parts = self.begin();
        parts.extend(picture.parts());
        parts.push(part!("layers/share"));
        let buffers = [&self.parts.split, self.parts.coc, self.packed, &picture.buffer, &self.parts.edge];
        work.recorder.run(&Spec::new(&parts, &[]), &self.params, &buffers, self.groups())?;
        work.recorder
            .worked(u64::from(self.params.width) * u64::from(self.params.end_y - self.params.first_y))
    }

    /// A pass over all layers, some at a time, with `out` as their results and `before` the buffers in front of those.
    fn over_layers<'b>(
        &self,
        work: &mut Work<'_, '_>,
        parts: &[Part],
        params: BandParams,
        before: &[&wgpu::Buffer],
        out: impl Iterator<Item = &'b wgpu::Buffer>,
    ) -> Result<()> {
        let out: Vec<&wgpu::Buffer> = out.collect();
        for (k, some) in out.chunks(MOST_OUTS).enumerate() {
            let outs = match some.len() {
                1 => part!("layers/outs_1"),
                2 => part!("layers/outs_2"),
                _ => part!("layers/outs_3"),
            };
            let mut all = self.begin();
            let (types, last) = parts.split_at(parts.len() - 1);
            all.extend(types);
            all.push(outs);
            all.extend(last);
            let spec = Spec::new(&all, &[("LAYERS", Constant::Count(self.parts.layers))]);
            let params = BandParams { first: (k * MOST_OUTS) as u32, ..params };
            let mut buffers = vec![&self.parts.split, self.parts.coc, self.packed];
            buffers.extend(before);
            buffers.extend(some);
            buffers.push(&self.parts.edge);
            work.recorder.run(&spec, &params, &buffers, self.groups())?;
            let pixels = u64::from(self.params.width) * u64::from(params.end_y - params.first_y);
            work.recorder.worked(pixels * u64::from(self.parts.layers))?;
        }
        Ok(())
    }

    fn circles(&self, work: &mut Work<'_, '_>, layers: &[Layer]) -> Result<()> {
        let out = layers.iter().map(|layer| &layer.circle);
        self.over_layers(work, &[part!("layers/circles")], self.params, &[], out)
    }

    /// The planes of one group, or the coverage where that is a group of its own.
    fn joint(&self, work: &mut Work<'_, '_>, group: usize, layers: &[Layer]) -> Result<()> {
        let out = layers.iter().map(|layer| &layer.groups[group].buffer);
        let planes = self.parts.planes_of(group);
        if planes == 0 {
            return self.over_layers(work, &[part!("layers/coverages")], self.params, &[], out);
        }
        let picture = &self.parts.picture[group];
        let coverage = self.parts.planes - 4 * group;
        let params = BandParams {
            group: group as u32,
            planes: planes as u32,
            coverage: if coverage < 4 { coverage as u32 } else { NO_COVERAGE },
            ..self.params
        };
        let [lane, px] = picture.parts();
        self.over_layers(work, &[lane, px, part!("layers/joint")], params, &[&picture.buffer], out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_with_their_borders_fit() {
        for height in [1, 2, 3, 17, 540] {
            for allowed in [0, 1000, 1600, 3216, 5000, 100_000] {
                match band_rows(allowed, 1000, height) {
                    Some(rows) => {
                        assert!((1..=height).contains(&rows), "{height} {allowed} {rows}");
                        assert!((rows + 2).min(height) as u64 * 1000 <= allowed, "{height} {allowed} {rows}");
                    }
                    None => assert!(height.min(3) as u64 * 1000 + 16 > allowed, "{height} {allowed}"),
                }
            }
        }
    }
}
