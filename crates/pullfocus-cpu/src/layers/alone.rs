//! One layer alone, over nothing, or its matte ([`pullfocus_core::Show`]).

use super::over;
use crate::rows::for_each_row;
use pullfocus_core::{Cancel, Plane, Result, Show};

/// Puts one value into every plane: nothing is 0, the matte of what covers everything 1.
pub fn even<'p>(planes: impl IntoIterator<Item = &'p mut Plane>, value: f32, cancel: &Cancel) -> Result<()> {
    for plane in planes {
        for_each_row(plane, cancel, |_, row| row.fill(value))?;
    }
    Ok(())
}

/// Replaces planes by those of a layer over nothing, or by its matte, both as `over` sees them; `layer` and `planes` stand in the same
/// order. Without coverage it covers all.
pub fn lay_alone<'p>(
    planes: impl IntoIterator<Item = &'p mut Plane>,
    layer: &[Plane],
    coverage: Option<&Plane>,
    show: Show,
    cancel: &Cancel,
) -> Result<()> {
    let planes = planes.into_iter();
    match coverage {
        None if show.is_matte() => even(planes, 1.0, cancel),
        Some(coverage) if show.is_matte() => {
            for plane in planes {
                for_each_row(plane, cancel, |y, row| {
                    for (value, coverage) in row.iter_mut().zip(coverage.row(y)) {
                        *value = coverage.clamp(0.0, 1.0);
                    }
                })?;
            }
            Ok(())
        }
        coverage => {
            for (plane, layer) in planes.zip(layer) {
                even([&mut *plane], 0.0, cancel)?;
                over(plane, layer, coverage, cancel)?;
            }
            Ok(())
        }
    }
}
