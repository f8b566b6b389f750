//! The same picture from both: the GPU's beside the CPU's.

use crate::adapter::{AdapterOption, describe};
use crate::difference::{Difference, FLOOR};
use crate::frames::{FrameOptions, TestFrame, made};
use crate::place::{Output, provenance};
use crate::table::Table;
use anyhow::{Context, Result, ensure};
use clap::Args;
use pullfocus::aperture::Mask;
use pullfocus::{
    Aperture, ApertureShape, Bokeh, Cancel, Distance, Layering, Method, Picture, Plane, Renderer, Settings,
    Size,
};
use pullfocus_gpu::Host;
use pullfocus_testkit::Grid;
use pullfocus_testkit::reference::diffuse;
use rayon::prelude::*;
use std::time::Instant;

/// Options of `same`.
#[derive(Args, Clone, Debug)]
pub struct Options {
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    adapter: AdapterOption,
    #[command(flatten)]
    frames: FrameOptions,
}

/// Both compute in f32 and sum in other orders: a value passes some ten blurs, each within 1e-5 of the f64 reference.
const BOUND: f64 = 1e-4;

/// What is allowed beside that, in parts of the picture's brightest value: two units in its last place. A light's rim and
/// what is dark beside it come out of sums in which the light is, and those cannot be known any better in f32.
const ROUNDING: f64 = 2.0 / (1u32 << 23) as f64;

/// What is allowed instead where an aperture is spread through circles that each device has found on its own, in parts of the
/// picture's brightest value. The GPU's circles are f32 throughout and off by up to 8e-6 px in these scenes; a light of about a pixel
/// gives up to a whole of itself away for each pixel that its circle grows, and as much of the weight. The CPU's own
/// pictures differ in the same values and by as much when its circles are rounded so; with the same circles for both the
/// difference of one layer is below 1e-6.
const OF_CIRCLES: f64 = 2.0 * 8e-6;

/// What is allowed where the CPU mixes a light's sprite from two tabled sizes, whose rims lie a 16th of a pixel apart: a quarter of that
/// at the rim. With a cat's eye it cuts each sprite by itself, as the GPU does, and the other rows hold.
const OF_SIZES: f64 = 1.0 / 64.0;

/// One way to render.
struct Case {
    name: &'static str,
    settings: Settings,
    /// Whether both devices get the CPU's circles of confusion instead of depth.
    same_circles: bool,
    /// What is allowed beside the bound, in parts of the brightest value.
    rounding: f64,
}

fn cases() -> Result<[Case; 9]> {
    let case = |name, settings| Case { name, settings, same_circles: false, rounding: ROUNDING };
    let bokeh = Some(Bokeh { least_diameter: 1.0, ..Bokeh::default() });
    let little = bokeh.map(|bokeh| Bokeh { cats_eye: 0.01, ..bokeh });
    let cut = Some(Bokeh { cats_eye: 0.7, ..Bokeh::default() });
    let rings = (0..24 * 20).map(|i| ((i % 24 - 12) * (i / 24 - 10) % 5) as f32).map(f32::abs).collect();
    let picture = ApertureShape::Image(Mask::new(24, 20, rings)?);
    let picture = Aperture { shape: picture, rotation_degrees: 30.0, ..Aperture::DISC };
    let blades = Aperture { roundness: 0.3, squeeze: 1.5, ..Aperture::blades(7, 20.0) };
    let last = crate::speed::cases::last();
    let spread = Settings { layering: Layering::Single, ..last.clone() };
    Ok([
        Case { rounding: OF_CIRCLES, ..case("`final`", last) },
        Case { same_circles: true, ..case("one layer, aperture, the same circles", spread) },
        case("general layers, diffusion", crate::speed::cases::last_by_diffusion()),
        case("`preview`", crate::speed::cases::preview()),
        Case { rounding: OF_SIZES, ..case("highlights", Settings { bokeh, ..Settings::default() }) },
        case("highlights, a little cat's eye", Settings { bokeh: little, ..Settings::default() }),
        case(
            "highlights, one layer, bent blades, squeeze, cat's eye",
            Settings { layering: Layering::Single, bokeh: cut, aperture: blades, ..Settings::default() },
        ),
        case(
            "highlights, a picture of an aperture",
            Settings { bokeh: cut, aperture: picture, ..Settings::default() },
        ),
        case("one layer, diffusion", Settings { layering: Layering::Single, ..Settings::default() }),
    ])
}

