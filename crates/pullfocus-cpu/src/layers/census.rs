//! Counting a picture's diameters, for the places where layers are cut.

use pullfocus_core::split::{Census, Split, fast_asinh, knee, unit};
use pullfocus_core::{Cancel, Plane, Result};
use rayon::prelude::*;

/// Rows counted by one piece of work.
const BAND: usize = 64;

/// Counts the diameters and the depth edges of `coc`, and cuts it into `layers`.
pub fn split(coc: &Plane, layers: usize, display_width: f32, cancel: &Cancel) -> Result<Split> {
    let size = coc.size();
    let knee = knee(display_width);
    let per_step = 1.0 / unit(display_width);
    let position = |row: &[f32], out: &mut Vec<f32>| {
        out.clear();
        out.extend(row.iter().map(|c| fast_asinh(c / knee)));
    };
    let band = |band: usize| {
        let mut census = Census::default();
        let (mut u, mut below) = (Vec::new(), Vec::new());
        let rows = band * BAND..((band + 1) * BAND).min(size.height);
        position(coc.row(rows.start), &mut u);
        for y in rows {
            cancel.check()?;
            let row = coc.row(y);
            for &u in &u {
                census.pixel(u);
            }
            for (pair, u) in row.windows(2).zip(u.windows(2)) {
                census.pair(u[0], u[1], (pair[0] - pair[1]).abs() * per_step);
            }
            if y + 1 < size.height {
                let next = coc.row(y + 1);
                position(next, &mut below);
                for x in 0..size.width {
                    census.pair(u[x], below[x], (row[x] - next[x]).abs() * per_step);
                }
                std::mem::swap(&mut u, &mut below);
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
    Ok(census.split(layers, display_width))
}
