//! The tensor filter (third paper, section 6): the blur as a sum of separable terms down its matrix' diagonal. Each site gathers
//! one average under a Gaussian and spreads it as a Gaussian; the larger the blur, the fewer there are.
//!
//! # Changes from the paper
//! - Spacing and variances are derived ([`pullfocus_core::tensor`]), and a site counts as much as the pixels that it stands for:
//!   without that, dense sites outshine sparse ones where the blur changes.
//! - Sites go on beyond the borders, in line with those at the border, so that an even blur is the naive one there too.
//! - A leaf's side is a power of two, so its middle is that of a cell of the pyramid's level with this side, and both
//!   steps of such a site are small Gaussians in the middle of a cell.
//! - Repeated integration is done in whole numbers, which wrap around and come out exact: sums of sums of sums of f64 lose everything.
//!
//! # Practice
//! The steps follow each other for all sites: the averages are kept, in the order of the sites, which depends on the picture alone.
//! Each step shares out its work by sites or by rows of its result, so that the bytes do not depend on the threads.

mod integral;
mod levels;
mod naive;
mod sites;
#[cfg(test)]
mod tests;

use super::splats::Splats;
use super::{Spread, at_least};
use pullfocus_core::tensor::{Gathering, Spreading};
use pullfocus_core::{Cancel, Error, Plane, Quality, Result, Size};
use sites::Sites;

/// Sites in one piece of work.
const CHUNK: usize = 512;

/// Sites, their averages, levels and tables, kept from call to call.
#[derive(Debug, Default)]
pub struct Buffers {
    sites: Sites,
    levels: levels::Levels,
    integral: integral::Integral,
    splats: Option<([Splats; 2], f32)>,
}

/// What every step has at hand.
#[derive(Clone, Copy)]
struct Call<'a> {
    inputs: &'a [&'a Plane],
    spread: &'a Spread<'a>,
    splats: &'a [Splats; 2],
    /// Planes and, after them, the weight.
    channels: usize,
    cancel: &'a Cancel,
}

impl Call<'_> {
    /// Value of a channel at a pixel, with its weight.
    #[inline(always)]
    fn value(&self, channel: usize, x: usize, y: usize) -> f32 {
        match self.inputs.get(channel) {
            Some(input) => input.at(x, y),
            None => self.spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(x, y))),
        }
    }

    fn size(&self) -> Size {
        self.spread.size()
    }
}

/// Zeros, or an error that says how many bytes there are not.
fn zeros<T: Clone + Default>(data: &mut Vec<T>, length: usize, what: &'static str, size: Size) -> Result<()> {
    data.clear();
    data.try_reserve_exact(length).map_err(|_| Error::OutOfMemory {
        what,
        size,
        bytes: (length * size_of::<T>()) as u64,
    })?;
    data.resize(length, T::default());
    Ok(())
}

/// See [`super::add_up`].
pub fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    buffers: &mut Buffers,
    cancel: &Cancel,
) -> Result<()> {
    spread.tensor.check()?;
    let scale = spread.vertical_scale;
    let Buffers { sites, levels, integral, splats } = buffers;
    if !matches!(splats, Some((_, of)) if *of == scale) {
        let ratio = |own: f32, other: f32| (own / own.min(other)).powi(2);
        let axes = [ratio(1.0, scale), ratio(scale, 1.0)];
        *splats = Some((axes.map(|ratio| Splats::new(Quality::Standard, ratio)), scale));
    }
    let Some((splats, _)) = splats else { return Ok(()) };
    let call = Call { inputs, spread, splats, channels: outputs.len(), cancel };
    sites.place(&call)?;
    let pyramid = (spread.tensor.gather == Gathering::Pyramid, spread.tensor.spread == Spreading::Pyramid);
    if pyramid.0 || pyramid.1 {
        levels.fit(&call, sites)?;
    }
    match spread.tensor.gather {
        Gathering::Naive => naive::gather(&call, sites)?,
        Gathering::Pyramid => levels.gather(&call, sites)?,
        Gathering::RepeatedIntegration => integral.gather(&call, sites)?,
    }
    match spread.tensor.spread {
        Spreading::Naive => naive::spread(&call, sites, outputs),
        Spreading::Pyramid => levels.spread(&call, sites, outputs),
    }
}
