//! Checks of highlights in a backend's whole pipeline. Each panics with what differs.

use super::diffusion::{CANCELLED_WITHIN, cancelled_after};
use super::render::{all_finite, run, same_bits};
use super::{RenderSubject, on_threads};
use crate::grid::Grid;
use crate::reference::bokeh as reference;
use crate::scenes;
use pullfocus_core::{
    Aperture, Bokeh, Cancel, Element, Error, Frame, Layering, Method, Picture, Plane, Scene, Settings, Size,
};

/// Every layering with every method of the backend, and highlights of each.
fn all_settings(subject: &impl RenderSubject, bokeh: Bokeh) -> Vec<Settings> {
    let mut all = Vec::new();
    for &method in subject.methods() {
        for layering in [Layering::Single, Layering::PAPER, Layering::General { layers: 4 }] {
            all.push(Settings { method, layering, bokeh: Some(bokeh), ..Settings::default() });
        }
    }
    all
}

/// Sprites of circles of every size.
fn bokeh() -> Bokeh {
    Bokeh { least_diameter: 0.5, ..Bokeh::default() }
}

/// A fence before a ramp of noise, with lights in both.
fn busy(size: Size) -> Scene {
    let mut scene = scenes::fence_over_ramp(size, -9.0, 14.0);
    let lights = scenes::noise(size, 0.0, 1.0, 23);
    for (plane, light) in scene.base.picture.colors.iter_mut().zip([90.0, 60.0, 200.0]) {
        for (value, &chance) in plane.data_mut().iter_mut().zip(lights.data()) {
            *value = if chance > 0.98 { light * chance } else { *value };
        }
    }
    scene
}

/// Three planes that hold `value` at these places, half and a quarter of it.
fn lights(size: Size, ground: f32, value: f32, places: &[(usize, usize)]) -> Vec<Plane> {
    [1.0, 0.5, 0.25]
        .map(|part| scenes::plane(size, |x, y| if places.contains(&(x, y)) { value * part } else { ground }))
        .into()
}

fn sum(plane: &Plane) -> f64 {
    Grid::from_plane(plane).sum()
}

/// Where nothing is bright enough, or nothing is blurred, every byte is as without highlights.
pub fn no_highlights_change_nothing(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 54);
    let mut scene = scenes::fence_over_ramp(size, -9.0, 14.0);
    scene.foreground = Some(Element {
        picture: Picture {
            colors: vec![scenes::constant(size, 0.1); 3],
            alpha: Some(scenes::checker(size, 20)),
        },
        ..scenes::by_circle(vec![], None, scenes::constant(size, -12.0)).base
    });
    let sharp = scenes::by_circle(lights(size, 0.1, 900.0, &[(30, 20)]), None, scenes::constant(size, 0.0));
    for settings in all_settings(subject, Bokeh { threshold: 9.0, ..bokeh() }) {
        let plain = Settings { bokeh: None, ..settings.clone() };
        let (with, without) = (run(subject, &scene, None, &settings), run(subject, &scene, None, &plain));
        assert!(same_bits(&with, &without), "{settings:?}");
        let rendered = run(subject, &sharp, None, &settings);
        assert!(same_bits(&rendered, &sharp.base.picture), "{settings:?} without blur");
    }
}

/// A light alone is the reference's disc, whatever blurs the rest, and keeps its energy.
pub fn a_light_alone_is_a_disc(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 64);
    let frame = Frame::full(size);
    let aperture = Aperture { roundness: 0.4, ..Aperture::blades(5, 10.0) };
    for c in [17.0, -11.0] {
        let colors = lights(size, 0.0, 700.0, &[(45, 30)]);
        let scene = scenes::by_circle(colors.clone(), None, scenes::constant(size, c));
        let grids: Vec<Grid> = colors.iter().map(Grid::from_plane).collect();
        let circle = Grid::filled(size.width, size.height, f64::from(c));
        let (_, excess) = reference::take_out(&grids, &circle, &bokeh(), &frame);
        let expected = reference::sprites(&excess, &circle, &bokeh(), &aperture, &frame, Some(&circle));
        for settings in all_settings(subject, bokeh()) {
            let settings = Settings { aperture: aperture.clone(), ..settings };
            let rendered = run(subject, &scene, None, &settings);
            for ((expected, plane), before) in expected.iter().zip(&rendered.colors).zip(&colors) {
                let error = expected.distance_to(plane) / expected.largest();
                // The rim as in the sprites' own tests; what stays of the light, a seven-hundredth, is blurred by the method.
                assert!(error < 0.12, "{settings:?}, {c}: {error}");
                // What stays of a square or a Gaussian is cut and divided; the sprite is exact.
                let kept = sum(plane) / sum(before) - 1.0;
                assert!(kept.abs() < 1e-3, "{settings:?}, {c}: {kept}");
            }
        }
    }
}

