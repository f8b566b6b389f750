//! Checks of a backend's whole pipeline. Each panics with what differs.

use super::diffusion::{CANCELLED_WITHIN, EXACT_DISC, cancelled_after, exact};
use super::foreground::foreground;
pub use super::foreground::{
    emission_is_blurred_too, foreground_light_is_kept, the_lens_says_what_is_in_front,
};
use super::{RenderSubject, bits, on_threads};
use crate::grid::Grid;
use crate::reference;
use crate::scenes::{self, TwoPlanes};
use pullfocus_core::diffusion::{Diffusion, Integrator, JacobiStop, Solver};
use pullfocus_core::picture::LARGEST;
use pullfocus_core::response::Rational;
use pullfocus_core::{
    Camera, Cancel, DepthDecoding, DepthKind, Distance, Error, Layering, Lens, Method, Picture, Plane,
    Preset, Scene, Settings, Size,
};

/// Every layering with the final integrator, layers with the Gaussian's, and the preview; every kind of layering with
/// each spreading method that the backend has.
pub(super) fn all_settings(subject: &impl RenderSubject) -> Vec<Settings> {
    let of = |layering| Settings { layering, ..Settings::default() };
    let mut all = vec![
        of(Layering::Single),
        of(Layering::PAPER),
        of(Layering::Background { layers: 3, threshold: 0.02 }),
        of(Layering::General { layers: 1 }),
        of(Layering::General { layers: 3 }),
        Settings::default(),
        Settings::preset(Preset::Preview),
        Settings {
            diffusion: Diffusion {
                integrator: Integrator::Rational(Rational::GAUSSIAN),
                ..Diffusion::default()
            },
            ..Settings::default()
        },
    ];
    for &method in subject.methods().iter().filter(|method| **method != Method::Diffusion) {
        for layering in [Layering::Single, Layering::PAPER, Layering::General { layers: 3 }] {
            all.push(Settings { method, ..of(layering) });
        }
    }
    all
}

pub(super) fn run(
    subject: &mut impl RenderSubject,
    scene: &Scene,
    camera: Option<&Camera>,
    settings: &Settings,
) -> Picture {
    let mut scene = scene.clone();
    let distance = scene.base.distance.clone();
    subject.render(&mut scene, camera, settings, &Cancel::new()).expect("the render runs");
    assert!(bits(scene.base.distance.plane()) == bits(distance.plane()), "the distance stays as it was");
    scene.base.picture
}

pub(super) fn same_bits(a: &Picture, b: &Picture) -> bool {
    a.planes().map(bits).eq(b.planes().map(bits))
}

pub(super) fn all_finite(picture: &Picture) -> bool {
    picture.planes().all(|plane| plane.data().iter().all(|v| v.is_finite()))
}

/// A fence before a ramp, with alpha that has a hole.
pub(super) fn busy(size: Size) -> Scene {
    let mut scene = scenes::fence_over_ramp(size, -9.0, 14.0);
    let alpha = scenes::plane(size, |x, y| if x > size.width / 2 && y < size.height / 3 { 0.0 } else { 1.0 });
    for color in &mut scene.base.picture.colors {
        color.data_mut().iter_mut().zip(alpha.data()).for_each(|(c, a)| *c *= a);
    }
    scene.base.picture.alpha = Some(alpha);
    scene
}

fn circle_mut(scene: &mut Scene) -> &mut Plane {
    match &mut scene.base.distance {
        Distance::Coc(plane) | Distance::Depth { plane, .. } => plane,
    }
}

pub(super) fn lens(aperture_diameter_m: f64, focus_m: f64) -> Camera {
    Camera::new(Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m }, focus_m).expect("a lens")
}

/// An aperture of 0, and circles of 0, give the input's own bytes.
pub fn a_pinhole_keeps_every_bit(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 54);
    let depth = scenes::ramp(size, 0.5, 30.0);
    let colors = vec![scenes::noise(size, 0.0, 3.0, 1), scenes::checker(size, 5), scenes::point(size, 900.0)];
    let scene = scenes::by_depth(colors.clone(), depth);
    let still =
        scenes::by_circle(colors, Some(scenes::noise(size, 0.0, 1.0, 2)), scenes::constant(size, 0.0));
    for settings in all_settings(subject) {
        let rendered = run(subject, &scene, Some(&lens(0.0, 2.0)), &settings);
        assert!(same_bits(&rendered, &scene.base.picture), "{settings:?} with an aperture of 0");
        let rendered = run(subject, &still, None, &settings);
        assert!(same_bits(&rendered, &still.base.picture), "{settings:?} with circles of 0");
    }
}

