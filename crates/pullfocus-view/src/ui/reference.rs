//! What the picture is compared with: one picture, or a sequence whose frames go with those that are looked at.

use super::App;
use crate::engine::Reference;
use crate::look::View;
use pullfocus_core::Window;
use pullfocus_io::sequence::Pattern;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, TryRecvError};

/// References as far as they are read.
#[derive(Default)]
pub struct References {
    /// What there is.
    pub now: Option<Arc<Reference>>,
    coming: Option<Coming>,
    followed: Option<Followed>,
}

/// Where references come from, and what was asked for last.
struct Followed {
    /// A sequence; none for one picture, which lies elsewhere beside each data window.
    pattern: Option<Pattern>,
    file: PathBuf,
    data: Option<Window>,
}

/// A reference that is being read.
struct Coming {
    receiver: Receiver<Result<Reference, String>>,
    /// Where it comes from, if the user has opened it; else it is the next one from there.
    opened: Option<Followed>,
}

impl References {
    /// Whether one is being read.
    pub fn are_coming(&self) -> bool {
        self.coming.is_some()
    }

    /// Frames of another file have other references.
    pub fn stay_behind(&mut self) {
        (self.coming, self.followed) = (None, None);
    }
}

impl App {
    /// Opens a picture to compare with, or a sequence (`ref.####.exr`), whose frames go with those that are looked at.
    pub fn open_reference(&mut self, path: &Path) {
        let pattern = Pattern::parse(path).ok().flatten().filter(|_| !path.exists());
        let file =
            pattern.as_ref().map_or_else(|| path.to_owned(), |pattern| pattern.file(self.frame_number()));
        let data = self.plate.as_ref().map(|plate| plate.scene.frame.data);
        self.read_reference(&file.clone(), Some(Followed { pattern, file, data }));
    }

    /// Goes on to the reference of the frame in front.
    pub(super) fn follow_reference(&mut self) {
        let is_calm = !self.references.are_coming() && self.playing.is_none();
        let Some(data) = self.plate.as_ref().filter(|_| is_calm).map(|plate| plate.scene.frame.data) else {
            return;
        };
        let frame = self.plate_frame;
        let Some(followed) = &mut self.references.followed else { return };
        let file =
            followed.pattern.as_ref().map_or_else(|| followed.file.clone(), |pattern| pattern.file(frame));
        if followed.file != file || followed.data != Some(data) {
            (followed.file, followed.data) = (file.clone(), Some(data));
            self.read_reference(&file, None);
        }
    }

    fn read_reference(&mut self, path: &Path, opened: Option<Followed>) {
        let (sender, receiver) = mpsc::channel();
        let ((device, queue), path, ctx) = (self.device.clone(), path.to_owned(), self.ctx.clone());
        let plate = self.plate.clone();
        let read = move || {
            let frame = plate.as_ref().map(|plate| &plate.scene.frame);
            // Nobody waits any more where this fails.
            let _ = sender.send(Reference::read(&device, &queue, &path, frame));
            ctx.request_repaint();
        };
        match std::thread::Builder::new().name("reference".into()).spawn(read) {
            Ok(_) => self.references.coming = Some(Coming { receiver, opened }),
            Err(error) => self.say(format!("a thread could not be started: {error}")),
        }
    }

    /// Takes a reference that was read.
    pub(super) fn take_reference(&mut self) {
        let Some(coming) = self.references.coming.take() else { return };
        let read = match coming.receiver.try_recv() {
            Err(TryRecvError::Empty) => {
                self.references.coming = Some(coming);
                return;
            }
            Err(TryRecvError::Disconnected) => Err("the reference could not be read".into()),
            Ok(read) => read,
        };
        match (read, coming.opened) {
            (Ok(reference), opened) => {
                self.references.now = Some(Arc::new(reference));
                if let Some(followed) = opened {
                    self.references.followed = Some(followed);
                    if !self.look.shows(View::Reference) && !self.look.shows(View::Difference) {
                        self.look.left = View::Difference;
                    }
                }
            }
            // What was open stays.
            (Err(sentence), Some(_)) => self.say(sentence),
            (Err(sentence), None) => {
                // The one before is another frame's.
                self.references.now = None;
                self.say(sentence);
            }
        }
    }
}
