//! The conformance suite itself: the f64 reference, rounded to f32, passes it, and broken subjects do not.

use pullfocus_core::{Camera, Cancel, Diffusion, Error, Plane, Report, Result, Scene, Settings};
use pullfocus_testkit::conformance::{Medium, diffusion as checks};
use pullfocus_testkit::{Grid, reference};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The reference as a backend.
fn subject(planes: &mut [Plane], medium: Medium<'_>, settings: &Diffusion, cancel: &Cancel) -> Result<()> {
    settings.check()?;
    let diameter = Grid::from_plane(medium.diameter);
    let gamma = medium.gamma.map(|g| Grid::from_plane(g).map(|g| g.max(1e-6)));
    for plane in planes {
        plane.expect_size("a plane", medium.diameter.size())?;
        cancel.check()?;
        let x = Grid::from_plane(plane);
        let scale = f64::from(medium.vertical_scale);
        *plane = reference::diffuse(&x, &diameter, gamma.as_ref(), scale, settings).to_plane();
    }
    Ok(())
}

#[test]
fn the_reference_passes_what_does_not_take_long() {
    checks::constants_are_kept(&mut subject);
    checks::heat_is_kept(&mut subject);
    checks::one_axis_is_self_adjoint(&mut subject);
    checks::mirrored_in_mirrored_out(&mut subject);
    checks::stays_within_the_range(&mut subject);
    checks::holes_without_heat_are_filled(&mut subject);
    checks::jacobi_reaches_its_tolerance(&mut subject);
    checks::odd_settings_are_refused(&mut subject);
    checks::a_raised_flag_cancels(&mut subject);
}

fn fails(check: impl FnOnce()) -> bool {
    catch_unwind(AssertUnwindSafe(check)).is_err()
}

#[test]
fn broken_subjects_fail() {
    let mut leaking = |planes: &mut [Plane], medium: Medium<'_>, settings: &Diffusion, cancel: &Cancel| {
        subject(planes, medium, settings, cancel)?;
        planes.iter_mut().for_each(|p| p.data_mut().iter_mut().for_each(|v| *v *= 0.9999));
        Ok(())
    };
    assert!(fails(|| checks::constants_are_kept(&mut leaking)));
    assert!(fails(|| checks::heat_is_kept(&mut leaking)));
    assert!(fails(|| checks::zero_blur_keeps_every_bit(&mut leaking)));
    assert!(fails(|| checks::matches_the_f64_reference(&mut leaking)));
    let mut transposed = |planes: &mut [Plane], medium: Medium<'_>, settings: &Diffusion, cancel: &Cancel| {
        let turned = |p: &Plane| Grid::from_plane(p).transposed().to_plane();
        let (diameter, gamma) = (turned(medium.diameter), medium.gamma.map(turned));
        let medium = Medium { diameter: &diameter, gamma: gamma.as_ref(), ..medium };
        let mut other: Vec<Plane> = planes.iter().map(turned).collect();
        subject(&mut other, medium, settings, cancel)?;
        planes.iter_mut().zip(&other).for_each(|(p, o)| *p = turned(o));
        Ok(())
    };
    assert!(fails(|| checks::matches_the_f64_reference(&mut transposed)), "columns before rows is noticed");
    let mut deaf = |_: &mut [Plane], _: Medium<'_>, _: &Diffusion, _: &Cancel| Ok::<(), Error>(());
    assert!(fails(|| checks::a_raised_flag_cancels(&mut deaf)));
    assert!(fails(|| checks::odd_settings_are_refused(&mut deaf)));
    assert!(fails(|| checks::has_the_variance_of_the_disc(&mut deaf)));
}

/// Diffusions and renders as types with names.
type Diffuses = fn(&mut [Plane], Medium<'_>, &Diffusion, &Cancel) -> Result<()>;
type Renders = fn(&mut Scene, Option<&Camera>, &Settings, &Cancel) -> Result<Report>;

#[test]
fn the_lists_hold_every_check_and_their_checks_run() {
    // Public functions that take a subject, as the sources have them.
    let declared = |source: &str| source.matches("\npub fn ").count();
    let diffusion = pullfocus_testkit::diffusion_checks!(Diffuses);
    // `exact` is not a check.
    assert_eq!(diffusion.len(), declared(include_str!("../src/conformance/diffusion.rs")) - 1);
    let render = pullfocus_testkit::render_checks!(Renders);
    let foregrounds = declared(include_str!("../src/conformance/foreground.rs"));
    assert_eq!(render.len(), declared(include_str!("../src/conformance/render.rs")) + foregrounds);
    let bokeh = pullfocus_testkit::bokeh_checks!(Renders);
    assert_eq!(bokeh.len(), declared(include_str!("../src/conformance/bokeh.rs")));
    let show = pullfocus_testkit::show_checks!(Renders);
    assert_eq!(show.len(), declared(include_str!("../src/conformance/show.rs")));
    let (_, check) = diffusion.iter().find(|(name, _)| *name == "odd_settings_are_refused").expect("a check");
    let mut subject: Diffuses = subject;
    check(&mut subject);
    let mut deaf: Diffuses = |_, _, _, _| Ok(());
    assert!(fails(|| check(&mut deaf)));
}
