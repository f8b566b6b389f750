//! Loops over the rows of planes on the caller's threads, with cancellation between bands of rows.

use crate::wide;
use pullfocus_core::{Cancel, Plane, Result};
use rayon::prelude::*;

/// Rows in one piece of work: enough to be worth a thread, few enough to stop soon.
const BAND: usize = 16;

/// Calls `f(y, row)` for every row of `plane`.
pub fn for_each_row(plane: &mut Plane, cancel: &Cancel, f: impl Fn(usize, &mut [f32]) + Sync) -> Result<()> {
    let width = plane.size().width;
    if width == 0 {
        return Ok(());
    }
    plane.data_mut().par_chunks_mut(width * BAND).enumerate().try_for_each(|(band, rows)| {
        cancel.check()?;
        wide::run(Band { first: band * BAND, rows, width, f: &f });
        Ok(())
    })
}

/// Some rows of a plane and what is done with them.
struct Band<'a, F> {
    first: usize,
    rows: &'a mut [f32],
    width: usize,
    f: &'a F,
}

impl<F: Fn(usize, &mut [f32])> wide::Work for Band<'_, F> {
    #[inline(always)]
    fn run(self) {
        for (i, row) in self.rows.chunks_mut(self.width).enumerate() {
            (self.f)(self.first + i, row);
        }
    }
}

/// Folds every row with `f` and joins the results in the order of the rows, so that the outcome does not
/// depend on the number of threads.
pub fn fold_rows<T: Send>(
    height: usize,
    cancel: &Cancel,
    f: impl Fn(usize) -> T + Sync + Send,
    join: impl Fn(T, T) -> T,
) -> Result<Option<T>> {
    cancel.check()?;
    let rows: Vec<T> = (0..height).into_par_iter().with_min_len(BAND).map(f).collect();
    cancel.check()?;
    Ok(rows.into_iter().reduce(join))
}

/// The rows of several planes of one size: for each y, row y of every plane.
pub fn rows_of(planes: &mut [Plane]) -> Vec<Vec<&mut [f32]>> {
    let Some(size) = planes.first().map(Plane::size) else { return Vec::new() };
    if size.area() == 0 {
        return Vec::new();
    }
    let mut rows: Vec<Vec<&mut [f32]>> = (0..size.height).map(|_| Vec::with_capacity(planes.len())).collect();
    for plane in planes.iter_mut() {
        for (row, slice) in rows.iter_mut().zip(plane.data_mut().chunks_mut(size.width)) {
            row.push(slice);
        }
    }
    rows
}
