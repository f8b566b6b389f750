//! The quality report.

use super::methods::{Input, Method};
use super::{Results, Score, Truth};
use crate::data::DevScene;
use crate::place::provenance;
use crate::table::Table;

/// Where a reference's crops go, below the results' folder.
pub fn crop_name(reference: &str) -> String {
    format!("pictures/quality/{}.png", reference.replace('/', "_"))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), v| (sum + v, count + 1));
    sum / count.max(1) as f64
}

/// The whole page.
pub fn report(scenes: &[DevScene], results: &Results) -> String {
    let size = scenes[0].size;
    let count = results.references.len();
    let mut text = format!(
        "# Quality\n\n{}\n\n\
         {count} pictures of {size} through a true thin lens (path traced, `data/README.md`). PSNR in dB (more is better) and FLIP (less is\n\
         better; the published tool's, its default viewer) on sRGB clipped to 0..1. *Band*: only pixels within half of the picture's\n\
         largest circle of confusion of a depth edge (neighbours that differ by 10 % in depth). One setting for all pictures in each row.\n\n",
        provenance()
    );
    text += "## Means over all pictures\n\n";
    text += &means(results);
    text += "\n";
    text += &shape(results);
    text += "## FLIP, picture by picture\n\n";
    text += &pictures(results, |score| score.flip, 3);
    text += "\n## PSNR, picture by picture\n\n";
    text += &pictures(results, |score| score.psnr, 1);
    text += "\n## FLIP in the band, scene by scene\n\n";
    text += &by_scene(scenes, results, |score| score.band_flip, 3);
    text += "\n## PSNR in the band, scene by scene\n\n";
    text += &by_scene(scenes, results, |score| score.band_psnr, 1);
    text += "\n## The references themselves\n\n";
    text += &references(scenes);
    text += "\n## Side by side\n\nPinhole, one layer, `final`, reference; where one layer errs most.\n\n";
    for name in &results.references {
        text += &format!("{name}\n\n<img src=\"../{}\" alt=\"{name}\" width=\"100%\">\n\n", crop_name(name));
    }
    text
}

fn means(results: &Results) -> String {
    let mut table =
        Table::new(["method", "input", "PSNR", "FLIP", "PSNR, band", "FLIP, band", "seconds a picture"]);
    for (method, entries) in results.methods.iter().zip(&results.entries) {
        let of = |f: fn(&Score) -> f64| mean(entries.iter().map(|e| f(&e.score)));
        let input = match method.input() {
            Input::Single => "RGBZ",
            Input::Layered => "foreground + behind",
        };
        table.row([
            method.name(),
            input.to_owned(),
            format!("{:.2}", of(|s| s.psnr)),
            format!("{:.4}", of(|s| s.flip)),
            format!("{:.2}", of(|s| s.band_psnr)),
            format!("{:.4}", of(|s| s.band_flip)),
            match method {
                Method::Unblurred => String::new(),
                _ => format!("{:.3}", mean(entries.iter().map(|e| e.seconds))),
            },
        ]);
    }
    table.to_markdown()
}

/// Pairs of rows that differ in the shape alone.
const PAIRS: [(&str, &str, &str); 8] = [
    ("one layer of diffusion", "one layer, Gaussian (rational)", "one layer, disc"),
    ("general layers of diffusion", "5 general layers, Gaussian (rational)", "5 general layers, disc"),
    ("brute force, one layer", "brute force: Gaussian", "brute force: disc"),
    ("brute force by depth", "brute force: Gaussian by depth", "brute force: disc by depth"),
    (
        "foreground + behind, diffusion",
        "layered: 5 general layers, Gaussian (rational)",
        "layered: 5 general layers, disc",
    ),
    ("general layers, spread", "general layers, naive Gaussian", "general layers, aperture"),
    (
        "foreground + behind, spread",
        "layered: general layers, naive Gaussian",
        "layered: general layers, aperture",
    ),
    (
        "foreground + behind, brute force",
        "brute force: Gaussian on the layers",
        "brute force: disc on the layers",
    ),
];

fn shape(results: &Results) -> String {
    let flip = |name: &str| {
        let row = results.methods.iter().position(|m| m.name() == name)?;
        Some(mean(results.entries[row].iter().map(|e| e.score.flip)))
    };
    let mut table = Table::new([
        "the same but for the shape",
        "FLIP, Gaussian",
        "FLIP, disc",
        "the shape's part of the Gaussian's error",
    ]);
    let mut any = false;
    for (label, gaussian, disc) in PAIRS {
        if let (Some(gaussian), Some(disc)) = (flip(gaussian), flip(disc)) {
            any = true;
            table.row([
                label.to_owned(),
                format!("{gaussian:.4}"),
                format!("{disc:.4}"),
                format!("{:.0} %", 100.0 * (gaussian - disc) / gaussian),
            ]);
        }
    }
    if !any {
        return String::new();
    }
    format!("## How much is the Gaussian shape itself\n\n{}\n", table.to_markdown())
}

fn pictures(results: &Results, of: fn(&Score) -> f64, digits: usize) -> String {
    let short = |name: &String| {
        name.split_once('_').map_or(name.clone(), |(scene, rest)| {
            format!("{scene}/{}", rest.rsplit('/').next().unwrap_or_default())
        })
    };
    let mut table = Table::new(["method".to_owned()].into_iter().chain(results.references.iter().map(short)));
    for (method, entries) in results.methods.iter().zip(&results.entries) {
        let values = entries.iter().map(|e| format!("{:.digits$}", of(&e.score)));
        table.row([method.name()].into_iter().chain(values));
    }
    table.to_markdown()
}

fn by_scene(scenes: &[DevScene], results: &Results, of: fn(&Score) -> f64, digits: usize) -> String {
    let mut table =
        Table::new(["method".to_owned()].into_iter().chain(scenes.iter().map(|s| s.name.clone())));
    for (method, entries) in results.methods.iter().zip(&results.entries) {
        let values = scenes.iter().map(|scene| {
            let of_scene = results
                .references
                .iter()
                .zip(entries)
                .filter(|(name, _)| name.split('/').next() == Some(scene.name.as_str()));
            format!("{:.digits$}", mean(of_scene.map(|(_, e)| of(&e.score))))
        });
        table.row([method.name()].into_iter().chain(values));
    }
    table.to_markdown()
}

fn references(scenes: &[DevScene]) -> String {
    let mut table = Table::new([
        "picture",
        "noise, dB",
        "measured at width",
        "largest circle, px",
        "band, % of the picture",
    ]);
    for scene in scenes {
        for reference in &scene.references {
            let part = Truth::new(scene, reference).map_or(0.0, |truth| truth.band_part());
            table.row([
                reference.name.clone(),
                reference.noise_db.map_or("not stated".to_owned(), |(db, _)| format!("{db:.1}")),
                reference.noise_db.map_or(String::new(), |(_, width)| width.to_string()),
                format!("{:.1}", reference.largest_circle),
                format!("{:.0}", 100.0 * part),
            ]);
        }
    }
    format!(
        "The noise is the renderer's own (256 samples a pixel), the PSNR of the reference against one without noise. A copy of half the\n\
         size has some 6 dB less noise. No method can be told apart from a better one beyond that.\n\n{}",
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality::methods;

    #[test]
    fn the_pairs_are_rows() {
        let names: Vec<String> = methods::all().iter().map(Method::name).collect();
        for (_, gaussian, disc) in PAIRS {
            assert!(
                names.iter().any(|n| n == gaussian) && names.iter().any(|n| n == disc),
                "{gaussian}, {disc}"
            );
        }
    }
}
