//! A pass to embed: the caller's textures in, the caller's texture out, recorded into the caller's encoder.

use crate::bokeh;
use crate::coc::{self, Circles, Meaning, Place, Source};
use crate::context::Context;
use crate::diffusion::Tuning;
use crate::memory::{self, Memory};
use crate::pipeline::{self, Element, Near, layout};
use crate::planes::{Group, Storage};
use crate::recorder::{Recorder, Sink};
use crate::spreading;
use crate::textures;
use crate::timer::Timer;
use crate::work::Work;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::diffusion::{JacobiStop, Solver};
use pullfocus_core::{Camera, DepthDecoding, Error, Frame, Result, Settings, Size};

/// The buffers of one picture size. They are made by the first frame of that size and kept; later frames allocate
/// nothing.
///
/// A recording's uniforms stay in here until it is submitted: up to [`Buffers::MOST_PENDING`] recordings may wait for one
/// submission.
#[derive(Debug)]
pub struct Buffers {
    memory: Memory,
    size: Size,
    storage: Storage,
    tuning: Tuning,
}

impl Buffers {
    /// How many recordings may be in command buffers that are not submitted yet.
    pub const MOST_PENDING: u64 = memory::MOST_PENDING;

    /// Buffers for pictures of `size`; most of them are made by the first recording.
    ///
    /// That they are made does not say that a frame fits: highlights need one binding of 16 bytes for each pixel of whole tiles
    /// of 16 x 16 (8.39 million pixels with WebGPU's default of 128 MiB), the aperture of some 10.7 bytes (12.6 million). Whether a
    /// frame fits is what [`Context::prepare`] returns.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]; [`Error::DeviceLimit`] where a group of four planes is more than one binding may hold, and for a
    /// device that cannot blur at all ([`Context::is_usable`]).
    pub fn new(context: &Context, size: Size, storage: Storage) -> Result<Self> {
        let memory = Memory::new(context)?;
        memory::check_binding(context, size.area() as u64 * Group::pixel_bytes(4, storage))?;
        Ok(Self { memory, size, storage, tuning: Tuning::default() })
    }

    /// Goes over to pictures of another size; frees the buffers of the size before. Nothing may be waiting for its
    /// submission.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`].
    pub fn resize(&mut self, context: &Context, size: Size) -> Result<()> {
        if size != self.size {
            self.memory.clear();
            self.size = size;
        }
        memory::check_binding(context, size.area() as u64 * Group::pixel_bytes(4, self.storage))
    }

    /// How work is cut from the next recording on.
    pub fn set_tuning(&mut self, tuning: Tuning) {
        self.tuning = tuning;
    }

    /// Width and height.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Bytes of device memory held.
    pub fn bytes(&self) -> u64 {
        self.memory.bytes()
    }

    /// How many buffers were made so far: stays the same from the second frame on.
    pub fn made(&self) -> u64 {
        self.memory.made()
    }
}

/// A depth texture of the caller's, of the picture's size.
#[derive(Debug, Clone, Copy)]
pub struct Depth<'a> {
    /// A view of the first mip level of a depth format (the depth aspect alone), or of a colour format whose red channel is
    /// meant.
    pub view: &'a wgpu::TextureView,
    /// What its numbers mean; a hardware depth buffer is [`DepthDecoding::hardware`]. `None`: they are signed
    /// diameters of the circle of confusion in pixels.
    pub decoding: Option<DepthDecoding>,
}

/// A picture of the caller's: colour, linear and premultiplied, and its depth.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// The first mip level of a texture of any format that reads as floating point: 8 or 16 bits, sRGB (decoded by the hardware), f16, f32.
    pub color: &'a wgpu::TextureView,
    /// Whether its alpha means something and is blurred along.
    pub alpha: bool,
    /// Its depth.
    pub depth: Depth<'a>,
}

