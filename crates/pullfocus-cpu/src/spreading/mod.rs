//! Blur by spreading: every pixel becomes its point spread function (third paper: Kosloff, Barsky 2010).
//!
//! # Theory
//! A lens makes a disc of each point, so each pixel is added to the result as its PSF, with as much weight as it has. What is
//! added up is divided by the weight that arrived, which a further plane carries: constants are kept, at the borders too, and
//! a bright point is as bright as the points around leave it. (Energy is kept before that division.)
//!
//! # Changes from the paper
//! - A result is an average with positive weights, so it is held within its plane's own least and largest values: rounding
//!   cannot move a constant, nor bring a colour below 0.
//! - A matte (the first paper's background layer) is the weight with which a pixel is spread. Its 0 counts as
//!   [`LEAST_GAMMA`], as in diffusion, so that there is an answer everywhere.
//!
//! # Practice
//! Each method fills sums and weights on its own; this module prepares and divides. Work is cut by the picture's size
//! alone, so the bytes are the same for any number of threads.

mod aperture;
mod brute;
pub(crate) mod footprint;
mod pyramid;
mod splats;
mod square;
mod tensor;
#[cfg(test)]
mod tests;

use crate::rows::{fold_rows, for_each_row};
use pullfocus_core::scheme::LEAST_GAMMA;
use pullfocus_core::{Aperture, Cancel, Error, Method, Mipmap, Plane, Psf, Quality, Result, Size, Tensor};

/// Which spreading, and what it spreads over.
#[derive(Debug, Clone, Copy)]
pub struct Spread<'a> {
    /// Any but [`Method::Diffusion`].
    pub method: Method,
    /// The shape, where the method has a choice.
    pub psf: Psf,
    /// The aperture's shape, where it is spread.
    pub aperture: &'a Aperture,
    /// How finely the pyramid draws.
    pub quality: Quality,
    /// How the tensor filter works.
    pub tensor: Tensor,
    /// What the pyramid does between two levels.
    pub mipmap: Mipmap,
    /// Diameters of the circle of confusion in pixels of width; where they are negative, in front of focus, the aperture is
    /// turned by half a turn.
    pub circle: &'a Plane,
    /// Weight with which a pixel is spread, 0 or more; 1 everywhere if there is none. Values below 1e-15, NaN included,
    /// count as 1e-15.
    pub gamma: Option<&'a Plane>,
    /// Pixels of height for each pixel of width; 1 for square ones.
    pub vertical_scale: f32,
}

/// Memory kept from call to call.
#[derive(Debug, Default)]
pub struct SpreadBuffers {
    sums: Vec<Plane>,
    weight: Plane,
    methods: MethodBuffers,
}

/// What a method keeps for itself.
#[derive(Debug, Default)]
struct MethodBuffers {
    square: square::Sums,
    pyramid: pyramid::Pyramid,
    aperture: aperture::Shapes,
    tensor: tensor::Buffers,
}

impl Spread<'_> {
    fn size(&self) -> Size {
        self.circle.size()
    }

    /// The diameter that pixel (x, y) is spread over.
    #[inline(always)]
    fn diameter(&self, x: usize, y: usize) -> f32 {
        let Size { width, height } = self.size();
        pullfocus_core::psf::diameter(self.circle.at(x, y), width.max(height))
    }
}

/// The specific heat's floor, which serves weights as well.
#[inline(always)]
fn at_least(gamma: f32) -> f32 {
    // The comparison is false for NaN.
    if gamma > LEAST_GAMMA { gamma } else { LEAST_GAMMA }
}

/// Blurs `planes`, in place. All have the size of the circle of confusion, which may be anything, nothing included.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::Setting`], [`Error::Unsupported`] for diffusion, [`Error::OutOfMemory`], and
/// [`Error::Cancelled`], after which the planes hold anything.
pub fn spread(
    planes: &mut [&mut Plane],
    spread: &Spread<'_>,
    buffers: &mut SpreadBuffers,
    cancel: &Cancel,
) -> Result<()> {
    spread.psf.check(spread.method)?;
    spread.aperture.check()?;
    let size = spread.size();
    for plane in planes.iter() {
        plane.expect_size("a plane to spread", size)?;
    }
    if let Some(gamma) = spread.gamma {
        gamma.expect_size("the weight", size)?;
    }
    cancel.check()?;
    if size.area() == 0 || planes.is_empty() {
        return Ok(());
    }
    let mut ranges = Vec::with_capacity(planes.len());
    for plane in planes.iter_mut() {
        ranges.push(range(plane, cancel)?);
        if let Some(gamma) = spread.gamma {
            for_each_row(plane, cancel, |y, row| {
                row.iter_mut().zip(gamma.row(y)).for_each(|(value, &gamma)| *value *= at_least(gamma));
            })?;
        }
    }
    let SpreadBuffers { sums, weight, methods } = buffers;
    if sums.len() < planes.len() {
        sums.resize_with(planes.len(), Plane::default);
    }
    {
        let inputs: Vec<&Plane> = planes.iter().map(|plane| &**plane).collect();
        let mut outputs: Vec<&mut Plane> = sums[..planes.len()].iter_mut().chain([&mut *weight]).collect();
        for output in &mut outputs {
            output.resize(size)?;
        }
        add_up(&inputs, spread, &mut outputs, methods, cancel)?;
    }
    for ((plane, sum), (low, high)) in planes.iter_mut().zip(sums).zip(ranges) {
        for_each_row(plane, cancel, |y, row| {
            for (x, ((value, &sum), &weight)) in row.iter_mut().zip(sum.row(y)).zip(weight.row(y)).enumerate()
            {
                // No weight at all leaves the pixel as it is.
                let own = || *value / spread.gamma.map_or(1.0, |gamma| at_least(gamma.at(x, y)));
                *value = if weight > 0.0 { sum / weight } else { own() }.clamp(low, high);
            }
        })?;
    }
    Ok(())
}

/// Least and largest value of a plane.
fn range(plane: &Plane, cancel: &Cancel) -> Result<(f32, f32)> {
    let row = |y| {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for &value in plane.row(y) {
            low = if value < low { value } else { low };
            high = if value > high { value } else { high };
        }
        (low, high)
    };
    let joined =
        fold_rows(plane.size().height, cancel, row, |(a, b): (f32, f32), (c, d)| (a.min(c), b.max(d)))?;
    // Without any number there is nothing to hold on to.
    Ok(joined.filter(|(low, high)| low <= high).unwrap_or((f32::NEG_INFINITY, f32::INFINITY)))
}

/// Writes the sums of `inputs`, which carry their weight already, and after them the sum of weights.
fn add_up(
    inputs: &[&Plane],
    spread: &Spread<'_>,
    outputs: &mut [&mut Plane],
    buffers: &mut MethodBuffers,
    cancel: &Cancel,
) -> Result<()> {
    match spread.method {
        Method::Naive | Method::Gather => brute::add_up(inputs, spread, outputs, cancel),
        Method::Square => square::add_up(inputs, spread, outputs, &mut buffers.square, cancel),
        Method::Pyramid => pyramid::add_up(inputs, spread, outputs, &mut buffers.pyramid, cancel),
        Method::Aperture => aperture::add_up(inputs, spread, outputs, &mut buffers.aperture, cancel),
        Method::Tensor => tensor::add_up(inputs, spread, outputs, &mut buffers.tensor, cancel),
        Method::Diffusion => {
            Err(Error::Unsupported { what: "diffusion", reason: "it is no spreading method" })
        }
    }
}
