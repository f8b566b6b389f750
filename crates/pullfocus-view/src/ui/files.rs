//! Opening and saving, and what a restart brings back.

use super::App;
use crate::document::{Document, keep_assumed};
use crate::loader::{How, Request};
use crate::session::{Keeper, Session};
use crate::{clip, opening};
use eframe::egui;
use pullfocus_io::output::Existing;
use pullfocus_job::config::{self, Options};
use pullfocus_job::failure::Failure;
use pullfocus_job::options::Blur;
use pullfocus_job::storage;
use pullfocus_job::values::Label;
use std::path::{Path, PathBuf};
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
        // The next start may be in another folder.
        Self { path: std::path::absolute(path).unwrap_or_else(|_| path.to_owned()), text }
    }

    /// Whether a shot is what was written there.
    fn holds(&self, shot: &Options) -> bool {
        self.text.is_some() && config::text(shot, &self.path).ok() == self.text
    }

    /// Whether writing this file again loses nothing of anybody's.
    fn is_ours(&self, path: &Path) -> bool {
        let now = || std::fs::read_to_string(path).ok();
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
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
        self.loader.open(Request { path: None, options, frame: *frame, other, how: How::Back });
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
        let path = Some(path.to_owned());
        self.loader.open(Request { path, options, frame: i64::MIN, other: None, how: How::Anew });
    }

    /// Remembers what was opened.
    fn opened(&mut self, path: Option<&Path>) {
        self.keep_unsaved();
        self.references.stay_behind();
        self.saved = path.filter(|path| opening::is_shot(path)).map(ShotFile::of);
        if let Some(path) = path {
            self.session.opened(path);
        }
    }

    /// Holds one picture over frames, or goes back to one picture where `seconds` is none. What was made stays.
    pub(super) fn hold(&mut self, seconds: Option<f64>) {
        let [mut options, other] = self.document.takes.clone();
        let mut frame = i64::MIN;
        options.files.frames = seconds.map(|seconds| {
            let frames = (seconds * self.look.fps).round().max(2.0) as i64;
            // A name's own number is its frame; a still is held over others.
            let number = self.clip.as_ref().and_then(|clip| clip.files(0)).and_then(|files| files.number);
            frame = if number.is_some_and(|number| (1..=frames).contains(&number)) { 1001 } else { 1 };
            Label(format!("{frame}-{}", frame + frames - 1))
        });
        self.loader.open(Request { path: None, options, frame, other: Some(other), how: How::Held });
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
                let [shot, other] = &self.document.takes;
                let is_other = self.front() == 1 && shot != other;
                self.say(match keys {
                    Ok(()) if is_other => {
                        "Saved is take A, which is the shot; B to A makes this one the shot.".into()
                    }
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

    /// Keeps pulls that were never saved, when another file takes their place: this window's, or the last session's where nothing
    /// of it was opened.
    fn keep_unsaved(&mut self) {
        let Some(session) = &self.session_path else { return };
        let (takes, saved) = match &self.clip {
            Some(_) => (self.document.takes.clone(), self.saved.clone()),
            None => self.last_takes(),
        };
        let [shot, other] = &takes;
        let is_saved = saved.is_some_and(|saved| saved.holds(shot));
        let lost = [(shot, !is_saved), (other, other.keys != shot.keys)];
        let lost = lost.into_iter().filter(|(take, is_lost)| *is_lost && !take.keys.is_empty());
        let (mut kept, mut faults) = (Vec::new(), Vec::new());
        for (take, _) in lost {
            let text = config::write(&absolute(take));
            let path = free_path(session, &text);
            match write_beside(&path, &text) {
                Ok(()) => kept.push(path),
                Err(failure) => faults.push(failure.to_string()),
            }
        }
        for path in &kept {
            self.session.opened(path);
        }
        let names: Vec<String> = kept.iter().map(|path| path.display().to_string()).collect();
        if let Some(fault) = faults.into_iter().next() {
            self.say(format!("A pull that was not saved could not be kept: {fault}."));
        } else if !names.is_empty() {
            self.say(format!("The pull that was not saved is kept in {}.", names.join(" and ")));
        }
    }

    /// What the last session has left, and the file that its shot was saved in.
    fn last_takes(&self) -> ([Options; 2], Option<ShotFile>) {
        let Session { shot, other, shot_path, shot_text, .. } = &self.session;
        let parsed = |text: &Option<String>| config::parse(text.as_deref()?).ok();
        let shot = parsed(shot).unwrap_or_default();
        let other = parsed(other).unwrap_or_else(|| shot.clone());
        ([shot, other], shot_path.clone().map(|path| ShotFile::kept(path, shot_text.clone())))
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
        let Some(keeper) = &self.keeper else { return };
        let mut session = Session { look: self.look.clone(), ..self.session.clone() };
        if self.clip.is_some() {
            let [shot, other] = self.document.takes.each_ref().map(|take| config::write(&absolute(take)));
            session.other = (other != shot).then_some(other);
            session.shot = Some(shot);
            session.frame = self.frame_number();
            let saved = self.saved.as_ref().filter(|saved| saved.path.to_str().is_some());
            session.shot_path = saved.map(|saved| saved.path.clone());
            session.shot_text = saved.and_then(|saved| saved.text().map(str::to_owned));
        }
        if session != self.written {
            keeper.keep(session.clone());
            (self.session, self.written) = (session.clone(), session);
        }
    }

    /// Tells, once, that a session cannot be kept.
    pub(super) fn take_kept(&mut self) {
        let Some(sentence) = self.keeper.as_ref().and_then(Keeper::take_fault) else { return };
        // What was not written is written with the next change.
        self.written = Session::default();
        if self.session_fault.as_ref() != Some(&sentence) {
            tracing::warn!("{sentence}");
            self.session_fault = Some(sentence.clone());
            self.say(sentence);
        }
    }

    /// Takes what the loader has opened.
    pub(super) fn take_opened(&mut self, request: Request, ctx: &egui::Context) {
        let Request { path, options, frame, other, how } = request;
        self.message = None;
        if how == How::Anew {
            self.opened(path.as_deref());
        }
        self.engine.clear();
        let (clip, first, fault) = {
            let shelf = self.loader.shelf();
            let clip = shelf.clip.clone();
            let wanted = clip.as_ref().map(|clip| clip.source(clip.nearest(frame as f64)));
            let fault = wanted.and_then(|wanted| shelf.faults.get(&wanted).cloned());
            (clip, shelf.any(), fault)
        };
        if how == How::Held {
            for take in &mut self.document.takes {
                take.files.frames.clone_from(&options.files.frames);
            }
        } else {
            let mut takes = [options.clone(), other.unwrap_or(options)];
            if let Some((_, plate)) = &first {
                takes.iter_mut().for_each(|take| keep_assumed(&mut take.lens, &plate.found));
            }
            self.document = Document { takes };
            self.look.zoom = None;
        }
        self.undo = super::steps();
        self.clip.clone_from(&clip);
        (self.plate, self.hovered) = (None, None);
        (self.selected_key, self.playing) = (None, None);
        // One that can be read, where the one that is wanted cannot.
        let there = fault.as_ref().and(first.as_ref()).zip(clip.as_ref());
        self.go_to(there.map_or(frame, |((index, _), clip)| clip.number(*index)));
        let title = clip.as_ref().map_or_else(String::new, |clip| format!("{} – ", clip.name));
        ctx.send_viewport_cmd(egui::ViewportCommand::Title(format!("{title}pullfocus")));
        let keys = clip.map_or(Ok(()), |clip| clip.check_keys(self.document.shot()));
        let warning = first.and_then(|(_, plate)| plate.warnings.first().cloned());
        let kept = self.message.take().map(|(sentence, _)| sentence);
        let told: Vec<String> = [kept, fault, keys.err(), warning].into_iter().flatten().collect();
        if !told.is_empty() {
            self.say(told.join(" "));
        }
    }
}

/// Where a pull is kept that nobody saved: a name beside the session that holds nothing else.
fn free_path(session: &Path, text: &str) -> PathBuf {
    let named = |number: u32| match number {
        1 => session.with_file_name("unsaved.toml"),
        _ => session.with_file_name(format!("unsaved-{number}.toml")),
    };
    let is_free =
        |path: &PathBuf| !path.exists() || std::fs::read_to_string(path).is_ok_and(|there| there == text);
    (1..).map(named).find(is_free).unwrap_or_else(|| named(1))
}

fn write_beside(path: &Path, text: &str) -> Result<(), Failure> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    storage::save_bytes(path, text.as_bytes())
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