/// `single` is one diffusion of every plane and nothing else.
pub fn one_layer_matches_the_f64_reference(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 54);
    let camera = lens(0.03, 2.0);
    let depth = scenes::plane(size, |x, y| if (x / 9 + y / 7) % 3 == 0 { 1.0 } else { 2.0 + x as f32 * 0.1 });
    let colors = vec![scenes::noise(size, 0.0, 3.0, 3), scenes::checker(size, 5)];
    let scene = scenes::by_depth(colors, depth.clone());
    let formula = camera.circle_of_confusion(&scene.frame);
    let diameter = Grid::from_plane(&depth).map(|z| formula.diameter(z));
    let rational = Integrator::Rational(Rational::GAUSSIAN);
    for integrator in [Integrator::BackwardEuler { steps: 1 }, rational, Integrator::Disc] {
        let diffusion = Diffusion { integrator, ..Diffusion::default() };
        let settings = Settings { layering: Layering::Single, diffusion, ..Settings::default() };
        let rendered = run(subject, &scene, Some(&camera), &settings);
        for (before, after) in scene.base.picture.planes().zip(rendered.planes()) {
            let x = Grid::from_plane(before);
            let expected = reference::diffuse(&x, &diameter, None, 1.0, &diffusion);
            // The rational integrator's negative lobe may be cut off where no colour is negative.
            let cut = expected.map(|v| v.max(0.0));
            let error = expected.distance_to(after).min(cut.distance_to(after)) / x.largest();
            // The solvers' bound, and as much for circles computed in f32.
            assert!(error < 2.0 * exact(&diffusion), "{integrator:?} errs by {error:e}");
        }
    }
}

/// An even picture stays even, whatever its circles; so does an even foreground over the same colour.
pub fn constants_are_kept(subject: &mut impl RenderSubject) {
    let size = Size::new(120, 68);
    let even =
        || vec![scenes::constant(size, 0.7), scenes::constant(size, 40.0), scenes::constant(size, 0.0)];
    let mut scene = scenes::fence_over_ramp(size, -12.0, 17.0);
    scene.base.picture = Picture { colors: even(), alpha: Some(scenes::constant(size, 1.0)) };
    let mut layered = scene.clone();
    layered.foreground = Some(foreground(size, &[0.7, 40.0, 0.0], -15.0));
    for settings in all_settings(subject) {
        for scene in [&scene, &layered] {
            let rendered = run(subject, scene, None, &settings);
            for (before, after) in scene.base.picture.planes().zip(rendered.planes()) {
                let before = Grid::from_plane(before);
                // Some ten blurs of the solvers' bound, composited.
                let error = before.distance_to(after) / before.largest().max(1.0);
                assert!(error < 10.0 * EXACT_DISC, "{settings:?} moves a constant by {error:e}");
            }
        }
    }
}

/// Black with alpha 0 comes out as exactly that, in front of focus and behind it.
pub fn empty_pixels_stay_empty(subject: &mut impl RenderSubject) {
    let size = Size::new(60, 34);
    let empty = vec![scenes::constant(size, 0.0); 3];
    let scene = scenes::by_circle(empty, Some(scenes::constant(size, 0.0)), scenes::ramp(size, -20.0, 20.0));
    for settings in all_settings(subject) {
        let rendered = run(subject, &scene, None, &settings);
        let zero = rendered.planes().all(|plane| plane.data().iter().all(|v| *v == 0.0));
        assert!(zero, "{settings:?} fills empty pixels");
    }
}

