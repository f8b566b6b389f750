//! Blur by spreading the lens's aperture, in compute passes. The formulas are core's ([`pullfocus_core::spans`]), the theory
//! stands in `docs/methods/aperture.md`; this is who adds up on a GPU.
//!
//! # Practice
//! Light is added up in whole numbers of 64 bits (two words with a carry: WGSL has atomics of 32 bits alone), so that sums do not
//! depend on their order and nothing is left beyond a span. A tile of pixels adds in its workgroup's memory first (`draw`), then
//! each row of a level is summed, from coarse levels to fine ones (`sum`); the finest is the picture. How large circles are is known to
//! the device alone: passes are recorded for as many levels as there may be, and leave at once where there is nothing.

mod places;
mod table;

pub use table::Kept;

use crate::planes::{Group, workgroups};
use crate::recorder::Recorder;
use crate::shader::{Constant, Part, Spec, part, uniform};
use places::{MOST_LEVELS, Places};
use pullfocus_core::psf::MOST_DIAMETER;
use pullfocus_core::spans::{HALF, MOST_ROWS, PHASES, SIZES, STEPS};
use pullfocus_core::{Aperture, Method, Result, Settings, Size};

uniform! {
    /// See `spans.wgsl`.
    SpansParams {
        width: u32,
        height: u32,
        first: u32,
        layer: u32,
        level: u32,
        levels: u32,
        first_y: u32,
        end_y: u32,
        scale: f32,
        most: f32,
        least: f32,
        wide: f32,
        front: u32,
        unused_0: u32,
        unused_1: u32,
        unused_2: u32,
        places: [[u32; 4]; MOST_LEVELS],
    }
}

/// What is spread, and how.
#[derive(Debug, Clone, Copy)]
pub struct Spread<'a> {
    /// Signed diameters in pixels of width, f32.
    pub circle: &'a wgpu::Buffer,
    /// Weight with which a pixel is spread, f32, 0 to 1; 1 everywhere if there is none.
    pub gamma: Option<&'a wgpu::Buffer>,
    /// Pixels of height for each pixel of width.
    pub vertical_scale: f32,
    /// The aperture's shape.
    pub aperture: &'a Aperture,
    /// The buffer whose third word says how many layers there are: for groups of layers beyond that nothing is done.
    pub found: &'a wgpu::Buffer,
    /// The most bytes of one buffer: where a group's sums are more, its planes go through a few at a time.
    pub most_bytes: u64,
}

/// Pixels along each side of a workgroup's tile (`draw.wgsl`).
const TILE: usize = 16;
/// Bytes of what is known of a group (`measure.wgsl`): nine words.
const STATS_BYTES: u64 = 64;
/// Ends that a point writes for each plane, as work (a pixel of a plane read and written once is 1): 36 rows of two ends, in
/// workgroup memory.
const WORK_OF_A_POINT: u64 = 32;

/// Refuses methods that GPUs do not have, and shapes that the method has not.
///
/// # Errors
/// [`pullfocus_core::Error::Unsupported`].
pub fn check(settings: &Settings) -> Result<()> {
    settings.method.expect_on_gpu()?;
    if settings.method == Method::Aperture {
        settings.spread_aperture().expect_outline()?;
    }
    Ok(())
}

/// Planes of a group that go through at a time, and whether their weight goes with them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Share {
    first: u32,
    lanes: u32,
    weight: bool,
}

impl Share {
    fn channels(self) -> u32 {
        self.lanes + u32::from(self.weight)
    }
}

/// How a group of `planes` planes goes through where `allowed` channels fit at a time; the first group brings the weight.
fn shares(planes: u32, weight: bool, allowed: u64) -> Vec<Share> {
    let fits = |lanes: u32, weight: bool| u64::from(lanes + u32::from(weight)) <= allowed;
    let lanes = [planes, 2, 1].into_iter().find(|&lanes| lanes <= planes && fits(lanes, false)).unwrap_or(1);
    let mut shares = Vec::new();
    let together = weight && fits(lanes, true);
    if weight && !together {
        shares.push(Share { first: 0, lanes: 0, weight: true });
    }
    for first in (0..planes).step_by(lanes as usize) {
        shares.push(Share { first, lanes, weight: together && first == 0 });
    }
    shares
}

