//! The third paper's figures 2 to 7: the pyramid's levels, the blur as a matrix, the tensor filter's sites.

use crate::data::{DevScene, Reference, read_all};
use crate::panels::Panel;
use crate::place::{Output, workspace};
use anyhow::{Context, Result};
use clap::Args;
use pullfocus::psf::variance;
use pullfocus::pyramid::{cell_variance, level_of, reach, splat};
use pullfocus::tensor::{Gathering, Sites, Spreading};
use pullfocus::{Aperture, Cancel, Method, Mipmap, Picture, Plane, Psf, Quality, Size, Tensor};
use pullfocus_cpu::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_testkit::Grid;
use pullfocus_testkit::reference::tensor::TensorFilter;

/// Options of `spreading-figures`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
}

/// Panels in rows of this many.
struct Figure(&'static str, usize, Vec<Panel>);

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let scenes = read_all(&workspace().join("data/dev480"))?;
    let mut figures = vec![svd()?, outer_product()?];
    if !options.output.quick {
        figures.extend([pyramid(&scenes)?, diagonal(&scenes)?, resampling(&scenes)?, missed()?]);
        figures.extend(sites(&scenes)?);
    }
    for Figure(name, columns, panels) in figures {
        let grid = Panel::grid(&panels, columns)?;
        // Photographs as JPEG, plots as PNG.
        let bytes = if name.ends_with("jpg") { grid.to_jpeg()? } else { grid.to_png()? };
        options.output.write_bytes(&format!("pictures/spreading/{name}"), &bytes)?;
        println!("{name}");
    }
    Ok(())
}

/// A grid from black at 0 to white at `most`.
fn grey(grid: &Grid, most: f64) -> Panel {
    Panel::of_circles(&grid.to_plane(), most as f32)
}

fn blurred(planes: &[Plane], circle: &Plane, method: Method, tensor: Tensor) -> Result<Picture> {
    let mut planes = planes.to_vec();
    let spreading = Spread {
        method,
        psf: Psf::Gaussian,
        aperture: &Aperture::DISC,
        quality: Quality::Standard,
        mipmap: Mipmap::Linear,
        tensor,
        circle,
        gamma: None,
        vertical_scale: 1.0,
    };
    let mut each: Vec<&mut Plane> = planes.iter_mut().collect();
    spread(&mut each, &spreading, &mut SpreadBuffers::default(), &Cancel::new())?;
    Ok(Picture::opaque(planes))
}

/// The circles of a lens whose aperture is this many times as wide.
fn wider(circles: &Plane, factor: f32) -> Result<Plane> {
    Ok(Plane::from_fn(circles.size(), |x, y| factor * circles.at(x, y))?)
}

fn scene<'a>(scenes: &'a [DevScene], name: &str) -> Result<(&'a DevScene, &'a Reference)> {
    let scene =
        scenes.iter().find(|s| s.name.starts_with(name)).with_context(|| format!("no scene {name}"))?;
    Ok((scene, scene.references.first().context("a scene has a reference")?))
}

