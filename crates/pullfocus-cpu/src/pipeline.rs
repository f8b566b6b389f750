//! The sentence, in code: image + depth + camera → circle of confusion → layers → method → composite.

use crate::bokeh::Shown;
use crate::layers;
use crate::rows::{fold_rows, for_each_row};
use crate::work::{Memory, Work};
use crate::{coc, depth_repair};
use pullfocus_core::coc::CocCurve;
use pullfocus_core::depth::HALF_MAX;
use pullfocus_core::picture::LARGEST;
use pullfocus_core::{
    Camera, Cancel, Distance, Element, Error, Frame, Layering, Picture, Plane, Report, Result, Scene,
    Settings, Show,
};

/// Renders frames, one after the other; its buffers stay from frame to frame.
///
/// Work runs on the rayon pool of the calling thread; use `ThreadPool::install` to bring one's own. The
/// result is the same, byte for byte, for any number of threads. Beside the scene itself, `preview` needs
/// two planes for each circle of confusion and up to four more (one for pictures of more than 64
/// million pixels); `final` needs its layers, some 10 planes each. A foreground needs one more plane.
#[derive(Debug, Default)]
pub struct Renderer {
    memory: Memory,
    coc: Plane,
    /// As the lens alone makes them, where there is a foreground: the picture's and the foreground's.
    behind: Plane,
    foreground_coc: Plane,
}

impl Renderer {
    /// A renderer without buffers; the first frame makes them.
    pub fn new() -> Self {
        Self::default()
    }

    /// Replaces `scene.base.picture` by the picture through the lens. Alpha and further planes go through
    /// the same lens; depth stays as it was. The camera may be left out where circles of confusion are given.
    ///
    /// Colours that are no numbers have a stated rule: NaN becomes 0, infinity the largest half, 65504.
    ///
    /// # Errors
    /// Any [`Error`]; the picture is then unspecified, but whole. [`Error::Cancelled`] comes within 50 ms of the
    /// flag.
    pub fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        settings.check()?;
        scene.check()?;
        cancel.check()?;
        let mut report = Report::default();
        let Scene { frame, base, foreground } = scene;
        let mut work = Work::new(frame, settings, cancel, &mut self.memory, &mut report);

        let near_curve = work.stage("circle of confusion", |work| {
            make_numbers(&mut base.picture, cancel)?;
            let curve = coc::curve(frame, &base.distance, camera, &settings.coc)?;
            let planes = &mut [(curve, &mut self.coc), (curve.lens_alone(), &mut self.behind)];
            let planes = &mut planes[..1 + usize::from(foreground.is_some())];
            circles(work, frame, &base.distance, camera, settings, planes)?;
            let Some(Element { picture, distance }) = foreground else { return Ok(curve) };
            make_numbers(picture, cancel)?;
            let curve = coc::curve(frame, distance, camera, &settings.coc)?;
            let planes = &mut [(curve.lens_alone(), &mut self.foreground_coc)];
            circles(work, frame, distance, camera, settings, planes)?;
            Ok(curve)
        })?;
        let mut coc_range = range(&self.coc, cancel)?;
        let in_focus = coc_range == [0.0, 0.0];
        if foreground.is_some() {
            let [low, high] = range(&self.foreground_coc, cancel)?.map(|c| near_curve.shape(f64::from(c)));
            coc_range = [coc_range[0].min(low), coc_range[1].max(high)];
        }
        work.report.coc_range = coc_range;
        work.report.highlights = settings.bokeh.map(|_| 0);

        let layers = match settings.layering {
            Layering::Single => {
                blur_picture(&mut work, &mut base.picture, &self.coc)?;
                1
            }
            Layering::Background { layers, threshold } => {
                let threshold = threshold as f32 * work.display_width;
                blur_with_background(&mut work, &mut base.picture, &self.coc, layers, threshold)?;
                1 + layers as usize
            }
            // All in focus: the picture itself, to the last bit.
            Layering::General { .. } if in_focus => {
                only_layer(&mut work, &mut base.picture, |_, _| Ok(()))?;
                1
            }
            Layering::General { layers } => {
                layers::blur_layers(&mut work, &mut base.picture, &self.coc, layers)?
            }
        };
        work.report.layers = layers;

        if let Some(element) = foreground {
            let alpha = element.picture.alpha.as_ref().ok_or(Error::Setting {
                name: "foreground's alpha",
                value: 0.0,
                reason: "must be there: alpha says where the foreground covers the picture",
            })?;
            work.report.layers += 1;
            if work.show.alone().is_none_or(|number| number as usize == layers) {
                let near = layers::Near {
                    picture: &element.picture,
                    alpha,
                    coc: &self.foreground_coc,
                    behind: &self.behind,
                    curve: near_curve,
                };
                layers::blur_element_over(&mut work, &near, &mut base.picture)?;
            }
        }
        Ok(report)
    }

    /// Writes the signed circle of confusion of `distance` (diameter in pixels, positive behind focus) into `coc`.
    ///
    /// # Errors
    /// Any [`Error`].
    pub fn circle_of_confusion(
        &mut self,
        frame: &Frame,
        distance: &Distance,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
        coc: &mut Plane,
    ) -> Result<Report> {
        settings.check()?;
        let mut report = Report::default();
        let mut work = Work::new(frame, settings, cancel, &mut self.memory, &mut report);
        work.stage("circle of confusion", |work| {
            let curve = coc::curve(frame, distance, camera, &settings.coc)?;
            circles(work, frame, distance, camera, settings, &mut [(curve, &mut *coc)])
        })?;
        report.coc_range = range(coc, cancel)?;
        Ok(report)
    }
}