/// Spreads groups of planes, in place, over the aperture.
///
/// # Errors
/// [`pullfocus_core::Error::Unsupported`] for an aperture that is a picture; [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`]; a
/// host's [`pullfocus_core::Error::Cancelled`].
pub fn spread(recorder: &mut Recorder<'_>, size: Size, groups: &[&Group], spread: &Spread<'_>) -> Result<()> {
    if size.area() == 0 || groups.is_empty() {
        return Ok(());
    }
    let table = recorder.memory.spans(recorder.context, size, (spread.aperture, spread.vertical_scale))?;
    let most = MOST_DIAMETER * size.width.max(size.height) as f32;
    let places = Places::new(size, most * spread.vertical_scale);
    let allowed = spread.most_bytes / (8 * places.cells());
    let weights = recorder.take_plane(size)?;
    for (g, group) in groups.iter().enumerate() {
        let stats = recorder.take(size, STATS_BYTES)?;
        let params = SpansParams {
            width: size.width as u32,
            height: size.height as u32,
            first: 0,
            layer: group.layer.unwrap_or(0),
            level: 0,
            levels: places.levels() as u32,
            first_y: 0,
            end_y: size.height as u32,
            scale: spread.vertical_scale,
            most,
            least: table.least,
            wide: table.wide,
            front: table.front,
            unused_0: 0,
            unused_1: 0,
            unused_2: 0,
            places: places.all(),
        };
        let spreading = Spreading { spread, size, group, stats, weights: &weights, places: &places, params };
        spreading.measure(recorder)?;
        for share in shares(group.planes, g == 0, allowed) {
            spreading.run(recorder, share, &table.buffer)?;
        }
        recorder.give([spreading.stats]);
    }
    recorder.give([weights]);
    Ok(())
}

/// One group on its way.
struct Spreading<'a> {
    spread: &'a Spread<'a>,
    size: Size,
    group: &'a Group,
    stats: wgpu::Buffer,
    weights: &'a wgpu::Buffer,
    places: &'a Places,
    params: SpansParams,
}

