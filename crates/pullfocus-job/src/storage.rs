//! Reading and writing pictures of every kind, in the program's terms.

use crate::draw::Canvas;
use crate::failure::{Failure, Result};
use pullfocus_core::{Cancel, Frame, Picture, Plane, Window};
use pullfocus_io::exr::{ChannelSource, Contents};
use pullfocus_io::images::{self, Bits, Encoding, Format, Image, Profile, Stored};
use pullfocus_io::output::{Existing, PendingFile};
use pullfocus_io::{
    AttributeValue, Channels, Document, FileError, FoundCamera, Limits, NamedPlane, SampleType,
    SelectedDepth, Selection, align_element, align_plane, write_exr,
};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What files may ask for where the user trusts them.
pub const NO_LIMITS: Limits = Limits {
    max_pixels: u64::MAX,
    max_plane_bytes: u64::MAX,
    max_header_bytes: u64::MAX,
    max_channels: usize::MAX,
    max_parts: usize::MAX,
    max_chunks: u64::MAX,
    max_chunk_bytes: u64::MAX,
};

/// The usual limits, or none.
pub fn limits(allow_large_files: bool) -> Limits {
    if allow_large_files { NO_LIMITS } else { Limits::default() }
}

/// A file that was read.
#[derive(Debug)]
pub struct Loaded {
    /// Its path.
    pub path: PathBuf,
    /// Where its pixels lie.
    pub frame: Frame,
    /// Its colour.
    pub picture: Picture,
    /// Its depth.
    pub depth: Option<NamedPlane>,
    /// Its circles of confusion, where they were asked for.
    pub coc: Option<NamedPlane>,
    /// What it says about its camera.
    pub camera: FoundCamera,
    /// What files may ask for.
    limits: Limits,
    origin: Origin,
}

#[derive(Debug)]
enum Origin {
    Exr { document: Box<Document>, channels: Channels },
    Image { names: Vec<String>, stored: Stored, profile: Option<Profile>, notes: Vec<String> },
}

/// What numbers that were stored so need in an OpenEXR file: halves keep the codes of 8 bits apart, not those of 16.
fn sample_type(stored: Stored) -> SampleType {
    match stored {
        Stored::Integer(..=8) => SampleType::Half,
        Stored::Integer(_) | Stored::Float => SampleType::Float,
    }
}

impl Loaded {
    /// Names of the planes of its picture, no two alike: with their parts before them ("bg.R") where channels of several parts have
    /// the same.
    pub fn channel_names(&self) -> Vec<String> {
        let (document, channels) = match &self.origin {
            Origin::Exr { document, channels } => (document, channels),
            Origin::Image { names, .. } => return names.clone(),
        };
        let names: HashSet<&str> = channels.all().map(|source| source.name.as_str()).collect();
        let alike = names.len() < channels.all().count();
        let name = |source: &ChannelSource| match alike {
            true => format!("{}.{}", document.part_name(source.part), source.name),
            false => source.name.clone(),
        };
        channels.all().map(name).collect()
    }

    /// How many colour planes its picture has, or had before they were moved into a scene.
    pub fn color_count(&self) -> usize {
        match &self.origin {
            Origin::Exr { channels, .. } => channels.colors.len(),
            Origin::Image { names, .. } => names.iter().filter(|name| *name != "A").count(),
        }
    }

    /// What the user should know about how it was read, as clauses about "it", the file.
    pub fn notes(&self) -> impl Iterator<Item = &String> {
        let own: &[String] = match &self.origin {
            Origin::Exr { .. } => &[],
            Origin::Image { notes, .. } => notes,
        };
        self.camera.notes.iter().chain(own)
    }

    /// The colour profile that goes along.
    fn profile(&self) -> Option<&Profile> {
        match &self.origin {
            Origin::Exr { .. } => None,
            Origin::Image { profile, .. } => profile.as_ref(),
        }
    }

    /// A sentence, where a picture that is not OpenEXR would lack some of its colours.
    pub fn left_out(&self) -> Option<String> {
        let names = self.channel_names();
        let beyond = names.get(3..self.color_count()).filter(|beyond| !beyond.is_empty())?;
        Some(format!(
            "a picture that is not OpenEXR shows three colours ({}), so {} left out; write .exr to keep all, or choose with --channels",
            names[..3].join(", "),
            match beyond {
                [one] => format!("{one} is"),
                more => format!("{} are", more.join(", ")),
            }
        ))
    }

