//! FLIP: the difference that a viewer sees when two pictures alternate on a screen.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020, for pictures of low dynamic range.
//!
//! # Theory
//! 1. Both pictures go to the opponent space YCxCz and through the eye's contrast sensitivity at the viewing
//!    distance, a Gaussian per channel (two for Cz); then to L*a*b* with Hunt's adjustment. Their HyAB distance to
//!    the power 0.7, remapped to 0..1, is the colour difference (section 4.1).
//! 2. Edges and points (first and second derivatives of a Gaussian) of the unfiltered Y are compared; the
//!    larger difference, to the power 0.5, is the feature difference (section 4.2).
//! 3. FLIP is the colour difference to the power (1 - feature difference) (section 4.3).
//!
//! # Practice
//! Filters are separated as in the published tool (version 1.7), sampled at pixels, cut at three standard
//! deviations (the widest one of the colour filters for all of them) and normalised; outside the picture the
//! border's pixels continue. Work goes through strips of rows, so that memory beside the result stays below
//! about 600 rows of either picture; a strip's rows are shared out over the caller's rayon pool.

mod color;
mod filter;

use crate::error::{Error, Result};
use color::{color_difference, to_lab, to_opponent};
use filter::{Filters, LANES, Window};
use pullfocus_core::{Plane, srgb};
use rayon::prelude::*;

/// The published tool's viewer: 0.7 m before a screen 0.7 m and 3840 pixels wide, about 67 pixels per degree.
pub const DEFAULT_PIXELS_PER_DEGREE: f32 = 67.020_64;

/// What FLIP found.
#[derive(Debug, Clone, PartialEq)]
pub struct FlipMap {
    /// Mean over all pixels, 0 (equal) to 1.
    pub mean: f64,
    /// The difference at each pixel, 0 to 1.
    pub map: Plane,
}

/// FLIP at [`DEFAULT_PIXELS_PER_DEGREE`], of sRGB-encoded pictures from 0 to 1.
///
/// # Errors
/// [`Error::Core`] where sizes differ or memory cannot be had, [`Error::Empty`].
pub fn flip(reference: &[Plane; 3], test: &[Plane; 3]) -> Result<FlipMap> {
    flip_at(reference, test, DEFAULT_PIXELS_PER_DEGREE)
}

/// Rows of a strip; a multiple of what two or more threads take at a time.
const STRIP: usize = 512;
/// Values of one row after the pass along it: Y, Cx, two of Cz, and Y under the three feature filters.
const CHANNELS: usize = 7;

/// FLIP for a viewer for whom one degree of sight is `pixels_per_degree` pixels: 1 to 1000.
///
/// # Errors
/// As [`flip`], and [`Error::PixelsPerDegree`].
pub fn flip_at(reference: &[Plane; 3], test: &[Plane; 3], pixels_per_degree: f32) -> Result<FlipMap> {
    let size = crate::common_size(reference, test)?;
    if !(1.0..=1000.0).contains(&pixels_per_degree) {
        return Err(Error::PixelsPerDegree { value: pixels_per_degree });
    }
    let filters = Filters::new(pixels_per_degree);
    let reach = filters.reach();
    let mut map = Plane::filled(size, 0.0)?;
    // Rows are padded to whole vectors.
    let stride = size.width.next_multiple_of(LANES);
    let rows_held = (STRIP + 2 * reach).min(size.height);
    // Both pictures' filtered rows, row by row, then channel by channel.
    let mut filtered = Plane::default();
    filtered.resize(pullfocus_core::Size::new(2 * CHANNELS * stride, rows_held))?;

    for (strip, rows) in map.data_mut().chunks_mut(STRIP * size.width).enumerate() {
        let first = strip * STRIP;
        let count = rows.len() / size.width;
        let held = first.saturating_sub(reach)..(first + count + reach).min(size.height);
        let along = filtered.data_mut().par_chunks_mut(2 * CHANNELS * stride);
        along.zip(held.clone().into_par_iter()).for_each_init(
            || RowScratch::new(size.width, stride, reach),
            |scratch, (out, y)| {
                let (a, b) = out.split_at_mut(CHANNELS * stride);
                scratch.filter_along(&filters, reference, y, a);
                scratch.filter_along(&filters, test, y, b);
            },
        );
        let window = Window { data: filtered.data(), held, stride, per_row: 2 * CHANNELS };
        rows.par_chunks_mut(size.width).enumerate().for_each_init(
            || ColumnScratch::new(stride),
            |scratch, (y, out)| scratch.compare(&filters, &window, first + y, out),
        );
    }
    let per_row = map.data().par_chunks(size.width).map(|row| row.iter().map(|&v| f64::from(v)).sum::<f64>());
    let sum: f64 = per_row.collect::<Vec<_>>().iter().sum();
    Ok(FlipMap { mean: sum / size.area() as f64, map })
}

