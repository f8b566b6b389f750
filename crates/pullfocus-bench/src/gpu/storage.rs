//! What f16 storage costs in accuracy.

use super::session::{Measured, Session, refused};
use crate::difference::{Difference, FLOOR};
use crate::frames::{FrameOptions, TestFrame, made};
use crate::speed::cases::{last, last_by_diffusion, preview};
use crate::table::Table;
use anyhow::Result;
use pullfocus::{Cancel, Picture, Settings};
use pullfocus_gpu::Storage;
use pullfocus_metrics::{display, psnr};

/// f16 beside f32.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    pub difference: Difference,
    /// dB of the sRGB-encoded pictures; infinite where they are the same.
    pub psnr: f64,
}

/// A row: some frames of one kind.
pub struct Row {
    pub frames: String,
    pub input: &'static str,
    pub settings: &'static str,
    pub costs: Vec<Measured<Cost>>,
}

/// All rows: a made frame, then the data folder's.
pub fn measure(session: &mut Session, options: &FrameOptions) -> Result<Vec<Row>> {
    let made: Vec<TestFrame> = made(session.size(960, 544))?.into_iter().take(1).collect();
    // Two of `final` take a software device half a minute.
    let most = if session.quick { Some(1) } else { session.software.then_some(2) };
    let read = options.read(most)?;
    let mut rows = vec![];
    let by_diffusion = ("general layers, diffusion", last_by_diffusion());
    for (name, settings) in [("`preview`", preview()), by_diffusion, ("`final`", last())] {
        let mut add = |frames: String, of: Vec<&TestFrame>| -> Result<()> {
            let Some(first) = of.first() else { return Ok(()) };
            let input = first.input;
            let costs = of.iter().map(|frame| cost(session, frame, &settings)).collect::<Result<_>>()?;
            rows.push(Row { frames, input, settings: name, costs });
            Ok(())
        };
        add(made[0].name.clone(), made.iter().collect())?;
        for layered in [false, true] {
            let of: Vec<&TestFrame> =
                read.iter().filter(|frame| frame.scene.foreground.is_some() == layered).collect();
            let size = of.first().map(|frame| frame.scene.frame.data.size.to_string());
            add(format!("{} with references, {}", of.len(), size.unwrap_or_default()), of)?;
        }
    }
    Ok(rows)
}

fn cost(session: &mut Session, frame: &TestFrame, settings: &Settings) -> Result<Measured<Cost>> {
    let mut pictures = vec![];
    for storage in [Storage::Full, Storage::Half] {
        session.host.set_storage(storage);
        let mut scene = frame.scene.clone();
        let rendered = session.host.render(&mut scene, frame.camera.as_ref(), settings, &Cancel::new());
        if let Err(why) = refused(rendered)? {
            return Ok(Err(why));
        }
        pictures.push(scene.base.picture);
    }
    Ok(Ok(between(&pictures[1], &pictures[0])?))
}

fn between(half: &Picture, full: &Picture) -> Result<Cost> {
    let psnr = psnr(&display(full)?, &display(half)?)?;
    Ok(Cost { difference: Difference::between(half, full, f64::INFINITY, 0.0), psnr })
}

/// The section.
pub fn section(rows: &[Row]) -> String {
    let mut table =
        Table::new(["frames", "input", "settings", "largest difference", "mean", "least PSNR, dB"]);
    for row in rows {
        let head = [row.frames.clone(), row.input.to_owned(), row.settings.to_owned()];
        let there: Vec<Cost> = row.costs.iter().filter_map(|cost| cost.as_ref().ok().copied()).collect();
        let why = row.costs.iter().find_map(|cost| cost.as_ref().err());
        let cells = match why {
            Some(why) => [why.clone(), String::new(), String::new()],
            None => {
                let all = there.iter().fold(Difference::default(), |all, cost| all.and(cost.difference));
                let least = there.iter().map(|cost| cost.psnr).fold(f64::INFINITY, f64::min);
                [
                    format!("{:.1e}", all.largest),
                    format!("{:.1e}", all.mean()),
                    if least.is_finite() { format!("{least:.1}") } else { "the same".into() },
                ]
            }
        };
        table.row(head.into_iter().chain(cells));
    }
    format!(
        "## What f16 storage costs\n\nf16 beside f32: |a - b| / max(|b|, {FLOOR}), the largest and the mean of all values; PSNR of the pictures as a screen shows\n\
         them (sRGB, clipped to 0..1), the least of the frames. Circles, systems and sums are f32 in both.\n\n{}\n",
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus::Size;
    use pullfocus_testkit::scenes::constant;

    #[test]
    fn the_worst_of_the_frames_stands_in_the_table() {
        let size = Size::new(16, 16);
        let even = |v| Picture::opaque(vec![constant(size, v); 3]);
        let costs =
            vec![Ok(between(&even(0.5), &even(0.5)).unwrap()), Ok(between(&even(0.55), &even(0.5)).unwrap())];
        let row = |costs| Row { frames: "2".into(), input: "RGBZ", settings: "`final`", costs };
        let text = section(&[row(costs)]);
        assert!(text.contains("| 1.0e-1 | 5.0e-2 | 2"), "{text}");
        let text = section(&[row(vec![Err("did not fit: z".into())])]);
        assert!(text.contains("did not fit: z"), "{text}");
    }
}
