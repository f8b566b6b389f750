//! Bokeh highlights: bright light out of focus leaves the picture, and comes back as sprites in the aperture's shape. The
//! CPU's `bokeh` has the theory, core's the formulas.
//!
//! # Practice
//! Highlights are kept by tiles of 16 x 16 pixels, in the order of their pixels, so nothing depends on which thread was first.
//! A tile of the result visits the tiles that reach it. Nothing is blended by the render pipeline: sums are f32 in registers,
//! whatever the planes' own format, and a pixel can ask what hides the light (`seen`). How many there are is known to
//! the device alone, so a caller's encoder gets one pass for all of them; a host looks, and cuts the work.

mod shape;
mod sprites;

pub use shape::{Shape, ShapeOf};

use crate::context::Context;
use crate::layers::cover_part;
use crate::planes::Group;
use crate::recorder::Recorder;
use crate::shader::{Constant, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::bokeh::Field;
use pullfocus_core::layers::general::LEADING;
use pullfocus_core::psf::MOST_DIAMETER;
use pullfocus_core::split::unit;
use pullfocus_core::{Aperture, Bokeh, Error, Frame, Result, Settings, Size};

/// Pixels along a tile's side.
const SIDE: usize = 16;
/// Places of pixels have 16 bits across and 16 down.
const LONGEST_SIDE: usize = 1 << 16;
/// Bytes of a highlight.
const LIGHT_BYTES: u64 = 16;
/// Numbers that f32 and shaders can reckon with.
const LARGE: f64 = 1e15;

uniform! {
    /// See `find.wgsl`.
    FindParams {
        width: u32,
        height: u32,
        tiles: u32,
        leading: u32,
        threshold: f32,
        low: f32,
        high: f32,
        bend: f32,
        least: f32,
        gain: f32,
        largest: f32,
        unit_x: f32,
        unit_y: f32,
        reach: f32,
        point: f32,
        area: f32,
        sides: u32,
        columns: u32,
        rows: u32,
        longer_side: f32,
        cats_eye: f32,
        axis_x: f32,
        axis_y: f32,
        field_x: f32,
        field_y: f32,
    }
}

uniform! {
    /// See `take.wgsl`.
    TakeParams { width: u32, tiles: u32, planes: u32 }
}

uniform! {
    /// See `through.wgsl`.
    ShareParams { width: u32, tiles: u32, coverage: u32, layer: u32, first: u32 }
}

uniform! {
    /// See `rows.wgsl`.
    RowsParams { across: u32, down: u32 }
}

/// What sprites look like in a frame, and where they are counted.
#[derive(Debug, Clone)]
pub struct Look {
    bokeh: Bokeh,
    shape: Shape,
    /// The optical axis, and one over the way to a corner, across and down.
    axis: [f32; 2],
    field: [f32; 2],
    display_width: f32,
    /// How many highlights were found; one word.
    pub total: wgpu::Buffer,
}

impl Look {
    /// The look of a frame's highlights, if the settings ask for any.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLimit`] for an aperture's picture that is too large, [`pullfocus_core::Error::OutOfMemory`].
    pub fn new(recorder: &mut Recorder<'_>, frame: &Frame, settings: &Settings) -> Result<Option<Self>> {
        let Some(bokeh) = settings.bokeh else { return Ok(None) };
        let aperture: &Aperture = &settings.aperture;
        let shape = Shape::of(recorder, aperture, frame.vertical_scale(), bokeh.cats_eye > 0.0)?;
        let field = Field::new(frame);
        let near = |value: f64| if value.is_finite() { value.clamp(-LARGE, LARGE) as f32 } else { 0.0 };
        let total = recorder.take(Size::new(1, 1), 4)?;
        recorder.encoder().clear_buffer(&total, 0, None);
        Ok(Some(Self {
            bokeh,
            shape,
            axis: field.axis.map(near),
            field: [1.0, field.vertical_scale].map(|scale| near(1.0 / (scale * field.half_diagonal))),
            display_width: frame.display_width() as f32,
            total,
        }))
    }
}

/// Where sprites are seen.
#[derive(Debug, Clone, Copy)]
pub enum Shown<'a> {
    /// Everywhere.
    All,
    /// In this layer, counted from the farthest, everywhere; they go into the layer's own groups before it is laid over others.
    InLayer(u32),
    /// In the only layer, whose circles these are: where nothing nearer and sharper is.
    ByCircle(&'a wgpu::Buffer),
}

/// The light that was taken out of a picture.
#[derive(Debug)]
pub struct Lights {
    look: Look,
    size: Size,
    /// Highlights by tiles.
    lights: wgpu::Buffer,
    /// Of each tile, then of each row of tiles, how many and how large.
    tiles: wgpu::Buffer,
    /// Where sprites end that a cat's eye cuts.
    extents: Option<wgpu::Buffer>,
    /// Their light, group by group.
    taken: Vec<Group>,
    /// Of each layer how much of each light belongs to it.
    shares: Vec<wgpu::Buffer>,
    /// What nearer layers leave of each light.
    clear: Option<wgpu::Buffer>,
}

/// Refuses pictures whose highlights would have no place: it is kept as two halves of a word (`find.wgsl`).
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn check(context: &Context, size: Size, settings: &Settings) -> Result<()> {
    let side = size.width.max(size.height);
    if settings.bokeh.is_none() || side <= LONGEST_SIDE {
        return Ok(());
    }
    Err(Error::DeviceLimit {
        device: context.name().to_owned(),
        what: "pixels along a side of a picture with highlights",
        needed: side as u64,
        allowed: LONGEST_SIDE as u64,
        instead: "render without highlights or on the processor",
    })
}

/// How many tiles cover a picture.
fn tiles(size: Size) -> [usize; 2] {
    [size.width.div_ceil(SIDE), size.height.div_ceil(SIDE)]
}

/// A workgroup for each.
fn each_tile(size: Size) -> [u32; 3] {
    let [across, down] = tiles(size);
    [across as u32, down as u32, 1]
}

/// Tile by tile, with room for a whole one at the edges.
fn by_tiles(size: Size) -> Size {
    let [across, down] = tiles(size);
    Size::new(across * SIDE, down * SIDE)
}

/// Which planes of the group `group` are light, where there are `colors` of them.
fn colors_of(group: usize, colors: usize) -> usize {
    colors.saturating_sub(4 * group).min(4)
}

impl Work<'_, '_> {
    /// Takes highlights out of the first `colors` planes of `groups`, if that was asked for. `circles` has their circles of confusion,
    /// `signs` the sides of focus. They are to be given back ([`Lights::give_back`]).
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`], a host's
    /// [`pullfocus_core::Error::Cancelled`].
    pub fn take_lights(
        &mut self,
        groups: &[&Group],
        colors: usize,
        [circles, signs]: [&wgpu::Buffer; 2],
    ) -> Result<Option<Lights>> {
        let Some(look) = self.look.clone() else { return Ok(None) };
        let Some(&first) = groups.first() else { return Ok(None) };
        self.recorder.stage("highlights");
        let (size, room) = (self.size, by_tiles(self.size));
        let places = room.area() as u64;
        let [across, down] = tiles(size);
        let cut = look.bokeh.cats_eye > 0.0;
        let mut lights = Lights {
            lights: self.recorder.take(size, places * LIGHT_BYTES)?,
            tiles: self.recorder.take(size, 8 * (across * down + down) as u64)?,
            extents: if cut { Some(self.recorder.take(size, places * 16)?) } else { None },
            taken: Vec::new(),
            shares: Vec::new(),
            clear: None,
            size,
            look,
        };
        lights.find(self, first, colors, [circles, signs])?;
        for (i, &group) in groups.iter().enumerate() {
            let planes = colors_of(i, colors);
            if planes == 0 {
                break;
            }
            let taken = Group::take(self.recorder, room, group.planes, group.storage)?;
            let params = TakeParams { width: size.width as u32, tiles: across as u32, planes: planes as u32 };
            let [lane, px] = group.parts();
            let spec = Spec::new(&[lane, px, part!("bokeh/tile"), part!("bokeh/take")], &[]);
            let buffers = [&lights.lights, &lights.tiles, &group.buffer, &taken.buffer];
            self.recorder.run(&spec, &params, &buffers, each_tile(size))?;
            lights.taken.push(taken);
        }
        self.recorder.worked(2 * places)?;
        Ok(Some(lights))
    }
}

impl Lights {
    fn find(
        &self,
        work: &mut Work<'_, '_>,
        picture: &Group,
        colors: usize,
        [circles, signs]: [&wgpu::Buffer; 2],
    ) -> Result<()> {
        let Self { look, size, .. } = self;
        let Look { bokeh, shape, .. } = look;
        let curve = bokeh.curve(look.display_width);
        let params = FindParams {
            width: size.width as u32,
            height: size.height as u32,
            tiles: tiles(*size)[0] as u32,
            leading: colors.min(LEADING) as u32,
            threshold: curve.threshold,
            low: curve.low,
            high: curve.high,
            // Without a knee nothing lies within it.
            bend: if curve.bend.is_finite() { curve.bend } else { 0.0 },
            least: curve.least,
            gain: bokeh.gain as f32,
            largest: MOST_DIAMETER * size.width.max(size.height) as f32,
            unit_x: shape.unit[0],
            unit_y: shape.unit[1],
            reach: shape.reach,
            point: shape.point,
            area: shape.area,
            sides: shape.sides,
            columns: shape.corners[0],
            rows: shape.corners[1],
            longer_side: shape.longer_side,
            cats_eye: look.displacement(),
            axis_x: look.axis[0],
            axis_y: look.axis[1],
            field_x: look.field[0],
            field_y: look.field[1],
        };
        let [lane, px] = picture.parts();
        let parts = [lane, px, part!("bokeh/tile"), part!("bokeh/cats_eye"), shape.part, part!("bokeh/find")];
        let spec = Spec::new(&parts, &[("CUT", Constant::Flag(self.extents.is_some()))]);
        // What is not written must still be bound, and nothing twice.
        let nothing = work.recorder.take(Size::new(1, 1), 16)?;
        let extents = self.extents.as_ref().unwrap_or(&nothing);
        let buffers =
            [&picture.buffer, circles, signs, &shape.buffer, &self.lights, &self.tiles, extents, &look.total];
        work.recorder.run(&spec, &params, &buffers, each_tile(*size))?;
        work.recorder.worked(12 * size.area() as u64)?;
        work.recorder.give([nothing]);
        Ok(())
    }

    /// Finds how much of each light belongs to each of `layers`, from far to near and not blurred yet; their groups hold the
    /// coverage as plane `coverage`.
    ///
    /// # Errors
    /// As [`Work::take_lights`].
    pub fn share_out(&mut self, work: &mut Work<'_, '_>, layers: &[&[Group]], coverage: usize) -> Result<()> {
        work.recorder.stage("highlights");
        let bytes = by_tiles(self.size).area() as u64 * 4;
        let clear = work.recorder.take(self.size, bytes)?;
        for _ in layers {
            self.shares.push(work.recorder.take(self.size, bytes)?);
        }
        for (layer, groups) in layers.iter().enumerate().rev() {
            let covering = &groups[coverage / 4];
            let params = self.share_params(layer, layers.len(), coverage);
            let parts =
                [part!("bokeh/tile"), cover_part(covering), part!("bokeh/through"), part!("bokeh/share")];
            let buffers =
                [&self.lights, &self.tiles, &covering.buffer, &work.range, &clear, &self.shares[layer]];
            work.recorder.run(&Spec::new(&parts, &[]), &params, &buffers, each_tile(self.size))?;
        }
        self.clear = Some(clear);
        work.recorder.worked(self.size.area() as u64)
    }

    fn share_params(&self, layer: usize, layers: usize, coverage: usize) -> ShareParams {
        ShareParams {
            width: self.size.width as u32,
            tiles: tiles(self.size)[0] as u32,
            coverage: (coverage % 4) as u32,
            layer: layer as u32,
            first: (layer + 1 == layers).into(),
        }
    }

    /// Adds to each of `layers` that is shown, blurred by now, its share of the lights.
    ///
    /// # Errors
    /// As [`Work::take_lights`].
    pub fn add_to_layers(
        &self,
        work: &mut Work<'_, '_>,
        layers: &[Vec<Group>],
        coverage: usize,
    ) -> Result<()> {
        let alone = work.show.alone();
        let farthest = alone.map_or(0, |number| number as usize);
        // From near to far: each takes something of what is left for the next.
        for (layer, groups) in layers.iter().enumerate().skip(farthest).rev() {
            let params = self.share_params(layer, layers.len(), coverage);
            self.weigh(work, &params, Some(&groups[coverage / 4]))?;
            if alone.is_some_and(|number| number != layer as u32) {
                continue;
            }
            let groups: Vec<&Group> = groups.iter().collect();
            self.sprites(work, &groups, Shown::InLayer(layer as u32), coverage)?;
        }
        Ok(())
    }

    /// Adds the sprites to a picture's groups.
    ///
    /// # Errors
    /// As [`Work::take_lights`].
    pub fn add(&self, work: &mut Work<'_, '_>, groups: &[&Group], shown: Shown<'_>) -> Result<()> {
        self.weigh(work, &self.share_params(0, 1, 0), None)?;
        self.sprites(work, groups, shown, 0)
    }

    /// Finds what each light is multiplied with, in a layer where its coverage is given.
    fn weigh(&self, work: &mut Work<'_, '_>, params: &ShareParams, covering: Option<&Group>) -> Result<()> {
        work.recorder.stage("highlights");
        let nothing = work.recorder.memory.nothing.clone();
        let spare = work.recorder.take(Size::new(1, 1), 16)?;
        let mut parts = vec![part!("bokeh/tile"), covering.map_or(part!("layers/cover_1"), cover_part)];
        parts.extend([part!("bokeh/through"), part!("bokeh/weigh")]);
        let spec = Spec::new(&parts, &[("LAYERED", Constant::Flag(covering.is_some()))]);
        let buffers = [
            &self.lights,
            &self.tiles,
            covering.map_or(&nothing, |group| &group.buffer),
            &work.range,
            self.clear.as_ref().unwrap_or(&spare),
            self.shares.get(params.layer as usize).unwrap_or(&nothing),
        ];
        work.recorder.run(&spec, params, &buffers, each_tile(self.size))?;
        work.recorder.give([spare]);
        let [across, down] = tiles(self.size).map(|count| count as u32);
        let rows = Spec::new(&[part!("bokeh/rows")], &[]);
        work.recorder.run(&rows, &RowsParams { across, down }, &[&self.tiles], [down, 1, 1])?;
        work.recorder.worked(self.size.area() as u64)
    }

    /// Gives the memory back.
    pub fn give_back(self, recorder: &mut Recorder<'_>) {
        let taken = self.taken.into_iter().map(|group| group.buffer);
        let small = [self.lights, self.tiles].into_iter().chain(self.extents).chain(self.clear);
        recorder.give(taken.chain(small).chain(self.shares));
    }
}

impl Look {
    /// How far a cat's eye moves the second disc in the corners, in diameters.
    fn displacement(&self) -> f32 {
        self.bokeh.cats_eye as f32 * self.shape.reach
    }

    /// Pixels that look as one does at a width of 960.
    fn display_unit(&self) -> f32 {
        unit(self.display_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::bokeh::{LEAST_CLEAR, NODES};

    #[test]
    fn highlights_whose_places_do_not_fit_are_refused() {
        let (device, queue) = wgpu::Device::noop(&wgpu::DeviceDescriptor::default());
        let context = Context::new(&device, &queue);
        let lit = Settings { bokeh: Some(Bokeh::default()), ..Settings::default() };
        let refused = |size, settings: &Settings| check(&context, size, settings).err();
        assert_eq!(refused(Size::new(65536, 1), &lit), None);
        assert_eq!(refused(Size::new(1, 65536), &lit), None);
        for size in [Size::new(65537, 1), Size::new(1, 65537)] {
            let error = refused(size, &lit);
            assert!(
                matches!(error, Some(Error::DeviceLimit { needed: 65537, allowed: 65536, .. })),
                "{error:?}"
            );
            assert_eq!(refused(size, &Settings::default()), None);
        }
    }

    #[test]
    fn the_shaders_numbers_are_cores() {
        for (part, line) in [
            (part!("bokeh/weigh"), format!("const LEAST_CLEAR: f32 = {LEAST_CLEAR:?};")),
            (part!("bokeh/sprites"), format!("const LAST_NODE: f32 = {:?};", (NODES - 1) as f32)),
            (part!("bokeh/tile"), format!("const SIDE: u32 = {SIDE}u;")),
        ] {
            assert!(part.text.contains(&line), "{line}");
        }
    }
}
