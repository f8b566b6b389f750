//! How many threads the work has.

use crate::failure::{Failure, Result};

/// The most threads that can be asked for.
const MOST_THREADS: u32 = 1024;

/// Refuses a number of threads that no pool has.
///
/// # Errors
/// [`Failure::Usage`].
pub fn check_threads(threads: Option<u32>) -> Result<()> {
    match threads {
        Some(n) if !(1..=MOST_THREADS).contains(&n) => {
            Err(Failure::usage(format!("--threads is {n}; it must lie between 1 and {MOST_THREADS}")))
        }
        _ => Ok(()),
    }
}

/// Makes the process's one pool, of so many threads; as many as there are processors if nothing is said. Whatever
/// is done in parallel after that runs on it, from whichever thread.
///
/// # Errors
/// A number of threads that cannot be had; a pool that is there already.
pub fn start_pool(threads: Option<u32>) -> Result<()> {
    check_threads(threads)?;
    rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0) as usize).build_global().map_err(
        |error| Failure::failed(format!("the threads could not be started: {error}; try --threads 1")),
    )
}

/// Runs `work` on the pool of [`start_pool`], which it makes.
///
/// # Errors
/// Those of `work`, and as [`start_pool`].
pub fn in_pool<T: Send>(threads: Option<u32>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    start_pool(threads)?;
    rayon::scope(|_| work())
}