/// Figure 2: what each level of the pyramid gets, divided by its weight, and the result.
fn pyramid(scenes: &[DevScene]) -> Result<Figure> {
    let (lights, lens) = scene(scenes, "S4")?;
    let size = lights.size;
    let circles = wider(&lens.circles, 2.5)?;
    let colors = &lights.input.picture.colors;
    let mut panels = vec![];
    for level in 0..5usize {
        let (width, height) = (((size.width - 1) >> level) + 1, ((size.height - 1) >> level) + 1);
        let reach = reach(5.3);
        let mut sums = vec![Grid::filled(width, height, 0.0); 4];
        for (x, y) in (0..size.height).flat_map(|y| (0..size.width).map(move |x| (x, y))) {
            let v = variance(f64::from(circles.at(x, y)));
            let (first, next) = level_of(v, Quality::Standard);
            let share = if level == first {
                1.0 - next
            } else if level == first + 1 {
                next
            } else {
                0.0
            };
            if share == 0.0 {
                continue;
            }
            let axis = |at: usize| {
                let middle = (at as f64 + 0.5) / (1 << level) as f64 - 0.5 - (at >> level) as f64;
                splat(cell_variance(v, level), middle, level == 0, reach)
            };
            let (across, down) = (axis(x), axis(y));
            for (i, wy) in down.iter().enumerate() {
                let Some(row) = ((y >> level) + i).checked_sub(reach).filter(|row| *row < height) else {
                    continue;
                };
                for (k, wx) in across.iter().enumerate() {
                    let Some(column) = ((x >> level) + k).checked_sub(reach).filter(|c| *c < width) else {
                        continue;
                    };
                    let weight = f64::from(share) * wx * wy;
                    for (channel, sum) in sums.iter_mut().enumerate() {
                        let value = colors.get(channel).map_or(1.0, |plane| f64::from(plane.at(x, y)));
                        sum.data[row * width + column] += weight * value;
                    }
                }
            }
        }
        let shown = |channel: usize| {
            let most = sums[3].largest().max(1e-9);
            Grid::from_fn(size.width, size.height, |x, y| {
                let at = (y >> level) * width + (x >> level);
                sums[channel].data[at] / most
            })
            .to_plane()
        };
        panels.push(Panel::of(&Picture::opaque((0..3).map(shown).collect()))?);
    }
    panels.push(Panel::of(&blurred(colors, &circles, Method::Pyramid, Tensor::default())?)?);
    Ok(Figure("third_2.jpg", 3, panels))
}

const SIDE: usize = 192;

/// The variance of a blur of one axis that grows along the picture.
fn growing(at: f64) -> f64 {
    let sigma = 1.5 + 14.0 * at / SIDE as f64;
    sigma * sigma
}

fn gaussian(distance: f64, variance: f64) -> f64 {
    (-0.5 * distance * distance / variance).exp() / (std::f64::consts::TAU * variance).sqrt()
}

/// The spreading matrix of one axis: in each column the PSF of its pixel.
fn matrix() -> Grid {
    Grid::from_fn(SIDE, SIDE, |x, y| gaussian(y as f64 - x as f64, growing(x as f64)))
}

/// A matrix as it is shown: the square root, so that faint parts are seen.
fn shown(matrix: &Grid) -> Panel {
    grey(&matrix.map(|v| v.max(0.0).sqrt()), 0.35)
}

/// Figure 3: the best separable approximation of each block, for smaller and smaller blocks.
fn svd() -> Result<Figure> {
    let whole = matrix();
    let mut panels = vec![shown(&whole)];
    for block in [96, 48, 24] {
        let mut made = Grid::filled(SIDE, SIDE, 0.0);
        for (left, top) in
            (0..SIDE / block).flat_map(|i| (0..SIDE / block).map(move |k| (i * block, k * block)))
        {
            let at = |x: usize, y: usize| whole.at(left + x, top + y);
            let most = (0..block * block).map(|i| at(i % block, i / block)).fold(0.0, f64::max);
            if most < 1e-9 {
                continue;
            }
            // The first singular vectors, by powers.
            let mut right = vec![1.0; block];
            let mut column = vec![0.0; block];
            for _ in 0..60 {
                for (y, value) in column.iter_mut().enumerate() {
                    *value = (0..block).map(|x| at(x, y) * right[x]).sum();
                }
                for (x, value) in right.iter_mut().enumerate() {
                    *value = (0..block).map(|y| at(x, y) * column[y]).sum();
                }
                let length = right.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-300);
                right.iter_mut().for_each(|v| *v /= length);
            }
            for (x, y) in (0..block).flat_map(|x| (0..block).map(move |y| (x, y))) {
                made.data[(top + y) * SIDE + left + x] = column[y] * right[x];
            }
        }
        panels.push(shown(&made));
    }
    Ok(Figure("third_3.png", 4, panels))
}