/// The rule for colour that is no number: NaN counts as 0, plus and minus infinity as plus and minus 65504, half's
/// largest (an infinity in a file is a half that overflowed), and what is larger than any light as the largest. So one bad pixel never
/// spreads, and the picture is the same as if the file had held those values.
pub fn numbers_that_are_none_follow_the_rule(subject: &mut impl RenderSubject) {
    let size = Size::new(80, 45);
    let clean = busy(size);
    let mut odd = clean.clone();
    let mut mended = clean;
    let bad = [
        (3, 3, f32::NAN),
        (40, 20, f32::INFINITY),
        (41, 22, f32::NEG_INFINITY),
        (70, 40, -f32::NAN),
        (12, 30, f32::MAX),
        (60, 8, -1e25),
    ];
    for (x, y, value) in bad {
        let rule = match value {
            value if value.is_nan() => 0.0,
            value if value.is_infinite() => 65504f32.copysign(value),
            value => LARGEST.copysign(value),
        };
        odd.base.picture.colors[1].row_mut(y)[x] = value;
        mended.base.picture.colors[1].row_mut(y)[x] = rule;
    }
    if let Some(alpha) = &mut odd.base.picture.alpha {
        alpha.row_mut(9)[9] = f32::NAN;
    }
    if let Some(alpha) = &mut mended.base.picture.alpha {
        alpha.row_mut(9)[9] = 0.0;
    }
    for settings in all_settings(subject) {
        let rendered = run(subject, &odd, None, &settings);
        assert!(all_finite(&rendered), "{settings:?} lets a NaN or an infinity through");
        let expected = run(subject, &mended, None, &settings);
        assert!(same_bits(&rendered, &expected), "{settings:?} does not follow the rule");
    }
}

/// Depth of every odd number, in every convention, and odd circles give finite pictures.
pub fn any_depth_gives_numbers(subject: &mut impl RenderSubject) {
    let size = Size::new(45, 30);
    let odd =
        [f32::NAN, 0.0, -0.0, -1.0, f32::INFINITY, f32::NEG_INFINITY, 65504.0, 1e10, 1e-30, 3e38, 2.0, 1.0];
    let depth = scenes::plane(size, |x, y| odd[(x / 3 + y) % odd.len()]);
    let camera = lens(0.02, 2.0);
    let kinds = [
        DepthKind::Planar,
        DepthKind::Ray,
        DepthKind::Inverse,
        DepthKind::Disparity { scale: 0.5, shift: 0.1 },
        DepthKind::Normalized { near_m: 0.5, far_m: 9.0, inverted: true },
    ];
    let colors = vec![scenes::noise(size, 0.0, 1.0, 5)];
    for settings in all_settings(subject) {
        for kind in kinds {
            let mut scene = scenes::by_depth(colors.clone(), depth.clone());
            let decoding = DepthDecoding { kind, ..DepthDecoding::default() };
            scene.base.distance = Distance::Depth { plane: depth.clone(), decoding };
            let rendered = run(subject, &scene, Some(&camera), &settings);
            assert!(all_finite(&rendered), "{kind:?} with {settings:?}");
        }
        let circles = scenes::by_circle(colors.clone(), None, depth.clone());
        let rendered = run(subject, &circles, None, &settings);
        assert!(all_finite(&rendered), "circles of any number with {settings:?}");
    }
}

/// 1 x 1 and every odd small size render to finite values near the input's range.
pub fn every_small_size_renders(subject: &mut impl RenderSubject) {
    let sizes = [1, 2, 3, 4, 5, 7, 8, 9, 16, 17, 33];
    for settings in all_settings(subject) {
        for size in sizes.iter().flat_map(|&w| sizes.map(|h| Size::new(w, h))) {
            let colors = vec![scenes::noise(size, 0.4, 0.6, 6)];
            let alpha = Some(scenes::constant(size, 1.0));
            let scene = scenes::by_circle(colors, alpha, scenes::ramp(size, -6.0, 9.0));
            let rendered = run(subject, &scene, None, &settings);
            // A rational integrator overshoots a step by less than a tenth of it.
            let within = |v: &f32| (0.38..=0.62).contains(v);
            assert!(rendered.colors[0].data().iter().all(within), "{size} with {settings:?}");
        }
        let mut layered = busy(Size::new(1, 1));
        layered.foreground = Some(foreground(Size::new(1, 1), &[0.5, 0.5, 0.5], -3.0));
        assert!(all_finite(&run(subject, &layered, None, &settings)), "1 x 1 with a foreground");
    }
}

