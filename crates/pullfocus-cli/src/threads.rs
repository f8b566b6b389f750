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

/// Runs `work` on a pool of so many threads; as many as there are processors if nothing is said.
///
/// # Errors
/// Those of `work`; a number of threads that cannot be had.
pub fn in_pool<T: Send>(threads: Option<u32>, work: impl FnOnce() -> Result<T> + Send) -> Result<T> {
    check_threads(threads)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0) as usize).build().map_err(
        |error| Failure::failed(format!("the threads could not be started: {error}; try --threads 1")),
    )?;
    pool.install(work)
}
