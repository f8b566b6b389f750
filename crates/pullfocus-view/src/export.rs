//! Writing a shot to files, beside the window.

use crate::clip::Clip;
use crate::color::Table;
use crate::document::Document;
use crate::screen::Transform;
use eframe::egui;
use pullfocus::{Device, Renderer};
use pullfocus_core::{Cancel, Picture};
use pullfocus_io::output::Existing;
use pullfocus_io::sequence::Pattern;
use pullfocus_job::draw::Canvas;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::job::Job;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::{load, storage};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum What {
    /// The shot at full quality, as `pullfocus render` writes it.
    #[default]
    Shot,
    /// What is seen, as pictures: with exposure and display transform.
    Pictures,
    /// What is seen, as a movie.
    Movie,
}

/// What is to be written.
#[derive(Debug, Clone)]
pub struct Order {
    /// What.
    pub what: What,
    /// Frames are written `name.####.exr`.
    pub output: PathBuf,
    /// Whether files that are there may be replaced.
    pub overwrite: bool,
    /// Of the screen.
    pub transform: Transform,
    /// Of the screen.
    pub table: Option<Arc<Table>>,
    /// Of the screen.
    pub gain: f32,
    /// Frames a second.
    pub fps: f64,
}

/// How far it is.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Frames written.
    pub done: usize,
    /// Of so many.
    pub of: usize,
    /// How it ended, in one sentence.
    pub end: Option<std::result::Result<String, String>>,
}

/// A run under way.
pub struct Export {
    progress: Arc<Mutex<Progress>>,
    cancel: Cancel,
}

impl Export {
    /// Begins.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(
        ctx: &egui::Context,
        clip: Arc<Clip>,
        document: Document,
        order: Order,
    ) -> std::io::Result<Self> {
        let progress = Arc::new(Mutex::new(Progress::default()));
        let cancel = Cancel::new();
        let (theirs, stop, ctx) = (Arc::clone(&progress), cancel.clone(), ctx.clone());
        std::thread::Builder::new().name("export".into()).spawn(move || {
            let tell = |done, of| {
                let mut progress = theirs.lock().unwrap_or_else(PoisonError::into_inner);
                (progress.done, progress.of) = (done, of);
                drop(progress);
                ctx.request_repaint();
            };
            let end = match order.what {
                What::Shot => shot(&document, &order, &stop, &tell),
                What::Pictures => pictures(&clip, &document, &order, &stop, &tell),
                What::Movie => movie(&clip, &document, &order, &stop, &tell),
            };
            let mut progress = theirs.lock().unwrap_or_else(PoisonError::into_inner);
            progress.end = Some(match end {
                Ok(()) => Ok(format!("Wrote {}.", order.output.display())),
                Err(_) if stop.is_cancelled() => Err(format!(
                    "Stopped: {} of {} frames are written, none by half.",
                    progress.done, progress.of
                )),
                Err(failure) => Err(failure.to_string()),
            });
            drop(progress);
            ctx.request_repaint();
        })?;
        Ok(Self { progress, cancel })
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether it is over.
    pub fn is_done(&self) -> bool {
        self.progress().end.is_some()
    }

    /// Asks it to stop.
    pub fn cancel(&self) {
        self.cancel.cancel();
    }
}

impl Drop for Export {
    fn drop(&mut self) {
        // A window that is closed ends what it began; files are whole or not there.
        self.cancel.cancel();
    }
}

type Tell<'a> = &'a dyn Fn(usize, usize);

fn existing(order: &Order) -> Existing {
    if order.overwrite { Existing::Replace } else { Existing::Refuse }
}

/// The same steps as `pullfocus render`, so the same pixels.
fn shot(document: &Document, order: &Order, cancel: &Cancel, tell: Tell<'_>) -> Result<()> {
    let mut options = document.shot().clone();
    options.files.output = Some(order.output.clone());
    options.files.overwrite = order.overwrite.then_some(true);
    options.files.resume = None;
    let job = Job::new(&options, Purpose::Render)?;
    let mut renderer = Renderer::open(&job.device)?;
    renderer.set_storage(job.storage);
    tell(0, job.frames.len());
    for files in &job.frames {
        files.need(job.existing)?;
    }
    for (index, files) in job.frames.iter().enumerate() {
        cancel.check()?;
        let mut loaded = load::load(&job, files, cancel)?;
        let camera = loaded.camera.as_ref().map(|resolved| resolved.camera);
        renderer.render(&mut loaded.scene, camera.as_ref(), &job.settings, cancel)?;
        let picture = &mut loaded.scene.base.picture;
        storage::save(&loaded.target, picture, &files.output, job.bits, job.existing)?;
        tell(index + 1, job.frames.len());
    }
    Ok(())
}

