//! What threads share.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The content, whoever had it before.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked has left whole values: each is assigned in one go.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the window and a thread lay down for each other, and a bell for whoever waits.
#[derive(Default)]
pub struct Desk<T> {
    content: Mutex<T>,
    bell: Condvar,
}

impl<T> Desk<T> {
    /// What lies there.
    pub fn look(&self) -> MutexGuard<'_, T> {
        lock(&self.content)
    }

    /// Tells whoever waits that something has changed.
    pub fn ring(&self) {
        self.bell.notify_all();
    }

    /// What lies there once this is no longer so.
    pub fn wait_while(&self, so: impl FnMut(&mut T) -> bool) -> MutexGuard<'_, T> {
        self.bell.wait_while(self.look(), so).unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits while this is so; false where it still is after that time.
    pub fn wait_for(&self, time: Duration, so: impl FnMut(&mut T) -> bool) -> bool {
        let waited = self.bell.wait_timeout_while(self.look(), time, so);
        !waited.unwrap_or_else(PoisonError::into_inner).1.timed_out()
    }
}
