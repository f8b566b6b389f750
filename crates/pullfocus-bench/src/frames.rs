//! Frames to render on two devices: made ones, and those of a data folder.

use crate::data::{DevScene, circles, read_all};
use crate::place::workspace;
use anyhow::{Result, ensure};
use clap::Args;
use pullfocus::{Camera, Plane, Scene, Settings, Size};
use pullfocus_testkit::scenes::{TwoPlanes, fence_over_ramp};
use std::path::PathBuf;

/// Which frames.
#[derive(Args, Clone, Debug, Default)]
pub struct FrameOptions {
    /// Folder of scenes; the 480 x 270 ones that ship with the project where none is given.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Only scenes whose name contains this text.
    #[arg(long, value_name = "TEXT")]
    scenes: Option<String>,
    /// At most so many cameras; the first one of every scene before the second of any.
    #[arg(long, value_name = "N")]
    at_most: Option<usize>,
}

/// A frame.
#[derive(Debug, Clone)]
pub struct TestFrame {
    /// Scene and camera: "S1_fence/0".
    pub name: String,
    /// "RGBZ" or "foreground + behind".
    pub input: &'static str,
    /// The picture.
    pub scene: Scene,
    /// The lens; none where circles of confusion are given.
    pub camera: Option<Camera>,
    /// Signed diameters, where one layer's f64 reference can be made of them.
    pub circle: Option<Plane>,
}

const SINGLE: &str = "RGBZ";
const LAYERED: &str = "foreground + behind";

/// Every seventh pixel of every fifth row a light.
fn lit(mut scene: Scene) -> Scene {
    let colors = [90.0, 40.0, 176.0];
    for (plane, light) in scene.base.picture.colors.iter_mut().zip(colors) {
        for y in (2..plane.size().height).step_by(5) {
            plane.row_mut(y).iter_mut().skip(3 * y % 7).step_by(7).for_each(|value| *value = light);
        }
    }
    scene
}

/// A fence over a ramp, given by circles, without and with lights; two planes, given by depth.
pub fn made(size: Size) -> Result<Vec<TestFrame>> {
    let fence = fence_over_ramp(size, -0.02 * size.width as f32, 0.04 * size.width as f32);
    let planes = TwoPlanes::new(size, 2.0);
    let single = planes.single();
    let circle = circles(&single.base, &planes.camera)?;
    let frame = |name: &str, input, scene, camera, circle| TestFrame {
        name: format!("{name}, {size}"),
        input,
        scene,
        camera,
        circle,
    };
    let given = fence.base.distance.plane().clone();
    Ok(vec![
        frame("fence over a ramp", SINGLE, fence.clone(), None, Some(given.clone())),
        frame("lights in both", SINGLE, lit(fence), None, Some(given)),
        frame("two planes", SINGLE, single, Some(planes.camera), Some(circle)),
        frame("two planes", LAYERED, planes.layered(), Some(planes.camera), None),
    ])
}

impl FrameOptions {
    /// The frames of the data folder; none where the folder that ships is not there.
    pub fn read(&self, most: Option<usize>) -> Result<Vec<TestFrame>> {
        let folder = match &self.data {
            Some(folder) => folder.clone(),
            None => workspace().join("data/dev480"),
        };
        if self.data.is_none() && !folder.is_dir() {
            return Ok(vec![]);
        }
        let mut all = read_all(&folder)?;
        all.retain(|scene| self.scenes.as_ref().is_none_or(|text| scene.name.contains(text.as_str())));
        ensure!(!all.is_empty(), "no scene of {} has such a name", folder.display());
        let most = self.at_most.or(most).unwrap_or(usize::MAX);
        Ok(ordered(&all).into_iter().take(most).flat_map(|(scene, at)| frames(scene, at)).collect())
    }
}

/// Scenes and numbers of their references: all first ones, then all second ones.
fn ordered(scenes: &[DevScene]) -> Vec<(&DevScene, usize)> {
    let most = scenes.iter().map(|scene| scene.references.len()).max().unwrap_or(0);
    let of =
        |at| scenes.iter().filter(move |scene| at < scene.references.len()).map(move |scene| (scene, at));
    (0..most).flat_map(of).collect()
}

fn frames(scene: &DevScene, at: usize) -> [TestFrame; 2] {
    let reference = &scene.references[at];
    let frame = |input, made, circle| TestFrame {
        name: reference.name.clone(),
        input,
        scene: made,
        camera: Some(reference.camera),
        circle,
    };
    [frame(SINGLE, scene.single(), Some(reference.circles.clone())), frame(LAYERED, scene.layered(), None)]
}

impl TestFrame {
    /// Whether a f64 reference stands for this frame with these settings: one layer, depth as it is.
    pub fn has_reference(&self, settings: &Settings) -> bool {
        self.circle.is_some()
            && settings.layering == pullfocus::Layering::Single
            && !settings.repair_depth
            && settings.bokeh.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn made_frames_are_scenes_of_both_kinds() {
        let frames = made(Size::new(48, 27)).unwrap();
        for frame in &frames {
            frame.scene.check().unwrap();
        }
        assert!(frames.iter().any(|f| f.input == LAYERED && f.scene.foreground.is_some()));
        assert!(
            frames[0]
                .has_reference(&Settings { layering: pullfocus::Layering::Single, ..Settings::default() })
        );
        assert!(!frames[0].has_reference(&Settings::default()));
    }

    #[test]
    fn every_scene_has_its_turn() {
        let options = FrameOptions { at_most: Some(6), ..FrameOptions::default() };
        let names: Vec<String> = options.read(None).unwrap().into_iter().map(|f| f.name).collect();
        // Five scenes, then the second camera of the first; each once as RGBZ, once in two elements.
        assert_eq!(names.len(), 12);
        assert!(names[10].starts_with("S1_fence") && names[10] != names[0], "{names:?}");
        let none = FrameOptions { scenes: Some("nothing".into()), ..FrameOptions::default() };
        assert!(none.read(None).unwrap_err().to_string().contains("such a name"));
    }
}
