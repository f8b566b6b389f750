//! Camera attributes of OpenEXR and of the common renderers.
//!
//! Names and units: the OpenEXR project's list of standard attributes; what V-Ray, Arnold and Gaffer, Unreal's
//! Movie Render Queue and Redshift are known to write. A distance in units of the scene is not taken for
//! metres: it becomes a note.

use crate::exr::container::{Part, RawAttribute};
use crate::exr::text::latin1;
use pullfocus_core::depth::NOTHING_FROM;
use serde::Serialize;

/// A number, and the attribute that it was found in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The number, in the unit that the field states.
    pub value: f64,
    /// The attribute's name.
    pub attribute: String,
}

/// What a file says about its camera.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FoundCamera {
    /// Focal length in millimetres.
    pub focal_length_mm: Option<Found>,
    /// f-stop.
    pub f_stop: Option<Found>,
    /// Focus distance in metres; may be infinite.
    pub focus_distance_m: Option<Found>,
    /// Width of the sensor (film back) in millimetres.
    pub sensor_width_mm: Option<Found>,
    /// Horizontal field of view in degrees.
    pub fov_x_degrees: Option<Found>,
    /// Far clip **in the depth channel's own unit**, which renderers write where nothing was hit.
    pub far_clip: Option<Found>,
    /// Metres in one unit of the depth channel, where the program that wrote the file fixes it.
    pub depth_unit_m: Option<Found>,
    /// What was found and cannot be used without knowing more, in words.
    pub notes: Vec<String>,
}

#[derive(Clone, Copy)]
enum Field {
    FocalLength,
    FStop,
    FocusDistance,
    SensorWidth,
    Fov,
    FarClip,
}

/// Attribute, field, factor to the field's unit. The first that is there wins.
const KNOWN: &[(&str, Field, f64)] = &[
    // OpenEXR standard attributes: mm, f-number, m.
    ("pinholeFocalLength", Field::FocalLength, 1.0),
    ("nominalFocalLength", Field::FocalLength, 1.0),
    ("effectiveFocalLength", Field::FocalLength, 1.0),
    ("aperture", Field::FStop, 1.0),
    ("focus", Field::FocusDistance, 1.0),
    ("sensorOverallDimensions", Field::SensorWidth, 1.0),
    ("fieldOfViewHorizontal", Field::Fov, 1.0),
    // V-Ray: film back and focal length in mm, field of view in degrees, clips in units of the scene.
    ("cameraFocalLength", Field::FocalLength, 1.0),
    ("cameraFNumber", Field::FStop, 1.0),
    ("cameraAperture", Field::SensorWidth, 1.0),
    ("cameraFov", Field::Fov, 1.0),
    ("cameraFarClip", Field::FarClip, 1.0),
    // Arnold and Gaffer: mm.
    ("CameraFocalLength", Field::FocalLength, 1.0),
    ("CameraFilmApertureHorizontal", Field::SensorWidth, 1.0),
    ("arnold/camera/far_clip", Field::FarClip, 1.0),
    // Unreal, all as text: mm, f-number, cm, degrees.
    ("unreal/camera/FinalImage/focalLength", Field::FocalLength, 1.0),
    ("unreal/camera/FinalImage/fstop", Field::FStop, 1.0),
    ("unreal/camera/FinalImage/focalDistance", Field::FocusDistance, 0.01),
    ("unreal/camera/FinalImage/sensorWidth", Field::SensorWidth, 1.0),
    ("unreal/camera/FinalImage/fov", Field::Fov, 1.0),
    // Redshift: degrees. Its aperture comes in inches or as a factor, depending on the host.
    ("rs/camera/FStop", Field::FStop, 1.0),
    ("rs/camera/fov", Field::Fov, 1.0),
    ("rs/camera/farPlane", Field::FarClip, 1.0),
];

/// Attributes in units of the scene or of the host program.
const NOTED: &[(&str, &str)] = &[
    (
        "cameraTargetDistance",
        "the distance to the camera's target in units of the scene, not always in focus",
    ),
    ("rs/camera/DOFFocusDistance", "the focus distance in units of the scene"),
    ("rs/camera/aperture", "the film back in a unit that depends on the host program (inches in Maya)"),
];

