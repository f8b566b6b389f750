//! The frames of a run on their way: while one is computed, the next is read and the one before is written.
//!
//! Three threads hand frames to each other, and each waits until the next one takes what it has: at most three frames
//! are in memory, one in each place. Frames stay in order. What waits for files, and what a format does in one go,
//! happens on the threads of reading and writing; all that is done in parallel runs on the rayon pool.

use crate::report::{FrameReport, Outcome};
use pullfocus::Renderer;
use pullfocus_core::{Camera, Cancel, Frame, Picture, Plane, Scene};
use pullfocus_io::output::Need;
use pullfocus_job::failure::Result;
use pullfocus_job::frames::FrameFiles;
use pullfocus_job::job::Job;
use pullfocus_job::load::{self, LoadedFrame};
use pullfocus_job::storage::Loaded;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// A frame that was computed and is not written yet.
#[derive(Debug)]
pub struct Made {
    /// The file whose channels the result replaces.
    pub target: Loaded,
    /// Where the pixels lie.
    pub frame: Frame,
    /// The picture: blurred, or for `coc` as it was.
    pub picture: Picture,
    /// The circle of confusion, for `coc`; else nothing.
    pub coc: Plane,
    /// What became of it so far.
    pub report: FrameReport,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Made {
    /// Takes a loaded frame apart: what there is to tell and to write into, what is computed with, and the camera.
    pub fn begin(files: &FrameFiles, loaded: LoadedFrame) -> (Self, Scene, Option<Camera>) {
        let LoadedFrame { scene, target, camera, found: _, distance, channels, warnings } = loaded;
        let mut report = FrameReport::new(files.inputs(), files.outputs());
        report.size = Some([scene.frame.data.size.width, scene.frame.data.size.height]);
        report.channels = channels;
        report.distance = Some(distance);
        let (camera, values) = camera.map(|resolved| (resolved.camera, resolved.values)).unzip();
        report.camera = values.unwrap_or_default();
        let picture = Picture::default();
        (Self { target, frame: scene.frame, picture, coc: Plane::default(), report, warnings }, scene, camera)
    }
}

/// What a command does to a frame between reading and writing.
pub type Compute = fn(&Job, &mut Renderer, &FrameFiles, LoadedFrame, &Cancel) -> Result<Made>;

/// What has come to its end, in the order of the frames.
#[derive(Debug)]
pub enum Arrival {
    /// The device is open; before the first frame.
    Device(String),
    /// The output was there, and `--resume` kept it.
    Kept(Box<FrameReport>),
    /// A frame to be written, and how long it took so far, without waiting for the others.
    Made(Box<Made>, Duration),
}

/// A frame as the reader hands it on: none where there is nothing to do.
type Read = Option<(Box<LoadedFrame>, Duration)>;

/// Runs a job's frames; `arrive` writes and tells on the calling thread. The device is opened while the first
/// frame is read.
///
/// # Errors
/// That of the first frame that has one, or of the device; the frames before it have arrived.
pub fn run(
    job: &Job,
    compute: Compute,
    cancel: &Cancel,
    arrive: &mut dyn FnMut(&FrameFiles, Arrival) -> Result<()>,
) -> Result<()> {
    let (to_computing, read) = sync_channel(0);
    let (to_writing, made) = sync_channel(0);
    thread::scope(|scope| {
        let start = |name: &str| thread::Builder::new().name(name.into());
        // Where a thread cannot be started, the other ends at once: nobody takes what it has.
        start("reading").spawn_scoped(scope, || read_all(job, cancel, to_computing))?;
        start("computing").spawn_scoped(scope, || compute_all(job, compute, cancel, read, to_writing))?;
        let result = made.into_iter().try_for_each(|item: Result<(usize, Arrival)>| {
            let (index, arrival) = item?;
            arrive(&job.frames[index], arrival)
        });
        if result.is_err() {
            // Nobody waits for what is still in work.
            cancel.cancel();
        }
        result
    })
}

fn read_all(job: &Job, cancel: &Cancel, to: SyncSender<Result<Read>>) {
    for files in &job.frames {
        let frame = read(job, files, cancel);
        let last = frame.is_err();
        if to.send(frame).is_err() || last {
            return;
        }
    }
}

fn read(job: &Job, files: &FrameFiles, cancel: &Cancel) -> Result<Read> {
    cancel.check()?;
    if files.need(job.existing)? == Need::Finished {
        return Ok(None);
    }
    let start = Instant::now();
    let frame = load::load(job, files, cancel)?;
    Ok(Some((Box::new(frame), start.elapsed())))
}

fn compute_all(
    job: &Job,
    compute: Compute,
    cancel: &Cancel,
    from: Receiver<Result<Read>>,
    to: SyncSender<Result<(usize, Arrival)>>,
) {
    let mut renderer = match Renderer::open(&job.device) {
        Ok(renderer) => renderer,
        Err(error) => {
            // If nobody listens any more, there is an earlier error.
            let _ = to.send(Err(error.into()));
            return;
        }
    };
    renderer.set_storage(job.storage);
    if to.send(Ok((0, Arrival::Device(renderer.device_text())))).is_err() {
        return;
    }
    for (index, read) in from.into_iter().enumerate() {
        let files = &job.frames[index];
        let arrival = read.and_then(|read| {
            let Some((frame, reading)) = read else {
                let report = FrameReport::new(files.inputs(), files.outputs());
                return Ok(Arrival::Kept(Box::new(FrameReport { outcome: Outcome::Skipped, ..report })));
            };
            let start = Instant::now();
            let on_gpu = renderer.is_gpu();
            let work = || compute(job, &mut renderer, files, *frame, cancel);
            // Who waits for a GPU should not hold a thread of the pool.
            let mut made = if on_gpu { work() } else { rayon::scope(|_| work()) }?;
            made.report.stages.insert(0, crate::report::StageReport::new("read", reading));
            Ok(Arrival::Made(Box::new(made), reading + start.elapsed()))
        });
        let last = arrival.is_err();
        if to.send(arrival.map(|arrival| (index, arrival))).is_err() || last {
            return;
        }
    }
}
