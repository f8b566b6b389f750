//! What a settings file's options do where the command line's exclude them: they step back.
//!
//! A flag lies over the same option of the file; here, it also takes away what cannot go with it. What the command
//! line alone or the file alone puts together wrongly stays as it is and is refused later.

use crate::options::{
    Blur, Depth, DepthForm, Files, IntegratorName, LayeringName, Lens, MethodName, PsfName, SolverName,
};
use crate::settings::{method_of, of_diffusion};
use crate::storage::check_output;
use crate::values::Shape;

/// Circles of confusion take the place of depth, wherever it is; layers bring their own depth.
pub fn distance(file: (&mut Files, &mut Depth), flags: (&Files, &Depth)) {
    if flags.1.coc_channel.is_some() {
        file.0.depth_file = None;
        file.1.depth_channel = None;
    }
    if flags.0.depth_file.is_some() || flags.1.depth_channel.is_some() {
        file.1.coc_channel = None;
    }
    if flags.0.foreground.is_some() || flags.0.behind.is_some() {
        file.0.depth_file = None;
    }
    if flags.0.depth_file.is_some() {
        (file.0.foreground, file.0.behind) = (None, None);
    }
}

/// Replacing what is there, or keeping it; bits that another format has.
pub fn files(file: &mut Files, flags: &Files) {
    if flags.overwrite == Some(true) {
        file.resume = None;
    }
    if flags.resume == Some(true) {
        file.overwrite = None;
    }
    if let (Some(output), Some(bits), None) = (&flags.output, file.bits, flags.bits)
        && check_output(output, None).is_ok()
        && check_output(output, Some(bits.into())).is_err()
    {
        file.bits = None;
    }
}

/// The two forms of the aperture, and those of the angle; the keys' focal length counts as the file's. True where the
/// keys' has to step back too.
pub fn lens(file: &mut Lens, keyed_focal: bool, flags: &Lens) -> bool {
    if flags.f_stop.is_some() {
        file.aperture_diameter = None;
    }
    if flags.aperture_diameter.is_some() {
        file.f_stop = None;
    }
    // Of field of view, focal length and sensor width any two may stand together.
    let all_three = flags.fov_x.or(file.fov_x).is_some()
        && (flags.focal_length.or(file.focal_length).is_some() || keyed_focal)
        && flags.sensor_width.or(file.sensor_width).is_some();
    if !all_three {
        return false;
    }
    if flags.fov_x.is_none() {
        if flags.focal_length.is_some() || flags.sensor_width.is_some() {
            file.fov_x = None;
        }
    } else if flags.focal_length.is_some() {
        file.sensor_width = None;
    } else {
        // The sensor stays: it makes a focal length of the field of view, which an f-stop needs.
        file.focal_length = None;
        return true;
    }
    false
}

/// A form of depth, and the details of the others.
pub fn depth(file: &mut Depth, flags: &Depth) {
    if let Some(form) = flags.depth {
        if form != DepthForm::Disparity {
            (file.depth_scale, file.depth_shift) = (None, None);
        }
        if form != DepthForm::Normalized {
            (file.depth_near, file.depth_far, file.depth_invert) = (None, None, None);
        }
        if matches!(form, DepthForm::Disparity | DepthForm::Normalized) {
            file.depth_unit = None;
        }
        return;
    }
    let disparity = flags.depth_scale.is_some() || flags.depth_shift.is_some();
    let normalized =
        flags.depth_near.is_some() || flags.depth_far.is_some() || flags.depth_invert == Some(true);
    let excluded = match file.depth {
        Some(DepthForm::Disparity) => normalized || flags.depth_unit.is_some(),
        Some(DepthForm::Normalized) => disparity || flags.depth_unit.is_some(),
        _ => false,
    };
    if excluded {
        file.depth = None;
        (file.depth_scale, file.depth_shift) = (None, None);
        (file.depth_near, file.depth_far, file.depth_invert) = (None, None, None);
    }
}

/// Which layers, and how many.
pub fn layering(file: &mut Blur, flags: &Blur) {
    // Said again, a layering changes nothing; another one has its own layers.
    if flags.layering.is_some() && flags.layering != file.layering {
        (file.layers, file.layer_threshold) = (None, None);
    }
    let single = file.layering == Some(LayeringName::Single);
    let general = file.layering == Some(LayeringName::General);
    if (flags.layers.is_some() && single) || (flags.layer_threshold.is_some() && (single || general)) {
        file.layering = None;
    }
}

