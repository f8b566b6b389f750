//! The device that all tests share, and what its layers say.

use pullfocus_gpu::{Choice, Host, adapters};
use std::sync::{Mutex, OnceLock, PoisonError};

/// The adapter that tests run on; the environment may name it.
pub fn choice() -> Option<Choice> {
    let wanted = std::env::var("PULLFOCUS_TEST_ADAPTER").ok().filter(|name| !name.is_empty());
    let usable = adapters().into_iter().filter(|info| info.unusable.is_none());
    let found = match &wanted {
        Some(name) => usable.map(|info| info.name).find(|n| n.to_lowercase().contains(&name.to_lowercase())),
        None => usable.map(|info| info.name).next(),
    };
    found.map(Choice::Named)
}

/// Whether there is an adapter.
///
/// # Panics
/// If there is none and the environment says that there must be.
pub fn there() -> bool {
    log::set_logger(&Listener).expect("the first logger");
    log::set_max_level(log::LevelFilter::Warn);
    let there = choice().is_some();
    let required = std::env::var("PULLFOCUS_TEST_GPU").is_ok_and(|value| value == "required");
    assert!(there || !required, "PULLFOCUS_TEST_GPU=required, and no adapter was found");
    there
}

/// Does something with the shared host, one test at a time.
pub fn with_host<T>(work: impl FnOnce(&mut Host) -> T) -> T {
    static HOST: OnceLock<Mutex<Host>> = OnceLock::new();
    let host = HOST.get_or_init(|| {
        let choice = choice().expect("an adapter: the test is ignored without");
        Mutex::new(Host::open(&choice).expect("the adapter opens"))
    });
    work(&mut host.lock().unwrap_or_else(PoisonError::into_inner))
}

static COMPLAINTS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// What wgpu and the validation layers (in builds with debug assertions, where they are installed) reported.
pub fn complaints() -> Vec<String> {
    COMPLAINTS.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

struct Listener;

impl log::Log for Listener {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Error
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            let text = format!("{}: {}", record.target(), record.args());
            COMPLAINTS.lock().unwrap_or_else(PoisonError::into_inner).push(text);
        }
    }

    fn flush(&self) {}
}
