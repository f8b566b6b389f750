//! The papers' figures with our scenes: each failure and its cure beside each other.

mod first;
mod second;

use crate::data::{DevScene, Reference, read_all};
use crate::panels::{Crop, Panel};
use crate::place::{Output, provenance, workspace};
use anyhow::{Context, Result};
use clap::Args;
use pullfocus::{Cancel, Diffusion, Integrator, Layering, Picture, Plane, Renderer, Scene, Settings};
use pullfocus_testkit::Grid;
use std::path::PathBuf;

/// Options of `figures`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    /// Folder of scenes; the 480 x 270 ones that ship with the project where none is given.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

/// One figure: its panels in rows of two or as told, and what they show.
struct Figure {
    /// File name without ending.
    name: &'static str,
    /// Heading.
    title: &'static str,
    /// What is to be seen, in Markdown.
    text: String,
    panels: Vec<Panel>,
    columns: usize,
}

/// Makes one figure out of the data.
type Maker = fn(&[DevScene]) -> Result<Figure>;

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let folder = options.data.clone().unwrap_or_else(|| workspace().join("data/dev480"));
    let scenes = read_all(&folder)?;
    let mut makers: Vec<Maker> = vec![
        first::figure_2,
        first::figure_3,
        first::figure_4,
        first::figure_6,
        first::figure_6_failure,
        second::figure_2_1_a,
        second::figure_2_1_b,
        second::figure_3_1,
        second::figure_3_2,
    ];
    if options.output.quick {
        makers.truncate(1);
    }
    let mut text = format!(
        "# The papers' figures, with our scenes\n\n{}\n\n\
         What the two diffusion papers show, made again with the pictures in `data/dev480`, and what this project does where theirs fail. The first\n\
         paper is Kass, Lefohn, Owens, *Interactive Depth of Field Using Simulated Diffusion on a GPU* (2006); the second is Beck-Norén, Valter,\n\
         Kinner, *Depth of Field by Simulated Heat Diffusion* (2012). Panels are named from left to right, row by row.\n\
         *Reference* is the same scene path traced through a true lens.\n\n",
        provenance()
    );
    for make in makers {
        let figure = make(&scenes)?;
        eprintln!("{}", figure.title);
        let file = format!("pictures/papers/{}.jpg", figure.name);
        options.output.write_bytes(&file, &Panel::grid(&figure.panels, figure.columns)?.to_jpeg()?)?;
        text += &format!("## {}\n\n{}\n\n![{}]({file})\n\n", figure.title, figure.text, figure.title);
    }
    options.output.write("papers.md", &text)
}

/// A scene by the beginning of its name.
fn scene<'a>(scenes: &'a [DevScene], name: &str) -> Result<&'a DevScene> {
    scenes.iter().find(|s| s.name.starts_with(name)).with_context(|| format!("the data has no scene {name}"))
}

fn reference(scene: &DevScene, index: usize) -> Result<&Reference> {
    scene.references.get(index).with_context(|| format!("{} has no reference {index}", scene.name))
}

/// A scene through a reference's lens.
fn render(mut scene: Scene, reference: &Reference, settings: &Settings) -> Result<Picture> {
    scene.base.picture.alpha = None;
    Renderer::new().render(&mut scene, Some(&reference.camera), settings, &Cancel::new())?;
    Ok(scene.base.picture)
}

/// The papers' integrator, one backward-Euler step, calibrated by variance.
fn one_step() -> Diffusion {
    Diffusion { integrator: Integrator::BackwardEuler { steps: 1 }, ..Diffusion::default() }
}

fn settings(layering: Layering, diffusion: Diffusion) -> Settings {
    Settings { layering, diffusion, ..Settings::default() }
}

fn grids(planes: &[Plane]) -> Vec<Grid> {
    planes.iter().map(Grid::from_plane).collect()
}

fn picture(grids: &[Grid]) -> Picture {
    Picture::opaque(grids.iter().map(Grid::to_plane).collect())
}

/// Panels of these pictures, cut to a part given in parts of the picture and enlarged.
fn panels(pictures: &[&Picture], crop: Option<[f64; 4]>, enlarge: usize) -> Result<Vec<Panel>> {
    pictures
        .iter()
        .map(|picture| {
            let panel = Panel::of(picture)?;
            let crop = crop.map(|part| pixels(part, panel.width, panel.height));
            Ok(crop.map_or(panel.clone(), |crop| panel.crop(crop)).enlarged(enlarge))
        })
        .collect()
}

/// Left, top, width, height in parts of the picture, as pixels.
fn pixels([x, y, w, h]: [f64; 4], width: usize, height: usize) -> Crop {
    let of = |part: f64, whole: usize| (part * whole as f64).round() as usize;
    [of(x, width), of(y, height), of(w, width), of(h, height)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figures_are_made() {
        let folder = tempfile::tempdir().unwrap();
        let output = Output { out: Some(folder.path().to_path_buf()), quick: true };
        run(&Options { output, data: None }).unwrap();
        let text = std::fs::read_to_string(folder.path().join("papers.md")).unwrap();
        assert!(text.contains("pictures/papers/first_2.jpg"));
        assert!(folder.path().join("pictures/papers/first_2.jpg").is_file());
    }

    #[test]
    fn parts_become_pixels() {
        assert_eq!(pixels([0.5, 0.0, 0.25, 1.0], 480, 270), [240, 0, 120, 270]);
    }
}
