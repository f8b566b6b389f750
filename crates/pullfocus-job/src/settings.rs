//! From options to the library's settings: what goes with what.

use crate::failure::{Failure, Result};
use crate::options::{
    Blur, CalibrationName, Circle, Depth, DepthForm, GatherName, IntegratorName, LayeringName, MethodName,
    MipmapName, PresetName, PsfName, QualityName, SitesName, SolverName, SpreadName,
};
use crate::values::{Largest, Number, Shape};
use pullfocus_core::aperture::{MOST_MASK_SIDE, Mask};
use pullfocus_core::diffusion::{Calibration, JacobiStop};
use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::response::Rational;
use pullfocus_core::tensor::{Gathering, LEAST_SPACING, MOST_SPACING, Sites, Spreading};
use pullfocus_core::{
    Aperture, ApertureShape, Bokeh, CocSettings, DepthDecoding, DepthKind, Diffusion, Integrator, Layering,
    Method, Mipmap, Preset, Psf, Quality, Settings, Solver, Tensor,
};
use pullfocus_io::Limits;
use std::path::Path;

fn usage<T>(sentence: &str) -> Result<T> {
    Err(Failure::usage(sentence))
}

/// The library's settings.
///
/// # Errors
/// [`Failure::Usage`]: options that do not go together, values outside their ranges.
pub fn settings(blur: &Blur, circle: &Circle, depth: &Depth) -> Result<Settings> {
    let preset = match blur.preset {
        Some(PresetName::Preview) => Preset::Preview,
        Some(PresetName::Final) | None => Preset::Final,
    };
    let mut base = Settings::preset(preset);
    // Who says how diffusion works means diffusion.
    if of_diffusion(blur).is_some() {
        base.method = Method::Diffusion;
    }
    let (method, psf, quality) = method(blur, base.method)?;
    let settings = Settings {
        coc: coc(circle)?,
        layering: layering(blur, base.layering)?,
        show: blur.show.map_or(base.show, |shown| shown.0),
        method,
        psf,
        aperture: aperture(blur)?,
        bokeh: bokeh(blur)?,
        quality,
        mipmap: mipmap(blur, method)?,
        tensor: tensor(blur)?,
        diffusion: diffusion(blur, base.diffusion)?,
        repair_depth: depth.repair_depth.unwrap_or(base.repair_depth),
    };
    settings.check().map_err(|error| Failure::usage(error.to_string()))?;
    Ok(settings)
}

fn coc(circle: &Circle) -> Result<CocSettings> {
    let factor = |flag: &str, number: Option<Number>| match number {
        None => Ok(1.0),
        Some(Number(value)) if value.is_finite() && value >= 0.0 => Ok(value),
        Some(Number(value)) => {
            Err(Failure::usage(format!("{flag} is {value}; it must be a factor of 0 or above")))
        }
    };
    Ok(CocSettings {
        max_px: match circle.max_coc {
            Some(Largest::Pixels(px)) => Some(px),
            _ => None,
        },
        max_width: match circle.max_coc {
            Some(Largest::Width(part)) => Some(part),
            _ => None,
        },
        front: factor("--front", circle.front)?,
        back: factor("--back", circle.back)?,
        protect_m: circle.protect.map(|range| range.0),
    })
}

fn layering(blur: &Blur, preset: Layering) -> Result<Layering> {
    let base = match blur.layering {
        None => preset,
        Some(LayeringName::Single) => Layering::Single,
        Some(LayeringName::Background) => Layering::PAPER,
        Some(LayeringName::General) => Layering::default(),
    };
    if blur.layers.is_some_and(|n| !(1..=MOST_LAYERS).contains(&n)) {
        return usage("--layers must lie between 1 and 16");
    }
    match (base, blur.layers, blur.layer_threshold) {
        (Layering::Single, Some(_), _) => {
            usage("--layers goes with --layering background or general; --layering single has one layer")
        }
        (Layering::Background { layers, threshold }, n, part) => Ok(Layering::Background {
            layers: n.unwrap_or(layers),
            threshold: match part {
                None => threshold,
                Some(Number(part)) if part > 0.0 && part <= 1.0 => part,
                Some(Number(part)) => {
                    return Err(Failure::usage(format!(
                        "--layer-threshold is {part}; it is a part of the picture's width, above 0 and at most 1"
                    )));
                }
            },
        }),
        (_, _, Some(_)) => usage("--layer-threshold goes with --layering background"),
        (Layering::General { layers }, n, None) => Ok(Layering::General { layers: n.unwrap_or(layers) }),
        (Layering::Single, None, None) => Ok(Layering::Single),
    }
}

