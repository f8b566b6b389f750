//! Opening and saving, and what a restart brings back.

use super::App;
use crate::document::{Document, keep_assumed};
use crate::engine::Reference;
use crate::loader::Request;
use crate::look::View;
use crate::session::Session;
use crate::{clip, opening};
use eframe::egui;
use pullfocus_io::output::Existing;
use pullfocus_job::config::{self, Options};
use pullfocus_job::options::Blur;
use pullfocus_job::storage;
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
    /// As a session remembers it.
    pub fn kept(path: PathBuf, text: Option<String>) -> Self {
        Self { path, text }
    }

    pub fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

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
        let other = self.session.other.as_deref().and_then(|text| config::parse(text).ok());
        let Session { shot_path, shot_text, frame, .. } = &self.session;
        self.saved = shot_path.clone().map(|path| ShotFile::kept(path, shot_text.clone()));
        self.loader.open(Request { path: None, options, frame: *frame, other });
    }

    /// Opens a picture, a folder, a pattern or a shot; takes a colour config for the screen.
    pub fn open_path(&mut self, path: &Path) {
        if opening::is_config(path) {
            self.choose_config(path);
            return;
        }
        // Options of the command line are for what it opens; the device is for all.
        let device = self.base.blur.device.clone();
        let blur = Blur { device, ..Blur::default() };
        let options = std::mem::replace(&mut self.base, Options { blur, ..Options::default() });
        self.loader.open(Request { path: Some(path.to_owned()), options, frame: 0, other: None });
    }

    /// Remembers what was opened.
    fn opened(&mut self, request: &Request) {
        let Some(path) = &request.path else { return };
        self.keep_unsaved();
        self.saved = opening::is_shot(path).then(|| ShotFile::of(path));
        self.session.opened(path);
    }

    /// Opens a picture to compare with.
    pub fn open_reference(&mut self, path: &Path) {
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
                let keys = self.clip.as_ref().map_or(Ok(()), |clip| clip.check_keys(self.document.shot()));
                self.say(match keys {
                    Ok(()) => {
                        let name = clip::file_name(path);
                        format!("Saved. `pullfocus render --shot {name}` renders these pixels.")
                    }
                    Err(sentence) => format!("Saved, but `pullfocus render` will not take it: {sentence}"),
                });
                self.saved = Some(ShotFile::of(path));
                self.session.opened(path);
            }
            Err(failure) => self.say(failure.to_string()),
        }
    }

    /// Keeps a pull that was never saved, when another file takes its place.
    fn keep_unsaved(&mut self) {
        let shot = self.document.shot();
        let (Some(session), false, true) = (&self.session_path, shot.keys.is_empty(), self.is_unsaved())
        else {
            return;
        };
        let path = session.with_file_name("unsaved.toml");
        match storage::save_bytes(&path, config::write(&absolute(shot)).as_bytes()) {
            Ok(()) => {
                self.say(format!("The pull that was not saved is kept in {}.", path.display()));
                self.session.opened(&path);
            }
            Err(failure) => self.say(failure.to_string()),
        }
    }

    /// Whether the shot is another than its file holds.
    fn is_unsaved(&self) -> bool {
        let saved = self
            .saved
            .as_ref()
            .and_then(|saved| Some(config::text(self.document.shot(), &saved.path).ok()? == saved.text()?));
        self.clip.is_some() && saved != Some(true)
    }

    /// Whether something changed that a restart should bring back.
    pub(super) fn has_news(&self) -> bool {
        let (document, look, frame) = &self.kept_state;
        *document != self.document || *look != self.look || *frame != self.frame_number()
    }

    /// Remembers what a restart brings back.
    pub(super) fn keep_session(&mut self) {
        self.kept = Instant::now();
        self.kept_state = (self.document.clone(), self.look.clone(), self.frame_number());
        let Some(path) = self.session_path.clone() else { return };
        let mut session = Session {
            look: self.look.clone(),
            frame: self.frame_number(),
            shot_path: self.saved.as_ref().map(|saved| saved.path.clone()),
            shot_text: self.saved.as_ref().and_then(|saved| saved.text().map(str::to_owned)),
            ..self.session.clone()
        };
        if self.clip.is_some() {
            let [shot, other] = self.document.takes.each_ref().map(|take| config::write(&absolute(take)));
            session.other = (other != shot).then_some(other);
            session.shot = Some(shot);
        }
        if session != self.written {
            match session.write(&path) {
                Ok(()) => (self.session, self.written) = (session.clone(), session),
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
        let Request { options, frame, other, .. } = request;
        let mut takes = [options.clone(), other.unwrap_or(options)];
        if let Some(plate) = &plate {
            takes.iter_mut().for_each(|take| keep_assumed(&mut take.lens, &plate.found));
        }
        self.document = Document { takes };
        self.undo = super::steps();
        self.clip.clone_from(&clip);
        self.plate = None;
        (self.selected_key, self.playing) = (None, None);
        self.look.zoom = None;
        self.go_to(frame);
        let title = clip.as_ref().map_or_else(String::new, |clip| format!("{} – ", clip.name));
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(format!("{title}pullfocus")));
        let keys = clip.map_or(Ok(()), |clip| clip.check_keys(self.document.shot()));
        let warnings = plate.map(|plate| plate.warnings.clone()).unwrap_or_default();
        if let Some(warning) = keys.err().or(warnings.into_iter().next()) {
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
