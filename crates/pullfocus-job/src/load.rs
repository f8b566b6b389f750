//! One frame from its files: colour, distance, camera.

use crate::camera::{self, Attribute, CameraValue, FileCamera, Resolved};
use crate::failure::{Failure, Result};
use crate::frames::FrameFiles;
use crate::job::Job;
use crate::shot;
use crate::storage::{self, Loaded};
use pullfocus_core::{Cancel, DepthDecoding, DepthKind, Distance, Element, Frame, Picture, Plane, Scene};
use pullfocus_io::{Found, FoundCamera, NamedPlane, Selection, align_element};
use std::path::Path;

/// A frame ready for the renderer.
#[derive(Debug)]
pub struct LoadedFrame {
    /// What the renderer takes.
    pub scene: Scene,
    /// The file whose channels the result replaces; its own picture has been moved into the scene, unless the
    /// result comes from other files.
    pub target: Loaded,
    /// The camera; none where circles of confusion were given.
    pub camera: Option<Resolved>,
    /// What the file says about its camera, and the job's fallback where it says nothing.
    pub found: FileCamera,
    /// What `distance` was read from, for people.
    pub distance: String,
    /// Names of the planes that are blurred.
    pub channels: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

fn attribute(found: &Option<Found>) -> Option<Attribute> {
    found
        .as_ref()
        .map(|found| Attribute { value: found.value, from: format!("attribute {}", found.attribute) })
}

/// What a file with this frame says about its camera.
pub fn file_camera(found: &FoundCamera, frame: &Frame) -> FileCamera {
    let mut camera = FileCamera {
        focus_distance: attribute(&found.focus_distance_m),
        f_stop: attribute(&found.f_stop),
        focal_length: attribute(&found.focal_length_mm),
        sensor_width: attribute(&found.sensor_width_mm),
        fov_x: attribute(&found.fov_x_degrees),
    };
    // A screen window wider than its default 1 was set by a renderer: it is the field of view.
    if camera.fov_x.is_none() && frame.screen_window_width != 1.0 && frame.screen_window_width > 0.0 {
        let degrees = 2.0 * f64::from(0.5 * frame.screen_window_width).atan().to_degrees();
        camera.fov_x = Some(Attribute { value: degrees, from: "attribute screenWindowWidth".into() });
    }
    camera
}

/// Depth decoding as the user gave it, filled from the file that the depth came from; `values` tells of it.
fn decoding(job: &Job, found: &FoundCamera, values: &mut Vec<CameraValue>) -> DepthDecoding {
    let mut decoding = job.decoding;
    if job.selection.coc_channel.is_some() {
        return decoding;
    }
    if !matches!(decoding.kind, DepthKind::Planar | DepthKind::Ray | DepthKind::Inverse) {
        return decoding;
    }
    if let (false, Some(unit)) = (job.unit_given, &found.depth_unit_m) {
        decoding.unit_m = unit.value;
        values.push(camera::value("depth unit", unit.value, "m", format!("attribute {}", unit.attribute)));
    }
    if let (None, Some(far)) = (decoding.far_clip_m, &found.far_clip) {
        let metres = far.value * decoding.unit_m;
        if metres.is_finite() && metres > 0.0 {
            decoding.far_clip_m = Some(metres);
            values.push(camera::value("depth far clip", metres, "m", format!("attribute {}", far.attribute)));
        }
    }
    decoding
}

/// Reads one frame.
///
/// # Errors
/// Files that cannot be read or do not fit together; [`Failure::Usage`] where the camera is incomplete.
pub fn load(job: &Job, files: &FrameFiles, cancel: &Cancel) -> Result<LoadedFrame> {
    let mut warnings = Vec::new();
    match (&files.foreground, &files.behind) {
        (Some(foreground), Some(behind)) => {
            load_layers(job, files, (foreground, behind), &mut warnings, cancel)
        }
        _ => load_single(job, files, &mut warnings, cancel),
    }
    .map(|frame| LoadedFrame { warnings, ..frame })
}

/// What is taken out of one of a frame's files. A view is no matter of files that have none, where another one has.
fn selection(job: &Job, files: &FrameFiles, path: &Path) -> Result<Selection> {
    let mut selection = job.selection.clone();
    if selection.view.is_some() && !storage::has_views(path, &job.limits)? {
        for other in files.read().filter(|other| *other != path) {
            if storage::has_views(other, &job.limits)? {
                selection.view = None;
                break;
            }
        }
    }
    Ok(selection)
}

fn load_single(
    job: &Job,
    files: &FrameFiles,
    warnings: &mut Vec<String>,
    cancel: &Cancel,
) -> Result<LoadedFrame> {
    let Some(input) = &files.input else { return Err(Failure::usage("give IN, the picture to blur")) };
    let wanted = Selection {
        without_depth: files.depth_file.is_some() && job.selection.coc_channel.is_none(),
        ..selection(job, files, input)?
    };
    let mut loaded = storage::load(input, &wanted, &job.limits, cancel)?;
    note_reading(&loaded, warnings);
    let (named, from, of_depth) = match (loaded.coc.take(), &files.depth_file, loaded.depth.take()) {
        (Some(coc), _, _) => (coc, input.as_path(), loaded.camera.clone()),
        (None, Some(file), _) => {
            let wanted = selection(job, files, file)?;
            let depth = storage::load_depth(file, &wanted, &loaded.frame, &job.limits, cancel)?;
            note_bits(job, file, depth.bits, warnings);
            (depth.named, file.as_path(), depth.camera)
        }
        (None, None, Some(depth)) => (depth, input.as_path(), loaded.camera.clone()),
        (None, None, None) => return Err(no_depth(input)),
    };
    let (name, frame) = (input.display().to_string(), loaded.frame);
    let channels = loaded.channel_names();
    let picture = std::mem::take(&mut loaded.picture);
    let (mut camera, found) = resolve(job, &loaded.camera, (&name, files.number), &frame)?;
    let mut values = Vec::new();
    let decoding = decoding(job, &of_depth, &mut values);
    let text = format!("{} of {}", named.name, from.display());
    if let Some(camera) = &mut camera {
        camera.values.extend(values);
        note_nothing(&named, from, decoding, warnings);
    }
    let base = Element { picture, distance: to_distance(job, named.plane, decoding) };
    Ok(LoadedFrame {
        scene: Scene::new(frame, base),
        target: loaded,
        camera,
        found,
        distance: text,
        channels,
        warnings: Vec::new(),
    })
}

fn load_layers(
    job: &Job,
    files: &FrameFiles,
    (foreground, behind): (&Path, &Path),
    warnings: &mut Vec<String>,
    cancel: &Cancel,
) -> Result<LoadedFrame> {
    // A part belongs to one file; the other files have their own.
    let part = job.selection.part.clone().filter(|_| files.input.is_none());
    let of_far = Selection { part, ..selection(job, files, behind)? };
    let of_near = Selection { part: None, ..selection(job, files, foreground)? };
    let mut far = storage::load(behind, &of_far, &job.limits, cancel)?;
    let mut near = storage::load(foreground, &of_near, &job.limits, cancel)?;
    let target = match &files.input {
        Some(input) => {
            let wanted =
                Selection { without_depth: true, coc_channel: None, ..selection(job, files, input)? };
            Some(storage::load(input, &wanted, &job.limits, cancel)?)
        }
        None => None,
    };
    let frame = target.as_ref().map_or(far.frame, |target| target.frame);
    let main = files.input.as_deref().unwrap_or(behind);
    note_reading(target.as_ref().unwrap_or(&far), warnings);
    let mut found = target.as_ref().map_or_else(FoundCamera::default, |target| target.camera.clone());
    for other in [&far.camera, &near.camera] {
        fill(&mut found, other);
    }
    let main_name = main.display().to_string();
    let (mut camera, found) = resolve(job, &found, (&main_name, files.number), &frame)?;
    // Each has the unit and the far clip of its own file.
    let mut values = Vec::new();
    let behind_it = decoding(job, &far.camera, &mut values);
    let mut of_front = Vec::new();
    let in_front = decoding(job, &near.camera, &mut of_front);
    of_front.retain(|value| !values.contains(value));
    if let Some(camera) = &mut camera {
        camera.values.extend(values.into_iter().chain(of_front));
    }

    let channels = target.as_ref().unwrap_or(&far).channel_names();
    let text = format!("{} of {}", far.distance_name(), behind.display());
    let mut base = element(job, behind, &mut far, &frame, behind_it)?;
    let near_element = element(job, foreground, &mut near, &frame, in_front)?;
    if near_element.picture.alpha.is_none() {
        return Err(Failure::failed(format!(
            "{}: the foreground has no alpha, which says where it covers what is behind; render it with one",
            foreground.display()
        )));
    }
    let mut target = target.unwrap_or(far);
    let wanted = target.color_count();
    for (path, count) in
        [(behind, base.picture.colors.len()), (foreground, near_element.picture.colors.len())]
    {
        if count != wanted {
            return Err(Failure::failed(format!(
                "{}: {count} colour channels were taken from it but {wanted} from {}; choose the same layers with --channels",
                path.display(),
                main.display()
            )));
        }
    }
    // The target's own colour is replaced whole; its alpha only where the layers have one.
    match (&base.picture.alpha, target.picture.alpha.take()) {
        (None, Some(alpha)) if files.input.is_some() => {
            if alpha.data().iter().any(|&value| value != 1.0) {
                warnings.push(format!(
                    "{} has alpha and {} has none: the alpha of {} is taken for both and blurred with them",
                    main.display(),
                    behind.display(),
                    main.display()
                ));
            }
            base.picture.alpha = Some(alpha);
        }
        _ => {}
    }
    target.picture = Picture::default();
    Ok(LoadedFrame {
        scene: Scene { frame, base, foreground: Some(near_element) },
        target,
        camera,
        found,
        distance: text,
        channels,
        warnings: Vec::new(),
    })
}

fn element(
    job: &Job,
    path: &Path,
    loaded: &mut Loaded,
    onto: &Frame,
    decoding: DepthDecoding,
) -> Result<Element> {
    let NamedPlane { plane, .. } =
        loaded.coc.take().or_else(|| loaded.depth.take()).ok_or_else(|| no_depth(path))?;
    let nothing = if job.selection.coc_channel.is_some() { 0.0 } else { f32::INFINITY };
    let picture = std::mem::take(&mut loaded.picture);
    let (picture, plane) = align_element(path, (picture, Some(plane), &loaded.frame), onto, nothing)?;
    let plane = plane.ok_or_else(|| no_depth(path))?;
    Ok(Element { picture, distance: to_distance(job, plane, decoding) })
}

fn to_distance(job: &Job, plane: Plane, decoding: DepthDecoding) -> Distance {
    if job.selection.coc_channel.is_some() {
        Distance::Coc(plane)
    } else {
        Distance::Depth { plane, decoding }
    }
}

fn no_depth(path: &Path) -> Failure {
    Failure::failed(format!(
        "{}: no depth channel was found; name it with --depth-channel, give a file with --depth-file, or circles of confusion with --coc-channel ('pullfocus inspect' lists the channels)",
        path.display()
    ))
}

/// Whole numbers hold no metres, and 8 bits of them make steps that can be seen.
fn note_bits(job: &Job, path: &Path, bits: Option<u8>, warnings: &mut Vec<String>) {
    let Some(bits) = bits else { return };
    let metres = matches!(job.decoding.kind, DepthKind::Planar | DepthKind::Ray | DepthKind::Inverse);
    if metres && !job.unit_given {
        warnings.push(format!(
            "{}: its whole numbers are read as 0 to 1 m; say what they mean with --depth normalized or disparity, or with --depth-unit (65.535 for 16-bit millimetres)",
            path.display()
        ));
    }
    if bits <= 8 {
        warnings.push(format!(
            "{}: depth of {bits} bits is coarse, so the blur may change in steps",
            path.display()
        ));
    }
}

/// Depth in which nothing is there blurs all alike, as if it were infinitely far: seldom what is meant.
fn note_nothing(depth: &NamedPlane, path: &Path, decoding: DepthDecoding, warnings: &mut Vec<String>) {
    // Where a ray runs matters for the far clip alone, and then little: every pixel is taken for the middle one.
    let there = |&value: &f32| decoding.to_metres(value, || [0.0, 0.0]).is_finite();
    if !depth.plane.data().iter().any(there) {
        warnings.push(format!(
            "{}: nothing but \"nothing there\" in its depth ({}), so all of the picture counts as infinitely far; check --depth and --depth-channel",
            path.display(),
            depth.name
        ));
    }
}

fn note_reading(loaded: &Loaded, warnings: &mut Vec<String>) {
    warnings.extend(loaded.notes().map(|note| format!("{}: {note}", loaded.path.display())));
}

/// The camera, and what its file says of it; no camera where circles of confusion are given.
fn resolve(
    job: &Job,
    found: &FoundCamera,
    (name, number): (&str, Option<i64>),
    frame: &Frame,
) -> Result<(Option<Resolved>, FileCamera)> {
    if job.selection.coc_channel.is_some() {
        return Ok((None, FileCamera::default()));
    }
    let lens = shot::lens_at(&job.lens, &job.keys, number);
    let mut from_file = file_camera(found, frame);
    from_file.fill(&job.fallback, &lens);
    let mut resolved = camera::resolve(&lens, &from_file, name)?;
    shot::name_keyed(&mut resolved.values, &job.keys, number);
    Ok((Some(resolved), from_file))
}

fn fill(found: &mut FoundCamera, other: &FoundCamera) {
    let fill = |slot: &mut Option<Found>, from: &Option<Found>| {
        if slot.is_none() {
            slot.clone_from(from);
        }
    };
    fill(&mut found.focal_length_mm, &other.focal_length_mm);
    fill(&mut found.f_stop, &other.f_stop);
    fill(&mut found.focus_distance_m, &other.focus_distance_m);
    fill(&mut found.sensor_width_mm, &other.sensor_width_mm);
    fill(&mut found.fov_x_degrees, &other.fov_x_degrees);
}