/// The first option given that says how diffusion works.
pub fn of_diffusion(blur: &Blur) -> Option<&'static str> {
    let given = [
        (blur.integrator.is_some(), "--integrator"),
        (blur.steps.is_some(), "--steps"),
        (blur.calibration.is_some(), "--calibration"),
        (blur.solver.is_some(), "--solver"),
        (blur.sweeps.is_some(), "--sweeps"),
        (blur.tolerance.is_some(), "--tolerance"),
    ];
    given.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
}

/// The library's name for a method.
pub fn method_of(name: MethodName) -> Method {
    match name {
        MethodName::Diffusion => Method::Diffusion,
        MethodName::Naive => Method::Naive,
        MethodName::Gather => Method::Gather,
        MethodName::Square => Method::Square,
        MethodName::Pyramid => Method::Pyramid,
        MethodName::Aperture => Method::Aperture,
        MethodName::Tensor => Method::Tensor,
    }
}

fn method(blur: &Blur, preset: Method) -> Result<(Method, Psf, Quality)> {
    let method = blur.method.map_or(preset, method_of);
    if let Some(option) = of_diffusion(blur).filter(|_| method != Method::Diffusion) {
        return Err(Failure::usage(format!(
            "{option} goes with --method diffusion; the other methods spread pixels and solve nothing"
        )));
    }
    let quality = match blur.quality {
        Some(_) if method != Method::Pyramid => return usage("--quality goes with --method pyramid"),
        Some(QualityName::Fine) => Quality::Fine,
        Some(QualityName::Standard) | None => Quality::Standard,
    };
    let psf = match blur.psf {
        Some(_) if !method.has_psf() => return usage("--psf goes with --method naive or gather"),
        Some(PsfName::Aperture) => Psf::Aperture,
        Some(PsfName::Gaussian) | None => Psf::Gaussian,
    };
    let shaped = psf == Psf::Aperture || method == Method::Aperture || blur.bokeh_threshold.is_some();
    if let Some(option) = of_aperture(blur).filter(|_| !shaped) {
        return Err(Failure::usage(format!(
            "{option} needs a method that has the aperture's shape: --method aperture, naive and gather with --psf aperture, or highlights (--bokeh-threshold)"
        )));
    }
    Ok((method, psf, quality))
}

/// The first option given that says what the aperture looks like.
pub fn of_aperture(blur: &Blur) -> Option<&'static str> {
    let given = [
        (blur.aperture.is_some(), "--aperture"),
        (blur.aperture_rotation.is_some(), "--aperture-rotation"),
        (blur.aperture_roundness.is_some(), "--aperture-roundness"),
        (blur.squeeze.is_some(), "--squeeze"),
    ];
    given.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
}

fn aperture(blur: &Blur) -> Result<Aperture> {
    let shape = match &blur.aperture {
        None | Some(Shape::Disc) => ApertureShape::Disc,
        Some(Shape::Blades(count)) => ApertureShape::Blades(*count),
        Some(Shape::Image(file)) => ApertureShape::Image(mask(file)?),
    };
    if blur.aperture_roundness.is_some() && !matches!(shape, ApertureShape::Blades(_)) {
        return usage("--aperture-roundness goes with --aperture blades:N");
    }
    let or = |number: Option<Number>, or| number.map_or(or, |number| number.0);
    Ok(Aperture {
        shape,
        rotation_degrees: or(blur.aperture_rotation, 0.0),
        roundness: or(blur.aperture_roundness, 0.0),
        squeeze: or(blur.squeeze, 1.0),
    })
}

/// The first option given that says what highlights look like.
pub fn of_bokeh(blur: &Blur) -> Option<&'static str> {
    let given = [
        (blur.bokeh_gain.is_some(), "--bokeh-gain"),
        (blur.bokeh_knee.is_some(), "--bokeh-knee"),
        (blur.bokeh_least.is_some(), "--bokeh-least"),
        (blur.cats_eye.is_some(), "--cats-eye"),
    ];
    given.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
}

