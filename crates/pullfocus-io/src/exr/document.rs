//! An open OpenEXR file.

use crate::error::{FileError, FileResult};
use crate::exr::camera::FoundCamera;
use crate::exr::choice::{Chosen, deep};
use crate::exr::container::Container;
use crate::exr::contents::{Contents, DepthContents, PartContents};
use crate::exr::names::{Catalogue, Channel, Layer};
use crate::exr::pixels::{Target, read_planes};
use crate::exr::selection::{ChannelSource, Channels, NamedPlane, Selected, SelectedDepth, Selection};
use crate::limits::Limits;
use pullfocus_core::depth::{HALF_MAX, NOTHING_FROM};
use pullfocus_core::{Cancel, Frame, Picture, Plane, Size, Window};
use std::path::{Path, PathBuf};

/// An open OpenEXR file: its header is read and checked, its pixels are still in the file.
///
/// The file stays open as long as the document lives, so that its channels can be carried over when the
/// blurred picture is written; it may be replaced by its own output.
#[derive(Debug)]
pub struct Document {
    pub(crate) container: Container,
    pub(crate) catalogue: Catalogue,
    pub(crate) cancel: Cancel,
}

impl Document {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// [`FileError::Io`], [`FileError::Unsupported`] where it is not OpenEXR, [`FileError::Damaged`],
    /// [`FileError::TooLarge`].
    pub fn open(path: impl AsRef<Path>, limits: &Limits) -> FileResult<Self> {
        Ok(Self::of(Container::open(path.as_ref(), limits)?))
    }

    /// Reads the header of a file in memory; `name` stands in messages.
    ///
    /// # Errors
    /// As [`Document::open`].
    pub fn from_bytes(name: impl Into<PathBuf>, bytes: Vec<u8>, limits: &Limits) -> FileResult<Self> {
        Ok(Self::of(Container::from_bytes(name.into(), bytes, limits)?))
    }

    fn of(container: Container) -> Self {
        let catalogue = Catalogue::of(&container);
        Self { container, catalogue, cancel: Cancel::new() }
    }

