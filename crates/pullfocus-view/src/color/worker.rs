//! The thread that reads configs and fills tables: the window never waits for either.

use super::config::Reader;
use super::{Choice, Menu, Table};
use crate::locked::Desk;
use eframe::egui;
use std::path::PathBuf;
use std::sync::Arc;

/// What a table is wanted for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ask {
    /// Which view of which config.
    pub choice: Choice,
    /// The picture's file, for the config's file rules.
    pub file: Option<PathBuf>,
    /// Raised by one, files are read again.
    pub again: u64,
}

/// What there is.
#[derive(Debug, Clone, Default)]
pub struct State {
    /// What the config offers, where it could be read.
    pub menu: Option<Arc<Menu>>,
    /// The transform; the one before while another is under way, none where it cannot be had.
    pub table: Option<Arc<Table>>,
    /// Why there is none, in one sentence.
    pub fault: Option<String>,
}

#[derive(Default)]
struct Work {
    asked: Option<Ask>,
    /// What [`Work::state`] is the answer to.
    answered: Option<Ask>,
    state: State,
    /// A sentence that nobody has told yet.
    untold: Option<String>,
    quit: bool,
}

/// The thread's end in the window.
pub struct Colors {
    desk: Arc<Desk<Work>>,
    environment: Option<String>,
}

impl Colors {
    /// Starts the thread. `environment` is what the variable OCIO holds.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(ctx: &egui::Context, environment: Option<String>) -> std::io::Result<Self> {
        let desk = Arc::new(Desk::<Work>::default());
        let environment = environment.filter(|value| !value.trim().is_empty());
        let (theirs, ctx, variable) = (Arc::clone(&desk), ctx.clone(), environment.clone());
        std::thread::Builder::new().name("colour".into()).spawn(move || work(&theirs, &ctx, variable))?;
        Ok(Self { desk, environment })
    }

    /// What the variable OCIO holds, if anything.
    pub fn environment(&self) -> Option<&str> {
        self.environment.as_deref()
    }

    /// Wants a transform; what is wanted already costs nothing.
    pub fn ask(&self, ask: Ask) {
        let mut work = self.desk.look();
        if work.asked.as_ref() != Some(&ask) {
            work.asked = Some(ask);
            self.desk.ring();
        }
    }

    /// What there is now.
    pub fn state(&self) -> State {
        self.desk.look().state.clone()
    }

    /// Whether something is under way.
    pub fn is_busy(&self) -> bool {
        let work = self.desk.look();
        work.asked != work.answered
    }

    /// What went wrong since this was asked last.
    pub fn take_fault(&self) -> Option<String> {
        self.desk.look().untold.take()
    }
}

impl Drop for Colors {
    fn drop(&mut self) {
        self.desk.look().quit = true;
        self.desk.ring();
    }
}

fn work(desk: &Desk<Work>, ctx: &egui::Context, environment: Option<String>) {
    let mut reader = Reader::new(environment);
    loop {
        let work = desk.wait_while(|work| !work.quit && work.asked == work.answered);
        let Some(ask) = work.asked.clone().filter(|_| !work.quit) else { return };
        drop(work);
        let (menu, table) = reader.read(&ask);
        let mut work = desk.look();
        work.state.menu = menu.map(Arc::new);
        match table {
            Ok(table) => (work.state.table, work.state.fault) = (Some(table), None),
            Err(sentence) => {
                (work.state.table, work.state.fault) = (None, Some(sentence.clone()));
                work.untold = Some(sentence);
            }
        }
        work.answered = Some(ask);
        drop(work);
        ctx.request_repaint();
    }
}