/// One frame with one setting.
struct Row {
    name: String,
    input: &'static str,
    settings: &'static str,
    /// The frame's largest colour: sums round to parts of it.
    brightest: f32,
    difference: Difference,
    /// CPU and GPU from the f64 reference, where there is one.
    from_reference: Option<[Difference; 2]>,
}

/// Runs the command.
pub fn run(options: &Options) -> Result<()> {
    let quick = options.output.quick;
    let mut host = options.adapter.open()?;
    let size = if quick { Size::new(96, 54) } else { Size::new(480, 270) };
    let mut frames = made(size)?;
    let data = options.frames.read(quick.then_some(1))?;
    let without =
        if data.is_empty() { " The scenes with references are not here: made frames only." } else { "" };
    frames.extend(data);
    let start = Instant::now();
    let mut rows = vec![];
    let mut cpu = Renderer::new();
    for frame in &frames {
        eprintln!("{}, {} ({:.0} s)", frame.name, frame.input, start.elapsed().as_secs_f64());
        for case in cases()? {
            let row = compare(frame, &case, &mut cpu, &mut host);
            rows.push(row.with_context(|| format!("{}, {}, {}", frame.name, frame.input, case.name))?);
        }
    }
    let text = report(&rows, &format!("{}\n\n{}{without}", provenance(), describe(host.info())));
    options.output.write("results/same.md", &text)?;
    let beyond: usize = rows.iter().map(|row| row.difference.beyond).sum();
    ensure!(
        beyond == 0,
        "{beyond} values of the GPU's pictures are more than {BOUND:e} and their rounding from the CPU's"
    );
    Ok(())
}

fn compare(frame: &TestFrame, case: &Case, cpu: &mut Renderer, host: &mut Host) -> Result<Row> {
    let (camera, settings) = (frame.camera.as_ref(), &case.settings);
    let mut by_cpu = frame.scene.clone();
    if case.same_circles {
        for element in std::iter::once(&mut by_cpu.base).chain(&mut by_cpu.foreground) {
            let mut coc = Plane::default();
            let cancel = Cancel::new();
            cpu.circle_of_confusion(&by_cpu.frame, &element.distance, camera, settings, &cancel, &mut coc)?;
            element.distance = Distance::Coc(coc);
        }
    }
    let mut by_gpu = by_cpu.clone();
    cpu.render(&mut by_cpu, camera, settings, &Cancel::new())?;
    host.render(&mut by_gpu, camera, settings, &Cancel::new())?;
    let (by_cpu, by_gpu) = (by_cpu.base.picture, by_gpu.base.picture);
    let from_reference = match &frame.circle {
        Some(circle) if settings.method == Method::Diffusion && frame.has_reference(settings) => {
            let references = references(&frame.scene.base.picture, circle, settings);
            let from = |picture: &Picture| Difference::from_reference(picture.planes(), &references, BOUND);
            Some([from(&by_cpu), from(&by_gpu)])
        }
        _ => None,
    };
    let brightest =
        frame.scene.base.picture.planes().flat_map(Plane::data).fold(0.0f32, |most, v| v.max(most));
    Ok(Row {
        name: frame.name.clone(),
        input: frame.input,
        settings: case.name,
        brightest,
        difference: Difference::between(&by_gpu, &by_cpu, BOUND, case.rounding * f64::from(brightest)),
        from_reference,
    })
}