/// Left and right are alike, and so are top and bottom.
pub fn a_mirrored_scene_gives_the_mirrored_picture(subject: &mut impl RenderSubject) {
    // Both a multiple of what fills may be reduced by, so that their blocks are mirrored, too.
    let size = Size::new(128, 64);
    let scene = busy(size);
    let flip = |p: &Plane| scenes::plane(size, |x, y| p.at(size.width - 1 - x, size.height - 1 - y));
    let mut mirrored = scene.clone();
    for plane in mirrored.base.picture.planes_mut() {
        *plane = flip(plane);
    }
    let circle = circle_mut(&mut mirrored);
    *circle = flip(circle);
    for settings in all_settings(subject) {
        let plain = run(subject, &scene, None, &settings);
        let other = run(subject, &mirrored, None, &settings);
        for (a, b) in plain.planes().zip(other.planes()) {
            let error = Grid::from_plane(a).distance_to(&flip(b));
            // Some ten blurs of the solvers' bound, composited.
            assert!(error < 10.0 * EXACT_DISC, "{settings:?} differs by {error:e}");
        }
    }
}

/// A white disc alone before nothing keeps its light through a focus pull, however its layers are cut: one surface must not
/// lie in two layers that cover each other. (The first paper's background layer mixes two blurs, and keeps no sums.)
pub fn one_thing_keeps_its_light(subject: &mut impl RenderSubject) {
    let size = Size::new(160, 120);
    let disc =
        scenes::plane(size, |x, y| if (x as f32 - 79.5).hypot(y as f32 - 59.5) < 20.0 { 1.0 } else { 0.0 });
    // A normalised spread cannot keep sums where circles vary.
    let keeps =
        |s: &Settings| s.method == Method::Diffusion && !matches!(s.layering, Layering::Background { .. });
    for settings in all_settings(subject).into_iter().filter(keeps) {
        for step in 0..24 {
            let own = -6.0 + 0.7 * step as f32;
            let circle = scenes::plane(size, |x, y| if disc.at(x, y) > 0.0 { own } else { own + 9.0 });
            let scene = scenes::by_circle(vec![disc.clone()], Some(disc.clone()), circle);
            let rendered = run(subject, &scene, None, &settings);
            let before = Grid::from_plane(&disc).sum();
            let after = Grid::from_plane(&rendered.colors[0]).sum();
            // Coverage cut at 1 where lobes overshoot, and negative lobes cut at 0, change sums a little.
            assert!((after / before - 1.0).abs() < 0.02, "{settings:?}, {own} px: {before} became {after}");
        }
    }
}

/// Lights a thousand times brighter than what is around them, at depths of every kind, leave nothing negative.
pub fn bright_lights_leave_nothing_negative(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 64);
    let light = scenes::noise(size, 0.0, 1.0, 5);
    let depth = scenes::noise(size, -12.0, 14.0, 6);
    let color = scenes::plane(size, |x, y| if light.at(x, y) > 0.98 { 900.0 } else { 0.01 * light.at(x, y) });
    for settings in all_settings(subject) {
        let scene = scenes::by_circle(vec![color.clone()], None, depth.clone());
        let least =
            run(subject, &scene, None, &settings).colors[0].data().iter().copied().fold(0.0, f32::min);
        assert!(least >= 0.0, "{settings:?}: {least}");
    }
}

/// A blurred near half over a sharp even one: with a foreground element within the Gaussian's distance from the disc of the
/// exact answer; out of one picture with depth (general layers) soft as well.
pub fn a_near_edge_is_soft_over_a_sharp_one(subject: &mut impl RenderSubject) {
    let size = Size::new(400, 24);
    let planes = TwoPlanes::new(size, 4.0);
    let contrast = f64::from(planes.colors[0] - planes.colors[1]);
    let worst = |picture: &Picture| {
        let differences =
            (0..size.width).map(|x| (f64::from(picture.colors[0].at(x, 12)) - planes.exact(x)).abs());
        differences.fold(0.0, f64::max) / contrast
    };
    let settings = Settings::default();
    let layered = worst(&run(subject, &planes.layered(), Some(&planes.camera), &settings));
    // The integrals of a disc and of a Gaussian of its variance differ by at most 0.025; the integrator's own
    // error and the pixel's width come on top.
    assert!(layered < 0.06, "the layered edge is {layered} of the contrast from the exact one");
    let single = worst(&run(subject, &planes.single(), Some(&planes.camera), &settings));
    // A hard edge errs by 0.5 there.
    assert!(single < 0.25, "the single picture's edge is {single} of the contrast from the exact one");
}