fn bokeh(blur: &Blur) -> Result<Option<Bokeh>> {
    let Some(Number(threshold)) = blur.bokeh_threshold else {
        return match of_bokeh(blur) {
            None => Ok(None),
            Some(option) => Err(Failure::usage(format!(
                "{option} goes with --bokeh-threshold X, the brightness from which light is a highlight"
            ))),
        };
    };
    let plain = Bokeh::default();
    let or = |number: Option<Number>, or| number.map_or(or, |number| number.0);
    Ok(Some(Bokeh {
        threshold,
        gain: or(blur.bokeh_gain, plain.gain),
        knee: or(blur.bokeh_knee, plain.knee),
        least_diameter: or(blur.bokeh_least, plain.least_diameter),
        cats_eye: or(blur.cats_eye, plain.cats_eye),
    }))
}

/// How much light a picture of an aperture lets through: the mean of its colours, as far as it is not transparent.
fn mask(file: &Path) -> Result<Mask> {
    let limits = Limits { max_pixels: (MOST_MASK_SIDE * MOST_MASK_SIDE) as u64, ..Limits::default() };
    let picture = pullfocus_io::images::read_picture(file, &limits).map_err(|error| {
        if error.asks_for_limits() {
            Failure::usage(format!(
                "{}: a picture of an aperture has {MOST_MASK_SIDE} x {MOST_MASK_SIDE} pixels at most; make it smaller",
                file.display()
            ))
        } else {
            error.into()
        }
    })?;
    let size = picture.size();
    let share = 1.0 / picture.colors.len().max(1) as f32;
    let value = |i: usize| picture.colors.iter().map(|plane| plane.data()[i]).sum::<f32>() * share;
    let data = (0..size.area()).map(value).collect();
    Mask::new(size.width, size.height, data)
        .map_err(|error| Failure::usage(format!("{}: {error}", file.display())))
}

fn mipmap(blur: &Blur, method: Method) -> Result<Mipmap> {
    match blur.mipmap {
        Some(_) if method != Method::Pyramid => usage("--mipmap goes with --method pyramid"),
        Some(MipmapName::Nearest) => Ok(Mipmap::Nearest),
        Some(MipmapName::Linear) | None => Ok(Mipmap::Linear),
    }
}

/// The first option given that says how the tensor filter works.
fn of_tensor(blur: &Blur) -> Option<&'static str> {
    let given = [
        (blur.tensor_sites.is_some(), "--tensor-sites"),
        (blur.tensor_spacing.is_some(), "--tensor-spacing"),
        (blur.tensor_gather.is_some(), "--tensor-gather"),
        (blur.tensor_spread.is_some(), "--tensor-spread"),
    ];
    given.into_iter().find(|(given, _)| *given).map(|(_, name)| name)
}

fn tensor(blur: &Blur) -> Result<Tensor> {
    if let Some(option) = of_tensor(blur).filter(|_| blur.method != Some(MethodName::Tensor)) {
        return Err(Failure::usage(format!("{option} goes with --method tensor")));
    }
    let preset = Tensor::default();
    let spacing = blur.tensor_spacing.map_or(preset.spacing, |spacing| spacing.0);
    if !(LEAST_SPACING..=MOST_SPACING).contains(&spacing) {
        return usage("--tensor-spacing must lie between 0.25 and 0.84 standard deviations");
    }
    Ok(Tensor {
        sites: match blur.tensor_sites {
            Some(SitesName::Skip) => Sites::Skip,
            Some(SitesName::Quadtree) | None => Sites::Quadtree,
        },
        spacing,
        gather: match blur.tensor_gather {
            Some(GatherName::Naive) => Gathering::Naive,
            Some(GatherName::RepeatedIntegration) => Gathering::RepeatedIntegration,
            Some(GatherName::Pyramid) | None => Gathering::Pyramid,
        },
        spread: match blur.tensor_spread {
            Some(SpreadName::Naive) => Spreading::Naive,
            Some(SpreadName::Pyramid) | None => Spreading::Pyramid,
        },
    })
}

