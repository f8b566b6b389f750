//! Checks of layers that are shown alone. Each panics with what differs.

use super::RenderSubject;
use super::compare_pictures;
use super::foreground::foreground;
use super::render::{all_finite, all_settings, busy, run, same_bits};
use crate::grid::Grid;
use crate::scenes;
use pullfocus_core::{Bokeh, Cancel, Layering, Picture, Plane, Scene, Settings, Show, Size};

/// The settings with this shown.
fn showing(settings: &Settings, show: Show) -> Settings {
    Settings { show, ..settings.clone() }
}

/// Every layering by every method, and some with highlights of every size.
fn with_highlights(subject: &impl RenderSubject) -> Vec<Settings> {
    let bokeh = Some(Bokeh { threshold: 0.6, least_diameter: 0.5, ..Bokeh::default() });
    let plain = all_settings(subject);
    let bright: Vec<_> = plain.iter().map(|settings| Settings { bokeh, ..settings.clone() }).collect();
    plain.into_iter().chain(bright).collect()
}

/// The picture, how many layers it has, and each layer with its matte.
fn taken_apart(
    subject: &mut impl RenderSubject,
    scene: &Scene,
    settings: &Settings,
) -> (Picture, Vec<[Picture; 2]>) {
    let mut rendered = scene.clone();
    let report = subject.render(&mut rendered, None, settings, &Cancel::new()).expect("the render runs");
    let layers = (0..report.layers as u32).map(|number| {
        [Show::Layer(number), Show::Matte(number)].map(|show| {
            let mut rendered = scene.clone();
            let alone = subject.render(&mut rendered, None, &showing(settings, show), &Cancel::new());
            let alone = alone.expect("a layer alone");
            assert_eq!(alone.layers, report.layers, "{settings:?}: as many layers with {show:?}");
            assert_eq!(alone.coc_range, report.coc_range, "{settings:?} with {show:?}");
            rendered.base.picture
        })
    });
    (rendered.base.picture, layers.collect())
}

/// Lays layers over each other by their mattes, from the farthest to the nearest.
fn put_together(layers: &[[Picture; 2]]) -> Picture {
    let mut result = layers[0][0].clone();
    for [layer, matte] in &layers[1..] {
        for ((behind, front), matte) in result.planes_mut().zip(layer.planes()).zip(matte.planes()) {
            for ((behind, front), matte) in behind.data_mut().iter_mut().zip(front.data()).zip(matte.data()) {
                *behind = front + (1.0 - matte) * *behind;
            }
        }
    }
    result
}

fn is(picture: &Picture, value: f32) -> bool {
    picture.planes().all(|plane| plane.data().iter().all(|v| *v == value))
}

/// Layers laid over each other by their mattes are the result; the farthest covers everything.
fn check_layers(subject: &mut impl RenderSubject, scene: &Scene, settings: &Settings) {
    let (picture, layers) = taken_apart(subject, scene, settings);
    let name = format!("{}, {settings:?}", picture.size());
    // The same sums of a few products, rounded in another order: 16 layers round by 6e-8 of values that light may make some ten
    // times as large.
    compare_pictures(&name, &put_together(&layers), &picture, 1e-5, 1.0);
    assert!(is(&layers[0][1], 1.0), "{name}: the farthest layer covers everything");
    for [_, matte] in &layers {
        let within = |plane: &Plane| plane.data().iter().all(|v| (0.0..=1.0).contains(v));
        assert!(matte.planes().all(within), "{name}: a matte leaves 0 to 1");
        let first = matte.planes().next().expect("a plane");
        assert!(matte.planes().all(|plane| plane == first), "{name}: a matte is the same in every plane");
    }
    for number in [layers.len() as u32, 99, u32::MAX] {
        for show in [Show::Layer(number), Show::Matte(number)] {
            let none = run(subject, scene, None, &showing(settings, show));
            assert!(is(&none, 0.0), "{name}: {show:?} is no layer");
        }
    }
}

