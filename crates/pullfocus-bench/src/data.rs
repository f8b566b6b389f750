//! Scenes with path-traced references.

use anyhow::{Context, Result, bail, ensure};
use pullfocus::{Camera, DepthDecoding, Distance, Element, Frame, Lens, Picture, Plane, Scene, Size};
use pullfocus_io::{Document, Limits, Selection};
use serde::Deserialize;
use std::path::Path;

/// One scene of a data folder.
#[derive(Debug, Clone)]
pub struct DevScene {
    /// The folder's name.
    pub name: String,
    /// Width and height.
    pub size: Size,
    /// The pinhole picture with its depth.
    pub input: Element,
    /// Near objects alone.
    pub foreground: Element,
    /// All the rest.
    pub behind: Element,
    /// Pictures through a true lens.
    pub references: Vec<Reference>,
}

/// A picture through a true lens.
#[derive(Debug, Clone)]
pub struct Reference {
    /// Scene and number: "S1_fence/0".
    pub name: String,
    /// The lens.
    pub camera: Camera,
    /// What it saw: the truth up to its noise.
    pub picture: Picture,
    /// PSNR of its noise in dB, and the width of picture at which that was measured.
    pub noise_db: Option<(f64, usize)>,
    /// Largest circle of confusion in the picture, in pixels.
    pub largest_circle: f64,
    /// Signed diameters of the input.
    pub circles: Plane,
}

#[derive(Deserialize)]
struct CameraFile {
    width: usize,
    fov_x_deg: f64,
    settings: Vec<Setting>,
}

#[derive(Deserialize)]
struct Setting {
    name: String,
    focus_distance_m: f64,
    aperture_diameter_m: f64,
    available: bool,
    noise_psnr_db: Option<f64>,
    noise_psnr_db_at_960x540: Option<f64>,
}

impl DevScene {
    /// The pinhole picture alone.
    pub fn single(&self) -> Scene {
        Scene::new(Frame::full(self.size), self.input.clone())
    }

    /// Foreground and behind.
    pub fn layered(&self) -> Scene {
        Scene {
            foreground: Some(self.foreground.clone()),
            ..Scene::new(Frame::full(self.size), self.behind.clone())
        }
    }

    /// Reads a scene's folder.
    pub fn read(folder: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(folder.join("camera.json"))
            .with_context(|| format!("cannot read {}", folder.join("camera.json").display()))?;
        let file: CameraFile =
            serde_json::from_str(&text).with_context(|| format!("{}/camera.json", folder.display()))?;
        let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let input = element(&folder.join("input.exr"))?;
        let size = input.picture.size();
        ensure!(size.width == file.width, "{name}: camera.json says {} pixels of width", file.width);
        let mut references = vec![];
        for setting in file.settings.iter().filter(|s| s.available) {
            let path = folder.join(format!("{}.exr", setting.name));
            if !path.is_file() {
                eprintln!("{name} has no {}.exr; the others are taken", setting.name);
                continue;
            }
            let lens = Lens::Ideal {
                fov_x_degrees: file.fov_x_deg,
                aperture_diameter_m: setting.aperture_diameter_m,
            };
            let camera = Camera::new(lens, setting.focus_distance_m)?;
            let (picture, _) = picture(&path, true)?;
            ensure!(picture.size() == size, "{} is not {size}", path.display());
            let circles = circles(&input, &camera)?;
            let noise = setting.noise_psnr_db.map(|db| (db, size.width));
            references.push(Reference {
                name: format!("{name}/{}", setting.name.trim_start_matches("reference_")),
                camera,
                picture,
                noise_db: noise.or(setting.noise_psnr_db_at_960x540.map(|db| (db, 960))),
                largest_circle: circles.data().iter().fold(0.0, |most, c| f64::max(most, c.abs().into())),
                circles,
            });
        }
        Ok(Self {
            size,
            input,
            foreground: element(&folder.join("foreground.exr"))?,
            behind: element(&folder.join("behind.exr"))?,
            references,
            name,
        })
    }
}

/// Reads every scene of a data folder, in the order of their names.
pub fn read_all(folder: &Path) -> Result<Vec<DevScene>> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let mut folders = vec![];
    for entry in entries {
        let path = entry?.path();
        if path.join("camera.json").is_file() {
            folders.push(path);
        }
    }
    folders.sort();
    if folders.is_empty() {
        bail!("{} holds no scene: no folder in it has a camera.json", folder.display());
    }
    folders.iter().map(|folder| DevScene::read(folder)).collect()
}

fn picture(path: &Path, without_depth: bool) -> Result<(Picture, Option<Plane>)> {
    let document = Document::open(path, &Limits::default())?;
    let selected = document.select(&Selection { without_depth, ..Selection::default() })?;
    ensure!(selected.picture.colors.len() == 3, "{} has no R, G, B", path.display());
    Ok((selected.picture, selected.depth.map(|depth| depth.plane)))
}

fn element(path: &Path) -> Result<Element> {
    let (picture, depth) = picture(path, false)?;
    let plane = depth.with_context(|| format!("{} has no depth", path.display()))?;
    Ok(Element { picture, distance: Distance::Depth { plane, decoding: DepthDecoding::default() } })
}

/// Signed diameters of an element, by the core's formula.
pub fn circles(element: &Element, camera: &Camera) -> Result<Plane> {
    let Distance::Depth { plane, decoding } = &element.distance else {
        bail!("the data's distances are depths")
    };
    let frame = Frame::full(plane.size());
    let formula = camera.circle_of_confusion(&frame);
    let half = camera.half_width_tangent();
    Ok(Plane::from_fn(plane.size(), |x, y| {
        formula.diameter(decoding.metres_at(&frame, half, plane.at(x, y), x, y)) as f32
    })?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::workspace;

    #[test]
    fn the_shipped_scenes_read_and_agree_with_their_camera_files() {
        let scenes = read_all(&workspace().join("data/dev480")).unwrap();
        assert_eq!(scenes.iter().map(|s| s.references.len()).sum::<usize>(), 14);
        let fence = &scenes[0];
        assert_eq!(fence.size, Size::new(480, 270));
        // camera.json: coc_px.at_z_near of the first reference. Z is stored with 13 bits.
        assert!((fence.references[0].largest_circle - 34.6257).abs() < 0.01);
        fence.single().check().unwrap();
        fence.layered().check().unwrap();
    }

    #[test]
    fn a_folder_without_scenes_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let said = read_all(folder.path()).unwrap_err().to_string();
        assert!(said.contains("no scene"), "{said}");
    }
}