impl Spreading<'_> {
    /// A kernel out of the common parts and these.
    fn spec(&self, parts: &[Part], share: Option<Share>) -> Spec {
        let [lane, px] = self.group.parts();
        let mut all = vec![part!("spreading/spans"), lane, px];
        let mut constants = vec![
            ("MOST_LEVELS", Constant::Count(MOST_LEVELS as u32)),
            ("LAYERED", Constant::Flag(self.group.layer.is_some())),
        ];
        if let Some(share) = share {
            all.extend([crate::diffusion::limits_part(), part!("spreading/stats")]);
            constants.extend([
                ("LANES", Constant::Count(share.lanes)),
                ("CHANNELS", Constant::Count(share.channels())),
                ("WEIGHT", Constant::Flag(share.weight)),
                ("HAS_GAMMA", Constant::Flag(self.spread.gamma.is_some())),
                ("HALF", Constant::Count(HALF as u32)),
                ("MOST_ROWS", Constant::Count(MOST_ROWS as u32)),
                ("PHASES", Constant::Count(PHASES as u32)),
                ("SIZES", Constant::Count(SIZES as u32)),
                ("STEPS", Constant::Count(STEPS as u32)),
            ]);
        }
        all.extend(parts);
        Spec::new(&all, &constants)
    }

    /// Finds the highest level and the range of each plane.
    fn measure(&self, recorder: &mut Recorder<'_>) -> Result<()> {
        recorder.encoder().clear_buffer(&self.stats, 0, None);
        let spec = self.spec(&[part!("spreading/measure")], None);
        let rows = Size::new(self.size.width, self.size.height.div_ceil(8));
        let buffers = [self.spread.found, self.spread.circle, &self.group.buffer, &self.stats];
        recorder.run(&spec, &self.params, &buffers, workgroups(rows))
    }

    /// Spreads some planes.
    fn run(&self, recorder: &mut Recorder<'_>, share: Share, table: &wgpu::Buffer) -> Result<()> {
        let channels = u64::from(share.channels());
        let ends = recorder.take(self.size, 8 * channels * self.places.cells())?;
        let cells = recorder.take(self.size, 4 * channels * self.places.coarse_cells())?;
        recorder.encoder().clear_buffer(&ends, 0, None);
        let nothing = recorder.memory.nothing.clone();
        let gamma = self.spread.gamma.unwrap_or(&nothing);
        let params = SpansParams { first: share.first, ..self.params };

        let draw = self.spec(&[part!("spreading/draw")], Some(share));
        let buffers =
            [self.spread.found, &self.stats, table, &self.group.buffer, self.spread.circle, gamma, &ends];
        // Not kept: a table belongs to a shape of the aperture, which may change with every frame.
        let bindings: Vec<_> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
        let row = self.size.width as u64 * channels * WORK_OF_A_POINT;
        let rows = recorder.most_in_one_piece(row).next_multiple_of(TILE);
        for first in (0..self.size.height).step_by(rows) {
            let end = (first + rows).min(self.size.height);
            let params = SpansParams { first_y: first as u32, end_y: end as u32, ..params };
            let tiles = [self.size.width.div_ceil(TILE) as u32, (end - first).div_ceil(TILE) as u32, 1];
            recorder.run_bound(&draw, &params, &bindings, tiles)?;
            recorder.worked(row * (end - first) as u64)?;
        }

        for (level, place) in self.places.all()[..self.places.levels()].iter().enumerate().rev() {
            let give = if level == 0 { part!("spreading/finest") } else { part!("spreading/coarse") };
            let parts = [part!("spreading/enlarge"), give, part!("spreading/sum")];
            let params = SpansParams { level: level as u32, ..params };
            let mut buffers = vec![self.spread.found, &self.stats, &ends, &cells];
            if level == 0 {
                buffers.extend([&self.group.buffer, self.spread.circle, gamma, self.weights]);
            }
            let spec = self.spec(&parts, Some(share));
            recorder.run(&spec, &params, &buffers, [place[2], 1, 1])?;
            recorder.worked(u64::from(place[1]) * u64::from(place[2]) * channels * 4)?;
        }
        recorder.give([ends, cells]);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::spans::ENLARGING;

    #[test]
    fn every_plane_goes_through_once_and_the_weight_comes_first() {
        for planes in [1, 4] {
            for weight in [false, true] {
                for allowed in 0..7 {
                    let shares = shares(planes, weight, allowed);
                    let mut seen = 0;
                    for share in &shares {
                        assert!(u64::from(share.channels()) <= allowed.max(1), "{shares:?}");
                        assert!(share.lanes == 0 || share.first == seen, "{shares:?}");
                        seen += share.lanes;
                    }
                    assert_eq!(seen, planes, "{shares:?}");
                    let weights = shares.iter().position(|share| share.weight);
                    assert_eq!(weights, weight.then_some(0), "{shares:?}");
                    assert_eq!(shares.iter().filter(|share| share.weight).count(), weight.into());
                }
            }
        }
        assert_eq!(shares(4, true, 5).len(), 1);
    }

    #[test]
    fn the_shaders_numbers_are_cores() {
        let text = part!("spreading/enlarge").text;
        let [own, other] = ENLARGING;
        assert!(text.contains(&format!("const ENLARGING_OWN: f32 = {own:?};")), "{text}");
        assert!(text.contains(&format!("const ENLARGING_OTHER: f32 = {other:?};")), "{text}");
        // Where `level_of` takes it apart.
        assert_eq!(MOST_ROWS as f32, 1.5 * 32.0);
    }
}