/// A dark sliver between a sharp thing and a far one goes where its own circle says: none of its pixels stays darker than those
/// beside it.
pub fn a_sliver_between_two_things_is_blurred(subject: &mut impl RenderSubject) {
    let (diameters, colors) = ([0.0, 14.4, 31.0], [1.0, 0.02, 0.8]);
    let methods = subject.methods();
    let mut check = |method: Method, wide: f32, slope: f32| {
        let sliver = scenes::Sliver { size: Size::new(120, 80), slope, wide, diameters, colors };
        let scene = sliver.scene();
        let rendered = run(subject, &scene, None, &Settings { method, ..Settings::default() });
        let least = |diameter: f32| {
            let pixels = rendered.colors[0].data().iter().zip(scene.base.distance.plane().data());
            pixels.filter(|(_, c)| **c == diameter).map(|(v, _)| *v).fold(1.0, f32::min)
        };
        let [_, own, beside] = diameters.map(least);
        // Blurred, a sliver of two pixels is darker in its middle than beside it by 0.04; what is kept of it shows 0.1 to 0.2.
        assert!(own > beside - 0.06, "{method:?}, {wide} px, slope {slope}: {own} beside {beside}");
    };
    for method in [Method::Diffusion, Method::Aperture] {
        if !methods.contains(&method) {
            continue;
        }
        for wide in [1.0, 1.5, 2.0] {
            for slope in [0.0, 0.3, 1.0, 1.7, -0.6] {
                check(method, wide, slope);
            }
        }
    }
}

/// Circles that all move by a tenth of a pixel per frame, and by half of that: no pixel jumps. Where a pixel moves smoothly
/// the second difference over time falls to a quarter with the step, at a kink to a half; at a jump it stays.
pub fn a_focus_pull_has_no_jumps(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 54);
    let mut scene = busy(size);
    // A part of a picture 960 pixels wide: in a picture of 96 pixels a tenth of a pixel is a long way, since what is a layer
    // is measured in widths.
    scene.frame.display.size = Size::new(960, 540);
    for settings in all_settings(subject) {
        let mut worst = |step: f32| {
            let frames: Vec<Plane> = (0..(6.0 / step) as usize)
                .map(|frame| {
                    let mut scene = scene.clone();
                    let shift = -3.0 + step * frame as f32;
                    circle_mut(&mut scene).data_mut().iter_mut().for_each(|c| *c += shift);
                    run(subject, &scene, None, &settings).colors.swap_remove(0)
                })
                .collect();
            let second = frames.windows(3).flat_map(|w| {
                let values = w[0].data().iter().zip(w[1].data()).zip(w[2].data());
                values.map(|((a, b), c)| (a - 2.0 * b + c).abs())
            });
            second.fold(0.0, f32::max)
        };
        let (tenth, twentieth) = (worst(0.1), worst(0.05));
        // Values reach 1, and the contrast of neighbours about as much.
        assert!(tenth < 0.1, "{settings:?}: a second difference of {tenth}");
        // Between a kink's half and a jump's whole; below a thousandth nobody sees it.
        let least = 0.75 * tenth + 1e-3;
        assert!(twentieth < least, "{settings:?}: {tenth} in steps of 0.1 px, {twentieth} in steps of 0.05");
    }
}

/// Alpha that equals a colour stays equal to it: alpha is one more colour.
pub fn alpha_goes_through_the_same_lens(subject: &mut impl RenderSubject) {
    let size = Size::new(90, 51);
    let mut scene = busy(size);
    scene.base.picture.colors = scene.base.picture.alpha.iter().cloned().collect();
    for settings in all_settings(subject) {
        let rendered = run(subject, &scene, None, &settings);
        let alpha = rendered.alpha.as_ref().expect("alpha stays");
        let error = Grid::from_plane(alpha).distance_to(&rendered.colors[0]);
        assert!(error < 10.0 * EXACT_DISC, "{settings:?}: alpha is {error} from a colour that equals it");
        let within = |v: &f32| (-0.02..=1.02).contains(v);
        assert!(alpha.data().iter().all(within), "{settings:?}: alpha leaves 0 to 1");
    }
}

/// A light group beside the beauty leaves the beauty's bytes alone.
pub fn further_planes_do_not_change_the_others(subject: &mut impl RenderSubject) {
    let scene = busy(Size::new(64, 36));
    let mut more = scene.clone();
    more.base.picture.colors.push(scenes::noise(Size::new(64, 36), 0.0, 5.0, 7));
    for settings in all_settings(subject) {
        let plain = run(subject, &scene, None, &settings);
        let other = run(subject, &more, None, &settings);
        let same = plain.colors.iter().zip(&other.colors).all(|(a, b)| bits(a) == bits(b));
        assert!(same, "{settings:?}");
    }
}