/// What is blurred in one frame.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The whole picture, or with a foreground what is behind it.
    pub base: Picture<'a>,
    /// Near objects on their own; their alpha says where they cover the picture.
    pub foreground: Option<Picture<'a>>,
    /// Where the result goes: the first mip level of a texture of any colour format that can be rendered to, of the
    /// picture's size; written whole.
    pub output: &'a wgpu::TextureView,
    /// The format of the view `output` where it is not its texture's own, which wgpu does not tell: of an sRGB view of a
    /// swapchain's texture, say.
    pub output_format: Option<wgpu::TextureFormat>,
}

/// One frame's settings.
#[derive(Debug, Clone, Copy)]
pub struct FrameSettings<'a> {
    /// Where the pixels lie; [`Frame::full`] for a picture that fills its view.
    pub frame: Frame,
    /// The lens and its focus; may be left out where circles of confusion are given.
    pub camera: Option<&'a Camera>,
    /// Everything else; [`Settings::preset`] gives good ones.
    pub settings: &'a Settings,
}

impl Context {
    /// Records one frame into `encoder`: nothing is submitted, nothing waited for, nothing read back. The same picture as
    /// the CPU's `Renderer`, up to rounding.
    ///
    /// The first recording of new settings compiles pipelines, the first of a new size makes buffers; [`Context::prepare`]
    /// does both ahead. A `timer` begins anew with each recording.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`], [`Error::NoCamera`], [`Error::Setting`]; [`Error::DeviceLimit`] and
    /// [`Error::OutOfMemory`] with numbers; [`Error::DeviceLost`] once the device is known to be lost;
    /// [`Error::Unsupported`] for textures that cannot be bound (formats of whole numbers, several samples, not two dimensions, a
    /// usage that is missing) and for Jacobi with a tolerance. What is wrong with `inputs` and `frame` is refused before
    /// anything is recorded.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut Buffers,
        inputs: &Inputs<'_>,
        frame: &FrameSettings<'_>,
        mut timer: Option<&mut Timer>,
    ) -> Result<()> {
        if let Some(timer) = &mut timer {
            timer.reset();
        }
        let FrameSettings { frame, camera, settings } = *frame;
        settings.check()?;
        spreading::check(settings)?;
        let size = buffers.size;
        bokeh::check(self, size, settings)?;
        if frame.data.size != size {
            return Err(mismatch("the frame's data window", frame.data.size, size));
        }
        let views =
            [("the colour texture", inputs.base.color), ("the depth texture", inputs.base.depth.view)];
        let near = inputs.foreground.iter().flat_map(|near| {
            [
                ("the foreground's colour texture", near.color),
                ("the foreground's depth texture", near.depth.view),
            ]
        });
        for (what, view) in views.into_iter().chain(near).chain([("the output texture", inputs.output)]) {
            let extent = view.texture().size();
            let found = Size::new(extent.width as usize, extent.height as usize);
            if found != size {
                return Err(mismatch(what, found, size));
            }
        }
        if size.area() == 0 {
            return Ok(());
        }
        // All that is wrong with what was given is refused before anything is recorded; that the device is too small may
        // come out on the way.
        for picture in std::iter::once(&inputs.base).chain(&inputs.foreground) {
            textures::check_color(picture.color, wgpu::TextureUsages::TEXTURE_BINDING)?;
            source(picture.depth.view)?;
            coc::curve(&frame, camera, settings, &meaning(picture))?;
        }
        textures::check_color(inputs.output, wgpu::TextureUsages::RENDER_ATTACHMENT)?;
        let output = (inputs.output, textures::format_of(inputs.output, inputs.output_format)?);
        if matches!(settings.diffusion.solver, Solver::Jacobi(JacobiStop::Tolerance(_))) {
            return Err(Error::Unsupported {
                what: "Jacobi with a tolerance in an encoder of the caller's",
                reason: "it looks at results between sweeps; give a number of sweeps",
            });
        }
        let Buffers { memory, storage, tuning, .. } = buffers;
        let mut recorder = Recorder::new(self, memory, Sink::Encoder(encoder), timer)?;
        recorder.stage("circle of confusion");
        let camera = (&frame, camera, settings);
        let place = if inputs.foreground.is_some() { Place::Behind } else { Place::Alone };
        let base = Loaded::new(&mut recorder, &inputs.base, inputs.base.alpha, camera, *storage, place)?;
        let foreground = match &inputs.foreground {
            Some(near) => Some(Loaded::new(&mut recorder, near, true, camera, *storage, Place::Front)?),
            None => None,
        };
        let range = base.range.clone();
        let mut work = Work::new(&mut recorder, &frame, settings, *storage, *tuning, range);
        work.look_for_lights(&frame, settings)?;
        let found = work.look.as_ref().map(|look| look.total.clone());
        let over = foreground.as_ref().zip(base.lens.as_ref());
        let over = over.map(|(near, behind)| Near { element: &near.element, behind, curve: &near.curve });
        pipeline::render(&mut work, &base.element, over.as_ref(), settings)?;
        recorder.give(found);
        recorder.stage("store");
        textures::store(&mut recorder, size, &base.element.groups[0], inputs.base.alpha, output)?;
        for Loaded { element, range, lens, .. } in [base].into_iter().chain(foreground) {
            let groups = element.groups.into_iter().map(|group| group.buffer);
            recorder.give(groups.chain([element.coc, range]).chain(lens));
        }
        recorder.finish()
    }

    /// Compiles the pipelines and makes the buffers of such a frame, so that recording one takes no time. Records into an
    /// encoder of its own and throws that away.
    ///
    /// # Errors
    /// As [`Context::record`].
    pub fn prepare(
        &self,
        buffers: &mut Buffers,
        inputs: &Inputs<'_>,
        frame: &FrameSettings<'_>,
    ) -> Result<()> {
        let mut encoder = self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let slot = buffers.memory.slot();
        let result = self.record(&mut encoder, buffers, inputs, frame, None);
        // Its commands never run, so its uniforms need no place.
        buffers.memory.back_to_slot(slot);
        result
    }
}

