//! Writing a shot to files, beside the window.

use crate::clip::Clip;
use crate::color::Table;
use crate::document::Document;
use crate::framing::looked_at;
use crate::locked::lock;
use crate::screen::Transform;
use eframe::egui;
use pullfocus::{Device, Renderer};
use pullfocus_core::{Cancel, Frame, Picture, Show};
use pullfocus_io::output::{Existing, check_target};
use pullfocus_io::sequence::Pattern;
use pullfocus_job::draw::Canvas;
use pullfocus_job::failure::{Failure, Result};
use pullfocus_job::job::Job;
use pullfocus_job::purpose::Purpose;
use pullfocus_job::track::{self, Writing};
use pullfocus_job::values::{Label, Largest};
use pullfocus_job::{load, storage};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use tempfile::TempPath;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum What {
    /// The shot at full quality, as `pullfocus render` writes it.
    #[default]
    Shot,
    /// The result, as pictures: with exposure and display transform, as the screen shows it.
    Pictures,
    /// The result, as a movie, likewise.
    Movie,
    /// The lens at each frame, for other programs.
    Camera,
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
    /// Circle of confusion in pixels up to which something counts as in focus.
    pub sharp_px: f64,
    /// The take that is seen.
    pub side: usize,
    /// The layer that is seen alone; else what the shot shows.
    pub show: Option<Show>,
    /// The program that makes movies: [`ENCODER`], or one that takes the same arguments.
    pub encoder: PathBuf,
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
    thread: Option<JoinHandle<()>>,
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
        let thread = std::thread::Builder::new().name("export".into()).spawn(move || {
            let tell = |done, of| {
                let mut progress = lock(&theirs);
                (progress.done, progress.of) = (done, of);
                drop(progress);
                ctx.request_repaint();
            };
            let end = match order.what {
                What::Shot => shot(&document, &order, &stop, &tell),
                What::Pictures => pictures(&clip, &document, &order, &stop, &tell),
                What::Movie => movie(&clip, &document, &order, &stop, &tell),
                What::Camera => camera(&clip, &document, &order, &stop, &tell),
            };
            let mut progress = lock(&theirs);
            progress.end = Some(match end {
                Ok(()) => Ok(format!("Wrote {}.", order.output.display())),
                Err(_) if stop.is_cancelled() && matches!(order.what, What::Movie | What::Camera) => {
                    Err("Stopped: nothing is written.".into())
                }
                Err(_) if stop.is_cancelled() => Err(format!(
                    "Stopped: {} of {} frames are written, none by half.",
                    progress.done, progress.of
                )),
                Err(failure) => Err(failure.to_string()),
            });
            drop(progress);
            ctx.request_repaint();
        })?;
        Ok(Self { progress, cancel, thread: Some(thread) })
    }

    /// How far it is.
    pub fn progress(&self) -> Progress {
        lock(&self.progress).clone()
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
        // A window that is closed ends what it began, and waits until it has: files are whole or not there.
        self.cancel.cancel();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
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

/// Renders every frame as it is seen, and hands it over with its number in the clip and the aspect of its pixels.
fn frames(
    clip: &Clip,
    document: &Document,
    order: &Order,
    cancel: &Cancel,
    mut take: impl FnMut(usize, Canvas, f32) -> Result<()>,
) -> Result<()> {
    let device = document.shot().blur.device.clone().map_or(Device::Auto, |device| device.0);
    let mut renderer = Renderer::open(&device)?;
    for index in 0..clip.len() {
        cancel.check()?;
        let plate = clip.read(index, cancel)?;
        let mut wanted = document.take(order.side, &plate, clip.number(index)).map_err(Failure::failed)?;
        wanted.settings.show = order.show.unwrap_or(wanted.settings.show);
        let mut scene = plate.scene;
        renderer.render(&mut scene, wanted.camera.as_ref(), &wanted.settings, cancel)?;
        take(index, seen(&scene.base.picture, &scene.frame, order), scene.frame.vertical_scale())?;
    }
    Ok(())
}

/// A picture as the screen shows it: the display window, so that frames of other data windows register; black where no pixels are.
fn seen(picture: &Picture, frame: &Frame, order: &Order) -> Canvas {
    let (window, size) = (looked_at(frame), picture.size());
    let inside = |at: usize, window: i32, data: i32, length: usize| {
        let at = usize::try_from(i64::from(window) - i64::from(data) + at as i64).ok();
        at.filter(|&at| at < length)
    };
    let last = picture.colors.len().saturating_sub(1);
    let planes = [0, 1, 2].map(|i| picture.colors.get(if last < 2 { 0 } else { i }));
    Canvas::from_fn(window.size, |i| {
        let (x, y) = (i % window.size.width, i / window.size.width);
        let x = inside(x, window.x, frame.data.x, size.width);
        let y = inside(y, window.y, frame.data.y, size.height);
        let (Some(x), Some(y)) = (x, y) else { return [0; 3] };
        let linear = planes.map(|plane| plane.map_or(0.0, |plane| plane.at(x, y)));
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
    let file = |index| {
        pattern.as_ref().map_or_else(|| order.output.clone(), |pattern| pattern.file(clip.number(index)))
    };
    for index in 0..clip.len() {
        check_target(&file(index), clip.files(index).iter().flat_map(|files| files.read()), existing(order))?;
    }
    tell(0, clip.len());
    frames(clip, document, order, cancel, |index, canvas, _| {
        let output = file(index);
        storage::save_canvas(&canvas, &output, existing(order))?;
        tell(index + 1, clip.len());
        Ok(())
    })
}

/// The program that makes movies, where it is installed.
pub const ENCODER: &str = "ffmpeg";

fn movie(clip: &Clip, document: &Document, order: &Order, cancel: &Cancel, tell: Tell<'_>) -> Result<()> {
    let output = &order.output;
    let known =
        |ending: &&&str| output.extension().is_some_and(|theirs| theirs.eq_ignore_ascii_case(**ending));
    let Some(ending) = MOVIES.iter().find(known) else {
        return Err(Failure::usage(format!(
            "{}: a movie's name ends with .{}",
            output.display(),
            MOVIES.join(" or .")
        )));
    };
    check_target(output, clip.paths(), existing(order))?;
    tell(0, clip.len());
    // In a folder of its own until it is whole; that goes away with what is in it, whatever happens.
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = tempfile::Builder::new().prefix(".pullfocus-movie-").tempdir_in(folder)?;
    let half = folder.path().join(format!("movie.{ending}"));
    let mut encoder: Option<Encoder> = None;
    let mut size = None;
    frames(clip, document, order, cancel, |index, canvas, aspect| {
        let encoder = match &mut encoder {
            Some(encoder) => encoder,
            none => none.insert(Encoder::start(order, &half, (&canvas, aspect))?),
        };
        if (canvas.width, canvas.height) != *size.get_or_insert((canvas.width, canvas.height)) {
            return Err(Failure::failed(format!(
                "frame {} is of another size than the first; a movie has one size: write a picture sequence",
                clip.number(index)
            )));
        }
        encoder.take(&canvas)?;
        tell(index + 1, clip.len());
        Ok(())
    })?;
    cancel.check()?;
    if let Some(encoder) = encoder {
        encoder.finish()?;
    }
    let whole = TempPath::try_from_path(half)?;
    let renamed = if order.overwrite { whole.persist(output) } else { whole.persist_noclobber(output) };
    renamed.map_err(|error| Failure::failed(format!("{}: {}", output.display(), error.error)))
}

/// Endings of movies that everybody's player knows.
const MOVIES: [&str; 3] = ["mp4", "mov", "mkv"];

/// A run of the encoder. Dropped before it is finished, it is stopped.
struct Encoder {
    name: String,
    /// Where its messages are.
    said: PathBuf,
    child: Child,
}

impl Encoder {
    fn start(order: &Order, output: &Path, (canvas, aspect): (&Canvas, f32)) -> Result<Self> {
        let name = order.encoder.display().to_string();
        // A file, not a pipe: what nobody reads in time would stop it.
        let said = output.with_extension("txt");
        let fps = order.fps.to_string();
        let size = format!("{}x{}", canvas.width, canvas.height);
        // Most players want even sides, and take colours for BT.709's. Pixels that are not square stay as they are, and are told.
        let filters = format!(
            "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,setsar={aspect}:max=1000"
        );
        let child = Command::new(&order.encoder)
            .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", &size, "-r", &fps])
            .args(["-i", "-", "-vf", &filters, "-pix_fmt", "yuv420p"])
            .args(["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709"])
            .args(["-color_range", "tv"])
            .arg(output)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(File::create(&said)?)
            .spawn()
            .map_err(|error| {
                Failure::failed(format!(
                    "movies are made by the program {name}, which cannot be started ({error}); install it, or write a picture sequence"
                ))
            })?;
        Ok(Self { name, said, child })
    }

    fn take(&mut self, canvas: &Canvas) -> Result<()> {
        let sent = match &mut self.child.stdin {
            Some(pipe) => pipe.write_all(&canvas.data),
            None => Err(std::io::ErrorKind::BrokenPipe.into()),
        };
        // It has ended; what it said is of more use than that.
        sent.or_else(|error| Err(self.end()?.err().unwrap_or_else(|| error.into())))
    }

    fn finish(mut self) -> Result<()> {
        self.end()?
    }

    /// Waits for its end: what it made of the pictures.
    fn end(&mut self) -> Result<Result<()>> {
        drop(self.child.stdin.take());
        if self.child.wait()?.success() {
            return Ok(Ok(()));
        }
        let mut bytes = Vec::new();
        File::open(&self.said)?.take(1 << 16).read_to_end(&mut bytes)?;
        // It may speak any language.
        let said = String::from_utf8_lossy(&bytes);
        let last = said.lines().last().unwrap_or("it does not say why");
        Ok(Err(Failure::failed(format!("{} could not make the movie: {last}", self.name))))
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        // It may have ended long ago.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn camera(clip: &Clip, document: &Document, order: &Order, cancel: &Cancel, tell: Tell<'_>) -> Result<()> {
    let mut options = document.shot().clone();
    let numbers: Vec<String> = (0..clip.len()).map(|index| clip.number(index).to_string()).collect();
    options.files.frames = Some(Label(numbers.join(",")));
    tell(0, clip.len());
    let writing = Writing {
        output: &order.output,
        fps: order.fps,
        sharp: Largest::Pixels(order.sharp_px),
        existing: existing(order),
        name: &clip.name,
    };
    let note = |note| tracing::warn!("{note}; what it says of the camera is not used");
    track::save(&options, &clip.paths(), writing, cancel, note)?;
    tell(clip.len(), clip.len());
    Ok(())
}