/// A method, and what belongs to others.
pub fn method(file: &mut Blur, flags: &Blur) {
    if let Some(method) = flags.method {
        if method != MethodName::Diffusion {
            (file.integrator, file.steps, file.calibration) = (None, None, None);
            (file.solver, file.sweeps, file.tolerance) = (None, None, None);
        }
        if !method_of(method).has_psf() {
            without_aperture(file, flags);
        }
        if method != MethodName::Pyramid {
            (file.quality, file.mipmap) = (None, None);
        }
        if method != MethodName::Tensor {
            (file.tensor_sites, file.tensor_spacing) = (None, None);
            (file.tensor_gather, file.tensor_spread) = (None, None);
        }
    } else if of_diffusion(flags).is_some() && file.method != Some(MethodName::Diffusion) {
        (file.method, file.quality, file.mipmap) = (None, None, None);
        without_aperture(file, flags);
        (file.tensor_sites, file.tensor_spacing) = (None, None);
        (file.tensor_gather, file.tensor_spread) = (None, None);
    } else if flags.psf == Some(PsfName::Gaussian) {
        without_aperture(file, flags);
    }
    if flags.aperture.is_some() && !matches!(flags.aperture, Some(Shape::Blades(_))) {
        file.aperture_roundness = None;
    }
}

/// No shape of the method's own, and nothing that is said of one, but for highlights.
fn without_aperture(file: &mut Blur, flags: &Blur) {
    file.psf = None;
    if flags.bokeh_threshold.or(file.bokeh_threshold).is_some() {
        return;
    }
    file.aperture = None;
    (file.aperture_rotation, file.aperture_roundness, file.squeeze) = (None, None, None);
}

/// Integrator and steps, solver and when it stops.
pub fn diffusion(file: &mut Blur, flags: &Blur) {
    if flags.integrator.is_some_and(|integrator| integrator != IntegratorName::BackwardEuler) {
        file.steps = None;
    }
    if flags.steps.is_some() && file.integrator != Some(IntegratorName::BackwardEuler) {
        file.integrator = None;
    }
    if flags.solver.is_some_and(|solver| solver != SolverName::Jacobi) {
        (file.sweeps, file.tolerance) = (None, None);
    }
    if flags.sweeps.is_some() {
        file.tolerance = None;
    }
    if flags.tolerance.is_some() {
        file.sweeps = None;
    }
}

#[cfg(test)]
mod tests {
    use crate::config::parse;
    use crate::{camera, settings};

    /// Flags over a file, which must say what `expected` says and must go together.
    #[track_caller]
    fn over(flags: &str, file: &str, expected: &str) {
        let both = parse(flags).unwrap().over(parse(file).unwrap());
        assert_eq!(both, parse(expected).unwrap(), "{flags} over {file}");
        camera::check(&both.lens).unwrap();
        settings::settings(&both.blur, &both.circle, &both.depth).unwrap();
        settings::decoding(&both.depth).unwrap();
    }

    #[test]
    fn methods() {
        let disc = "method = 'naive'\npsf = 'aperture'";
        over("method = 'diffusion'", disc, "method = 'diffusion'");
        let lights = "aperture = 'blades:6'\nbokeh-threshold = 2";
        over("method = 'diffusion'", lights, &format!("method = 'diffusion'\n{lights}"));
        over("method = 'gather'", disc, "method = 'gather'\npsf = 'aperture'");
        over("psf = 'gaussian'", disc, "method = 'naive'\npsf = 'gaussian'");
        over("integrator = 'rational'", disc, "integrator = 'rational'");
        let fine = "method = 'pyramid'\nquality = 'fine'\nmipmap = 'nearest'";
        over("method = 'square'", fine, "method = 'square'");
        over("method = 'pyramid'", fine, fine);
        let sites = "method = 'tensor'\ntensor-sites = 'skip'\ntensor-spacing = 0.5\ntensor-gather = 'naive'";
        over("method = 'square'", sites, "method = 'square'");
        over("integrator = 'rational'", sites, "integrator = 'rational'");
        over("steps = 2\nintegrator = 'backward-euler'", fine, "steps = 2\nintegrator = 'backward-euler'");
        let jacobi = "integrator = 'backward-euler'\nsteps = 2\nsolver = 'jacobi'\nsweeps = 9\nlayers = 2";
        over("method = 'naive'", jacobi, "method = 'naive'\nlayers = 2");
    }

    #[test]
    fn integrator_and_solver() {
        let euler = "integrator = 'backward-euler'\nsteps = 4";
        over("integrator = 'disc'", euler, "integrator = 'disc'");
        over("integrator = 'backward-euler'", euler, euler);
        over("steps = 2", euler, "integrator = 'backward-euler'\nsteps = 2");
        let preview = "preset = 'preview'\n";
        over("steps = 2", &format!("{preview}integrator = 'rational'"), &format!("{preview}steps = 2"));
        over("solver = 'lu'", "solver = 'jacobi'\nsweeps = 9", "solver = 'lu'");
        over("solver = 'hybrid'", "solver = 'jacobi'\ntolerance = 0.1", "solver = 'hybrid'");
        over("sweeps = 9", "solver = 'jacobi'\ntolerance = 0.1", "solver = 'jacobi'\nsweeps = 9");
        over("tolerance = 0.1", "solver = 'jacobi'\nsweeps = 9", "solver = 'jacobi'\ntolerance = 0.1");
    }