    /// Lets `cancel` stop reading and writing between blocks of pixels.
    pub fn with_cancel(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// The path or name that the document was opened with.
    pub fn path(&self) -> &Path {
        &self.container.path
    }

    /// The views, the default one first; empty for a file with one eye.
    pub fn views(&self) -> &[String] {
        &self.catalogue.views
    }

    /// A part's name, or its number where it has none.
    pub fn part_name(&self, part: usize) -> String {
        self.catalogue.part_name(part)
    }

    /// What the attributes say about the camera, from the first part on.
    pub fn camera(&self) -> FoundCamera {
        self.container
            .parts
            .iter()
            .fold(FoundCamera::default(), |camera, part| camera.or(FoundCamera::of(part)))
    }

    /// What is in the file, from its header alone.
    pub fn contents(&self) -> Contents {
        let catalogue = &self.catalogue;
        let flat = |layer: &Layer| !self.container.parts[layer.part].header.deep;
        let beauty = catalogue.beauty(flat);
        let view = beauty.and_then(|layer| layer.view.clone());
        let depth = self.find_depths(beauty.map(|layer| layer.part), view.as_deref());
        Contents {
            file: self.container.path.display().to_string(),
            views: catalogue.views.clone(),
            parts: (self.container.parts.iter().enumerate())
                .map(|(index, part)| PartContents::of(part, index, catalogue))
                .collect(),
            beauty: beauty.map(|layer| catalogue.layer_name(layer)),
            depth_channel: depth.first().map(|channel| catalogue.full_name(channel)),
            depth: Vec::new(),
            camera: self.camera(),
        }
    }

    /// What is in the file, with the values of the channels that may hold depth.
    ///
    /// # Errors
    /// Those of reading pixels: see [`Document::select`].
    pub fn inspect(&self) -> FileResult<Contents> {
        let mut contents = self.contents();
        let found = self.catalogue.depths(None, |channel| !channel.deep && !channel.sub_sampled);
        // Some files hold hundreds of channels that might be depth.
        for channel in found.into_iter().take(16) {
            let part = &self.container.parts[channel.part];
            let mut plane = self.new_plane(part.window().size, 1, f32::INFINITY)?;
            let target = Target::new(channel, part.window(), &mut plane);
            read_planes(&self.container, &mut [target], &self.cancel)?;
            let camera = FoundCamera::of(part);
            contents.depth.push(measure(self.catalogue.full_name(channel), channel, plane, &camera));
        }
        Ok(contents)
    }

    /// Where the pixels that [`Document::select`] would take lie, and what the attributes say about their camera, from the
    /// header alone.
    ///
    /// # Errors
    /// [`FileError::NotFound`] for a view, part or layer that is not there.
    pub fn look(&self, selection: &Selection) -> FileResult<(Frame, FoundCamera)> {
        let chosen = self.choose_layers(selection)?;
        let first = self.first_part(&chosen, None, selection)?;
        let window = self.joint_window(&chosen, first, selection.cover_display)?;
        Ok((self.frame(first, window), self.camera_of(first)))
    }

    /// What the attributes say about a part's camera, and else those of the others.
    fn camera_of(&self, part: usize) -> FoundCamera {
        FoundCamera::of(&self.container.parts[part]).or(self.camera())
    }

    /// Takes out of the file what one render needs.
    ///
    /// # Errors
    /// [`FileError::NotFound`] for a view, part, layer or channel that is not there, [`FileError::Unsupported`]
    /// for deep and chroma-subsampled pictures, [`FileError::Damaged`], [`FileError::TooLarge`], cancellation.
    pub fn select(&self, selection: &Selection) -> FileResult<Selected> {
        let chosen = self.choose_layers(selection)?;
        let view = chosen.view.clone();
        self.check_readable(chosen.colors.iter().chain(&chosen.alpha).copied())?;

        let named = |name: &String| self.named_channel(name, view.as_deref(), selection.part.as_deref());
        let coc = selection.coc_channel.as_ref().map(named).transpose()?;
        let first = self.first_part(&chosen, coc, selection)?;
        let window = self.joint_window(&chosen, first, selection.cover_display)?;
        let depth = match &selection.depth_channel {
            _ if selection.without_depth || coc.is_some() => None,
            Some(name) => Some(named(name)?),
            None => {
                let found = self.find_depths(Some(first), view.as_deref());
                // The depth of the part that was asked for, before likelier names in others.
                let own = found.iter().find(|channel| selection.part.is_some() && channel.part == first);
                own.or(found.first()).copied()
            }
        };
        for channel in coc.iter().chain(&depth) {
            self.check_channel(channel)?;
        }

        // Blocks that are missing are noticed before memory is taken for the planes.
        let ids = chosen.colors.iter().chain(&chosen.alpha).map(|&id| &self.catalogue.channels[id]);
        let parts: Vec<usize> = ids.chain(coc).chain(depth).map(|channel| channel.part).collect();
        self.container.extents(|part, _| parts.contains(&part))?;

        let count = chosen.colors.len()
            + usize::from(chosen.alpha.is_some())
            + usize::from(coc.is_some())
            + usize::from(depth.is_some());
        let mut picture = Picture::default();
        for _ in &chosen.colors {
            picture.colors.push(self.new_plane(window.size, count, 0.0)?);
        }
        if chosen.alpha.is_some() {
            picture.alpha = Some(self.new_plane(window.size, count, 0.0)?);
        }
        let named = |channel: Option<&Channel>, fill| -> FileResult<Option<NamedPlane>> {
            channel
                .map(|channel| {
                    Ok(NamedPlane {
                        name: self.catalogue.full_name(channel),
                        plane: self.new_plane(window.size, count, fill)?,
                    })
                })
                .transpose()
        };
        let mut depth_plane = named(depth, f32::INFINITY)?;
        let mut coc_plane = named(coc, 0.0)?;

        let ids = chosen.colors.iter().chain(&chosen.alpha);
        let mut targets: Vec<Target> = ids
            .zip(picture.planes_mut())
            .map(|(&id, plane)| Target::new(&self.catalogue.channels[id], window, plane))
            .collect();
        for (channel, plane) in [(depth, &mut depth_plane), (coc, &mut coc_plane)] {
            if let (Some(channel), Some(named)) = (channel, plane) {
                targets.push(Target::new(channel, window, &mut named.plane));
            }
        }
        read_planes(&self.container, &mut targets, &self.cancel)?;

        let source = |&id: &usize| {
            let channel = &self.catalogue.channels[id];
            ChannelSource {
                part: channel.part,
                channel: channel.index,
                name: channel.name.clone(),
                sample_type: channel.sample_type,
            }
        };
        Ok(Selected {
            frame: self.frame(first, window),
            picture,
            channels: Channels {
                colors: chosen.colors.iter().map(source).collect(),
                alpha: chosen.alpha.as_ref().map(source),
                window,
            },
            depth: depth_plane,
            coc: coc_plane,
            camera: self.camera_of(first),
            view,
        })
    }

    /// Takes depth alone out of the file, which need not hold a picture; none where no channel is depth.
    ///
    /// # Errors
    /// As [`Document::select`].
    pub fn select_depth(&self, selection: &Selection) -> FileResult<Option<SelectedDepth>> {
        let Some(channel) = self.depth_alone(selection)? else { return Ok(None) };
        self.check_channel(channel)?;
        self.container.extents(|part, _| part == channel.part)?;
        let window = self.container.parts[channel.part].window();
        let mut plane = self.new_plane(window.size, 1, f32::INFINITY)?;
        read_planes(&self.container, &mut [Target::new(channel, window, &mut plane)], &self.cancel)?;
        Ok(Some(SelectedDepth {
            frame: self.frame(channel.part, window),
            depth: NamedPlane { name: self.catalogue.full_name(channel), plane },
            camera: self.camera_of(channel.part),
        }))
    }

    fn frame(&self, part: usize, data: Window) -> Frame {
        let header = &self.container.parts[part].header;
        let shared = &header.shared_attributes;
        let own = &header.own_attributes;
        let or = |value: f32, good: bool, otherwise: f32| {
            if value.is_finite() && good { value } else { otherwise }
        };
        let center = own.screen_window_center;
        Frame {
            display: crate::exr::container::window(shared.display_window),
            data,
            pixel_aspect: or(shared.pixel_aspect, shared.pixel_aspect > 0.0, 1.0),
            screen_window_center: [or(center.x(), true, 0.0), or(center.y(), true, 0.0)],
            screen_window_width: or(own.screen_window_width, own.screen_window_width > 0.0, 1.0),
        }
    }

    /// A plane, after the limits were asked; `count` planes of this size are wanted at once.
    fn new_plane(&self, size: Size, count: usize, fill: f32) -> FileResult<Plane> {
        let limits = &self.container.limits;
        let area = size.area() as u64;
        FileError::check_limit(self.path(), "the number of pixels", area, limits.max_pixels)?;
        FileError::check_limit(
            self.path(),
            "the number of bytes in all chosen channels",
            area.saturating_mul(4 * count as u64),
            limits.max_plane_bytes,
        )?;
        Ok(Plane::filled(size, fill)?)
    }

    /// The smallest window that holds all parts with chosen channels; the first part's, where none is chosen.
    fn joint_window(&self, chosen: &Chosen, first: usize, cover_display: bool) -> FileResult<Window> {
        let ids = chosen.colors.iter().chain(&chosen.alpha);
        let mut parts: Vec<usize> = ids.map(|&id| self.catalogue.channels[id].part).collect();
        if parts.is_empty() {
            parts.push(first);
        }
        let mut windows: Vec<Window> =
            parts.into_iter().map(|part| self.container.parts[part].window()).collect();
        if cover_display {
            let header = &self.container.parts[first].header;
            windows.push(crate::exr::container::window(header.shared_attributes.display_window));
        }
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        for window in windows {
            let start = [i64::from(window.x), i64::from(window.y)];
            let size = [window.size.width as i64, window.size.height as i64];
            for axis in 0..2 {
                low[axis] = low[axis].min(start[axis]);
                high[axis] = high[axis].max(start[axis] + size[axis]);
            }
        }
        let size = Size::new((high[0] - low[0]) as usize, (high[1] - low[1]) as usize);
        let limit = self.container.limits.max_pixels;
        FileError::check_limit(self.path(), "the number of pixels", size.area() as u64, limit)?;
        Ok(Window { x: low[0] as i32, y: low[1] as i32, size })
    }

    fn check_readable(&self, ids: impl Iterator<Item = usize>) -> FileResult<()> {
        ids.map(|id| &self.catalogue.channels[id]).try_for_each(|channel| self.check_channel(channel))
    }

    pub(crate) fn check_channel(&self, channel: &Channel) -> FileResult<()> {
        let name = self.catalogue.full_name(channel);
        if channel.deep {
            return Err(deep(self.path()));
        }
        if channel.sub_sampled {
            return Err(FileError::unsupported(
                self.path(),
                format!(
                    "the part with channel '{name}' stores some channels for a part of the pixels (chroma subsampling)"
                ),
                "save it with full R, G and B channels first",
            ));
        }
        Ok(())
    }
}

/// Sums up a depth channel; uses up the plane.
fn measure(name: String, channel: &Channel, plane: Plane, camera: &FoundCamera) -> DepthContents {
    let mut values = plane.into_data();
    let all = values.len().max(1);
    let far = camera.far_clip.as_ref().map_or(f64::INFINITY, |far| far.value * (1.0 - 1e-4));
    values.retain(|&value| {
        let size = value.abs();
        size > 0.0 && size != HALF_MAX && size < NOTHING_FROM && f64::from(size) < far
    });
    let nothing = 1.0 - values.len() as f64 / all as f64;
    let mut contents = DepthContents {
        channel: name,
        min: None,
        max: None,
        median: None,
        nothing,
        convention: String::new(),
    };
    if !values.is_empty() {
        let middle = values.len() / 2;
        contents.median = Some(*values.select_nth_unstable_by(middle, f32::total_cmp).1);
        contents.min = values.iter().copied().min_by(f32::total_cmp);
        contents.max = values.iter().copied().max_by(f32::total_cmp);
    }
    contents.convention = convention(channel, &contents, camera);
    contents
}

/// What the numbers probably mean, and which argument says so.
fn convention(channel: &Channel, values: &DepthContents, camera: &FoundCamera) -> String {
    let (Some(min), Some(max)) = (values.min, values.max) else {
        return "nothing is there: every value means that no surface was hit".to_owned();
    };
    if camera.depth_unit_m.is_some() {
        return "planar distance in centimetres, as Unreal writes it (--depth planar --depth-unit 0.01)"
            .to_owned();
    }
    if channel.base.eq_ignore_ascii_case("t") {
        return "distance along the ray, as Mitsuba writes it (--depth ray)".to_owned();
    }
    if max <= 0.0 {
        return "planar distance down the negative axis, read by its size (--depth planar)".to_owned();
    }
    if min >= 0.0 && max <= 1.0 {
        return "between 0 and 1: normalised (--depth normalized with near and far), 1/z (--depth inverse) \
                or disparity (--depth disparity)"
            .to_owned();
    }
    "planar distance in units of the scene (--depth planar, with --depth-unit where that is not metres)"
        .to_owned()
}