fn mismatch(what: &'static str, found: Size, expected: Size) -> Error {
    Error::SizeMismatch { what, found, expected }
}

fn meaning(picture: &Picture<'_>) -> Meaning {
    picture.depth.decoding.map_or(Meaning::Coc, Meaning::Depth)
}

/// How a depth texture is read.
fn source(view: &wgpu::TextureView) -> Result<Source<'_>> {
    textures::check_picture(view, wgpu::TextureUsages::TEXTURE_BINDING)?;
    let format = view.texture().format();
    if format.has_depth_aspect() {
        Ok(Source::DepthTexture(view))
    } else if textures::reads_as_floats(format) {
        Ok(Source::Texture(view))
    } else {
        Err(Error::Unsupported {
            what: "a depth texture of this format",
            reason: "it must be a depth format, or be read as floating point",
        })
    }
}

/// A picture on the device, with its circles of confusion ([`Circles`]).
struct Loaded {
    element: Element,
    curve: CocCurve,
    range: wgpu::Buffer,
    lens: Option<wgpu::Buffer>,
}

impl Loaded {
    fn new(
        recorder: &mut Recorder<'_>,
        picture: &Picture<'_>,
        alpha: bool,
        camera: (&Frame, Option<&Camera>, &Settings),
        storage: Storage,
        place: Place,
    ) -> Result<Self> {
        let size = camera.0.data.size;
        let planes = if alpha { 4 } else { 3 };
        let mut groups = vec![textures::load(recorder, size, picture.color, alpha, storage)?];
        for &count in &layout(planes)[1..] {
            groups.push(Group::take(recorder, size, count, storage)?);
        }
        let (meaning, source) = (meaning(picture), source(picture.depth.view)?);
        let circles = match (meaning, camera.2.repair_depth) {
            (Meaning::Depth(decoding), true) => {
                let plane = coc::read_depth(recorder, size, source)?;
                let mended = coc::repair(recorder, size, &plane, &decoding)?;
                let circles = coc::circles(recorder, camera, &meaning, Source::Plane(&mended), place)?;
                recorder.give([plane, mended]);
                circles
            }
            _ => coc::circles(recorder, camera, &meaning, source, place)?,
        };
        let Circles { curve, coc, range, lens } = circles;
        Ok(Self { element: Element { groups, colors: 3, planes, coc }, curve, range, lens })
    }
}
