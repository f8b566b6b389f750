//! What an engine does to have depth of field: all of it is in this file.

use crate::camera::{NEAR, Shot};
use crate::draw::Targets;
use anyhow::Result;
use pullfocus_core::{Aperture, ApertureShape, Bokeh, DepthDecoding, Frame, Preset, Settings, Size};
use pullfocus_gpu::{Buffers, Context, Depth, FrameSettings, Inputs, Picture, Storage};

/// How many [`looks`] there are; the last is the quickest.
pub const LOOKS: usize = 3;

/// Settings to choose from, and what to call them. A game takes one.
pub fn looks() -> [(&'static str, Settings); LOOKS] {
    let preview = Settings::preset(Preset::Preview);
    let aperture = Settings::preset(Preset::Final);
    let highlights = Settings {
        // Above anything that the sun lights: what is left are lamps and glints, and few pixels.
        bokeh: Some(Bokeh { threshold: 8.0, ..Bokeh::default() }),
        aperture: Aperture { shape: ApertureShape::Blades(7), roundness: 0.4, ..Aperture::default() },
        ..aperture.clone()
    };
    [("aperture and highlights", highlights), ("aperture", aperture), ("diffusion", preview)]
}

/// The pass, with all that it keeps from frame to frame.
pub struct DepthOfField {
    context: Context,
    buffers: Buffers,
    looks: [(&'static str, Settings); LOOKS],
}

impl DepthOfField {
    /// Once, on the engine's own device; buffers are for one size. Halves are enough for colour, and half the traffic.
    ///
    /// # Errors
    /// A picture that is too large for one of the device's bindings, which the message says with numbers.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: Size) -> Result<Self> {
        let context = Context::new(device, queue);
        // With this, recording on a device that was lost is an error rather than silence.
        let lost = context.when_lost();
        device.set_device_lost_callback(move |_, reason| lost(reason));
        let buffers = Buffers::new(&context, size, Storage::Half)?;
        Ok(Self { context, buffers, looks: looks() })
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
    /// A lost device; settings that cannot be.
    pub fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        targets: &Targets,
        shot: &Shot,
        foreground: bool,
    ) -> Result<()> {
        // What the numbers in the depth texture mean: `depth = 0 + NEAR / distance`, reversed with an infinite far plane.
        let decoding = Some(DepthDecoding::hardware(0.0, f64::from(NEAR)));
        // The picture: linear light, before tone mapping, so that a bright bulb is as bright when it is spread over many pixels.
        let base = Picture {
            color: &targets.base.color.view,
            alpha: false,
            depth: Depth { view: &targets.base.depth.view, decoding },
        };
        // Near objects, if they were drawn on their own: premultiplied colour, and alpha that says where they are. What they
        // hide is in the base, so that their soft edges show what is really there.
        let near = Picture {
            color: &targets.near.color.view,
            alpha: true,
            depth: Depth { view: &targets.near.depth.view, decoding },
        };
        let output = &targets.output.view;
        let inputs = Inputs { base, foreground: foreground.then_some(near), output };
        // The lens must be the one that the picture was projected with; focus and f-stop may change every frame.
        let camera = shot.camera()?;
        let frame = FrameSettings {
            frame: Frame::full(self.buffers.size()),
            camera: Some(&camera),
            settings: &self.looks[shot.look].1,
        };
        Ok(self.context.record(encoder, &mut self.buffers, &inputs, &frame, None)?)
    }
}

/// Which objects go into the foreground's textures: those that lie, whole, so far before focus that they are blurred by more than
/// a two-hundredth of the picture's width. `back` is the distance of an object's farthest point. The rest stays in the base, where
/// layers are found by depth alone.
///
/// # Errors
/// A focus distance within the focal length.
pub fn is_foreground(shot: &Shot, size: Size) -> Result<impl Fn(f32) -> bool> {
    let circle = shot.camera()?.circle_of_confusion(&Frame::full(size));
    let least = 0.005 * size.width as f64;
    // Diameters are negative in front of focus.
    Ok(move |back: f32| back > 0.0 && circle.diameter(f64::from(back)) < -least)
}
