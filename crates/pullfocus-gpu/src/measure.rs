//! How long things take on a device, by its own clock where it has one: for benchmarks.

use crate::diffusion::{self, Conductivity, How, Medium};
use crate::embed::{Buffers, Depth, FrameSettings, Inputs, Picture};
use crate::host::Host;
use crate::planes::{Storage, groups};
use crate::recorder::{Recorder, Sink, wait};
use crate::shader::{Spec, part, uniform};
use crate::timer::{Timer, Times};
use crate::transfer::{upload, upload_plane};
use pullfocus_core::scheme::{Scheme, Shape};
use pullfocus_core::{
    Camera, Cancel, DepthDecoding, Diffusion, Distance, Element, Error, Plane, Result, Scene, Settings, Size,
};
use std::time::{Duration, Instant};

uniform! {
    /// See `copy.wgsl`.
    CopyParams { count: u32, stride: u32 }
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// The time of each round.
    pub rounds: Vec<Duration>,
    /// Stages of the last round, where the device has a clock.
    pub stages: Vec<(&'static str, Duration)>,
    /// Bytes that must be read and written in one round, at least.
    pub bytes: u64,
    /// Whether the device's own clock told; else the host's, around submission and waiting.
    pub by_device: bool,
}

impl Timing {
    /// The median round.
    pub fn median(&self) -> Duration {
        let mut rounds = self.rounds.clone();
        rounds.sort();
        rounds.get(rounds.len() / 2).copied().unwrap_or_default()
    }
}

/// Rounds of something that is recorded, submitted and waited for.
fn rounds(
    host: &mut Host,
    count: usize,
    bytes: u64,
    one_submission: bool,
    mut round: impl FnMut(&mut Host, Option<&mut Timer>) -> Result<()>,
) -> Result<Timing> {
    let mut timer = Timer::new(host.context());
    let mut timing = Timing { rounds: Vec::new(), stages: Vec::new(), bytes, by_device: timer.is_some() };
    // The first round makes pipelines and buffers.
    for i in 0..=count.max(1) {
        if let Some(timer) = &mut timer {
            timer.reset();
        }
        let start = Instant::now();
        round(host, timer.as_mut())?;
        wait(host.context())?;
        let by_host = start.elapsed();
        let times = match &timer {
            Some(timer) => timer.read(host.context())?,
            None => Times::default(),
        };
        if i > 0 {
            timing.by_device &= times.whole;
            // One submission has one span; between several the host was asked whether to go on.
            let by_device =
                if one_submission { times.span } else { times.stages.iter().map(|(_, time)| *time).sum() };
            timing.rounds.push(if times.whole { by_device } else { by_host });
            timing.stages = times.stages;
        }
    }
    Ok(timing)
}

impl Host {
    /// Times one diffusion of `planes` through `circle` (diameters in pixels), on the device, again and again in place.
    /// Returns the planes as the first round left them, too.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn time_diffusion(
        &mut self,
        planes: &[Plane],
        circle: &Plane,
        settings: &Diffusion,
        count: usize,
        cancel: &Cancel,
    ) -> Result<(Timing, Vec<Plane>)> {
        settings.check()?;
        let size = circle.size();
        let mut first = planes.to_vec();
        self.diffuse(&mut first, (circle, None, 1.0), settings, cancel)?;
        let (storage, tuning) = (self.storage(), self.tuning());
        let resident = self.recorded(cancel, None, |recorder| {
            let sources: Vec<&Plane> = planes.iter().collect();
            let groups = upload(recorder, size, &sources, &groups(sources.len()), storage, false)?;
            Ok((groups, upload_plane(recorder, circle)?))
        })?;
        let scheme = Scheme::new(settings)?;
        let pixel: u64 = resident.0.iter().map(|group| group.buffer.size()).sum();
        let circles = resident.1.size() * resident.0.len() as u64;
        // Rows and columns each read and write all of it, and read the circles; a round response has four fields between.
        let fields = if scheme.shape == Shape::Round { 5 } else { 2 };
        let bytes = u64::from(scheme.steps) * 2 * (fields * pixel + circles);
        let timing = rounds(self, count, bytes, false, |host, timer| {
            host.recorded(cancel, timer, |recorder| {
                let medium = Medium {
                    conductivity: Conductivity::Circle(&resident.1),
                    gamma: None,
                    vertical_scale: 1.0,
                };
                let all: Vec<_> = resident.0.iter().collect();
                recorder.stage("diffusion");
                let how = How { floor_at_zero: true, tuning, found: None };
                diffusion::diffuse(recorder, size, &all, &medium, settings, &how)
            })
        })?;
        self.recorded(cancel, None, |recorder| {
            recorder.give(resident.0.into_iter().map(|group| group.buffer).chain([resident.1]));
            Ok(())
        })?;
        Ok((timing, first))
    }

    /// Times a copy on the device that reads half of `bytes` and writes half of them, in pieces that one binding can
    /// hold.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn time_copy(&mut self, bytes: u64, count: usize, cancel: &Cancel) -> Result<Timing> {
        let limits = self.context().limits();
        let piece = (bytes / 2)
            .min(limits.max_storage_buffer_binding_size.min(limits.max_buffer_size))
            .next_multiple_of(16)
            .max(16);
        let piece = piece.min(limits.max_storage_buffer_binding_size / 16 * 16);
        let pieces = (bytes / 2).div_ceil(piece).max(1);
        let size = Size::new(1, 1);
        let buffers = self.recorded(cancel, None, |recorder| {
            Ok([recorder.take(size, piece)?, recorder.take(size, piece)?])
        })?;
        let spec = Spec::new(&[part!("copy")], &[]);
        let workgroups = (piece / 16).div_ceil(256 * 4).clamp(1, 65535) as u32;
        let params = CopyParams { count: (piece / 16) as u32, stride: workgroups * 256 };
        let timing = rounds(self, count, 2 * piece * pieces, false, |host, timer| {
            host.recorded(cancel, timer, |recorder| {
                recorder.stage("copy");
                for _ in 0..pieces {
                    recorder.run(&spec, &params, &[&buffers[0], &buffers[1]], [workgroups, 1, 1])?;
                }
                Ok(())
            })
        })?;
        self.recorded(cancel, None, |recorder| {
            recorder.give(buffers);
            Ok(())
        })?;
        Ok(timing)
    }

    /// Times a whole frame as an engine would have it recorded: from textures to a texture (f32, or f16 where planes
    /// are stored so), circles of confusion from depth included.
    ///
    /// # Errors
    /// Any [`Error`]; [`Error::Unsupported`] for pictures with other than three planes and perhaps alpha.
    pub fn time_frame(
        &mut self,
        scene: &Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        count: usize,
    ) -> Result<(Timing, u64)> {
        scene.check()?;
        let size = scene.frame.data.size;
        let storage = self.storage();
        let base = Textures::new(self, &scene.base, storage)?;
        let near = scene.foreground.as_ref().map(|near| Textures::new(self, near, storage)).transpose()?;
        let output = texture(self, size, color_format(storage), wgpu::TextureUsages::RENDER_ATTACHMENT);
        let view = output.create_view(&Default::default());
        let inputs = Inputs {
            base: base.picture(),
            foreground: near.as_ref().map(Textures::picture),
            output: &view,
            output_format: None,
        };
        let frame = FrameSettings { frame: scene.frame, camera, settings };
        let context = self.context().clone();
        let mut buffers = Buffers::new(&context, size, storage)?;
        buffers.set_tuning(self.tuning());
        let timing = rounds(self, count, 0, true, |_, timer| {
            let mut encoder = context.device().create_command_encoder(&Default::default());
            context.record(&mut encoder, &mut buffers, &inputs, &frame, timer)?;
            context.queue().submit([encoder.finish()]);
            Ok(())
        })?;
        Ok((timing, buffers.bytes()))
    }
}