/// Figure 4: a Gaussian is the product of a column and a row.
fn outer_product() -> Result<Figure> {
    let side = 160;
    let of = |at: usize| (-0.5 * ((at as f64 - 79.5) / 24.0).powi(2)).exp();
    let band = |at: usize| at.abs_diff(80) < 8;
    let column = Grid::from_fn(side, side, |x, y| if band(x) { of(y) } else { 0.0 });
    let row = Grid::from_fn(side, side, |x, y| if band(y) { of(x) } else { 0.0 });
    let both = Grid::from_fn(side, side, |x, y| of(x) * of(y));
    Ok(Figure("third_4.png", 3, [column, row, both].iter().map(|grid| grey(grid, 1.0)).collect()))
}

/// Figure 5: the matrix out of separable Gaussians down its diagonal, every other one, and a picture blurred along its rows by it.
fn diagonal(scenes: &[DevScene]) -> Result<Figure> {
    let mut places = vec![];
    let mut at = 0.0;
    // As far apart as 0.6 of the deviation, beyond both ends.
    while at < SIDE as f64 + 60.0 {
        let distance = 0.6 * growing(at).sqrt();
        places.push((at, distance));
        at += distance;
    }
    places.extend((1..12).map(|n| (-0.9 * f64::from(n), 0.9)));
    let term = |(at, distance): (f64, f64)| {
        let v = growing(at.max(0.0));
        let g = pullfocus::tensor::gathered(v, distance.max(1.01));
        Grid::from_fn(SIDE, SIDE, |x, y| {
            distance * gaussian(x as f64 - at, g) * gaussian(y as f64 - at, v - g)
        })
    };
    let sum = |places: Vec<(f64, f64)>| {
        places
            .into_iter()
            .map(term)
            .fold(Grid::filled(SIDE, SIDE, 0.0), |sum, term| sum.zip(&term, |a, b| a + b))
    };
    let whole = sum(places.clone());
    let mut ordered = places;
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0));
    let every_third = sum(ordered.into_iter().step_by(3).collect());
    let (fence, _) = scene(scenes, "S1")?;
    let picture = fence.input.picture.colors.iter().map(|plane| {
        let part = Grid::from_fn(SIDE, SIDE, |x, y| f64::from(plane.at(150 + x, 40 + y)));
        part.by_rows(|_, row| {
            let out = |y: usize| {
                let weights = (0..SIDE).map(|x| whole.at(x, y));
                let (sum, weight) = weights.zip(row).fold((0.0, 0.0), |(s, n), (w, v)| (s + w * v, n + w));
                sum / weight
            };
            (0..SIDE).map(out).collect()
        })
        .to_plane()
    });
    let blurred = Panel::of(&Picture::opaque(picture.collect()))?;
    Ok(Figure("third_5.png", 4, vec![shown(&matrix()), shown(&whole), shown(&every_third), blurred]))
}

/// Figure 6: with one size of circle, the tensor filter is down-sampling and up-sampling.
fn resampling(scenes: &[DevScene]) -> Result<Figure> {
    let (mill, _) = scene(scenes, "S3")?;
    let colors = &mill.input.picture.colors;
    let circle = Plane::filled(mill.size, 70.0)?;
    let filter = TensorFilter {
        settings: Tensor::default(),
        diameter: &Grid::from_plane(&circle),
        vertical_scale: 1.0,
    };
    let sites = filter.sites();
    let first = sites.first().context("there are sites")?;
    let (side, v) = (first.distance, first.variance);
    let g = pullfocus::tensor::gathered(v, side);
    let low = colors.iter().map(|plane| {
        let grid = Grid::from_plane(plane);
        let along = |length: usize, line: &[f64]| -> Vec<f64> {
            (0..length)
                .map(|i| {
                    let middle = ((i as f64 / side).floor() + 0.5) * side - 0.5;
                    let weights = line.iter().enumerate().map(|(k, v)| (gaussian(k as f64 - middle, g), v));
                    let (sum, weight) = weights.fold((0.0, 0.0), |(s, n), (w, v)| (s + w * v, n + w));
                    sum / weight
                })
                .collect()
        };
        grid.by_rows(|_, row| along(row.len(), row))
            .by_columns(|_, column| along(column.len(), column))
            .to_plane()
    });
    let low = Panel::of(&Picture::opaque(low.collect()))?;
    let naive = blurred(colors, &circle, Method::Naive, Tensor::default())?;
    let tensor = blurred(colors, &circle, Method::Tensor, Tensor::default())?;
    let panels = vec![Panel::of(&mill.input.picture)?, low, Panel::of(&tensor)?, Panel::of(&naive)?];
    Ok(Figure("third_6.jpg", 2, panels))
}

