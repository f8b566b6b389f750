//! Rendering on the window's own device: colour and depth go there once, the result never leaves it.

use super::Take;
use super::worker::Made;
use crate::clip::Plate;
use crate::screen::{self, Texture};
use eframe::wgpu;
use pullfocus_core::{Distance, Element, Error, Report, Result, Size, Storage};
use pullfocus_gpu::{Buffers, Context, Depth, FrameSettings, Inputs, Picture, Timer};
use std::sync::Arc;

/// Textures of an element.
struct Resident {
    color: Texture,
    alpha: bool,
    depth: Texture,
    decoding: Option<pullfocus_core::DepthDecoding>,
}

impl Resident {
    /// In the textures of `old` where these fit.
    fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        element: &Element,
        old: Option<Self>,
    ) -> Result<Self> {
        let (color, depth) = old.map_or((None, None), |old| (Some(old.color), Some(old.depth)));
        Ok(Self {
            color: screen::full_precision(device, queue, &element.picture, color)?,
            alpha: element.picture.alpha.is_some(),
            depth: screen::distances(device, queue, element.distance.plane(), depth)?,
            decoding: match &element.distance {
                Distance::Depth { decoding, .. } => Some(*decoding),
                Distance::Coc(_) => None,
            },
        })
    }

    fn picture(&self) -> Picture<'_> {
        let depth = Depth { view: &self.depth.view, decoding: self.decoding };
        Picture { color: &self.color.view, alpha: self.alpha, depth }
    }
}

pub struct GpuBlur {
    context: Context,
    buffers: Option<Buffers>,
    timer: Option<Timer>,
    resident: Option<(Arc<Plate>, Resident, Option<Resident>)>,
    outputs: Vec<Texture>,
}

impl GpuBlur {
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let context = Context::new(device, queue);
        let timer = Timer::new(&context);
        Self { context, buffers: None, timer, resident: None, outputs: Vec::new() }
    }

    pub fn render(&mut self, plate: &Arc<Plate>, take: &Take) -> Result<Made> {
        take.settings.method.expect_on_gpu()?;
        let size = plate.size();
        self.load(plate)?;
        let output = self.output(size)?;
        let buffers = match &mut self.buffers {
            Some(buffers) => {
                buffers.resize(&self.context, size)?;
                buffers
            }
            none => none.insert(Buffers::new(&self.context, size, Storage::Full)?),
        };
        let Some((_, base, near)) = &self.resident else { return Err(Error::Cancelled) };
        let inputs = Inputs {
            base: base.picture(),
            foreground: near.as_ref().map(Resident::picture),
            output: &output.view,
            output_format: None,
        };
        let frame = FrameSettings {
            frame: plate.scene.frame,
            camera: take.camera.as_ref(),
            settings: &take.settings,
        };
        let device = self.context.device();
        let mut encoder = device.create_command_encoder(&Default::default());
        self.context.record(&mut encoder, buffers, &inputs, &frame, self.timer.as_mut())?;
        let index = self.context.queue().submit([encoder.finish()]);
        let wait = wgpu::PollType::Wait { submission_index: Some(index), timeout: None };
        device.poll(wait).map_err(|error| Error::DeviceLost {
            device: self.context.name().to_owned(),
            reason: error.to_string(),
        })?;
        let mut report = Report::default();
        if let Some(timer) = &self.timer {
            for (name, time) in timer.read(&self.context)?.stages {
                report.add(name, time);
            }
        }
        Ok(Made { texture: output, reduced: 1, report })
    }

    /// Brings a plate to the device, in the place of the one before.
    fn load(&mut self, plate: &Arc<Plate>) -> Result<()> {
        if self.resident.as_ref().is_some_and(|(known, ..)| Arc::ptr_eq(known, plate)) {
            return Ok(());
        }
        let (old_base, old_near) =
            self.resident.take().map_or((None, None), |(_, base, near)| (Some(base), near));
        let device = (self.context.device(), self.context.queue());
        let base = Resident::new(device, &plate.scene.base, old_base)?;
        let near = plate.scene.foreground.as_ref();
        let near = near.map(|near| Resident::new(device, near, old_near)).transpose()?;
        self.resident = Some((Arc::clone(plate), base, near));
        Ok(())
    }

    /// A texture that is not on the screen.
    fn output(&mut self, size: Size) -> Result<Texture> {
        self.outputs.retain(|texture| texture.size == size || !texture.is_free());
        if let Some(free) = self.outputs.iter().find(|texture| texture.size == size && texture.is_free()) {
            return Ok(free.clone());
        }
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let texture = Texture::new(self.context.device(), size, wgpu::TextureFormat::Rgba16Float, usage)?;
        self.outputs.push(texture.clone());
        Ok(texture)
    }
}
