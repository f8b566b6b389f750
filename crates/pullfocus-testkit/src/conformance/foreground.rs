//! Checks of a foreground that is given on its own. Each panics with what differs.

use super::RenderSubject;
use super::diffusion::EXACT_DISC;
use super::render::{all_settings, lens, run, same_bits};
use crate::grid::Grid;
use crate::scenes;
use pullfocus_core::coc::CocCurve;
use pullfocus_core::{CocSettings, Distance, Element, Picture, Scene, Settings, Size};

/// A block in the middle third with these colours, premultiplied by its coverage.
pub(super) fn foreground(size: Size, colors: &[f32], circle: f32) -> Element {
    let third = |n: usize, i: usize| (n / 3..2 * n / 3).contains(&i);
    let alpha =
        scenes::plane(size, |x, y| if third(size.width, x) && third(size.height, y) { 1.0 } else { 0.0 });
    let colors = colors.iter().map(|c| scenes::plane(size, |x, y| c * alpha.at(x, y))).collect();
    Element {
        picture: Picture { colors, alpha: Some(alpha) },
        distance: Distance::Coc(scenes::constant(size, circle)),
    }
}

/// A white foreground over black gives as much light as its alpha holds, spread softly.
pub fn foreground_light_is_kept(subject: &mut impl RenderSubject) {
    let size = Size::new(180, 120);
    let black = scenes::by_circle(vec![scenes::constant(size, 0.0)], None, scenes::constant(size, 3.0));
    for settings in all_settings(subject) {
        let mut scene = black.clone();
        scene.foreground = Some(foreground(size, &[1.0], -16.0));
        let before = scene.foreground.as_ref().map_or(0.0, |f| Grid::from_plane(&f.picture.colors[0]).sum());
        let rendered = run(subject, &scene, None, &settings);
        let after = Grid::from_plane(&rendered.colors[0]).sum();
        // Cutting a rational integrator's negative lobes adds a little.
        assert!((after / before - 1.0).abs() < 0.01, "{settings:?}: {before} became {after}");
        let edge = rendered.colors[0].at(59, 60);
        assert!((0.1..0.9).contains(&edge), "{settings:?}: the edge is hard ({edge})");
    }
}

/// The settings on top of the lens say how large circles are, never what is in front: an element is blurred by its own circles where they and
/// those behind it are the largest there may be, before focus or behind it, and where both are sharp.
pub fn the_lens_says_what_is_in_front(subject: &mut impl RenderSubject) {
    let size = Size::new(120, 80);
    let largest = CocSettings { max_px: Some(9.0), ..CocSettings::default() };
    let kept = CocSettings { protect_m: Some([2.0, 4.0]), ..CocSettings::default() };
    let front_alone = CocSettings { back: 0.0, ..CocSettings::default() };
    // The lens's focus, the element's left and right border, and what is behind it, in metres.
    let cases = [
        (largest.clone(), 0.3, [2.0, 2.0], 5.0),
        (largest, 30.0, [0.3, 0.4], 0.6),
        (kept, 10.0, [1.0, 2.4], 3.5),
        (front_alone, 1.5, [1.0, 3.0], 5.0),
    ];
    for (coc, focus_m, [left, right], behind_m) in cases {
        let camera = lens(0.1, focus_m);
        let third = size.width as f32 / 3.0;
        let part = |x: usize| ((x as f32 - third) / (third - 1.0)).clamp(0.0, 1.0);
        let depth = scenes::plane(size, |x, _| left + (right - left) * part(x));
        let even = vec![scenes::constant(size, 0.2)];
        let mut scene = scenes::by_depth(even.clone(), scenes::constant(size, behind_m));
        let curve = CocCurve::new(camera.circle_of_confusion(&scene.frame), &scene.frame, &coc);
        let curve = curve.expect("settings that can be");
        let circle = scenes::plane(size, |x, y| curve.diameter(f64::from(depth.at(x, y))));
        let element = |distance| Element { distance, ..foreground(size, &[1.0], 0.0) };
        // The same circles, before what is far behind.
        let mut given = scenes::by_circle(even, None, scenes::constant(size, 60.0));
        given.foreground = Some(element(Distance::Coc(circle)));
        scene.foreground = Some(element(scenes::by_depth(vec![], depth).base.distance));
        for settings in all_settings(subject) {
            let shaped = Settings { coc: coc.clone(), ..settings.clone() };
            let rendered = run(subject, &scene, Some(&camera), &shaped);
            let expected = run(subject, &given, None, &settings);
            let error = Grid::from_plane(&expected.colors[0]).distance_to(&rendered.colors[0]);
            // Some ten blurs of the solvers' bound, composited.
            assert!(error < 10.0 * EXACT_DISC, "{coc:?} moves an element by {error}, {settings:?}");
        }
    }
}

/// Light that covers nothing (alpha 0, as of sparks) goes through the lens by its own circles, as what covers does: it keeps its sum, is
/// soft, and is added to what is behind.
pub fn emission_is_blurred_too(subject: &mut impl RenderSubject) {
    let size = Size::new(180, 120);
    // Alpha in the first planes' group, and in another.
    for planes in [1, 5] {
        let scene = |element: f32, behind: f32| {
            let mut glow = foreground(size, &vec![0.75; planes], element);
            glow.picture.alpha = Some(scenes::constant(size, 0.0));
            let colors = vec![scenes::constant(size, 0.5); planes];
            Scene {
                foreground: Some(glow),
                ..scenes::by_circle(colors, None, scenes::constant(size, behind))
            }
        };
        let (blurred, sharp) = (scene(-16.0, 3.0), scene(0.0, 0.0));
        let glow = &foreground(size, &[0.75], 0.0).picture.colors[0];
        let sum = scenes::plane(size, |x, y| 0.5 + glow.at(x, y));
        for settings in all_settings(subject) {
            let rendered = run(subject, &blurred, None, &settings);
            for plane in &rendered.colors {
                let added = Grid::from_plane(plane).map(|v| v - 0.5).sum();
                let before = Grid::from_plane(glow).sum();
                // Cutting a rational integrator's negative lobes adds a little.
                assert!((added / before - 1.0).abs() < 0.01, "{settings:?}: {before} became {added}");
                let edge = (plane.at(59, 60) - 0.5) / 0.75;
                assert!((0.1..0.9).contains(&edge), "{settings:?}: the edge is hard ({edge})");
            }
            let rendered = run(subject, &sharp, None, &settings);
            let expected = Picture::opaque(vec![sum.clone(); planes]);
            assert!(same_bits(&rendered, &expected), "{settings:?} without blur");
        }
    }
}