fn diffusion(blur: &Blur, preset: Diffusion) -> Result<Diffusion> {
    let base = match blur.integrator {
        None => preset.integrator,
        Some(IntegratorName::BackwardEuler) => Integrator::BackwardEuler { steps: 1 },
        Some(IntegratorName::Disc) => Integrator::Disc,
        Some(IntegratorName::Rational) => Integrator::Rational(Rational::GAUSSIAN),
    };
    let integrator = match (base, blur.steps) {
        (_, Some(0)) => return usage("--steps is 0; it must be 1 or more"),
        (Integrator::BackwardEuler { steps }, n) => Integrator::BackwardEuler { steps: n.unwrap_or(steps) },
        (Integrator::Rational(_) | Integrator::Disc, Some(_)) => {
            return usage(
                "--steps goes with --integrator backward-euler; rational and disc are done in one and have no steps",
            );
        }
        (one, None) => one,
    };
    let solver = match (blur.solver, blur.sweeps, blur.tolerance) {
        (Some(SolverName::Jacobi), Some(_), Some(_)) => {
            return usage("--sweeps and --tolerance both say when Jacobi stops; give one of them");
        }
        (Some(SolverName::Jacobi), Some(0), None) => return usage("--sweeps is 0; it must be 1 or more"),
        (Some(SolverName::Jacobi), Some(n), None) => Solver::Jacobi(JacobiStop::Sweeps(n)),
        (Some(SolverName::Jacobi), None, Some(Number(t))) => {
            if !(t > 0.0 && t < 1.0) {
                return Err(Failure::usage(format!("--tolerance is {t}; it must lie between 0 and 1")));
            }
            Solver::Jacobi(JacobiStop::Tolerance(t as f32))
        }
        (Some(SolverName::Jacobi), None, None) => Solver::Jacobi(JacobiStop::default()),
        (Some(SolverName::CyclicReduction), None, None) => Solver::CyclicReduction,
        (Some(SolverName::ParallelCyclicReduction), None, None) => Solver::ParallelCyclicReduction,
        (Some(SolverName::Hybrid), None, None) => Solver::Hybrid,
        (Some(SolverName::Lu) | None, None, None) => Solver::Lu,
        _ => return usage("--sweeps and --tolerance go with --solver jacobi"),
    };
    let calibration = match blur.calibration {
        None => preset.calibration,
        Some(CalibrationName::Variance) => Calibration::Variance,
        Some(CalibrationName::Kass) => Calibration::Kass,
        Some(CalibrationName::Beck) => Calibration::Beck,
    };
    Ok(Diffusion { calibration, integrator, solver })
}

