//! Opening and saving, and what a restart brings back.

use super::App;
use crate::document::Document;
use crate::engine::Reference;
use crate::loader::Request;
use crate::look::View;
use crate::session::Session;
use crate::{clip, opening};
use eframe::egui;
use pullfocus_io::output::Existing;
use pullfocus_job::config::{self, Options};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::{Arc, mpsc};
use std::time::Instant;

/// The file that a shot came from or was saved in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ShotFile {
    pub path: PathBuf,
    /// What this program has written there, or would have. Where the file says something else, another hand wrote it: a
    /// comment, a change made meanwhile.
    text: Option<String>,
}

impl ShotFile {
    /// A file that is there.
    fn of(path: &Path) -> Self {
        let text = config::read(path).and_then(|options| config::text(&options, path)).ok();
        Self { path: path.to_owned(), text }
    }

    /// Whether writing this file again loses nothing of anybody's.
    fn is_ours(&self, path: &Path) -> bool {
        let now = || std::fs::read_to_string(path).ok();
        path == self.path && self.text.is_some() && now() == self.text
    }
}

impl App {
    /// Opens what was open when the program ended.
    pub(super) fn open_last(&mut self) {
        let Some(options) = self.session.shot.as_deref().and_then(|text| config::parse(text).ok()) else {
            return;
        };
        self.saved = self.session.shot_path.as_deref().filter(|path| path.is_file()).map(ShotFile::of);
        let frame = self.session.frame;
        self.loader.open(Request { path: None, options, frame });
    }

    /// Opens a picture, a folder, a pattern or a shot; takes a colour config for the screen.
    pub fn open_path(&mut self, path: &Path) {
        if opening::is_config(path) {
            self.choose_config(path);
            return;
        }
        self.loader.open(Request { path: Some(path.to_owned()), options: self.base.clone(), frame: 0 });
    }

    /// Remembers what was opened.
    pub(super) fn opened(&mut self, request: &Request) {
        let Some(path) = &request.path else { return };
        self.saved = opening::is_shot(path).then(|| ShotFile::of(path));
        self.session.opened(path);
    }

    /// Opens a picture to compare with.
    pub fn open_reference(&mut self, path: &Path) {
        let (sender, receiver) = mpsc::channel();
        let ((device, queue), path, ctx) = (self.device.clone(), path.to_owned(), self.ctx.clone());
        let read = move || {
            // Nobody waits any more where this fails.
            let _ = sender.send(Reference::read(&device, &queue, &path));
            ctx.request_repaint();
        };
        match std::thread::Builder::new().name("reference".into()).spawn(read) {
            Ok(_) => self.coming = Some(receiver),
            Err(error) => self.say(format!("a thread could not be started: {error}")),
        }
    }

    /// Takes a reference that was read.
    pub(super) fn take_reference(&mut self) {
        match self.coming.as_ref().map(Receiver::try_recv) {
            None | Some(Err(TryRecvError::Empty)) => return,
            Some(Ok(Ok(reference))) => {
                self.reference = Some(Arc::new(reference));
                self.look.left = View::Difference;
            }
            Some(Ok(Err(sentence))) => self.say(sentence),
            Some(Err(TryRecvError::Disconnected)) => self.say("the reference could not be read"),
        }
        self.coming = None;
    }

    /// Whether a shot can be saved there without a question: nothing is there, or the shot's own file as it was left.
    pub(super) fn may_save(&self, path: &Path) -> bool {
        !path.exists() || self.saved.as_ref().is_some_and(|saved| saved.is_ours(path))
    }

    /// Saves the shot. A file that is there is replaced if it is the shot's own and nobody else has changed it, or where
    /// `replace` says that the user was asked.
    pub fn save(&mut self, path: &Path, replace: bool) {
        let replace = replace || (path.exists() && self.may_save(path));
        let existing = if replace { Existing::Replace } else { Existing::Refuse };
        match config::write_to(self.document.shot(), path, existing) {
            Ok(()) => {
                self.say(format!(
                    "Saved. `pullfocus render --shot {}` renders these pixels.",
                    clip::file_name(path)
                ));
                self.saved = Some(ShotFile::of(path));
                self.session.opened(path);
            }
            Err(failure) => self.say(failure.to_string()),
        }
    }

    /// Remembers what a restart brings back.
    pub(super) fn keep_session(&mut self) {
        self.kept = Instant::now();
        let Some(path) = self.session_path.clone() else { return };
        let mut session = Session {
            look: self.look.clone(),
            frame: self.frame_number(),
            shot_path: self.saved.as_ref().map(|saved| saved.path.clone()),
            ..self.session.clone()
        };
        if self.clip.is_some() {
            session.shot = Some(config::write(&absolute(self.document.shot())));
        }
        if session != self.session {
            match session.write(&path) {
                Ok(()) => self.session = session,
                Err(sentence) => tracing::warn!("{sentence}"),
            }
        }
    }

    /// Takes what the loader has opened.
    pub(super) fn take_opened(&mut self, request: Request, ctx: &egui::Context) {
        self.engine.clear();
        self.opened(&request);
        let (clip, plate) = {
            let shelf = self.loader.shelf();
            (shelf.clip.clone(), shelf.plate(0))
        };
        let Request { mut options, frame, .. } = request;
        if let Some(plate) = &plate {
            crate::document::keep_assumed(&mut options.lens, &plate.found);
        }
        self.document = Document::new(options);
        self.undo = egui::util::undoer::Undoer::default();
        self.clip.clone_from(&clip);
        self.plate = None;
        (self.selected_key, self.playing) = (None, None);
        self.look.zoom = None;
        self.go_to(frame);
        let title = clip.as_ref().map_or_else(String::new, |clip| format!("{} – ", clip.name));
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(format!("{title}pullfocus")));
        let warnings = plate.map(|plate| plate.warnings.clone()).unwrap_or_default();
        if let Some(warning) = warnings.into_iter().next() {
            self.say(warning);
        }
    }
}

/// The options with files that are found from any folder.
fn absolute(options: &Options) -> Options {
    let mut options = options.clone();
    let files = &mut options.files;
    let one = |path: &mut PathBuf| *path = std::path::absolute(&*path).unwrap_or_else(|_| path.clone());
    files.input.iter_mut().flatten().for_each(one);
    for path in [&mut files.depth_file, &mut files.foreground, &mut files.behind, &mut files.output] {
        path.iter_mut().for_each(one);
    }
    options
}
