//! What is open: the frames that options name, and one of them in memory as a [`Plate`].

use crate::histogram::Histogram;
use crate::locked::lock;
use crate::proxy;
use pullfocus_core::{Cancel, Distance, Picture, Plane, Scene, Size};
use pullfocus_job::camera::{self, ASSUMED, FileCamera};
use pullfocus_job::config::Options;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::frames::FrameFiles;
use pullfocus_job::job::Job;
use pullfocus_job::load;
use pullfocus_job::options::Lens;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::shot;
use pullfocus_job::values::Number;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Frames that can be looked at.
#[derive(Debug)]
pub struct Clip {
    job: Job,
    /// Whether every frame has a number of its own.
    is_numbered: bool,
    /// For each frame the first one with the same files.
    sources: Vec<usize>,
    /// What it goes by in the window's title.
    pub name: String,
}

impl Clip {
    /// The frames that the options name. Nothing is read yet but names.
    ///
    /// # Errors
    /// [`Failure`]: options that do not go together, files that are not there.
    pub fn open(options: &Options) -> Result<Self> {
        // How the picture is blurred is not what is opened: a lens that is wrong now can be set right in the window.
        let given = &options.lens;
        let options = Options { lens: Default::default(), keys: Default::default(), ..options.clone() };
        let mut job = Job::new(&options, Purpose::View)?;
        job.fallback = FileCamera::assumed();
        // Distances along rays need the picture's angle, whatever the focus.
        let angle = Lens {
            fov_x: given.fov_x,
            focal_length: given.focal_length,
            sensor_width: given.sensor_width,
            focus_distance: Some(Number(f64::INFINITY)),
            ..Lens::default()
        };
        if camera::check(&angle).is_ok() {
            job.lens = angle;
        }
        // In the order of their numbers, where they have any.
        if job.frames.iter().all(|files| files.number.is_some()) {
            job.frames.sort_by_key(|files| files.number);
        }
        let is_numbered = job.frames.windows(2).all(|pair| match (pair[0].number, pair[1].number) {
            (Some(before), Some(after)) => before < after,
            _ => false,
        });
        let named =
            options.files.input.as_ref().and_then(|inputs| inputs.first()).or(options.files.behind.as_ref());
        let name = named.map_or_else(String::new, |path| file_name(path));
        let mut first = HashMap::new();
        let sources = job.frames.iter().enumerate().map(|(index, files)| {
            *first.entry(FrameFiles { number: None, ..files.clone() }).or_insert(index)
        });
        let sources = sources.collect();
        Ok(Self { job, is_numbered, sources, name })
    }

    /// How many frames there are; at least one.
    pub fn len(&self) -> usize {
        self.job.frames.len()
    }

    /// Whether there is none, which cannot be.
    pub fn is_empty(&self) -> bool {
        self.job.frames.is_empty()
    }

    /// The files of a frame.
    pub fn files(&self, index: usize) -> Option<&FrameFiles> {
        self.job.frames.get(index)
    }