/// A far light does not reach over what is sharp and near, a near one reaches over what is behind.
pub fn light_keeps_the_order_of_depth(subject: &mut impl RenderSubject) {
    let size = Size::new(160, 60);
    // The left half is sharp, the right one far away; and the other way round, near and out of focus.
    for (c, place, dark) in [(24.0, (84, 30), 0..74), (-24.0, (84, 30), 0..0)] {
        let half = |left: f32, right: f32| scenes::plane(size, move |x, _| if x < 80 { left } else { right });
        let colors = |light: f32| {
            let mut colors = lights(size, 0.1, light, &[place]);
            colors.iter_mut().for_each(|plane| {
                (0..60).for_each(|y| plane.row_mut(y)[..80].fill(0.4));
            });
            colors
        };
        let scene = |light| scenes::by_circle(colors(light), None, half(0.0, c));
        for settings in all_settings(subject, bokeh()) {
            // Naive gathering and what spreads by weight bleed without any light.
            let (with, without) =
                (run(subject, &scene(500.0), None, &settings), run(subject, &scene(0.1), None, &settings));
            let density = 500.0 / (std::f32::consts::PI / 4.0 * 24.0 * 24.0);
            let difference = |x: usize| with.colors[0].at(x, 30) - without.colors[0].at(x, 30);
            for x in dark.clone() {
                // Coverage of a blurred layer, whose own share of the sharp half is a few hundredths there.
                let seen = difference(x).abs() / density;
                assert!(seen < 0.1, "{settings:?}: {seen} of a far light at {x}");
            }
            let inside = difference(88) / density;
            assert!((0.7..1.3).contains(&inside), "{settings:?}, {c}: {inside} inside the disc");
            if c < 0.0 {
                let over = difference(76) / density;
                assert!(
                    (0.7..1.3).contains(&over),
                    "{settings:?}: {over} of a near light over what is behind"
                );
            }
        }
    }
}

/// A light in an element of its own is spread as far as its circle, over what is behind.
pub fn a_foreground_s_light_lies_over_all(subject: &mut impl RenderSubject) {
    let size = Size::new(96, 64);
    let behind = scenes::by_circle(lights(size, 0.2, 0.2, &[]), None, scenes::constant(size, 0.0));
    let all = all_settings(subject, bokeh());
    // A light that covers its pixel, and a spark, which covers nothing.
    for (settings, covers) in all.iter().flat_map(|settings| [(settings, 1.0), (settings, 0.0)]) {
        let mut scene = behind.clone();
        let alpha = scenes::plane(size, |x, y| if (x, y) == (45, 30) { covers } else { 0.0 });
        scene.foreground = Some(Element {
            picture: Picture { colors: lights(size, 0.0, 700.0, &[(45, 30)]), alpha: Some(alpha) },
            ..scenes::by_circle(vec![], None, scenes::constant(size, -20.0)).base
        });
        let rendered = run(subject, &scene, None, settings);
        let before = sum(&behind.base.picture.colors[0]);
        let kept = (sum(&rendered.colors[0]) - before) / 700.0;
        // The element's pixel takes 0.2 away, and covers a little elsewhere.
        assert!((kept - 1.0).abs() < 2e-3, "{settings:?}, alpha {covers}: {kept}");
        let density = 700.0 / (std::f32::consts::PI / 4.0 * 400.0);
        let at = |x| (rendered.colors[0].at(x, 30) - 0.2) / density;
        let (inside, outside) = (at(53), at(58));
        let is_disc = (inside - 1.0).abs() < 0.02 && outside.abs() < 0.01;
        assert!(is_disc, "{settings:?}, alpha {covers}: {inside} {outside}");
    }
}

/// Second differences over frames: the largest, in parts of `unit`.
fn second(frames: &[Plane], unit: f32) -> f32 {
    let second = frames.windows(3).flat_map(|w| {
        let values = w[0].data().iter().zip(w[1].data()).zip(w[2].data());
        values.map(|((a, b), c)| (a - 2.0 * b + c).abs())
    });
    second.fold(0.0, f32::max) / unit
}

/// Circles that move through focus by a tenth and by a twentieth of a pixel per frame: no pixel jumps. Where a light moves
/// smoothly the second difference falls to a quarter with the step, at a kink to a half; at a jump it stays.
pub fn a_focus_pull_over_lights_has_no_jumps(subject: &mut impl RenderSubject) {
    let size = Size::new(64, 36);
    let frame = Frame {
        display: pullfocus_core::Window { size: Size::new(960, 540), ..Frame::full(size).display },
        ..Frame::full(size)
    };
    let colors = lights(size, 0.05, 20.0, &[(20, 12), (40, 20), (21, 25)]);
    let circle = scenes::plane(size, |x, _| if x < 32 { 0.0 } else { 3.0 });
    for settings in all_settings(subject, Bokeh::default()) {
        let mut worst = |step: f32| {
            let frames: Vec<Plane> = (0..(9.0 / step) as usize)
                .map(|i| {
                    let shift = -4.5 + step * i as f32;
                    let circle = scenes::plane(size, |x, y| circle.at(x, y) + shift);
                    let mut scene = scenes::by_circle(colors.clone(), None, circle);
                    scene.frame = frame;
                    run(subject, &scene, None, &settings).colors.swap_remove(0)
                })
                .collect();
            // In parts of the light.
            second(&frames, 20.0)
        };
        let (tenth, twentieth) = (worst(0.1), worst(0.05));
        // Between a kink's half and a jump's whole; below a hundredth of the light, one frame, nobody sees it.
        assert!(
            twentieth < 0.8 * tenth + 5e-3,
            "{settings:?}: {tenth} in steps of 0.1 px, {twentieth} of 0.05"
        );
    }
}