/// One thread's buffers for the pass along rows: Y, Cx and Cz of a row with its border continued.
struct RowScratch {
    reach: usize,
    opponent: [Vec<f32>; 3],
}

impl RowScratch {
    fn new(width: usize, stride: usize, reach: usize) -> Self {
        debug_assert!(stride >= width);
        Self { reach, opponent: [0; 3].map(|_| vec![0.0; stride + 2 * reach]) }
    }

    fn filter_along(&mut self, filters: &Filters, picture: &[Plane; 3], y: usize, out: &mut [f32]) {
        let [r, g, b] = [0, 1, 2].map(|c| picture[c].row(y));
        let reach = self.reach;
        let [luminance, cx, cz] = &mut self.opponent;
        for (x, ((&r, &g), &b)) in r.iter().zip(g).zip(b).enumerate() {
            let linear = [r, g, b].map(|v| srgb::decode(crate::clipped(v)));
            [luminance[reach + x], cx[reach + x], cz[reach + x]] = to_opponent(linear);
        }
        for channel in &mut self.opponent {
            let (first, last) = (channel[reach], channel[reach + r.len() - 1]);
            channel[..reach].fill(first);
            channel[reach + r.len()..].fill(last);
        }
        let [luminance, cx, cz] = &self.opponent;
        let stride = out.len() / CHANNELS;
        let mut out = out.chunks_exact_mut(stride);
        let taps_and_source = [
            (&filters.y, luminance),
            (&filters.cx, cx),
            (&filters.cz[0], cz),
            (&filters.cz[1], cz),
            (&filters.smooth, luminance),
            (&filters.edge, luminance),
            (&filters.point, luminance),
        ];
        for (taps, source) in taps_and_source {
            if let Some(out) = out.next() {
                taps.along(source, reach, out);
            }
        }
    }
}

/// One thread's buffers for the pass down columns: the rows of filtered values that one row of the map needs.
struct ColumnScratch {
    /// Y, Cx, Cz of both pictures; the second part of Cz is added in place.
    color: [[Vec<f32>; 4]; 2],
    /// Edge and point, each across and down, of both pictures.
    feature: [[Vec<f32>; 4]; 2],
}

impl ColumnScratch {
    fn new(stride: usize) -> Self {
        let rows = || [0; 2].map(|_| [0; 4].map(|_| vec![0.0; stride]));
        Self { color: rows(), feature: rows() }
    }

    fn compare(&mut self, filters: &Filters, window: &Window<'_>, y: usize, out: &mut [f32]) {
        for picture in 0..2 {
            let base = picture * CHANNELS;
            let color = &mut self.color[picture];
            let colour_taps = [&filters.y, &filters.cx, &filters.cz[0], &filters.cz[1]];
            for (channel, (taps, row)) in colour_taps.into_iter().zip(color).enumerate() {
                taps.down(window, base + channel, y, row);
            }
            let [edge_across, edge_down, point_across, point_down] = &mut self.feature[picture];
            filters.smooth.down(window, base + 5, y, edge_across);
            filters.edge.down(window, base + 4, y, edge_down);
            filters.smooth.down(window, base + 6, y, point_across);
            filters.point.down(window, base + 4, y, point_down);
        }
        let lab = |picture: usize, x: usize| {
            let [luminance, cx, cz_1, cz_2] = &self.color[picture];
            to_lab([luminance[x], cx[x], cz_1[x] + cz_2[x]])
        };
        // Y runs from -16 to 100, and features are measured on 0 to 1: (Y + 16) / 116.
        let size = |picture: usize, from: usize, x: usize| {
            let (across, down) = (self.feature[picture][from][x], self.feature[picture][from + 1][x]);
            (across * across + down * down).sqrt() * (1.0 / 116.0)
        };
        for (x, out) in out.iter_mut().enumerate() {
            let color = color_difference(lab(0, x), lab(1, x));
            let edge = (size(0, 0, x) - size(1, 0, x)).abs();
            let point = (size(0, 2, x) - size(1, 2, x)).abs();
            let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt();
            *out = color.powf(1.0 - feature);
        }
    }
}