    /// The name of its depth or circle-of-confusion channel.
    pub fn distance_name(&self) -> String {
        self.coc
            .as_ref()
            .or(self.depth.as_ref())
            .map_or_else(|| "no depth".into(), |plane| plane.name.clone())
    }
}

/// Whether the path's ending says OpenEXR.
pub fn is_exr(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr"))
}

/// Reads what one render needs.
///
/// # Errors
/// Files that cannot be read, channels that are not there.
pub fn load(path: &Path, selection: &Selection, limits: &Limits, cancel: &Cancel) -> Result<Loaded> {
    if !is_exr_content(path)? {
        return load_image(path, selection, limits);
    }
    let document = Document::open(path, limits)?.with_cancel(cancel.clone());
    let selected = document.select(selection)?;
    Ok(Loaded {
        path: path.to_owned(),
        frame: selected.frame,
        picture: selected.picture,
        depth: selected.depth,
        coc: selected.coc,
        camera: selected.camera,
        limits: *limits,
        origin: Origin::Exr { document: Box::new(document), channels: selected.channels },
    })
}

/// Where a picture's pixels lie and what its file says of the camera; of OpenEXR files the header alone is read.
///
/// # Errors
/// As [`load`].
pub fn look(path: &Path, selection: &Selection, limits: &Limits) -> Result<(Frame, FoundCamera)> {
    if !is_exr_content(path)? {
        let loaded = load_image(path, selection, limits)?;
        return Ok((loaded.frame, loaded.camera));
    }
    Ok(Document::open(path, limits)?.look(selection)?)
}

/// Whether a file has views to choose from, by its header.
///
/// # Errors
/// As [`load`].
pub fn has_views(path: &Path, limits: &Limits) -> Result<bool> {
    Ok(is_exr_content(path)? && !Document::open(path, limits)?.views().is_empty())
}

/// Depth from a file of its own.
#[derive(Debug)]
pub struct Depth {
    /// The channel.
    pub named: NamedPlane,
    /// Bits of the whole numbers that it was stored as, read as 0 to 1.
    pub bits: Option<u8>,
    /// What its file says about the camera: the unit and the far clip are those of this depth.
    pub camera: FoundCamera,
}

/// Reads depth from a file of its own, laid onto the picture's frame.
///
/// # Errors
/// Files that cannot be read, another size than the picture's.
pub fn load_depth(
    path: &Path,
    selection: &Selection,
    frame: &Frame,
    limits: &Limits,
    cancel: &Cancel,
) -> Result<Depth> {
    if !is_exr_content(path)? {
        return load_image_depth(path, frame, limits);
    }
    // The picture's layers are not in this file.
    let selection = Selection { layers: Vec::new(), part: None, coc_channel: None, ..selection.clone() };
    let document = Document::open(path, limits)?.with_cancel(cancel.clone());
    let Some(SelectedDepth { frame: own, depth, camera }) = document.select_depth(&selection)? else {
        return Err(Failure::failed(format!(
            "{}: no depth channel was found; name it with --depth-channel ('pullfocus inspect' lists the channels)",
            path.display()
        )));
    };
    if own.display.size != frame.display.size {
        return Err(wrong_size(path, own.display.size, frame.display.size));
    }
    let (_, plane) =
        align_element(path, (Picture::default(), Some(depth.plane), &own), frame, f32::INFINITY)?;
    let named = NamedPlane { plane: plane.unwrap_or_default(), name: depth.name };
    Ok(Depth { named, bits: None, camera })
}

fn wrong_size(path: &Path, found: pullfocus_core::Size, expected: pullfocus_core::Size) -> Failure {
    Failure::failed(format!(
        "{}: depth is {found} but the picture is {expected}; bring both to one size first (depth without smoothing)",
        path.display()
    ))
}

