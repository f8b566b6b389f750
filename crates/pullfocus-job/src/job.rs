//! A job: options that were found to make sense together, before any picture is read.

use crate::camera::{self, FileCamera};
use crate::config::Options;
use crate::failure::{Failure, Result};
use crate::frames::{self, FrameFiles};
use crate::options::{Lens, StorageName};
use crate::purpose::Purpose;
use crate::settings;
use crate::shot;
use crate::storage;
use crate::threads::check_threads;
use crate::values::Shape;
use pullfocus::Device;
use pullfocus_core::pull::Pull;
use pullfocus_core::{DepthDecoding, Settings, Storage};
use pullfocus_io::images::Bits;
use pullfocus_io::output::{Existing, refuse_input};
use pullfocus_io::{Limits, Selection};

/// A validated job.
#[derive(Debug, Clone)]
pub struct Job {
    /// The frames, in order; at least one.
    pub frames: Vec<FrameFiles>,
    /// The lens as far as the user gave it.
    pub lens: Lens,
    /// What the lens is where neither the user nor the file says.
    pub fallback: FileCamera,
    /// Where the lens moves.
    pub keys: Pull,
    /// How depth is read, as far as the user said.
    pub decoding: DepthDecoding,
    /// Whether the user gave the unit of depth.
    pub unit_given: bool,
    /// The library's settings.
    pub settings: Settings,
    /// What is taken out of the picture's file.
    pub selection: Selection,
    /// What is done about outputs that are there.
    pub existing: Existing,
    /// How exactly pictures other than OpenEXR are stored.
    pub bits: Option<Bits>,
    /// What files may ask for.
    pub limits: Limits,
    /// What renders.
    pub device: Device,
    /// How a GPU keeps planes.
    pub storage: Storage,
    /// Number of threads; all processors if none.
    pub threads: Option<u32>,
    /// `coc`: diameter shown in full colour.
    pub coc_range: Option<f32>,
    /// What the user should know about the options.
    pub warnings: Vec<String>,
}

impl Job {
    /// Checks the options and finds the frames.
    ///
    /// # Errors
    /// [`Failure::Usage`] for options that do not go together; [`Failure::Failed`] for frames that are not there.
    pub fn new(options: &Options, purpose: Purpose) -> Result<Self> {
        let Options { files, lens, depth, circle, blur, view, run, keys } = options;
        let mut warnings = Vec::new();
        check_threads(run.threads)?;
        camera::check(lens)?;
        let settings = settings::settings(blur, circle, depth)?;
        let decoding = settings::decoding(depth)?;
        if files.overwrite == Some(true) && files.resume == Some(true) {
            return Err(Failure::usage(
                "--overwrite replaces files that are there and --resume keeps them; give one of them",
            ));
        }
        if depth.coc_channel.is_some() {
            if depth.depth_channel.is_some() || files.depth_file.is_some() {
                return Err(Failure::usage(
                    "--coc-channel takes the place of depth; leave --depth-channel and --depth-file out",
                ));
            }
            if camera::any_given(lens) {
                warnings.push(
                    "--coc-channel already holds what the lens does, so the lens options are not used".into(),
                );
            }
            if settings.coc.protect_m.is_some() {
                warnings.push(
                    "--protect is in metres and means nothing beside --coc-channel, so it is not used".into(),
                );
            }
        }
        match (purpose, &files.foreground, &files.behind) {
            (Purpose::Render | Purpose::View, Some(_), None) => {
                return Err(Failure::usage(
                    "--foreground needs --behind FILE, what is behind it; if IN shows only that, give it as --behind",
                ));
            }
            (Purpose::Render | Purpose::View, None, Some(_)) => {
                return Err(Failure::usage(
                    "--behind needs --foreground FILE, the near objects that lie over it",
                ));
            }
            (Purpose::Render | Purpose::View, Some(_), Some(_)) if files.depth_file.is_some() => {
                return Err(Failure::usage(
                    "--depth-file is the depth of IN; --foreground and --behind bring their own in their files",
                ));
            }
            _ => {}
        }
        let coc_range = match view.coc_range {
            Some(range) if !(range.0.is_finite() && range.0 > 0.0) => {
                return Err(Failure::usage(format!(
                    "--coc-range is {}; it must be a number of pixels above 0",
                    range.0
                )));
            }
            range => range.map(|range| range.0 as f32),
        };
        let label = |label: &Option<crate::values::Label>| label.as_ref().map(|label| label.0.clone());
        let selection = Selection {
            view: label(&files.view),
            part: label(&files.part),
            layers: blur.channels.clone().map(|names| names.0).unwrap_or_default(),
            depth_channel: label(&depth.depth_channel),
            coc_channel: label(&depth.coc_channel),
            cover_display: false,
            without_depth: false,
            // Circles of confusion come from depth alone.
            color_optional: purpose == Purpose::Coc,
        };
        let bits = files.bits.map(Bits::from);
        let frames = frames::find(options, purpose)?;
        if purpose != Purpose::View {
            // A pull that is being made may not fit yet.
            shot::check(keys, lens, &frames)?;
        }
        for frame in frames.iter().filter(|_| purpose != Purpose::View) {
            storage::check_output(&frame.output, bits)?;
            if let Some(preview) = &frame.preview_png {
                storage::check_preview(preview)?;
            }
            if let Some(Shape::Image(shape)) = &blur.aperture {
                // It is no frame's own file, but an input all the same.
                for output in std::iter::once(&frame.output).chain(&frame.preview_png) {
                    refuse_input(output, [shape])?;
                }
            }
        }
        Ok(Self {
            frames,
            lens: lens.clone(),
            fallback: FileCamera::default(),
            keys: keys.clone(),
            decoding,
            unit_given: depth.depth_unit.is_some(),
            settings,
            selection,
            existing: match (files.overwrite, files.resume) {
                (Some(true), _) => Existing::Replace,
                (_, Some(true)) => Existing::Keep,
                _ => Existing::Refuse,
            },
            limits: storage::limits(files.allow_large_files == Some(true)),
            storage: match blur.gpu_storage {
                Some(StorageName::F16) => Storage::Half,
                Some(StorageName::F32) | None => Storage::Full,
            },
            device: match purpose {
                Purpose::Render | Purpose::View => blur.device.clone().unwrap_or_default().0,
                // Circles are the CPU's work alone.
                Purpose::Coc => Device::Cpu,
            },
            threads: run.threads,
            coc_range,
            bits,
            warnings,
        })
    }
}