/// Where sites lie, as white points.
fn places(circle: &Plane, sites: Sites) -> Panel {
    let Size { width, height } = circle.size();
    let settings = Tensor { sites, ..Tensor::default() };
    let filter = TensorFilter { settings, diameter: &Grid::from_plane(circle), vertical_scale: 1.0 };
    let mut grid = Grid::filled(width, height, 0.0);
    for site in filter.sites() {
        let [x, y] = site.at.map(f64::floor);
        if x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64 {
            grid.data[y as usize * width + x as usize] += site.share;
        }
    }
    grey(&grid, 1.0)
}

/// Figure 7: a blur map, sites by both rules, and the result.
fn sites(scenes: &[DevScene]) -> Result<[Figure; 2]> {
    let (table, lens) = scene(scenes, "S5")?;
    let colors = &table.input.picture.colors;
    let circles = wider(&lens.circles, 4.0)?;
    let tensor = |settings| Panel::of(&blurred(colors, &circles, Method::Tensor, settings)?);
    let skip = Tensor {
        sites: Sites::Skip,
        gather: Gathering::Naive,
        spread: Spreading::Naive,
        ..Tensor::default()
    };
    let placed = vec![
        Panel::of_circles(&circles, 100.0),
        places(&circles, Sites::Quadtree),
        places(&circles, Sites::Skip),
    ];
    let naive = Panel::of(&blurred(colors, &circles, Method::Naive, Tensor::default())?)?;
    let results = vec![naive, tensor(Tensor::default())?, tensor(skip)?];
    Ok([Figure("third_7_sites.png", 3, placed), Figure("third_7.jpg", 3, results)])
}

/// Section 6.1: small blurred things that no skip level meets.
fn missed() -> Result<Figure> {
    let size = Size::new(160, 120);
    let thing = |x: usize, y: usize| (x + 19) % 32 < 5 && (y + 11) % 30 < 5;
    let ground = |x: usize, y: usize| if (x / 8 + y / 8).is_multiple_of(2) { 0.05 } else { 0.12 };
    let plane = |color: f32| Plane::from_fn(size, move |x, y| if thing(x, y) { color } else { ground(x, y) });
    let colors = [plane(8.0)?, plane(4.0)?, plane(0.6)?];
    // A skip level of 9: few of the things hold a row and a column that are multiples of it.
    let circle = Plane::from_fn(size, |x, y| if thing(x, y) { 60.0 } else { 4.0 })?;
    let tensor = |sites| blurred(&colors, &circle, Method::Tensor, Tensor { sites, ..Tensor::default() });
    let naive = blurred(&colors, &circle, Method::Naive, Tensor::default())?;
    let pictures = [Picture::opaque(colors.to_vec()), naive, tensor(Sites::Quadtree)?, tensor(Sites::Skip)?];
    let panels = pictures.iter().map(|picture| Ok(Panel::of(picture)?.enlarged(2))).collect::<Result<_>>()?;
    Ok(Figure("third_missed.png", 4, panels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figures_are_made() {
        let folder = tempfile::tempdir().unwrap();
        run(&Options { output: Output { out: Some(folder.path().to_path_buf()), quick: true } }).unwrap();
        assert!(folder.path().join("pictures/spreading/third_3.png").is_file());
    }
}
