//! Pictures to spread: made ones like the third paper's, those of a data folder, the user's own.

use crate::data::{DevScene, read_all};
use crate::place::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use pullfocus::{Picture, Plane, Size};
use pullfocus_io::images::{Format, read_depth, read_picture};
use pullfocus_io::{Document, Limits, Selection};
use std::path::{Path, PathBuf};

/// Which pictures.
#[derive(Args, Clone, Debug, Default)]
pub struct Pictures {
    /// Folder of scenes; the 480 x 270 ones that ship with the project where none is given.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// A picture of one's own: OpenEXR, PNG, JPEG, TIFF, HDR, PFM.
    #[arg(value_name = "PICTURE", requires_all = ["focus_distance", "circle_at_infinity"])]
    picture: Option<PathBuf>,
    /// Its planar depth in metres, where the picture is not an OpenEXR file with a channel Z.
    #[arg(long, value_name = "FILE", requires = "picture")]
    depth: Option<PathBuf>,
    /// Distance to what is in focus, in metres.
    #[arg(long, value_name = "M", requires = "picture")]
    focus_distance: Option<f32>,
    /// Diameter of the circle of confusion of what is infinitely far away, in pixels.
    #[arg(long, value_name = "PX", requires = "picture")]
    circle_at_infinity: Option<f32>,
    /// Only pictures whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
}

/// One picture.
#[derive(Debug, Clone)]
pub struct Case {
    /// What it is called.
    pub name: String,
    /// Three colour planes.
    pub picture: Picture,
    /// Signed diameters in pixels.
    pub circle: Plane,
    /// Figures of the third paper whose kind of picture it is.
    pub figures: &'static [usize],
}

impl Case {
    /// Mean standard deviation of the PSF in pixels: a quarter of the diameter.
    pub fn mean_deviation(&self) -> f64 {
        let sum: f64 = self.circle.data().iter().map(|c| f64::from(c.abs())).sum();
        0.25 * sum / self.circle.data().len().max(1) as f64
    }

    /// Whether pictures of it are written: of a scene with several cameras the first alone.
    pub fn shown(&self) -> bool {
        self.name.rsplit_once('/').is_none_or(|(_, camera)| camera == "0")
    }

    /// Whether it has values that a screen cannot show.
    pub fn hdr(&self) -> bool {
        self.picture.colors.iter().flat_map(Plane::data).any(|v| *v > 1.0)
    }
}

/// A ball before a wall: its middle and radius in heights of the picture, and its distance in metres.
const BALLS: [[f32; 4]; 5] = [
    [0.22, 0.62, 0.20, 1.2],
    [0.55, 0.48, 0.13, 2.0],
    [0.86, 0.40, 0.08, 4.0],
    [1.05, 0.66, 0.17, 1.5],
    [0.40, 0.34, 0.05, 7.0],
];
/// The distance in focus in made pictures, in metres.
const FOCUS: f32 = 2.0;

/// Where the ball, the ground or the wall is that is seen at a place, and its colour before it is lit.
fn seen(x: f32, y: f32) -> (f32, [f32; 3]) {
    let ball = BALLS.iter().enumerate().filter(|(_, b)| (x - b[0]).hypot(y - b[1]) < b[2]);
    if let Some((i, b)) = ball.min_by(|a, b| a.1[3].total_cmp(&b.1[3])) {
        let light = 0.3 + 0.6 * (1.0 - (x - b[0] + 0.5 * b[2]).hypot(y - b[1] + 0.5 * b[2]) / (1.6 * b[2]));
        let band = f32::from((((y - b[1]) * 40.0 + 100.0) as usize).is_multiple_of(3));
        let color =
            [[0.8, 0.2, 0.1], [0.2, 0.7, 0.2], [0.15, 0.3, 0.85], [0.85, 0.7, 0.1], [0.7, 0.7, 0.7]][i];
        return (b[3], color.map(|c: f32| light * (c + 0.15 * band).min(1.0)));
    }
    let ground = 0.55 / (y - 0.3).max(1e-3);
    if ground < 12.0 {
        let checks = ((x - 0.66) * ground * 4.0 + 1000.0).floor() + (ground * 4.0).floor();
        return (ground, [0.15, 0.14, 0.12].map(|c| c + 0.55 * (checks % 2.0)));
    }
    let bricks = ((y * 24.0).fract() < 0.12) || ((x * 12.0 + 0.5 * (y * 24.0).floor()).fract() < 0.06);
    (12.0, if bricks { [0.5, 0.5, 0.48] } else { [0.45, 0.22, 0.16] })
}

/// A made picture whose PSFs have a mean deviation of `deviation` pixels, with lights of up to 500 or without.
fn made(name: &str, size: Size, deviation: f32, lights: bool, figures: &'static [usize]) -> Result<Case> {
    let at = |x: usize, y: usize| {
        let scale = 1.0 / size.height as f32;
        seen((x as f32 + 0.5) * scale, (y as f32 + 0.5) * scale)
    };
    let light = |x: usize, y: usize| {
        // A few pixels each, in a row along the wall and some on the ground.
        let cell = [size.width / 17, size.height / 11].map(|n| n.max(4));
        let on = x % cell[0] < 2 && y % cell[1] < 2 && (x / cell[0] * 7 + y / cell[1] * 3).is_multiple_of(4);
        if lights && on { 500.0 / (1 + x / cell[0] % 5) as f32 } else { 0.0 }
    };
    let plane = |c: usize| Plane::from_fn(size, |x, y| at(x, y).1[c] + light(x, y));
    let picture = Picture::opaque(vec![plane(0)?, plane(1)?, plane(2)?]);
    let mut case = Case {
        name: format!("{name}, {size}"),
        picture,
        circle: Plane::from_fn(size, |x, y| 1.0 - FOCUS / at(x, y).0)?,
        figures,
    };
    let factor = deviation / case.mean_deviation() as f32;
    case.circle.data_mut().iter_mut().for_each(|c| *c *= factor);
    Ok(case)
}