/// What every layer shows, alone and by its matte, makes up the result: with a foreground and without, with highlights and without.
pub fn shown_layers_make_up_the_result(subject: &mut impl RenderSubject) {
    let size = Size::new(97, 55);
    let plain = busy(size);
    let mut layered = plain.clone();
    layered.foreground = Some(foreground(size, &[0.5, 0.9, 0.7], -11.0));
    for settings in with_highlights(subject) {
        for scene in [&plain, &layered] {
            check_layers(subject, scene, &settings);
        }
    }
}

/// So it is for 1 x 1 and other small sizes, without alpha too.
pub fn small_pictures_have_layers(subject: &mut impl RenderSubject) {
    for (width, height) in [(1, 1), (1, 7), (9, 2), (17, 16), (33, 5)] {
        let size = Size::new(width, height);
        let mut scene = busy(size);
        scene.base.picture.alpha = None;
        let mut layered = scene.clone();
        layered.foreground = Some(foreground(size, &[0.5, 0.5, 0.5], -3.0));
        for settings in with_highlights(subject) {
            for scene in [&scene, &layered] {
                check_layers(subject, scene, &settings);
            }
        }
    }
}

/// A picture in focus is its own only layer, to the bit; a foreground before it is the next. Background layers are behind it.
pub fn a_picture_in_focus_is_one_layer(subject: &mut impl RenderSubject) {
    let size = Size::new(60, 34);
    let mut scene = busy(size);
    scene.base.distance = scenes::by_circle(vec![], None, scenes::constant(size, 0.0)).base.distance;
    let mut layered = scene.clone();
    layered.foreground = Some(foreground(size, &[0.5, 0.9, 0.7], -11.0));
    for settings in all_settings(subject) {
        let number = match settings.layering {
            Layering::Background { layers, .. } => layers,
            Layering::Single | Layering::General { .. } => 0,
        };
        for scene in [&scene, &layered] {
            let shown = run(subject, scene, None, &showing(&settings, Show::Layer(number)));
            assert!(same_bits(&shown, &scene.base.picture), "{settings:?}");
            assert!(is(&run(subject, scene, None, &showing(&settings, Show::Matte(number))), 1.0));
            let (_, layers) = taken_apart(subject, scene, &settings);
            assert_eq!(layers.len(), number as usize + 1 + usize::from(scene.foreground.is_some()));
            check_layers(subject, scene, &settings);
        }
    }
}

/// A far red light comes with the farthest layer and a near green one with the nearest, whatever blurs.
pub fn lights_come_with_their_layer(subject: &mut impl RenderSubject) {
    let size = Size::new(160, 60);
    let light = |place: (usize, usize)| scenes::plane(size, |x, y| if (x, y) == place { 500.0 } else { 0.0 });
    let colors = vec![light((130, 30)), light((30, 30)), scenes::constant(size, 0.0)];
    let depth = scenes::plane(size, |x, _| if x < 80 { -14.0 } else { 14.0 });
    let scene = scenes::by_circle(colors, None, depth);
    let bokeh = Some(Bokeh::default());
    for &method in subject.methods() {
        let layering = Layering::General { layers: 2 };
        let settings = Settings { method, layering, bokeh, ..Settings::default() };
        let (_, layers) = taken_apart(subject, &scene, &settings);
        assert_eq!(layers.len(), 2, "{settings:?}");
        for (number, [layer, _]) in layers.iter().enumerate() {
            assert!(all_finite(layer), "{settings:?}");
            let sums = [0, 1].map(|plane| Grid::from_plane(&layer.colors[plane]).sum());
            let (own, other) = (sums[number], sums[1 - number]);
            // The sprite keeps its energy; what is left of a light below the threshold, 1 of 500, may leak by the other's fill.
            assert!((own / 500.0 - 1.0).abs() < 0.02, "{settings:?}: layer {number} has {own} of its light");
            assert!(other < 5.0, "{settings:?}: layer {number} has {other} of the other's light");
        }
    }
}