/// Renders every frame as it is seen.
fn frames(
    clip: &Clip,
    document: &Document,
    order: &Order,
    cancel: &Cancel,
    mut take: impl FnMut(usize, Canvas) -> Result<()>,
) -> Result<()> {
    let device = document.shot().blur.device.clone().map_or(Device::Auto, |device| device.0);
    let mut renderer = Renderer::open(&device)?;
    for index in 0..clip.len() {
        cancel.check()?;
        let plate = clip.read(index, cancel)?;
        let wanted = document.take(0, &plate, clip.number(index)).map_err(Failure::failed)?;
        let mut scene = plate.scene;
        renderer.render(&mut scene, wanted.camera.as_ref(), &wanted.settings, cancel)?;
        take(index, seen(&scene.base.picture, order))?;
    }
    Ok(())
}

/// A picture as the screen shows it.
fn seen(picture: &Picture, order: &Order) -> Canvas {
    let last = picture.colors.len().saturating_sub(1);
    let planes = [0, 1, 2].map(|i| picture.colors.get(if last < 2 { 0 } else { i }));
    Canvas::from_fn(picture.size(), |i| {
        let linear = planes.map(|plane| plane.map_or(0.0, |plane| plane.data()[i]));
        let colors = order.transform.colors(linear, order.gain, order.table.as_deref());
        colors.map(|color| (color * 255.0 + 0.5) as u8)
    })
}

fn pictures(clip: &Clip, document: &Document, order: &Order, cancel: &Cancel, tell: Tell<'_>) -> Result<()> {
    let pattern = Pattern::parse(&order.output)?;
    if clip.len() > 1 && pattern.is_none() {
        return Err(Failure::usage(format!(
            "{}: write a place for the frame number, like seen.####.png",
            order.output.display()
        )));
    }
    storage::check_preview(&order.output)?;
    tell(0, clip.len());
    frames(clip, document, order, cancel, |index, canvas| {
        let output =
            pattern.as_ref().map_or_else(|| order.output.clone(), |pattern| pattern.file(clip.number(index)));
        storage::save_canvas(&canvas, &output, existing(order))?;
        tell(index + 1, clip.len());
        Ok(())
    })
}

/// The program that makes movies, where it is installed.
const ENCODER: &str = "ffmpeg";

fn movie(clip: &Clip, document: &Document, order: &Order, cancel: &Cancel, tell: Tell<'_>) -> Result<()> {
    if order.output.exists() && !order.overwrite {
        return Err(Failure::failed(format!(
            "{}: it is already there; allow to replace it, or choose another name",
            order.output.display()
        )));
    }
    tell(0, clip.len());
    // Under another name until it is whole; the ending says the format.
    let ending =
        order.output.extension().map_or("mp4".into(), |ending| ending.to_string_lossy().into_owned());
    let half = order.output.with_extension(format!("part.{ending}"));
    let result = (|| {
        let mut child: Option<Child> = None;
        frames(clip, document, order, cancel, |index, canvas| {
            let encoder = match &mut child {
                Some(child) => child,
                none => none.insert(encoder(&half, &canvas, order.fps)?),
            };
            let Some(pipe) = &mut encoder.stdin else {
                return Err(Failure::failed("the encoder takes no pictures"));
            };
            pipe.write_all(&canvas.data).map_err(|error| Failure::failed(format!("{ENCODER}: {error}")))?;
            tell(index + 1, clip.len());
            Ok(())
        })?;
        let Some(child) = child else { return Ok(()) };
        let output = child.wait_with_output()?;
        if output.status.success() {
            return Ok(());
        }
        let last = String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned();
        Err(Failure::failed(format!("{ENCODER} could not write {}: {last}", order.output.display())))
    })();
    match result {
        Ok(()) => std::fs::rename(&half, &order.output).map_err(Failure::from),
        Err(failure) => {
            // It may not be there yet.
            let _ = std::fs::remove_file(&half);
            Err(failure)
        }
    }
}

fn encoder(output: &Path, canvas: &Canvas, fps: f64) -> Result<Child> {
    let size = format!("{}x{}", canvas.width, canvas.height);
    Command::new(ENCODER)
        .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &size, "-r", &fps.to_string()])
        // Most players want even sides and this form of colour.
        .args(["-i", "-", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
        .arg(output)
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| {
            Failure::failed(format!(
                "movies are made by the program {ENCODER}, which cannot be started ({error}); install it, or write a picture sequence"
            ))
        })
}
