//! What an engine does to have depth of field: all of it is in this file.

use crate::camera::NEAR;
use crate::draw::{Layer, Targets};
use anyhow::Result;
use pullfocus_core::{Aperture, ApertureShape, Bokeh, Camera, DepthDecoding, Frame, Preset, Settings, Size};
use pullfocus_gpu::{Buffers, Context, Depth, FrameSettings, Inputs, Picture, Storage};

/// Methods to choose from; the last is the quickest. A game takes one.
pub const LOOKS: [&str; 3] = ["aperture and highlights", "aperture", "diffusion"];

fn settings(look: usize) -> Settings {
    match LOOKS[look] {
        "diffusion" => Settings::preset(Preset::Preview),
        "aperture" => Settings::preset(Preset::Final),
        _ => Settings {
            // Above anything that the sun lights: what is left are lamps and glints, and few pixels.
            bokeh: Some(Bokeh { threshold: 8.0, ..Bokeh::default() }),
            aperture: Aperture { shape: ApertureShape::Blades(7), roundness: 0.4, ..Aperture::default() },
            ..Settings::preset(Preset::Final)
        },
    }
}

/// The pass, with all that it keeps from frame to frame.
pub struct DepthOfField {
    context: Context,
    buffers: Buffers,
}

impl DepthOfField {
    /// Once, on the engine's own device; buffers are for one size. Halves are enough for colour, and half the traffic.
    ///
    /// # Errors
    /// A picture whose colours are too large for one of the device's bindings, which the message says with numbers. A look may need
    /// more: whether it fits is what [`Context::prepare`] returns.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: Size) -> Result<Self> {
        let context = Context::new(device, queue);
        // With this, recording on a device that was lost is an error rather than silence.
        let lost = context.when_lost();
        device.set_device_lost_callback(move |_, reason| lost(reason));
        let buffers = Buffers::new(&context, size, Storage::Half)?;
        Ok(Self { context, buffers })
    }

    /// When the picture gets another size, after the last frame of the old one was submitted.
    ///
    /// # Errors
    /// As [`DepthOfField::new`].
    pub fn resize(&mut self, size: Size) -> Result<()> {
        Ok(self.buffers.resize(&self.context, size)?)
    }

    /// Each frame, into the engine's encoder, between drawing and tone mapping: reads `targets`' colour and depth and writes
    /// `targets.output`. Nothing is submitted and nothing waits. The first frame of a look compiles its pipelines; call
    /// [`Context::prepare`] while a level loads to have that over.
    ///
    /// # Errors
    /// A lost device; a picture that is too large for the look.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        // The lens must be the one that the picture was projected with; focus and f-stop may change every frame.
        (camera, look): (&Camera, usize),
        foreground: bool,
    ) -> Result<()> {
        let inputs = Inputs {
            base: picture(&targets.base, false),
            // Near objects, if they were drawn on their own: premultiplied colour, and alpha that says where they are. What
            // they hide is in the base, so that their soft edges show what is really there.
            foreground: foreground.then(|| picture(&targets.near, true)),
            output: &targets.output,
            output_format: None,
        };
        let settings = &settings(look);
        let frame = FrameSettings { frame: Frame::full(self.buffers.size()), camera: Some(camera), settings };
        Ok(self.context.record(encoder, &mut self.buffers, &inputs, &frame, None)?)
    }
}

/// A layer as the pass takes it: linear light, before tone mapping, so that a bright bulb is as bright when it is spread over many
/// pixels, and what the numbers in its depth texture mean: `0 + NEAR / distance`, reversed with an infinite far plane.
fn picture(layer: &Layer, alpha: bool) -> Picture<'_> {
    let decoding = Some(DepthDecoding::hardware(0.0, f64::from(NEAR)));
    Picture { color: &layer.color, alpha, depth: Depth { view: &layer.depth, decoding } }
}

/// Whether an object goes into the foreground's textures: if it lies, whole, so far before focus that it is blurred by more than
/// a two-hundredth of the picture's width. `back` is the distance of its farthest point. The rest stays in the base, where layers
/// are found by depth alone.
pub fn is_foreground(camera: &Camera, size: Size, back: f32) -> bool {
    // Diameters are negative in front of focus.
    let diameter = camera.circle_of_confusion(&Frame::full(size)).diameter(f64::from(back));
    back > 0.0 && diameter < -0.005 * size.width as f64
}
