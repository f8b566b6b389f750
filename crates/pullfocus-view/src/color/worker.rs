//! The thread that reads configs and fills tables: the window never waits for either.

use super::config::Reader;
use super::{Choice, Menu, Table};
use crate::locked::lock;
use eframe::egui;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

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
struct Desk {
    asked: Option<Ask>,
    /// What [`Desk::state`] is the answer to.
    answered: Option<Ask>,
    state: State,
    /// A sentence that nobody has told yet.
    untold: Option<String>,
    quit: bool,
}

#[derive(Default)]
struct Shared {
    desk: Mutex<Desk>,
    bell: Condvar,
}

impl Shared {
    fn desk(&self) -> MutexGuard<'_, Desk> {
        lock(&self.desk)
    }
}

/// The thread's end in the window.
pub struct Colors {
    shared: Arc<Shared>,
    environment: Option<String>,
}

impl Colors {
    /// Starts the thread. `environment` is what the variable OCIO holds.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(ctx: &egui::Context, environment: Option<String>) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let environment = environment.filter(|value| !value.trim().is_empty());
        let (theirs, ctx, variable) = (Arc::clone(&shared), ctx.clone(), environment.clone());
        std::thread::Builder::new().name("colour".into()).spawn(move || work(&theirs, &ctx, variable))?;
        Ok(Self { shared, environment })
    }

    /// What the variable OCIO holds, if anything.
    pub fn environment(&self) -> Option<&str> {
        self.environment.as_deref()
    }

    /// Wants a transform; what is wanted already costs nothing.
    pub fn ask(&self, ask: Ask) {
        let mut desk = self.shared.desk();
        if desk.asked.as_ref() != Some(&ask) {
            desk.asked = Some(ask);
            self.shared.bell.notify_one();
        }
    }

    /// What there is now.
    pub fn state(&self) -> State {
        self.shared.desk().state.clone()
    }

    /// Whether something is under way.
    pub fn is_busy(&self) -> bool {
        let desk = self.shared.desk();
        desk.asked != desk.answered
    }

    /// What went wrong since this was asked last.
    pub fn take_fault(&self) -> Option<String> {
        self.shared.desk().untold.take()
    }
}

impl Drop for Colors {
    fn drop(&mut self) {
        self.shared.desk().quit = true;
        self.shared.bell.notify_one();
    }
}

fn work(shared: &Shared, ctx: &egui::Context, environment: Option<String>) {
    let mut reader = Reader::new(environment);
    loop {
        let idle = |desk: &mut Desk| !desk.quit && desk.asked == desk.answered;
        let desk = shared.bell.wait_while(shared.desk(), idle).unwrap_or_else(PoisonError::into_inner);
        let Some(ask) = desk.asked.clone().filter(|_| !desk.quit) else { return };
        drop(desk);
        let (menu, table) = reader.read(&ask);
        let mut desk = shared.desk();
        desk.state.menu = menu.map(Arc::new);
        match table {
            Ok(table) => (desk.state.table, desk.state.fault) = (Some(table), None),
            Err(sentence) => {
                (desk.state.table, desk.state.fault) = (None, Some(sentence.clone()));
                desk.untold = Some(sentence);
            }
        }
        desk.answered = Some(ask);
        drop(desk);
        ctx.request_repaint();
    }
}