    /// All files that are read.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.job.frames.iter().flat_map(FrameFiles::read).cloned().collect()
    }

    /// The number of a frame, which rises from frame to frame: its own, or its place from 1 where frames have no numbers or share
    /// them.
    pub fn number(&self, index: usize) -> i64 {
        let own = self.files(index).and_then(|files| files.number);
        own.filter(|_| self.is_numbered || self.len() == 1).unwrap_or(index as i64 + 1)
    }

    /// Whether keys can be set at frames, so that the shot renders to what was seen.
    ///
    /// # Errors
    /// One sentence: frames without numbers of their own, or that share them.
    pub fn may_key(&self) -> std::result::Result<(), String> {
        if self.is_numbered || self.is_still() {
            return Ok(());
        }
        Err("keys stand at frames, and these files have no numbers or share them: open a sequence (shot.####.exr)".into())
    }

    /// Whether these keys are at frames that a run finds.
    ///
    /// # Errors
    /// One sentence, as [`Clip::may_key`]'s or `render`'s own.
    pub fn check_keys(&self, options: &Options) -> std::result::Result<(), String> {
        if !options.keys.is_empty() {
            self.may_key()?;
        }
        shot::check(&options.keys, &options.lens, &self.job.frames).map_err(|failure| failure.to_string())
    }

    /// The frame whose number is nearest.
    pub fn nearest(&self, number: f64) -> usize {
        let distance = |index: &usize| (self.number(*index) as f64 - number).abs();
        (0..self.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// The first frame with the same files: a held still is read once.
    pub fn source(&self, index: usize) -> usize {
        self.sources.get(index).copied().unwrap_or(index)
    }

    /// Whether it is one picture, which can be held.
    pub fn is_still(&self) -> bool {
        self.len() == 1
    }

    /// Whether it is one picture over several frames.
    pub fn is_held(&self) -> bool {
        self.len() > 1 && self.sources.iter().all(|&source| source == 0)
    }

    /// Reads a frame.
    ///
    /// # Errors
    /// [`Failure`] in one sentence.
    pub fn read(&self, index: usize, cancel: &Cancel) -> Result<Plate> {
        let files = self.files(index).ok_or_else(|| Failure::failed(format!("there is no frame {index}")))?;
        let loaded = load::load(&self.job, files, cancel)?;
        let mut warnings = self.job.warnings.clone();
        warnings.extend(loaded.warnings);
        let half_width = loaded.camera.as_ref().map(|resolved| resolved.camera.half_width_tangent());
        Plate::new(files, (loaded.scene, half_width), (loaded.found, loaded.distance), warnings)
    }
}

/// The last part of a path.
pub fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// How far away a frame's pixels are through a lens.
#[derive(Debug)]
pub struct Distances {
    /// Tangent of half the lens's horizontal angle; none where no lens was resolved.
    half_width: Option<f64>,
    /// Planar depth in metres, infinity where nothing is; or circles of confusion, where these were given. The
    /// foreground's where that covers the picture.
    pub plane: Plane,
    /// How much of the picture is how far away.
    pub histogram: Histogram,
}

impl Distances {
    fn new(scene: &Scene, half_width: Option<f64>) -> pullfocus_core::Result<Self> {
        let mut plane = metres(scene, &scene.base.distance, half_width)?;
        if let Some(near) = &scene.foreground {
            let over = metres(scene, &near.distance, half_width)?;
            if let Some(alpha) = &near.picture.alpha {
                let covers = alpha.data().iter().zip(over.data());
                for (depth, (&alpha, &over)) in plane.data_mut().iter_mut().zip(covers) {
                    if alpha >= 0.5 {
                        *depth = over;
                    }
                }
            }
        }
        let has_coc = matches!(scene.base.distance, Distance::Coc(_));
        let histogram = if has_coc { Histogram::default() } else { Histogram::of(&plane) };
        Ok(Self { half_width, plane, histogram })
    }
}

/// A frame in memory.
#[derive(Debug)]
pub struct Plate {
    /// Its number in the sequence, where it has one.
    pub number: Option<i64>,
    /// The file that it goes by.
    pub path: PathBuf,
    /// Colour and depth, in perfect focus.
    pub scene: Scene,
    /// What the file says about the camera.
    pub found: FileCamera,
    /// What its distance was read from.
    pub distance: String,
    /// Whether [`Plate::distances`] are circles of confusion.
    pub has_coc: bool,
    /// The largest circle of confusion in pixels, where these were given; at least 1.
    pub largest_coc: f32,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Through the lens that was looked through last.
    distances: Mutex<Arc<Distances>>,
    proxies: Mutex<Vec<(usize, Arc<Scene>)>>,
}

impl Plate {
    fn new(
        files: &FrameFiles,
        (scene, half_width): (Scene, Option<f64>),
        (found, distance): (FileCamera, String),
        warnings: Vec<String>,
    ) -> Result<Self> {
        let distances = Distances::new(&scene, half_width)?;
        let mut found = found;
        let has_coc = matches!(scene.base.distance, Distance::Coc(_));
        let finite = distances.plane.data().iter().map(|c| c.abs()).filter(|c| has_coc && c.is_finite());
        let largest_coc = finite.fold(1.0, f32::max);
        if let Some(focus) = found.focus_distance.as_mut().filter(|focus| focus.from == ASSUMED) {
            // What is in the middle of the picture is what it is about, more often than not.
            let size = distances.plane.size();
            let middle = distances.plane.at(size.width / 2, size.height / 2);
            let there = Some(f64::from(middle)).filter(|middle| middle.is_finite() && *middle > 0.1);
            focus.value = there
                .or(distances.histogram.distance(0.5))
                .filter(|focus| *focus > 0.1)
                .unwrap_or(focus.value);
        }
        Ok(Self {
            number: files.number,
            path: PathBuf::from(files.name()),
            scene,
            found,
            distance,
            has_coc,
            largest_coc,
            warnings,
            distances: Mutex::new(Arc::new(distances)),
            proxies: Mutex::default(),
        })
    }

    /// Width and height in pixels.
    pub fn size(&self) -> Size {
        self.scene.frame.data.size
    }

    /// How far away its pixels are, through the lens that was looked through last.
    pub fn distances(&self) -> Arc<Distances> {
        Arc::clone(&lock(&self.distances))
    }

    /// Looks through a lens, the tangent of half whose angle this is; whether distances changed. They do where they are along rays
    /// and this is another angle, and that takes a while.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::OutOfMemory`].
    pub fn look_through(&self, half_width: f64) -> pullfocus_core::Result<bool> {
        let elements = std::iter::once(&self.scene.base).chain(&self.scene.foreground);
        let along_rays = |distance: &Distance| match distance {
            Distance::Depth { decoding, .. } => decoding.needs_field_of_view(),
            Distance::Coc(_) => false,
        };
        let mut distances = elements.map(|element| &element.distance);
        if self.distances().half_width == Some(half_width) || !distances.any(along_rays) {
            return Ok(false);
        }
        let through = Arc::new(Distances::new(&self.scene, Some(half_width))?);
        *lock(&self.distances) = through;
        Ok(true)
    }

    /// Whether there is such a pixel.
    pub fn has_pixel(&self, [x, y]: [usize; 2]) -> bool {
        x < self.size().width && y < self.size().height
    }

    /// What other programs call a pixel: column and row in the file's own windows.
    pub fn coordinates(&self, [x, y]: [usize; 2]) -> [i64; 2] {
        let data = self.scene.frame.data;
        [i64::from(data.x) + x as i64, i64::from(data.y) + y as i64]
    }

    /// The picture as it was rendered: what is near over the rest.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::OutOfMemory`].
    pub fn in_focus(&self) -> pullfocus_core::Result<Cow<'_, Picture>> {
        let base = &self.scene.base.picture;
        let Some(near) = &self.scene.foreground else { return Ok(Cow::Borrowed(base)) };
        let Some(alpha) = &near.picture.alpha else { return Ok(Cow::Borrowed(&near.picture)) };
        let mut picture = base.clone();
        for (under, over) in picture.colors.iter_mut().zip(&near.picture.colors) {
            let covers = over.data().iter().zip(alpha.data());
            for (under, (over, alpha)) in under.data_mut().iter_mut().zip(covers) {
                *under = over + (1.0 - alpha) * *under;
            }
        }
        Ok(Cow::Owned(picture))
    }

    /// The first three colours of [`Plate::in_focus`] at a pixel of the picture.
    pub fn colors_at(&self, x: usize, y: usize) -> Vec<f32> {
        let base = &self.scene.base.picture;
        let near = self.scene.foreground.as_ref().map(|near| &near.picture);
        let alpha = near.map_or(0.0, |near| near.alpha.as_ref().map_or(1.0, |alpha| alpha.at(x, y)));
        let over = |i: usize| near.and_then(|near| near.colors.get(i)).map_or(0.0, |plane| plane.at(x, y));
        let under = base.colors.iter().take(3).enumerate();
        under.map(|(i, plane)| over(i) + (1.0 - alpha) * plane.at(x, y)).collect()
    }

    /// Bytes of memory, proxies left out.
    pub fn bytes(&self) -> usize {
        let elements = std::iter::once(&self.scene.base).chain(&self.scene.foreground);
        let planes: usize = elements.map(|element| element.picture.planes().count() + 1).sum();
        (planes + 1) * self.size().area() * size_of::<f32>()
    }

    /// The picture reduced to one pixel in `n` along each axis; kept for the next call.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::OutOfMemory`].
    pub fn proxy(&self, n: usize) -> pullfocus_core::Result<Arc<Scene>> {
        let mut proxies = lock(&self.proxies);
        if let Some((_, scene)) = proxies.iter().find(|(known, _)| *known == n) {
            return Ok(Arc::clone(scene));
        }
        let scene = Arc::new(proxy::reduced(&self.scene, n)?);
        // The four last asked for: together less than a third of the picture.
        if proxies.len() >= 4 {
            proxies.remove(0);
        }
        proxies.push((n, Arc::clone(&scene)));
        Ok(scene)
    }

    /// Planar depth in metres at a pixel; none outside, where nothing is, and where circles of confusion were given.
    pub fn depth_at(&self, x: usize, y: usize) -> Option<f64> {
        let size = self.size();
        if self.has_coc || x >= size.width || y >= size.height {
            return None;
        }
        Some(f64::from(self.distances().plane.at(x, y))).filter(|depth| depth.is_finite())
    }

    /// The depth to focus on where a user points: of the pixels around, the one nearest to the middle of them in depth, so
    /// that an anti-aliased edge or a hole of one pixel is not focused on.
    pub fn depth_to_focus(&self, x: usize, y: usize) -> Option<f64> {
        let around = (-1i64..=1).flat_map(|dy| (-1i64..=1).map(move |dx| (dx, dy)));
        let mut depths: Vec<f64> = around
            .filter_map(|(dx, dy)| {
                let at = |at: usize, by: i64| usize::try_from(at as i64 + by).ok();
                self.depth_at(at(x, dx)?, at(y, dy)?)
            })
            .collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied()
    }
}

/// Distance as planar metres; circles of confusion as they are.
fn metres(scene: &Scene, distance: &Distance, half_width: Option<f64>) -> pullfocus_core::Result<Plane> {
    let Distance::Depth { plane, decoding } = distance else { return copy(distance.plane()) };
    // Along a ray means nothing without an angle; a lens is always resolved where depth is.
    let half_width = half_width.unwrap_or(0.5);
    let mut out = Plane::filled(plane.size(), 0.0)?;
    let (width, frame) = (plane.size().width.max(1), &scene.frame);
    // Across, tangents grow evenly.
    let across = |x| frame.ray_tangents(half_width, x, 0)[0];
    let (first, step) = (across(0), across(1) - across(0));
    out.data_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        let up = frame.ray_tangents(half_width, 0, y)[1];
        for (x, (out, &value)) in row.iter_mut().zip(plane.row(y)).enumerate() {
            *out = decoding.to_metres(value, || [first + step * x as f64, up]) as f32;
        }
    });
    Ok(out)
}

fn copy(plane: &Plane) -> pullfocus_core::Result<Plane> {
    let mut out = Plane::filled(plane.size(), 0.0)?;
    out.data_mut().copy_from_slice(plane.data());
    Ok(out)
}