/// Refuses an output whose ending names no format that is written.
///
/// # Errors
/// [`Failure::Usage`].
pub fn check_output(path: &Path, bits: Option<Bits>) -> Result<()> {
    if is_exr(path) {
        return match bits {
            None => Ok(()),
            Some(_) => Err(Failure::usage(format!(
                "{}: --bits is for other pictures; an OpenEXR file has the types of an OpenEXR input, and of others half floats for 8 bits and floats for more",
                path.display()
            ))),
        };
    }
    Encoding::for_name(path, bits)?;
    Ok(())
}

/// Refuses a preview that would not be a PNG.
///
/// # Errors
/// [`Failure::Usage`].
pub fn check_preview(path: &Path) -> Result<()> {
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        return Ok(());
    }
    Err(Failure::usage(format!("--preview-png {}: the name must end with .png", path.display())))
}

/// Writes the result: into the file that it came from, as it were, where both are OpenEXR; else as a picture.
///
/// # Errors
/// What writing can run into; nothing has the output's name then that did not have it before.
pub fn save(
    target: &Loaded,
    picture: &mut Picture,
    output: &Path,
    bits: Option<Bits>,
    existing: Existing,
) -> Result<()> {
    if !is_exr(output) {
        images::save_with_profile(
            output,
            as_seen(picture, &target.frame, &target.limits)?.as_ref(),
            Encoding::for_name(output, bits)?,
            target.profile(),
            existing,
        )?;
        return Ok(());
    }
    let mut pending = PendingFile::create(output, existing)?;
    match &target.origin {
        Origin::Exr { document, channels } => {
            if channels.alpha.is_none() {
                picture.alpha = None;
            }
            document.write_to(&mut pending, channels, picture)
        }
        Origin::Image { names, stored, .. } => {
            let planes: Vec<_> = names
                .iter()
                .zip(picture.planes())
                .map(|(name, plane)| (name.as_str(), plane, sample_type(*stored)))
                .collect();
            write_exr(&mut pending, &target.frame, &planes, &[])
        }
    }
    .map_err(|error| error.of_output(output))?;
    pending.commit()?;
    Ok(())
}

/// The channel that holds signed diameters of the circle of confusion in what [`save_with_coc`] writes.
pub const COC_CHANNEL: &str = "coc";
/// The attribute of a file that has it.
pub const COC_ATTRIBUTE: &str = "pullfocus/coc";

/// Writes colour and the circle of confusion as the float channel `coc`: what `render --coc-channel coc` takes.
///
/// # Errors
/// As [`save`].
pub fn save_with_coc(
    target: &Loaded,
    frame: &Frame,
    picture: &Picture,
    coc: &Plane,
    output: &Path,
    existing: Existing,
) -> Result<()> {
    let names = target.channel_names();
    let kinds: Vec<SampleType> = match &target.origin {
        Origin::Exr { channels, .. } => channels.all().map(|source| source.sample_type).collect(),
        Origin::Image { stored, .. } => vec![sample_type(*stored); names.len()],
    };
    let mut planes: Vec<(&str, &Plane, SampleType)> = names
        .iter()
        .zip(picture.planes())
        .zip(kinds)
        .map(|((name, plane), kind)| (name.as_str(), plane, kind))
        .filter(|(name, ..)| *name != COC_CHANNEL)
        .collect();
    planes.push((COC_CHANNEL, coc, SampleType::Float));
    let note = "signed diameter of the circle of confusion in pixels, positive behind focus";
    let mut pending = PendingFile::create(output, existing)?;
    write_exr(&mut pending, frame, &planes, &[(COC_ATTRIBUTE, AttributeValue::Text(note.into()))])
        .map_err(|error| error.of_output(output))?;
    pending.commit()?;
    Ok(())
}

/// Writes an 8-bit PNG of the result, with the curve of sRGB.
///
/// # Errors
/// As [`save`].
pub fn save_preview(target: &Loaded, picture: &Picture, output: &Path, existing: Existing) -> Result<()> {
    let seen = as_seen(picture, &target.frame, &target.limits)?;
    let encoding = Encoding::for_name(Path::new("a.png"), Some(Bits::Eight))?;
    images::save_with_profile(output, seen.as_ref(), encoding, target.profile(), existing)?;
    Ok(())
}

