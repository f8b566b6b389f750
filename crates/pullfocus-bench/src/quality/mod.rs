//! Every method against path-traced references.

mod methods;
pub mod score;
mod write;

use crate::data::{DevScene, read_all};
use crate::panels::Panel;
use crate::place::{Output, workspace};
use anyhow::{Context, Result, ensure};
use clap::Args;
use methods::Method;
use pullfocus::Picture;
use score::{Score, Truth};
use std::path::PathBuf;
use std::time::Instant;

/// Options of `quality`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    /// Folder of scenes; the 480 x 270 ones that ship with the project where none is given.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only methods whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Only scenes whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    scene: Option<String>,
    /// Leave out the brute-force baselines, which take seconds a picture.
    #[arg(long)]
    no_brute_force: bool,
    /// Write whole pictures of every method (PNG) into this folder, to be looked at.
    #[arg(long, value_name = "DIR")]
    pictures: Option<PathBuf>,
}

/// One method's score on one picture.
struct Entry {
    score: Score,
    seconds: f64,
}

/// All scores: a row per method, a column per reference.
struct Results {
    methods: Vec<Method>,
    references: Vec<String>,
    entries: Vec<Vec<Entry>>,
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let folder = options.data.clone().unwrap_or_else(|| workspace().join("data/dev480"));
    let mut scenes = read_all(&folder)?;
    scenes.retain(|scene| options.scene.as_ref().is_none_or(|text| scene.name.contains(text.as_str())));
    if options.output.quick {
        scenes.truncate(1);
        scenes.iter_mut().for_each(|scene| scene.references.truncate(1));
    }
    let mut methods = methods::all();
    methods.retain(|method| {
        options.only.as_ref().is_none_or(|text| method.name().contains(text.as_str()))
            && !(method.brute_force() && (options.no_brute_force || options.output.quick))
    });
    ensure!(!scenes.is_empty() && !methods.is_empty(), "no scene or no method is left to score");
    let mut results =
        Results { entries: methods.iter().map(|_| vec![]).collect(), methods, references: vec![] };
    for scene in &scenes {
        for index in 0..scene.references.len() {
            score_reference(options, scene, index, &mut results)?;
        }
    }
    let text = write::report(&scenes, &results);
    options.output.write("results/quality.md", &text)
}

fn score_reference(options: &Options, scene: &DevScene, index: usize, results: &mut Results) -> Result<()> {
    let reference = &scene.references[index];
    eprintln!("{} ({})", reference.name, scene.size);
    let truth = Truth::new(scene, reference)?;
    for (row, method) in results.methods.iter().enumerate() {
        let start = Instant::now();
        let picture = method
            .blur(scene, reference)
            .with_context(|| format!("{} on {}", method.name(), reference.name))?;
        let seconds = start.elapsed().as_secs_f64();
        let score = truth.score(&picture)?;
        if let Some(folder) = &options.pictures {
            let name = format!("{}-{}.png", reference.name, method.name()).replace(['/', ' ', ':', ','], "_");
            crate::place::write_whole(&folder.join(name), &Panel::of(&picture)?.to_png()?)?;
        }
        results.entries[row].push(Entry { score, seconds });
    }
    results.references.push(reference.name.clone());
    let filtered = options.only.is_some() || options.no_brute_force;
    if options.output.docs().is_some() && !filtered {
        crops(options, scene, &truth, index)?;
    }
    Ok(())
}

/// Pinhole, one layer, final, reference: around where one layer errs most.
fn crops(options: &Options, scene: &DevScene, truth: &Truth, index: usize) -> Result<()> {
    let reference = &scene.references[index];
    let single = methods::single_layer().blur(scene, reference)?;
    let last = methods::last().blur(scene, reference)?;
    let [w, h] = [scene.size.width / 3, scene.size.height / 3];
    let crop = truth.worst_place(&single, w, h)?;
    let panel = |picture: &Picture| -> Result<Panel> { Ok(Panel::of(picture)?.crop(crop)) };
    let panels = [panel(&scene.input.picture)?, panel(&single)?, panel(&last)?, panel(&reference.picture)?];
    let name = write::crop_name(&reference.name);
    options.output.write_bytes(&name, &Panel::grid(&panels, 4)?.to_png()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_scores_every_fast_method() {
        let folder = tempfile::tempdir().unwrap();
        let options = Options {
            output: Output { out: Some(folder.path().to_path_buf()), quick: true },
            data: None,
            only: None,
            scene: Some("S3".to_owned()),
            no_brute_force: false,
            pictures: None,
        };
        run(&options).unwrap();
        let text = std::fs::read_to_string(folder.path().join("results/quality.md")).unwrap();
        for method in methods::all().iter().filter(|m| !m.brute_force()) {
            assert!(text.contains(&method.name()), "{} is missing", method.name());
        }
        assert!(!text.contains("NaN"), "{text}");
        assert!(folder.path().join("pictures/quality/S3_windmill_0.png").is_file());
    }
}
