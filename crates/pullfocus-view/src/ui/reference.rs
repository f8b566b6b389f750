//! What the picture is compared with: one picture, or a sequence whose frames go with those that are looked at.

use super::App;
use crate::engine::Reference;
use crate::look::View;
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
    /// A sequence, and its file that was asked for last.
    sequence: Option<(Pattern, PathBuf)>,
}

/// A reference that is being read.
struct Coming {
    receiver: Receiver<Result<Reference, String>>,
    /// The user has opened it: the sequence that it is of, if it is of one. Else it is the next frame of the one that is open.
    opened: Option<Option<(Pattern, PathBuf)>>,
}

impl References {
    /// Whether one is being read.
    pub fn are_coming(&self) -> bool {
        self.coming.is_some()
    }

    /// Frames of another file have other references.
    pub fn stay_behind(&mut self) {
        (self.coming, self.sequence) = (None, None);
    }
}

impl App {
    /// Opens a picture to compare with, or a sequence (`ref.####.exr`), whose frames go with those that are looked at.
    pub fn open_reference(&mut self, path: &Path) {
        let pattern = Pattern::parse(path).ok().flatten().filter(|_| !path.exists());
        let sequence = pattern.map(|pattern| {
            let file = pattern.file(self.frame_number());
            (pattern, file)
        });
        let file = sequence.as_ref().map_or_else(|| path.to_owned(), |(_, file)| file.clone());
        self.read_reference(&file, Some(sequence));
    }

    /// Goes on to the reference of the frame in front.
    pub(super) fn follow_reference(&mut self) {
        let (frame, is_calm) = (self.plate_frame, !self.references.are_coming() && self.playing.is_none());
        let Some((pattern, known)) = self.references.sequence.as_mut().filter(|_| is_calm) else { return };
        let file = pattern.file(frame);
        if *known != file {
            known.clone_from(&file);
            self.read_reference(&file, None);
        }
    }

    fn read_reference(&mut self, path: &Path, opened: Option<Option<(Pattern, PathBuf)>>) {
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
                if let Some(sequence) = opened {
                    self.references.sequence = sequence;
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