/// One, two, three and eight threads give the same bytes, from one picture and with a foreground.
pub fn any_number_of_threads_gives_the_same_bytes(subject: &mut (impl RenderSubject + Send)) {
    let size = Size::new(203, 117);
    let plain = busy(size);
    let mut layered = plain.clone();
    layered.foreground = Some(foreground(size, &[0.5, 0.6, 0.7], -11.0));
    for settings in all_settings(subject) {
        for scene in [&plain, &layered] {
            let one = on_threads(1, || run(subject, scene, None, &settings));
            for threads in [2, 3, 8] {
                let other = on_threads(threads, || run(subject, scene, None, &settings));
                assert!(same_bits(&one, &other), "{threads} threads differ, {settings:?}");
            }
        }
    }
}

/// A renderer that has rendered other sizes and settings gives what a fresh one gives.
pub fn a_second_run_gives_the_same_bytes(subject: &mut impl RenderSubject) {
    let (small, large) = (busy(Size::new(50, 40)), busy(Size::new(130, 70)));
    let settings = all_settings(subject);
    let first: Vec<_> = settings.iter().map(|s| run(subject, &small, None, s)).collect();
    for (settings, first) in settings.iter().zip(&first).rev() {
        run(subject, &large, None, settings);
        let again = run(subject, &small, None, settings);
        assert!(same_bits(first, &again), "{settings:?}");
    }
}

/// A flag that is raised before the run stops it.
pub fn a_raised_flag_cancels(subject: &mut impl RenderSubject) {
    let cancel = Cancel::new();
    cancel.cancel();
    for settings in all_settings(subject) {
        let mut scene = busy(Size::new(40, 30));
        let result = subject.render(&mut scene, None, &settings, &cancel);
        assert!(matches!(result, Err(Error::Cancelled)), "{settings:?}: {result:?}");
        assert_eq!(scene.base.picture.size(), Size::new(40, 30), "the picture stays whole");
    }
}

/// A flag raised during a long render stops it soon.
pub fn a_run_is_cancelled_from_outside(subject: &mut impl RenderSubject) {
    let size = Size::new(1024, 768);
    let slow = Diffusion { solver: Solver::Jacobi(JacobiStop::Sweeps(20_000)), ..Diffusion::default() };
    for layering in [Layering::Single, Layering::PAPER, Layering::default()] {
        let settings = Settings { layering, diffusion: slow, ..Settings::default() };
        let mut scene = busy(size);
        let (result, late) = cancelled_after(|cancel| subject.render(&mut scene, None, &settings, cancel));
        assert!(matches!(result, Err(Error::Cancelled)), "{layering:?}: {result:?}");
        assert!(late < CANCELLED_WITHIN, "{layering:?} went on for {late:?}");
    }
}

/// Depth without a camera, planes of other sizes, settings outside their ranges: errors, not panics.
pub fn what_does_not_fit_is_refused(subject: &mut impl RenderSubject) {
    let size = Size::new(20, 10);
    let settings = Settings::default();
    let mut refused = |mut scene: Scene, settings: &Settings| {
        subject.render(&mut scene, None, settings, &Cancel::new()).expect_err("is refused")
    };
    let depth = scenes::by_depth(vec![scenes::checker(size, 2)], scenes::constant(size, 2.0));
    assert_eq!(refused(depth, &settings), Error::NoCamera);
    let mut uneven = busy(size);
    uneven.base.picture.colors[1] = scenes::checker(Size::new(19, 10), 2);
    assert!(matches!(refused(uneven, &settings), Error::SizeMismatch { .. }));
    let none = Settings { layering: Layering::General { layers: 0 }, ..Settings::default() };
    assert!(matches!(refused(busy(size), &none), Error::Setting { .. }));
    let mut without_alpha = busy(size);
    without_alpha.foreground = Some(foreground(size, &[0.1, 0.2, 0.3], -2.0));
    if let Some(foreground) = &mut without_alpha.foreground {
        foreground.picture.alpha = None;
    }
    assert!(matches!(refused(without_alpha, &settings), Error::Setting { .. }));
}
