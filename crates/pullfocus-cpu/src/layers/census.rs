//! Counting a picture's diameters, for the places where layers are cut.

use crate::rows::for_each_row;
use crate::work::Work;
use pullfocus_core::split::{Census, Split, fast_asinh, knee, unit};
use pullfocus_core::{Plane, Result};
use rayon::prelude::*;

/// Rows counted by one piece of work.
const BAND: usize = 64;

/// Counts the diameters and the depth edges of `coc`, and cuts it into at most `layers`. Returns the position of
/// each pixel on the scale of layers, too.
pub fn split(work: &mut Work<'_>, coc: &Plane, layers: usize) -> Result<(Split, Plane)> {
    let size = coc.size();
    let knee = knee(work.display_width);
    let mut scale = work.memory.planes.take(size)?;
    for_each_row(&mut scale, work.cancel, |y, row| {
        for (u, c) in row.iter_mut().zip(coc.row(y)) {
            *u = fast_asinh(c / knee);
        }
    })?;
    let per_step = 1.0 / unit(work.display_width);
    let cancel = work.cancel;
    let band = |band: usize| {
        let mut census = Census::default();
        for y in band * BAND..((band + 1) * BAND).min(size.height) {
            cancel.check()?;
            let (c, u) = (coc.row(y), scale.row(y));
            for &u in u {
                census.pixel(u);
            }
            for (pair, u) in c.windows(2).zip(u.windows(2)) {
                census.pair(u[0], u[1], (pair[0] - pair[1]).abs() * per_step);
            }
            if y + 1 < size.height {
                let below = coc.row(y + 1).iter().zip(scale.row(y + 1));
                for ((c, u), (c_below, u_below)) in c.iter().zip(u).zip(below) {
                    census.pair(*u, *u_below, (c - c_below).abs() * per_step);
                }
            }
        }
        Ok(census)
    };
    // Bands are joined in their order: the same sums for any number of threads.
    let bands: Result<Vec<Census>> = (0..size.height.div_ceil(BAND)).into_par_iter().map(band).collect();
    let mut census = Census::default();
    for band in bands? {
        census.add(&band);
    }
    Ok((census.split(layers, work.display_width), scale))
}