/// The planes that are light: alpha is none.
fn colors(picture: &mut Picture) -> Vec<&mut Plane> {
    picture.colors.iter_mut().collect()
}

/// Shows a picture that is one layer, number 0, and that `blur` makes.
fn only_layer(
    work: &mut Work<'_>,
    picture: &mut Picture,
    blur: impl FnOnce(&mut Work<'_>, &mut Picture) -> Result<()>,
) -> Result<()> {
    match work.show {
        Show::Result | Show::Layer(0) => blur(work, picture),
        Show::Matte(0) => layers::even(picture.planes_mut(), 1.0, work.cancel),
        Show::Layer(_) | Show::Matte(_) => layers::even(picture.planes_mut(), 0.0, work.cancel),
    }
}

/// One layer, and nothing else.
fn blur_picture(work: &mut Work<'_>, picture: &mut Picture, coc: &Plane) -> Result<()> {
    only_layer(work, picture, |work, picture| {
        let mut lights = work.take_lights(&mut colors(picture), coc)?;
        let mut planes: Vec<&mut Plane> = picture.planes_mut().collect();
        work.stage("blur", |work| work.blur(&mut planes, coc, None))?;
        work.add_lights(&mut lights, &mut colors(picture), Shown::ByCircle(coc))?;
        work.give_lights(lights);
        Ok(())
    })
}

/// The midground over background layers; `threshold` is in pixels.
fn blur_with_background(
    work: &mut Work<'_>,
    picture: &mut Picture,
    coc: &Plane,
    layers: u32,
    threshold: f32,
) -> Result<()> {
    let mut lights = work.take_lights(&mut colors(picture), coc)?;
    match work.show.alone() {
        None => layers::blur_over_background(work, picture, coc, layers, threshold)?,
        Some(number) => layers::one_over_background(work, picture, coc, [layers, number], threshold)?,
    }
    // They are laid down after the last of these layers, the midground.
    if matches!(work.show, Show::Result) || work.show == Show::Layer(layers) {
        work.add_lights(&mut lights, &mut colors(picture), Shown::ByCircle(coc))?;
    }
    work.give_lights(lights);
    Ok(())
}

/// The circles of confusion of one element, by each of these curves, from its depth as it is or mended.
fn circles(
    work: &mut Work<'_>,
    frame: &Frame,
    distance: &Distance,
    camera: Option<&Camera>,
    settings: &Settings,
    planes: &mut [(CocCurve, &mut Plane)],
) -> Result<()> {
    let cancel = work.cancel;
    let mut write = |distance: &Distance| {
        planes.iter_mut().try_for_each(|(curve, plane)| {
            coc::circle_of_confusion(frame, distance, camera, curve, cancel, plane)
        })
    };
    let Distance::Depth { plane, decoding } = distance else { return write(distance) };
    let blended = depth_repair::blended_edges(plane, decoding, work.cancel)?;
    if work.report.blended_depth_edges.is_none() {
        work.report.blended_depth_edges = blended;
    }
    if !settings.repair_depth {
        return write(distance);
    }
    let mut mended = work.memory.planes.take(plane.size())?;
    depth_repair::repair(plane, decoding, work.cancel, &mut mended)?;
    let distance = Distance::Depth { plane: mended, decoding: *decoding };
    write(&distance)?;
    if let Distance::Depth { plane, .. } = distance {
        work.memory.planes.give([plane]);
    }
    Ok(())
}

/// Values that every solver can carry: NaN becomes 0, infinities and what is too large for a sum in f32 the
/// largest that is not.
fn make_numbers(picture: &mut Picture, cancel: &Cancel) -> Result<()> {
    for plane in picture.planes_mut() {
        for_each_row(plane, cancel, |_, row| {
            // A first look that vectorises; most rows need nothing more.
            if row.iter().fold(true, |fine, value| fine & (value.abs() <= LARGEST)) {
                return;
            }
            for value in row {
                *value = match *value {
                    v if v.is_nan() => 0.0,
                    v if v.is_infinite() => HALF_MAX.copysign(v),
                    v => v.clamp(-LARGEST, LARGEST),
                };
            }
        })?;
    }
    Ok(())
}

/// Smallest and largest diameter.
fn range(coc: &Plane, cancel: &Cancel) -> Result<[f32; 2]> {
    /// Side by side, so that a row does not wait for one comparison after the other.
    const LANES: usize = 32;
    let row = |y| {
        let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        let mut look = |values: &[f32]| {
            for ((low, high), &c) in low.iter_mut().zip(&mut high).zip(values) {
                *low = if c < *low { c } else { *low };
                *high = if c > *high { c } else { *high };
            }
        };
        let mut chunks = coc.row(y).chunks_exact(LANES);
        chunks.by_ref().for_each(&mut look);
        look(chunks.remainder());
        [low.into_iter().fold(f32::INFINITY, f32::min), high.into_iter().fold(f32::NEG_INFINITY, f32::max)]
    };
    let join = |[a, b]: [f32; 2], [c, d]: [f32; 2]| [a.min(c), b.max(d)];
    let range = fold_rows(coc.size().height, cancel, row, join)?;
    Ok(range.filter(|[low, high]| low <= high).unwrap_or_default())
}