fn color_format(storage: Storage) -> wgpu::TextureFormat {
    match storage {
        Storage::Full => wgpu::TextureFormat::Rgba32Float,
        Storage::Half => wgpu::TextureFormat::Rgba16Float,
    }
}

fn texture(
    host: &Host,
    size: Size,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    host.context().device().create_texture(&wgpu::TextureDescriptor {
        label: Some("a frame to measure with"),
        size: wgpu::Extent3d {
            width: size.width as u32,
            height: size.height as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// An element as textures.
struct Textures {
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    alpha: bool,
    decoding: Option<DepthDecoding>,
}

impl Textures {
    fn new(host: &Host, element: &Element, storage: Storage) -> Result<Self> {
        let size = element.picture.size();
        let [r, g, b] = &element.picture.colors[..] else {
            return Err(Error::Unsupported {
                what: "a texture of these planes",
                reason: "it must be R, G, B",
            });
        };
        let alpha = element.picture.alpha.as_ref();
        let pixels = (0..size.area()).map(|i| {
            [r, g, b].map(|plane| plane.data()[i]).into_iter().chain([alpha.map_or(1.0, |a| a.data()[i])])
        });
        let bytes: Vec<u8> = match storage {
            Storage::Full => pixels.flatten().flat_map(f32::to_le_bytes).collect(),
            Storage::Half => pixels.flatten().flat_map(|x| half::f16::from_f32(x).to_le_bytes()).collect(),
        };
        let use_ = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let color = texture(host, size, color_format(storage), use_);
        let depth = texture(host, size, wgpu::TextureFormat::R32Float, use_);
        let write = |texture: &wgpu::Texture, bytes: &[u8]| {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((bytes.len() / size.height.max(1)) as u32),
                rows_per_image: None,
            };
            host.context().queue().write_texture(texture.as_image_copy(), bytes, layout, texture.size());
        };
        write(&color, &bytes);
        write(&depth, bytemuck::cast_slice(element.distance.plane().data()));
        let decoding = match &element.distance {
            Distance::Depth { decoding, .. } => Some(*decoding),
            Distance::Coc(_) => None,
        };
        let view = |texture: wgpu::Texture| texture.create_view(&Default::default());
        Ok(Self { color: view(color), depth: view(depth), alpha: alpha.is_some(), decoding })
    }

    fn picture(&self) -> Picture<'_> {
        Picture {
            color: &self.color,
            alpha: self.alpha,
            depth: Depth { view: &self.depth, decoding: self.decoding },
        }
    }
}

impl Host {
    /// Records something, submits it and waits for it.
    fn recorded<T>(
        &mut self,
        cancel: &Cancel,
        timer: Option<&mut Timer>,
        work: impl FnOnce(&mut Recorder<'_>) -> Result<T>,
    ) -> Result<T> {
        let (context, memory) = self.parts();
        let sink = Sink::Host { encoder: None, cancel, work: 0 };
        let mut recorder = Recorder::new(context, memory, sink, timer)?;
        let result = work(&mut recorder)?;
        recorder.finish()?;
        Ok(result)
    }
}
