//! What comes back when the program is started again: recent files, the last shot, how it was looked at.

use crate::locked::Desk;
use crate::look::Look;
use eframe::egui;
use pullfocus_job::storage;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// How many recent files are remembered.
const MOST_RECENT: usize = 12;
/// A session holds a few lines; a file of more bytes is none.
const LARGEST_BYTES: u64 = 1 << 20;

/// What is remembered.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct Session {
    /// Files that were opened, the last one first.
    pub recent: Vec<PathBuf>,
    /// The shot that was open, as a settings file's text.
    pub shot: Option<String>,
    /// Take B, as a settings file's text, where it is another than the shot.
    pub other: Option<String>,
    /// The file that the shot was saved in, if it was.
    pub shot_path: Option<PathBuf>,
    /// What was written there.
    pub shot_text: Option<String>,
    /// The frame that was looked at.
    pub frame: i64,
    /// Dark or light, as the system has it if not given.
    pub dark: Option<bool>,
    /// How it was looked at.
    pub look: Look,
}

impl Session {
    /// Where the system keeps such files for this program.
    pub fn usual_path() -> Option<PathBuf> {
        Some(directories::ProjectDirs::from("", "", "pullfocus")?.config_dir().join("view.toml"))
    }

    /// What was remembered; an empty one where there is none or it cannot be read, which is no reason not to start.
    pub fn read(path: &Path) -> Self {
        let small = std::fs::metadata(path).is_ok_and(|data| data.len() <= LARGEST_BYTES);
        let text = if small { std::fs::read_to_string(path).ok() } else { None };
        text.and_then(|text| toml::from_str(&text).ok()).unwrap_or_default()
    }

    /// Remembers.
    ///
    /// # Errors
    /// One sentence; the old session then stands as it was.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let told = |error: &dyn std::fmt::Display| {
            format!("{}: the session cannot be kept: {error}", path.display())
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| told(&error))?;
        }
        let text = toml::to_string(self).map_err(|error| told(&error))?;
        storage::save_bytes(path, text.as_bytes()).map_err(|failure| told(&failure))
    }

    /// Puts a file on top of the recent ones.
    pub fn opened(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        if path.to_str().is_none() {
            // A session is text, and this name is none.
            return;
        }
        self.recent.retain(|known| *known != path);
        self.recent.insert(0, path);
        self.recent.truncate(MOST_RECENT);
    }
}

#[derive(Default)]
struct Work {
    next: Option<Session>,
    is_writing: bool,
    fault: Option<String>,
    quit: bool,
}

/// How long a window that closes waits for its session to be written.
const PATIENCE: Duration = Duration::from_secs(10);

/// A thread that writes sessions, so that no disk, and no server that is away, holds the window up. What was handed over last is
/// written when this is dropped.
pub struct Keeper {
    desk: Arc<Desk<Work>>,
}

impl Keeper {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(path: &Path, ctx: &egui::Context) -> std::io::Result<Self> {
        let desk = Arc::new(Desk::<Work>::default());
        let (theirs, path, ctx) = (Arc::clone(&desk), path.to_owned(), ctx.clone());
        let work = move || {
            loop {
                let mut work = theirs.wait_while(|work| work.next.is_none() && !work.quit);
                let Some(session) = work.next.take() else { return };
                work.is_writing = true;
                drop(work);
                let fault = session.write(&path).err();
                let is_news = fault.is_some();
                let mut work = theirs.look();
                (work.is_writing, work.fault) = (false, fault);
                drop(work);
                theirs.ring();
                if is_news {
                    ctx.request_repaint();
                }
            }
        };
        // It ends when this is dropped, or with the process.
        std::thread::Builder::new().name("session".into()).spawn(work)?;
        Ok(Self { desk })
    }

    /// Hands a session over, in the place of one that is not begun.
    pub fn keep(&self, session: Session) {
        self.desk.look().next = Some(session);
        self.desk.ring();
    }

    /// Waits until what was handed over is written, or cannot be; some seconds at most.
    pub fn finish(&self) {
        if !self.desk.wait_for(PATIENCE, |work| work.next.is_some() || work.is_writing) {
            tracing::warn!("the session is not written yet, and is not waited for");
        }
    }

    /// Why the last one could not be written, told once.
    pub fn take_fault(&self) -> Option<String> {
        self.desk.look().fault.take()
    }
}

impl Drop for Keeper {
    fn drop(&mut self) {
        self.finish();
        self.desk.look().quit = true;
        self.desk.ring();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_comes_back_and_rubbish_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/view.toml");
        let mut session = Session { frame: 7, shot: Some("f-stop = 2.8\n".into()), ..Session::default() };
        session.look.color.config = crate::color::Source::File("/config.ocio".into());
        session.opened(Path::new("/a.exr"));
        session.opened(Path::new("/b.exr"));
        session.opened(Path::new("/a.exr"));
        session.write(&path).unwrap();
        let back = Session::read(&path);
        assert_eq!(back, session);
        assert_eq!(back.recent, [PathBuf::from("/a.exr"), PathBuf::from("/b.exr")]);
        let ctx = egui::Context::default();
        // By the thread, which writes the last one whenever it ends.
        for frame in 0..20 {
            let keeper = Keeper::start(&path, &ctx).unwrap();
            (0..=frame).for_each(|frame| keeper.keep(Session { frame, ..session.clone() }));
            if frame % 2 == 0 {
                keeper.finish();
                assert_eq!(Session::read(&path).frame, frame);
            }
            drop(keeper);
            assert_eq!(Session::read(&path).frame, frame);
        }
        let nowhere = Keeper::start(&path.join("a file is no folder/view.toml"), &ctx).unwrap();
        nowhere.keep(session);
        nowhere.finish();
        assert!(nowhere.take_fault().unwrap().contains("view.toml") && nowhere.take_fault().is_none());
        std::fs::write(&path, "frame = [").unwrap();
        assert_eq!(Session::read(&path), Session::default());
        assert_eq!(Session::read(&folder.path().join("none")), Session::default());
    }
}