impl FoundCamera {
    /// Reads a part's attributes.
    pub(crate) fn of(part: &Part) -> Self {
        let mut camera = Self::default();
        for &(name, field, factor) in KNOWN {
            if let Some(value) = part.attribute(name).and_then(number) {
                camera.offer(field, value * factor, name);
            }
        }
        // Unreal names the render pass; another pass's values serve where the final image has none.
        for attribute in &part.attributes {
            let Some(path) = attribute.name.strip_prefix("unreal/camera/") else { continue };
            let field = match path.split_once('/').map(|(_, last)| last) {
                Some("focalLength") => (Field::FocalLength, 1.0),
                Some("fstop") => (Field::FStop, 1.0),
                Some("focalDistance") => (Field::FocusDistance, 0.01),
                Some("sensorWidth") => (Field::SensorWidth, 1.0),
                Some("fov") => (Field::Fov, 1.0),
                _ => continue,
            };
            if let Some(value) = number(attribute) {
                camera.offer(field.0, value * field.1, &attribute.name);
            }
            camera.depth_unit_m = Some(Found { value: 0.01, attribute: attribute.name.clone() });
        }
        for &(name, meaning) in NOTED {
            if let Some(value) = part.attribute(name).and_then(number) {
                camera.notes.push(format!("{name} = {value} is {meaning}; it was not used"));
            }
        }
        camera
    }

    /// Takes a value unless an earlier attribute gave one, or none is like it.
    fn offer(&mut self, field: Field, value: f64, name: &str) {
        let (slot, fits) = match field {
            Field::FocalLength => (&mut self.focal_length_mm, value.is_finite()),
            Field::FStop => (&mut self.f_stop, value.is_finite()),
            Field::FocusDistance => (&mut self.focus_distance_m, true),
            Field::SensorWidth => (&mut self.sensor_width_mm, value.is_finite()),
            Field::Fov => (&mut self.fov_x_degrees, value < 180.0),
            // V-Ray writes 1e30 for none.
            Field::FarClip => (&mut self.far_clip, value < f64::from(NOTHING_FROM)),
        };
        if slot.is_none() && fits && value > 0.0 {
            *slot = Some(Found { value, attribute: name.to_owned() });
        }
    }

    /// Fills what is missing from another part of the same file.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            focal_length_mm: self.focal_length_mm.or(other.focal_length_mm),
            f_stop: self.f_stop.or(other.f_stop),
            focus_distance_m: self.focus_distance_m.or(other.focus_distance_m),
            sensor_width_mm: self.sensor_width_mm.or(other.sensor_width_mm),
            fov_x_degrees: self.fov_x_degrees.or(other.fov_x_degrees),
            far_clip: self.far_clip.or(other.far_clip),
            depth_unit_m: self.depth_unit_m.or(other.depth_unit_m),
            notes: if self.notes.is_empty() { other.notes } else { self.notes },
        }
    }
}

/// The number in an attribute: numbers of any type, the first of a vector, or a number written as text.
pub(crate) fn number(attribute: &RawAttribute) -> Option<f64> {
    let b = &attribute.bytes;
    let four = || b.get(..4).and_then(|b| <[u8; 4]>::try_from(b).ok());
    match attribute.kind.as_str() {
        "float" | "v2f" | "v3f" => four().map(|b| f64::from(f32::from_le_bytes(b))),
        "int" | "v2i" | "v3i" => four().map(|b| f64::from(i32::from_le_bytes(b))),
        "double" | "v2d" | "v3d" => {
            b.get(..8).and_then(|b| <[u8; 8]>::try_from(b).ok()).map(f64::from_le_bytes)
        }
        "string" => latin1(b).trim().parse().ok(),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_from_every_type_that_renderers_use() {
        let read = |kind: &str, bytes: Vec<u8>| number(&RawAttribute::new("x", kind, bytes));
        assert_eq!(read("float", 2.5f32.to_le_bytes().to_vec()), Some(2.5));
        assert_eq!(read("double", 2.5f64.to_le_bytes().to_vec()), Some(2.5));
        assert_eq!(read("int", 3i32.to_le_bytes().to_vec()), Some(3.0));
        assert_eq!(read("string", b" 35.0 ".to_vec()), Some(35.0));
        assert_eq!(read("v2f", [24f32.to_le_bytes(), 18f32.to_le_bytes()].concat()), Some(24.0));
        assert_eq!(read("string", b"far".to_vec()), None);
        assert_eq!(read("float", vec![0; 3]), None);
    }
}