/// Writes an 8-bit picture that is sRGB already.
///
/// # Errors
/// As [`save`].
pub fn save_canvas(canvas: &Canvas, output: &Path, existing: Existing) -> Result<()> {
    if is_exr(output) {
        return Err(Failure::usage(format!(
            "{}: this picture is for looking at; end the name with .png",
            output.display()
        )));
    }
    let size = pullfocus_core::Size::new(canvas.width, canvas.height);
    let plane = |c: usize| {
        Plane::new(size, canvas.data.iter().skip(c).step_by(3).map(|&v| f32::from(v) / 255.0).collect())
    };
    let encoding =
        Encoding::for_name(output, Some(Bits::Eight)).or_else(|_| Encoding::for_name(output, None))?;
    images::save_srgb(output, &[plane(0)?, plane(1)?, plane(2)?], encoding, existing)?;
    Ok(())
}

/// What a screen shows: the display window, black where no pixels are; three colours or one, and alpha.
fn as_seen<'a>(picture: &'a Picture, frame: &Frame, limits: &Limits) -> Result<Cow<'a, Picture>> {
    let whole = frame.data == frame.display;
    if whole && matches!(picture.colors.len(), 1 | 3) {
        return Ok(Cow::Borrowed(picture));
    }
    let seen = |plane: &Plane| -> Result<Plane> { on_display(plane, frame, 0.0, limits) };
    let mut colors = picture.colors.iter().take(3).map(seen).collect::<Result<Vec<_>>>()?;
    if colors.len() == 2 {
        // Two of three colours: the third is dark.
        colors.push(Plane::filled(colors[0].size(), 0.0)?);
    }
    Ok(Cow::Owned(Picture { colors, alpha: picture.alpha.as_ref().map(seen).transpose()? }))
}

/// The plane in the frame's display window. A display window far larger than the pixels that are there is a
/// mistake in the file, or meant to exhaust memory.
///
/// # Errors
/// [`FileError::TooLarge`], memory.
pub fn on_display(plane: &Plane, frame: &Frame, fill: f32, limits: &Limits) -> Result<Plane> {
    if frame.data == frame.display {
        return Ok(plane.clone());
    }
    let area = frame.display.size.area() as u64;
    FileError::check_limit(
        "the picture to show",
        "the display window's number of pixels",
        area,
        limits.max_pixels,
    )?;
    Ok(align_plane(plane.clone(), frame.data, frame.display, fill)?)
}

/// Writes bytes as they are, over a file of this name.
///
/// # Errors
/// As [`save`].
pub fn save_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut pending = PendingFile::create(path, Existing::Replace)?;
    pending.write_all(bytes).map_err(|error| FileError::io(path, "write", error))?;
    pending.commit()?;
    Ok(())
}

/// Reads a picture as a screen shows it: its display window, its own colour in one or three planes, its alpha.
///
/// # Errors
/// Files that cannot be read.
pub fn read_picture(path: &Path, limits: &Limits) -> Result<Picture> {
    let selection = Selection { without_depth: true, ..Selection::default() };
    let loaded = load(path, &selection, limits, &Cancel::new())?;
    Ok(as_seen(&loaded.picture, &loaded.frame, limits)?.into_owned())
}

/// Reads a picture to lie beside another one: the same pixels of the camera's view, black where it has none. A picture of another
/// view, which has another size, is read as [`read_picture`] does.
///
/// # Errors
/// Files that cannot be read.
pub fn read_picture_beside(path: &Path, beside: &Frame, limits: &Limits) -> Result<Picture> {
    let selection = Selection { without_depth: true, ..Selection::default() };
    let Loaded { frame, picture, .. } = load(path, &selection, limits, &Cancel::new())?;
    if frame.display.size != beside.display.size {
        return Ok(as_seen(&picture, &frame, limits)?.into_owned());
    }
    // Both count from the corner of what the camera sees.
    let in_view = |frame: &Frame| {
        let (data, display) = (frame.data, frame.display);
        Window { x: data.x.saturating_sub(display.x), y: data.y.saturating_sub(display.y), size: data.size }
    };
    let (from, to) = (in_view(&frame), in_view(beside));
    let align = |plane: Plane| align_plane(plane, from, to, 0.0);
    let planes = |picture: Picture| -> Result<Picture> {
        let colors = picture.colors.into_iter().map(align).collect::<std::result::Result<_, _>>()?;
        Ok(Picture { colors, alpha: picture.alpha.map(align).transpose()? })
    };
    let picture = planes(picture)?;
    Ok(as_seen(&picture, &Frame::full(to.size), limits)?.into_owned())
}