/// A light that fades through the threshold in equal steps changes no pixel by more than its own steps.
pub fn a_fading_light_has_no_jumps(subject: &mut impl RenderSubject) {
    let size = Size::new(48, 32);
    let knees = [Bokeh::default(), Bokeh { knee: 0.0, ..Bokeh::default() }];
    let all: Vec<Settings> = knees.into_iter().flat_map(|bokeh| all_settings(subject, bokeh)).collect();
    for settings in all {
        let frames: Vec<Plane> = (0..60)
            .map(|i| {
                let colors = lights(size, 0.05, 0.05 * i as f32, &[(24, 16)]);
                let scene = scenes::by_circle(colors, None, scenes::constant(size, 9.0));
                run(subject, &scene, None, &settings).colors.swap_remove(0)
            })
            .collect();
        for pair in frames.windows(2) {
            let step = Grid::from_plane(&pair[0]).distance_to(&pair[1]);
            // A light's own step is 0.05, all of it in one pixel at most.
            assert!(step < 0.05, "{settings:?}: {step}");
        }
        // The slope bends at the knee, by a step times what a sprite and the method differ: a Gaussian's peak is 0.03 here, a disc's
        // half of that.
        let bend = second(&frames, 1.0);
        assert!(bend < 2e-3, "{settings:?}: {bend}");
    }
}

/// Colours and circles that are no numbers give numbers; all sizes render.
pub fn every_scene_gives_numbers(subject: &mut impl RenderSubject) {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e15, -1e15, 65504.0, 1e-30, -0.0, 7.0];
    let settings =
        all_settings(subject, Bokeh { cats_eye: 1.0, gain: 1000.0, least_diameter: 0.0, ..Bokeh::default() });
    for (i, settings) in settings.iter().enumerate() {
        let aperture = [
            Aperture { squeeze: 4.0, ..Aperture::DISC },
            Aperture { squeeze: 0.25, roundness: 0.5, ..Aperture::blades(3, 7.0) },
        ][i % 2]
            .clone();
        let settings = Settings { aperture, ..settings.clone() };
        for (w, h) in [(1, 1), (1, 9), (9, 1), (2, 3), (17, 5), (33, 34)] {
            let size = Size::new(w, h);
            let colors = vec![scenes::plane(size, |x, y| odd[(x * 3 + y) % odd.len()]); 2];
            let circle = scenes::plane(size, |x, y| odd[(x + y * 2) % odd.len()]);
            let mut scene = scenes::by_circle(colors, None, circle);
            for pixel_aspect in [1.0, 0.3, 2.5] {
                scene.frame.pixel_aspect = pixel_aspect;
                assert!(all_finite(&run(subject, &scene, None, &settings)), "{size}, {settings:?}");
            }
        }
    }
}

/// One, two, three and eight threads, and a second run, give the same bytes.
pub fn lights_give_the_same_bytes_again(subject: &mut (impl RenderSubject + Send)) {
    let scene = busy(Size::new(203, 117));
    let bokeh = Bokeh { cats_eye: 0.5, ..bokeh() };
    for settings in all_settings(subject, bokeh) {
        let one = on_threads(1, || run(subject, &scene, None, &settings));
        run(subject, &busy(Size::new(40, 30)), None, &settings);
        for threads in [2, 3, 8] {
            let other = on_threads(threads, || run(subject, &scene, None, &settings));
            assert!(same_bits(&one, &other), "{threads} threads differ, {settings:?}");
        }
    }
}

/// A flag stops it, before and on the way.
pub fn a_flag_stops_the_lights(subject: &mut impl RenderSubject) {
    let cancel = Cancel::new();
    cancel.cancel();
    let mut settings = all_settings(subject, bokeh());
    for settings in &settings {
        let mut scene = busy(Size::new(40, 30));
        let result = subject.render(&mut scene, None, settings, &cancel);
        assert!(matches!(result, Err(Error::Cancelled)), "{settings:?}: {result:?}");
    }
    settings.retain(|settings| settings.method == Method::Diffusion);
    for settings in settings {
        // Every pixel is a light whose sprite covers the picture.
        let size = Size::new(1024, 768);
        let circle = scenes::plane(size, |x, y| 300.0 + ((x * 7 + y * 13) % 101) as f32);
        let mut scene = scenes::by_circle(lights(size, 9.0, 9.0, &[]), None, circle);
        let (result, late) = cancelled_after(|cancel| subject.render(&mut scene, None, &settings, cancel));
        assert!(matches!(result, Err(Error::Cancelled)), "{settings:?}: {result:?}");
        assert!(late < CANCELLED_WITHIN, "{settings:?} went on for {late:?}");
    }
}
