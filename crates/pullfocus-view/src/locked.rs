//! What threads share.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The content, whoever had it before.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // A thread that panicked has left whole values: each is assigned in one go.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