/// What `inspect` found.
#[derive(Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Inspected {
    /// An OpenEXR file.
    Exr(Box<Contents>),
    /// Another picture.
    Image {
        /// PNG, JPEG, ...
        format: String,
        /// Pixels across.
        width: usize,
        /// Pixels down.
        height: usize,
        /// Whether it has alpha.
        alpha: bool,
        /// Whether its three colours are the same everywhere, as in a depth map.
        grey: bool,
        /// How its numbers are stored.
        stored: String,
        /// Smallest and largest number as `--depth-file` reads it: whole numbers as 0 to 1.
        as_depth: Option<[f32; 2]>,
    },
}

/// Looks into a file. An OpenEXR file whose pixels cannot be read (it is damaged, or still being rendered) has a header to
/// tell of: what is wrong with the pixels comes beside it.
///
/// # Errors
/// Files that cannot be read.
pub fn inspect(path: &Path, limits: &Limits) -> Result<(Inspected, Option<Failure>)> {
    if !is_exr_content(path)? {
        return Ok((inspect_image(path, limits)?, None));
    }
    let document = Document::open(path, limits)?;
    let (contents, wrong) = match document.inspect() {
        Ok(contents) => (contents, None),
        Err(error) => (document.contents(), Some(error.into())),
    };
    Ok((Inspected::Exr(Box::new(contents)), wrong))
}

/// Whether the file begins as OpenEXR does.
fn is_exr_content(path: &Path) -> Result<bool> {
    Ok(Format::detect(path)? == Format::OpenExr)
}

fn load_image(path: &Path, selection: &Selection, limits: &Limits) -> Result<Loaded> {
    if let Some(channel) = selection.coc_channel.as_ref().or(selection.depth_channel.as_ref()) {
        return Err(Failure::failed(format!(
            "{}: a picture of this kind has no channel '{channel}'; give depth in a file of its own with --depth-file",
            path.display()
        )));
    }
    let Image { picture, stored, profile, notes } = images::read_image(path, limits)?;
    let names =
        ["R", "G", "B"].into_iter().take(picture.colors.len()).chain(picture.alpha.as_ref().map(|_| "A"));
    Ok(Loaded {
        path: path.to_owned(),
        frame: Frame::full(picture.size()),
        depth: None,
        coc: None,
        camera: FoundCamera::default(),
        limits: *limits,
        origin: Origin::Image { names: names.map(str::to_owned).collect(), stored, profile, notes },
        picture,
    })
}

fn load_image_depth(path: &Path, frame: &Frame, limits: &Limits) -> Result<Depth> {
    let map = images::read_depth(path, limits)?;
    let size = map.plane.size();
    // A picture without windows is the data, or the whole display window.
    let own = [frame.data, frame.display].into_iter().find(|window| window.size == size);
    let Some(own) = own else { return Err(wrong_size(path, size, frame.data.size)) };
    let plane = align_plane(map.plane, own, frame.data, f32::INFINITY)?;
    let bits = match map.stored {
        Stored::Integer(bits) => Some(bits),
        Stored::Float => None,
    };
    let named = NamedPlane { name: "the first channel".into(), plane };
    Ok(Depth { named, bits, camera: FoundCamera::default() })
}

fn inspect_image(path: &Path, limits: &Limits) -> Result<Inspected> {
    let format = Format::detect(path)?;
    let picture = images::read_picture(path, limits)?;
    let depth = images::read_depth(path, limits)?;
    let values = depth.plane.data().iter().copied().filter(|value| value.is_finite());
    let [low, high] = values.fold([f32::INFINITY, f32::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    let size = picture.size();
    Ok(Inspected::Image {
        format: format!("{format:?}").to_uppercase(),
        width: size.width,
        height: size.height,
        alpha: picture.alpha.is_some(),
        grey: picture.colors.windows(2).all(|pair| pair[0] == pair[1]),
        stored: match depth.stored {
            Stored::Integer(bits) => format!("{bits}-bit whole numbers"),
            Stored::Float => "floats".into(),
        },
        as_depth: (low <= high).then_some([low, high]),
    })
}