fn of_data(scene: &DevScene) -> impl Iterator<Item = Case> + '_ {
    scene.references.iter().map(|reference| Case {
        name: reference.name.clone(),
        picture: Picture::opaque(scene.input.picture.colors.clone()),
        circle: reference.circles.clone(),
        figures: &[],
    })
}

/// Colours and planar depth of a file; depth where it has any.
fn read(path: &Path) -> Result<(Picture, Option<Plane>)> {
    let limits = Limits::default();
    if Format::detect(path).is_ok() {
        return Ok((read_picture(path, &limits)?, None));
    }
    let document = Document::open(path, &limits)?;
    let selected = document.select(&Selection::default())?;
    Ok((selected.picture, selected.depth.map(|depth| depth.plane)))
}

impl Pictures {
    fn own(&self, path: &Path) -> Result<Case> {
        let (picture, mut depth) = read(path)?;
        if let Some(file) = &self.depth {
            depth = Some(match Format::detect(file) {
                Ok(_) => read_depth(file, &Limits::default())?.plane,
                Err(_) => read(file)?.1.with_context(|| format!("{} has no depth", file.display()))?,
            });
        }
        let depth =
            depth.with_context(|| format!("{} has no depth; name one with --depth", path.display()))?;
        ensure!(depth.size() == picture.size(), "depth is {}, the picture {}", depth.size(), picture.size());
        let colors = match picture.colors.len() {
            1 => vec![picture.colors[0].clone(); 3],
            _ => picture.colors,
        };
        ensure!(colors.len() == 3, "{} is neither grey nor RGB", path.display());
        let (focus, most) = (self.focus_distance.unwrap_or(1.0), self.circle_at_infinity.unwrap_or(0.0));
        ensure!(focus > 0.0 && most.is_finite(), "the focus distance must be above 0, the circle a number");
        let circle = Plane::from_fn(depth.size(), |x, y| most * (1.0 - focus / depth.at(x, y).max(1e-6)))?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        Ok(Case { name, picture: Picture::opaque(colors), circle, figures: &[] })
    }

    /// All of them; in a quick run a small made one and one of the data.
    pub fn read(&self, quick: bool) -> Result<Vec<Case>> {
        let size = if quick { Size::new(96, 72) } else { Size::new(1024, 768) };
        let scale = size.width as f32 / 1024.0;
        let mut cases = vec![
            made("made, LDR, wide", size, 20.0 * scale, false, &[8, 12])?,
            made("made, LDR", size, 10.0 * scale, false, &[9])?,
            made("made, HDR", size, 5.0 * scale, true, &[10])?,
            made("made, HDR, narrow", size, 2.5 * scale, true, &[11])?,
        ];
        let shipped = workspace().join("data/dev480");
        if self.data.is_some() || shipped.is_dir() {
            let scenes = read_all(self.data.as_ref().unwrap_or(&shipped))?;
            let most = if quick { 1 } else { usize::MAX };
            cases.extend(scenes.iter().flat_map(of_data).take(most));
        }
        if let Some(path) = &self.picture {
            cases.push(self.own(path)?);
        }
        cases.retain(|case| self.only.as_ref().is_none_or(|text| case.name.contains(text.as_str())));
        ensure!(!cases.is_empty(), "no picture is left");
        Ok(cases)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn made_pictures_are_as_wide_and_bright_as_they_say() {
        let cases = Pictures::default().read(true).unwrap();
        assert!((cases[0].mean_deviation() - 20.0 * 96.0 / 1024.0).abs() < 1e-3);
        assert!(!cases[0].hdr() && cases[2].hdr());
        let signs =
            cases[0].circle.data().iter().fold([false; 2], |[a, b], c| [a || *c < 0.0, b || *c > 0.0]);
        assert_eq!(signs, [true; 2], "something before the focus and something behind it");
        assert!(cases.iter().flat_map(|case| case.figures).count() == 5);
    }

    #[test]
    fn a_picture_of_one_s_own_needs_depth() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        image::RgbImage::from_fn(8, 6, |x, y| image::Rgb([x as u8, y as u8, 9])).save(&path).unwrap();
        let depth = folder.path().join("z.pfm");
        let grey: Vec<u8> = (0..48).flat_map(|i| (1.0 + i as f32).to_le_bytes()).collect();
        std::fs::write(&depth, [b"Pf\n8 6\n-1.0\n".as_slice(), &grey].concat()).unwrap();
        let mut own = Pictures {
            picture: Some(path),
            focus_distance: Some(2.0),
            circle_at_infinity: Some(10.0),
            only: Some("a.png".into()),
            ..Pictures::default()
        };
        assert!(own.read(true).unwrap_err().to_string().contains("--depth"));
        own.depth = Some(depth);
        let case = own.read(true).unwrap().swap_remove(0);
        // PFM begins at the bottom: the first value is the lower left pixel's, 1 m.
        assert!((case.circle.at(0, 5) + 10.0).abs() < 1e-5, "{}", case.circle.at(0, 5));
    }
}
