//! Reading beside the window: files are opened and frames are read by a thread of their own, and kept while there is room.

use crate::clip::{Clip, Plate};
use crate::locked::lock;
use crate::opening;
use eframe::egui;
use pullfocus_core::Cancel;
use pullfocus_job::config::Options;
use pullfocus_job::failure::Failure;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Bytes of frames that are kept, where nobody says another number.
pub const ROOM: usize = 2 << 30;

/// Frames that are tried when a sequence is opened.
const MOST_TRIES: usize = 8;

/// What is to be opened.
#[derive(Debug, Clone)]
pub struct Request {
    /// A picture, a folder, a pattern or a shot; where there is none the options say all.
    pub path: Option<PathBuf>,
    /// Options that win over a shot's, and once it is open all of them.
    pub options: Options,
    /// The frame to look at.
    pub frame: i64,
    /// Take B, where it is another than take A.
    pub other: Option<Options>,
    /// What becomes of what is open.
    pub how: How,
}

/// What becomes of what is open when something else is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum How {
    /// It goes.
    Anew,
    /// Nothing was; the last session comes back.
    Back,
    /// It stays, with all that is made meanwhile: the picture is held over other frames.
    Held,
}

/// What there is.
#[derive(Debug, Default)]
pub struct Shelf {
    /// What is open.
    pub clip: Option<Arc<Clip>>,
    /// How it was opened; taken by whoever shows it first.
    pub opened: Option<Request>,
    /// Frames in memory, the last used last.
    plates: Vec<(usize, Arc<Plate>)>,
    /// Frames that cannot be read, and why.
    pub faults: HashMap<usize, String>,
    /// What could not be opened, in one sentence.
    pub fault: Option<String>,
    /// What is being read.
    pub reading: Option<String>,
}

impl Shelf {
    /// A frame, if it is there.
    pub fn plate(&self, index: usize) -> Option<Arc<Plate>> {
        self.plates.iter().find(|(known, _)| *known == index).map(|(_, plate)| Arc::clone(plate))
    }

    /// A frame that is there, whichever.
    pub fn any(&self) -> Option<(usize, Arc<Plate>)> {
        self.plates.first().cloned()
    }

    /// Whether a frame is there.
    pub fn has(&self, index: usize) -> bool {
        self.plates.iter().any(|(known, _)| *known == index)
    }

    /// Keeps a frame; where there is not room for all, those go that are not wanted, the oldest first.
    fn keep(&mut self, index: usize, plate: Arc<Plate>, wanted: &[usize], room: usize) {
        self.plates.retain(|(known, _)| *known != index);
        self.plates.push((index, plate));
        let bytes =
            |plates: &[(usize, Arc<Plate>)]| plates.iter().map(|(_, plate)| plate.bytes()).sum::<usize>();
        while self.plates.len() > 1 && bytes(&self.plates) > room {
            let oldest = self.plates.iter().position(|(known, _)| !wanted.contains(known) && *known != index);
            let Some(oldest) = oldest else { break };
            self.plates.remove(oldest);
        }
    }

    /// How many frames there is room for; one at least.
    fn fits(&self, room: usize) -> usize {
        let largest = self.plates.iter().map(|(_, plate)| plate.bytes()).max().unwrap_or(0);
        room.checked_div(largest).unwrap_or(usize::MAX).max(1)
    }
}

#[derive(Default)]
struct Inbox {
    open: Option<Request>,
    /// Frames to have, the most urgent first.
    wanted: Vec<usize>,
    /// Those that were wanted when the user stopped the reading: not again until others are.
    stopped: Option<Vec<usize>>,
    quit: bool,
}

struct Shared {
    inbox: Mutex<Inbox>,
    wake: Condvar,
    shelf: Mutex<Shelf>,
    cancel: Mutex<Cancel>,
    room: usize,
    ctx: egui::Context,
}

/// The thread that reads.
pub struct Loader {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Loader {
    /// Starts the thread; frames of `room` bytes are kept.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(ctx: &egui::Context, room: usize) -> std::io::Result<Self> {
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            wake: Condvar::new(),
            shelf: Mutex::default(),
            cancel: Mutex::default(),
            room,
            ctx: ctx.clone(),
        });
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("read".into()).spawn(move || run(&theirs))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Opens files in the place of what is open. What is open stays until that has worked.
    pub fn open(&self, request: Request) {
        lock(&self.shared.cancel).cancel();
        let mut inbox = lock(&self.shared.inbox);
        inbox.open = Some(request);
        inbox.wanted.clear();
        inbox.stopped = None;
        lock(&self.shared.shelf).fault = None;
        self.shared.wake.notify_one();
    }

    /// Frames to have, the most urgent first; as many of them as there is room for.
    pub fn want(&self, mut frames: Vec<usize>) {
        let mut inbox = lock(&self.shared.inbox);
        frames.truncate(lock(&self.shared.shelf).fits(self.shared.room));
        if inbox.open.is_none() && inbox.wanted != frames && inbox.stopped.as_ref() != Some(&frames) {
            inbox.stopped = None;
            inbox.wanted = frames;
            self.shared.wake.notify_one();
        }
    }

    /// Reads a frame that could not be read once more: it may be whole by now.
    pub fn retry(&self, index: usize) {
        let _inbox = lock(&self.shared.inbox);
        if lock(&self.shared.shelf).faults.remove(&index).is_some() {
            self.shared.wake.notify_one();
        }
    }

    /// Stops what is being read.
    pub fn cancel(&self) {
        let mut inbox = lock(&self.shared.inbox);
        inbox.open = None;
        inbox.stopped = Some(std::mem::take(&mut inbox.wanted));
        lock(&self.shared.cancel).cancel();
    }

    /// What there is now.
    pub fn shelf(&self) -> MutexGuard<'_, Shelf> {
        lock(&self.shared.shelf)
    }

    /// Whether there is nothing left to do.
    pub fn is_idle(&self) -> bool {
        let inbox = lock(&self.shared.inbox);
        let shelf = lock(&self.shared.shelf);
        inbox.open.is_none()
            && shelf.reading.is_none()
            && inbox.wanted.iter().all(|&index| shelf.has(index) || shelf.faults.contains_key(&index))
    }
}

