//! Layers: the picture taken apart by its circle of confusion, blurred, and put together again.

mod alone;
mod background;
mod census;
mod edges;
mod fill;
mod foreground;
mod general;

pub use alone::even;
pub use background::{blur_over_background, one_over_background};
pub use foreground::{Near, blur_element_over};
pub use general::blur_layers;

use crate::rows::for_each_row;
use pullfocus_core::{Cancel, Plane, Result};

/// Lays a premultiplied plane over another. Without coverage it covers all. Where a blur's lobes bring coverage above 1
/// the colour, which went with it, is brought back with it: what was even stays even.
fn over(behind: &mut Plane, front: &Plane, coverage: Option<&Plane>, cancel: &Cancel) -> Result<()> {
    for_each_row(behind, cancel, |y, row| match coverage {
        None => row.copy_from_slice(front.row(y)),
        Some(coverage) => {
            for ((behind, &front), &coverage) in row.iter_mut().zip(front.row(y)).zip(coverage.row(y)) {
                *behind = front / coverage.max(1.0) + (1.0 - coverage.clamp(0.0, 1.0)) * *behind;
            }
        }
    })
}