    #[test]
    fn layers() {
        let background = "layering = 'background'\nlayers = 3\nlayer-threshold = 0.02";
        over("layering = 'single'", background, "layering = 'single'");
        over("layering = 'general'", background, "layering = 'general'");
        over("layering = 'background'", background, background);
        over("layers = 4", "layering = 'single'", "layers = 4");
        over("layering = 'single'", "layers = 4", "layering = 'single'");
    }

    #[test]
    fn depth_forms() {
        let disparity = "depth = 'disparity'\ndepth-scale = 2\ndepth-shift = 0.1";
        let normalized = "depth = 'normalized'\ndepth-near = 1\ndepth-far = 9\ndepth-invert = true";
        for form in ["planar", "ray", "inverse"] {
            let flag = format!("depth = '{form}'");
            over(&flag, disparity, &flag);
            over(&flag, normalized, &flag);
        }
        over(disparity, normalized, disparity);
        over(normalized, disparity, normalized);
        over(disparity, "depth-unit = 'cm'", disparity);
        over("depth-unit = 'cm'", normalized, "depth-unit = 'cm'");
        let far = "depth = 'normalized'\ndepth-near = 1\ndepth-invert = true\ndepth-far = 5";
        over("depth-far = 5", normalized, far);
        over("coc-channel = 'coc'", "depth-channel = 'Z'\ndepth-file = 'z.png'", "coc-channel = 'coc'");
        over("depth-channel = 'Z'", "coc-channel = 'coc'", "depth-channel = 'Z'");
        over("depth-file = 'z.png'", "coc-channel = 'coc'", "depth-file = 'z.png'");
    }

    #[test]
    fn lenses() {
        let photo = "f-stop = 2\nfocal-length = 50\nsensor-width = 36";
        over(
            "fov-x = 40\naperture-diameter = 0.01",
            photo,
            "fov-x = 40\naperture-diameter = 0.01\nsensor-width = 36",
        );
        over("fov-x = 40", photo, "fov-x = 40\nf-stop = 2\nsensor-width = 36");
        over("fov-x = 40\nfocal-length = 35", photo, "fov-x = 40\nf-stop = 2\nfocal-length = 35");
        let ideal = "fov-x = 40\naperture-diameter = 0.01";
        over(photo, ideal, photo);
        over("f-stop = 4", ideal, "fov-x = 40\nf-stop = 4");
        over(
            "aperture-diameter = 0.02",
            photo,
            "aperture-diameter = 0.02\nfocal-length = 50\nsensor-width = 36",
        );
        let both = "fov-x = 40\nsensor-width = 36\nf-stop = 2";
        over("focal-length = 50", both, photo);
    }

    #[test]
    fn lenses_of_keys() {
        let focus = "\n[[key]]\nframe = 1\nfocus-distance = 2";
        let zoom = &format!("{focus}\nfocal-length = 50");
        let sensor = "f-stop = 2\nsensor-width = 36";
        over("fov-x = 30", &format!("{sensor}{zoom}"), &format!("fov-x = 30\n{sensor}{focus}"));
        // A sensor width takes the angle's place; without one the two go together.
        let angle = "f-stop = 2\nfov-x = 30";
        over("sensor-width = 36", &format!("{angle}{zoom}"), &format!("{sensor}{zoom}"));
        over("f-stop = 2", &format!("fov-x = 30{zoom}"), &format!("{angle}{zoom}"));
        over("fov-x = 30", &format!("f-stop = 2{zoom}"), &format!("{angle}{zoom}"));
    }

    #[test]
    fn layers_and_depth_in_a_file_of_its_own() {
        let layers = "input = 'in.exr'\nforeground = 'near.exr'\nbehind = 'far.exr'";
        over(layers, "depth-file = 'z.png'", layers);
        over("depth-file = 'z.png'", layers, "input = 'in.exr'\ndepth-file = 'z.png'");
    }

    #[test]
    fn bits_of_another_format() {
        let png = "output = 'k.png'\nbits = 16";
        over("output = 'k.exr'", png, "output = 'k.exr'");
        over("output = 'k.jpg'", png, "output = 'k.jpg'");
        over("output = 'k.tif'", png, "output = 'k.tif'\nbits = 16");
        over("output = 'folder'", png, "output = 'folder'\nbits = 16");
        over("output = 'k.exr'\nbits = 8", png, "output = 'k.exr'\nbits = 8");
    }

    #[test]
    fn outputs_that_are_there() {
        over("overwrite = true", "resume = true", "overwrite = true");
        over("resume = true", "overwrite = true", "resume = true");
        over("resume = false", "overwrite = true", "resume = false\noverwrite = true");
    }

    #[test]
    fn flags_that_exclude_each_other_are_still_refused() {
        let both = parse("f-stop = 2\naperture-diameter = 0.01").unwrap().over(parse("f-stop = 4").unwrap());
        assert!(camera::check(&both.lens).is_err());
        let both = parse("integrator = 'disc'\nsteps = 2").unwrap().over(parse("steps = 4").unwrap());
        assert!(settings::settings(&both.blur, &both.circle, &both.depth).is_err());
    }
}