/// One layer in f64; small negative lobes do not bring a plane below 0 or its own least value.
fn references(picture: &Picture, circle: &Plane, settings: &Settings) -> Vec<Grid> {
    let circle = Grid::from_plane(circle);
    let planes: Vec<&Plane> = picture.planes().collect();
    let reference = |plane: &&Plane| {
        let least = plane.data().iter().fold(0.0f32, |least, v| least.min(*v));
        let grid = Grid::from_plane(plane);
        diffuse(&grid, &circle, None, 1.0, &settings.diffusion).map(|v| v.max(least.into()))
    };
    planes.par_iter().map(reference).collect()
}

fn report(rows: &[Row], head: &str) -> String {
    let mut table = Table::new([
        "frame",
        "input",
        "settings",
        "brightest value",
        "largest difference",
        "mean",
        "values above 1e-4",
        "beyond rounding",
        "CPU from f64",
        "GPU from f64",
    ]);
    for row in rows {
        let reference =
            |at: usize| row.from_reference.map_or(String::new(), |from| format!("{:.1e}", from[at].largest));
        table.row([
            row.name.clone(),
            row.input.to_owned(),
            row.settings.to_owned(),
            format!("{:.1}", row.brightest),
            format!("{:.1e}", row.difference.largest),
            format!("{:.1e}", row.difference.mean()),
            row.difference.above.to_string(),
            row.difference.beyond.to_string(),
            reference(0),
            reference(1),
        ]);
    }
    let all = rows.iter().fold(Difference::default(), |all, row| all.and(row.difference));
    let said = match (all.above, all.beyond) {
        (0, _) => format!("The same: none of {} values is farther than {BOUND:e}.", all.count),
        (above, 0) => format!(
            "The same: {above} of {} values are farther than {BOUND:e}, all within their rounding.",
            all.count
        ),
        (_, beyond) => {
            format!("**Not the same: {beyond} of {} values are farther than {BOUND:e}.**", all.count)
        }
    };
    format!(
        "# The same picture from both\n\n{head}\n\n{said} The farthest is {:.1e}.\n\n\
         A value's difference is |GPU - CPU| / max(|CPU|, {FLOOR}). Both compute in f32, whose sums round to\n\
         parts of the brightest value around: beyond rounding is what is apart by more than two units in its last place, too; where an aperture is
         spread through circles that each has found on its own, by more than {OF_CIRCLES:e} of it (the GPU's circles are f32, up to 8e-6 px off); where the CPU mixes
         highlights from sizes an eighth of a pixel apart, by a 64th of it (rims lie as far from where they should; with a cat's eye it does not). One layer has a reference in f64: the largest\n\
         difference of each from that is beside it.\n\n{}",
        all.largest,
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(a: f64) -> Row {
        let difference = Difference::of([(a, 1.0), (1.0, 1.0)], BOUND);
        Row {
            name: "x".into(),
            input: "y",
            settings: "z",
            brightest: 3.0,
            difference,
            from_reference: Some([difference; 2]),
        }
    }

    #[test]
    fn the_report_says_whether_they_are_the_same() {
        let same = report(&[row(1.0 + 2e-5)], "head");
        assert!(same.contains("The same: none of 2 values") && same.contains("| 2.0e-5 |"), "{same}");
        let other = report(&[row(1.0), row(1.1)], "head");
        assert!(other.contains("**Not the same: 1 of 4 values"), "{other}");
    }

    #[test]
    fn the_cpu_is_near_the_reference() {
        let frame = made(Size::new(48, 27)).unwrap().swap_remove(0);
        let settings = cases().unwrap().into_iter().next_back().unwrap().settings;
        assert!(frame.has_reference(&settings));
        let references = references(&frame.scene.base.picture, frame.circle.as_ref().unwrap(), &settings);
        let mut scene = frame.scene.clone();
        Renderer::new().render(&mut scene, None, &settings, &Cancel::new()).unwrap();
        let from = Difference::from_reference(scene.base.picture.planes(), &references, BOUND);
        // Ten times below what two devices may differ by.
        assert!(from.largest < 0.1 * BOUND && from.count == 3 * 48 * 27, "{from:?}");
    }
}