impl Drop for Loader {
    fn drop(&mut self) {
        lock(&self.shared.inbox).quit = true;
        lock(&self.shared.cancel).cancel();
        self.shared.wake.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

enum Task {
    Open(Box<Request>),
    Read(Arc<Clip>, usize),
}

fn next(inbox: &mut Inbox, shelf: &Shelf) -> Option<Task> {
    if let Some(request) = inbox.open.take() {
        return Some(Task::Open(Box::new(request)));
    }
    let clip = shelf.clip.as_ref()?;
    let missing = |index: &&usize| !shelf.has(**index) && !shelf.faults.contains_key(*index);
    inbox.wanted.iter().find(missing).map(|&index| Task::Read(Arc::clone(clip), index))
}

fn run(shared: &Shared) {
    loop {
        let (task, cancel) = {
            let mut inbox = lock(&shared.inbox);
            loop {
                if inbox.quit {
                    return;
                }
                let mut shelf = lock(&shared.shelf);
                if let Some(task) = next(&mut inbox, &shelf) {
                    shelf.reading = Some(match &task {
                        Task::Open(request) => name_of(request),
                        Task::Read(clip, index) => {
                            clip.files(*index).map_or_else(String::new, |files| files.name())
                        }
                    });
                    let cancel = Cancel::new();
                    *lock(&shared.cancel) = cancel.clone();
                    break (task, cancel);
                }
                shelf.reading = None;
                drop(shelf);
                shared.ctx.request_repaint();
                inbox = shared.wake.wait(inbox).unwrap_or_else(PoisonError::into_inner);
            }
        };
        shared.ctx.request_repaint();
        match task {
            Task::Open(request) => open(shared, *request, &cancel),
            Task::Read(clip, index) => {
                let read = clip.read(index, &cancel);
                let wanted = lock(&shared.inbox).wanted.clone();
                let mut shelf = lock(&shared.shelf);
                // Something else may have been opened meanwhile.
                if shelf.clip.as_ref().is_some_and(|now| Arc::ptr_eq(now, &clip)) {
                    match read {
                        Ok(plate) => shelf.keep(index, Arc::new(plate), &wanted, shared.room),
                        Err(failure) if failure.is_cancelled() => {}
                        Err(failure) => {
                            shelf.faults.insert(index, failure.to_string());
                        }
                    }
                }
            }
        }
        lock(&shared.shelf).reading = None;
        shared.ctx.request_repaint();
    }
}

/// A clip's frame that is looked at first, or one that can be read where that cannot; and those that cannot be.
fn first(
    clip: &Clip,
    frame: i64,
    cancel: &Cancel,
) -> Result<(usize, Plate, HashMap<usize, String>), Failure> {
    let mut faults = HashMap::new();
    let mut told = None;
    let wanted = clip.source(clip.nearest(frame as f64));
    let others = (0..clip.len()).filter(|&index| index != wanted && clip.source(index) == index);
    // What is wrong with so many is wrong with all.
    for index in std::iter::once(wanted).chain(others).take(MOST_TRIES) {
        match clip.read(index, cancel) {
            Ok(plate) => return Ok((index, plate, faults)),
            Err(failure) if failure.is_cancelled() => return Err(failure),
            Err(failure) => {
                faults.insert(index, failure.to_string());
                told.get_or_insert(failure);
            }
        }
    }
    Err(told.unwrap_or_else(|| Failure::failed("there is no frame to be read")))
}

/// Opens a clip with a frame of it; only where both work does it take the place of what was open.
fn open(shared: &Shared, request: Request, cancel: &Cancel) {
    let Request { path, options, frame, .. } = &request;
    let opened = (|| {
        let options = match path {
            Some(path) => opening::options(path, options)?,
            None => options.clone(),
        };
        let clip = Clip::open(&options)?;
        let found = first(&clip, *frame, cancel)?;
        Ok::<_, Failure>((options, clip, found))
    })();
    let mut shelf = lock(&shared.shelf);
    match opened {
        Ok((options, clip, (index, plate, faults))) => {
            let opened = Some(Request { options, ..request });
            *shelf = Shelf { clip: Some(Arc::new(clip)), opened, faults, ..Shelf::default() };
            shelf.keep(index, Arc::new(plate), &[], shared.room);
        }
        Err(failure) if failure.is_cancelled() => {}
        Err(failure) => shelf.fault = Some(failure.to_string()),
    }
}

fn name_of(request: &Request) -> String {
    let files = &request.options.files;
    let inputs = files.input.iter().flatten();
    let named = request.path.iter().chain(inputs).chain(&files.behind).next();
    named.map_or_else(String::new, |path| path.display().to_string())
}