/// How depth is read.
///
/// # Errors
/// [`Failure::Usage`]: options that do not go together, values outside their ranges.
pub fn decoding(depth: &Depth) -> Result<DepthDecoding> {
    let form = depth.depth.unwrap_or(DepthForm::Planar);
    if form != DepthForm::Disparity && (depth.depth_scale.is_some() || depth.depth_shift.is_some()) {
        return usage("--depth-scale and --depth-shift go with --depth disparity");
    }
    if form != DepthForm::Normalized
        && (depth.depth_near.is_some() || depth.depth_far.is_some() || depth.depth_invert == Some(true))
    {
        return usage("--depth-near, --depth-far and --depth-invert go with --depth normalized");
    }
    if matches!(form, DepthForm::Disparity | DepthForm::Normalized) && depth.depth_unit.is_some() {
        return usage(
            "--depth-unit goes with --depth planar, ray or inverse; the others are given in metres already",
        );
    }
    let kind = match form {
        DepthForm::Planar => DepthKind::Planar,
        DepthForm::Ray => DepthKind::Ray,
        DepthForm::Inverse => DepthKind::Inverse,
        DepthForm::Disparity => match depth.depth_scale {
            Some(Number(scale)) => {
                DepthKind::Disparity { scale, shift: depth.depth_shift.map_or(0.0, |shift| shift.0) }
            }
            None => {
                return usage(
                    "--depth disparity needs --depth-scale S (and --depth-shift S): 1/z = scale * value + shift, in 1/m",
                );
            }
        },
        DepthForm::Normalized => match (depth.depth_near, depth.depth_far) {
            (Some(Number(near_m)), Some(Number(far_m))) => {
                DepthKind::Normalized { near_m, far_m, inverted: depth.depth_invert.unwrap_or(false) }
            }
            _ => {
                return usage(
                    "--depth normalized needs --depth-near M and --depth-far M, the distances of 0 and 1",
                );
            }
        },
    };
    let decoding = DepthDecoding {
        kind,
        unit_m: depth.depth_unit.map_or(1.0, |unit| unit.0),
        far_clip_m: depth.depth_far_clip.map(|far| far.0),
    };
    decoding.check().map_err(|error| Failure::usage(error.to_string()))?;
    Ok(decoding)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::parse;
    use pullfocus_core::Show;

    fn made(text: &str) -> Result<Settings> {
        let options = parse(text).unwrap();
        settings(&options.blur, &options.circle, &options.depth)
    }

    fn refused(text: &str, word: &str) {
        let options = parse(text).unwrap();
        let error = made(text).err().or_else(|| decoding(&options.depth).err()).expect(text);
        assert!(error.exit_code() == 2 && error.to_string().contains(word), "{text}: {error}");
    }

    #[test]
    fn nothing_given_is_the_final_preset() {
        assert_eq!(made("").unwrap(), Settings::preset(Preset::Final));
        assert_eq!(made("preset = 'preview'").unwrap(), Settings::preset(Preset::Preview));
        // Diffusion's own options ask for it.
        assert_eq!(made("solver = 'hybrid'").unwrap().method, Method::Diffusion);
        // Whatever the device.
        assert_eq!(made("device = 'gpu'").unwrap(), Settings::preset(Preset::Final));
    }

    #[test]
    fn what_is_given_overrides_the_preset() {
        let steps = made("preset = 'preview'\nsteps = 3\nlayers = 2\nlayer-threshold = 0.02").unwrap();
        assert_eq!(steps.diffusion.integrator, Integrator::BackwardEuler { steps: 3 });
        assert_eq!(steps.layering, Layering::Background { layers: 2, threshold: 0.02 });
        let single = made("layering = 'single'\ncalibration = 'kass'\nsolver = 'cyclic-reduction'").unwrap();
        assert_eq!(single.layering, Layering::Single);
        assert_eq!(single.diffusion.calibration, Calibration::Kass);
        assert_eq!(single.diffusion.solver, Solver::CyclicReduction);
        let exact = [
            ("lu", Solver::Lu),
            ("parallel-cyclic-reduction", Solver::ParallelCyclicReduction),
            ("hybrid", Solver::Hybrid),
        ];
        for (name, solver) in exact {
            assert_eq!(made(&format!("solver = '{name}'")).unwrap().diffusion.solver, solver, "{name}");
        }
        let jacobi = made("solver = 'jacobi'\nsweeps = 50").unwrap();
        assert_eq!(jacobi.diffusion.solver, Solver::Jacobi(JacobiStop::Sweeps(50)));
        assert_eq!(made("").unwrap().show, Show::Result);
        assert_eq!(made("show = 'layer:2'").unwrap().show, Show::Layer(2));
        assert_eq!(made("show = 'matte:0'\nlayering = 'single'").unwrap().show, Show::Matte(0));
        let coc = made("max-coc = '3%'\nfront = 0.5\nback = 2\nprotect = '1,2'").unwrap().coc;
        assert_eq!(
            (coc.max_width, coc.front, coc.back, coc.protect_m),
            (Some(0.03), 0.5, 2.0, Some([1.0, 2.0]))
        );
    }

    #[test]
    fn what_does_not_go_together_is_said() {
        refused("steps = 2", "--steps goes with");
        refused("integrator = 'rational'\nsteps = 1", "--steps goes with");
        refused("integrator = 'disc'\nsteps = 2", "--steps goes with");
        refused("integrator = 'backward-euler'\nsteps = 0", "1 or more");
        refused("layering = 'single'\nlayers = 2", "single has one layer");
        refused("layers = 40", "between 1 and 16");
        refused("layer-threshold = 0.1", "background");
        refused("sweeps = 4", "--solver jacobi");
        refused("solver = 'hybrid'\nsweeps = 4", "--solver jacobi");
        refused("solver = 'jacobi'\nsweeps = 4\ntolerance = 0.1", "one of them");
        refused("solver = 'jacobi'\ntolerance = 2", "between 0 and 1");
        refused("method = 'naive'\nintegrator = 'disc'", "--integrator goes with --method diffusion");
        refused("method = 'gather'\nsolver = 'jacobi'\nsweeps = 9", "--solver goes with --method diffusion");
        refused("psf = 'aperture'", "--method naive or gather");
        refused("method = 'pyramid'\naperture = 'blades:6'", "--method aperture");
        for option in ["bokeh-gain", "bokeh-knee", "bokeh-least", "cats-eye"] {
            refused(&format!("{option} = 0.5"), "goes with --bokeh-threshold");
        }
        refused("bokeh-threshold = 0", "above 0");
        refused("bokeh-threshold = 1\nbokeh-gain = -1", "between 0 and 1000");
        refused("bokeh-threshold = 1\nbokeh-knee = 2", "between 0 and 1");
        refused("bokeh-threshold = 1\ncats-eye = 1.5", "between 0 and 1");
        refused("method = 'naive'\nsqueeze = 2", "--psf aperture");
        let naive = |rest: &str| format!("method = 'naive'\npsf = 'aperture'\n{rest}");
        refused(&naive("aperture-roundness = 0.5"), "--aperture blades:N");
        refused(&naive("aperture = 'blades:6'\naperture-roundness = 1.5"), "between 0 and 1");
        refused(&naive("squeeze = 9"), "between 0.25 and 4");
        let lost = made(&naive("aperture = 'image:nowhere.png'")).unwrap_err();
        assert!(lost.to_string().contains("nowhere.png"), "{lost}");
        refused("method = 'square'\nquality = 'fine'", "--method pyramid");
        refused("method = 'pyramid'\npsf = 'aperture'", "--method naive or gather");
        refused("method = 'naive'\nmipmap = 'linear'", "--method pyramid");
        refused("method = 'pyramid'\ntensor-sites = 'skip'", "--tensor-sites goes with --method tensor");
        refused("method = 'tensor'\ntensor-spacing = 2", "between 0.25 and 0.84");
        refused("front = -1", "--front");
        refused("depth-scale = 2", "disparity");
        refused("depth = 'disparity'", "--depth-scale");
        refused("depth = 'normalized'\ndepth-near = 1", "--depth-far");
        refused("depth = 'normalized'\ndepth-near = 3\ndepth-far = 1", "beyond");
        refused("depth-near = 1", "normalized");
        refused("depth = 'disparity'\ndepth-scale = 1\ndepth-unit = 'cm'", "metres already");
        refused("depth-far-clip = 0", "far clip");
    }

    #[test]
    fn every_method_is_reached() {
        for (name, method) in
            [("diffusion", Method::Diffusion), ("naive", Method::Naive), ("gather", Method::Gather)]
        {
            assert_eq!(made(&format!("method = '{name}'")).unwrap().method, method);
        }
        let highlights = "bokeh-threshold = 3\nbokeh-gain = 2\nbokeh-least = 4\naperture = 'blades:5'";
        let settings = made(highlights).unwrap();
        let expected = Bokeh { threshold: 3.0, gain: 2.0, least_diameter: 4.0, ..Bokeh::default() };
        assert_eq!((settings.bokeh, settings.aperture), (Some(expected), Aperture::blades(5, 0.0)));
        let blades =
            made("method = 'naive'\npsf = 'aperture'\naperture = 'blades:6'\naperture-rotation = 15")
                .unwrap();
        assert_eq!(made("method = 'pyramid'\nquality = 'fine'").unwrap().quality, Quality::Fine);
        assert_eq!((blades.psf, blades.aperture), (Psf::Aperture, Aperture::blades(6, 15.0)));
        let alone = made("method = 'pyramid'\nmipmap = 'nearest'").unwrap();
        assert_eq!(alone.mipmap, Mipmap::Nearest);
        assert_eq!(made("method = 'pyramid'\nmipmap = 'linear'").unwrap().mipmap, Mipmap::Linear);
        let tensor = made("method = 'tensor'").unwrap();
        assert_eq!((tensor.method, tensor.tensor), (Method::Tensor, Tensor::default()));
        let paper =
            "tensor-sites = 'skip'\ntensor-gather = 'naive'\ntensor-spread = 'naive'\ntensor-spacing = 0.5";
        let (sites, gather, spread) = (Sites::Skip, Gathering::Naive, Spreading::Naive);
        let expected = Tensor { sites, spacing: 0.5, gather, spread };
        assert_eq!(made(&format!("method = 'tensor'\n{paper}")).unwrap().tensor, expected);
    }

    #[test]
    fn every_depth_form_is_reached() {
        let kind = |text: &str| decoding(&parse(text).unwrap().depth).unwrap();
        assert_eq!(kind("depth-unit = 'cm'").unit_m, 0.01);
        assert_eq!(kind("depth = 'ray'").kind, DepthKind::Ray);
        assert_eq!(kind("depth = 'inverse'").kind, DepthKind::Inverse);
        assert_eq!(
            kind("depth = 'disparity'\ndepth-scale = 2").kind,
            DepthKind::Disparity { scale: 2.0, shift: 0.0 }
        );
        assert_eq!(
            kind("depth = 'normalized'\ndepth-near = 1\ndepth-far = 9\ndepth-invert = true").kind,
            DepthKind::Normalized { near_m: 1.0, far_m: 9.0, inverted: true }
        );
        assert_eq!(kind("depth-far-clip = 500").far_clip_m, Some(500.0));
    }
}
