//! The camera: what the user gave, filled from what the file says, and which value came from where.

use crate::failure::{Failure, Result};
use crate::options::Lens as LensOptions;
use crate::values::Number;
use pullfocus_core::{Camera, Lens};
use serde::Serialize;

/// A value that a file holds, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// In the unit of the field that it stands in.
    pub value: f64,
    /// Where it comes from: "attribute focus", "assumed".
    pub from: String,
}

/// Where a value comes from that nobody gave ([`FileCamera::assumed`]).
pub const ASSUMED: &str = "assumed";

/// What a file says about its camera.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FileCamera {
    /// Metres, may be infinite.
    pub focus_distance: Option<Attribute>,
    /// f-number.
    pub f_stop: Option<Attribute>,
    /// Millimetres.
    pub focal_length: Option<Attribute>,
    /// Millimetres.
    pub sensor_width: Option<Attribute>,
    /// Degrees.
    pub fov_x: Option<Attribute>,
}

impl FileCamera {
    /// What to begin with where nobody says what the lens was: 50 mm at f/2.8 on 36 mm, focused at 3 m.
    pub fn assumed() -> Self {
        let assume = |value| Some(Attribute { value, from: ASSUMED.into() });
        Self {
            focus_distance: assume(3.0),
            f_stop: assume(2.8),
            focal_length: assume(50.0),
            sensor_width: assume(36.0),
            fov_x: None,
        }
    }

    /// Fills what is missing beside what is `given` from `other`. Beside a field of view one more length is enough, and the sensor
    /// is taken where the focal length is not known.
    pub fn fill(&mut self, other: &Self, given: &LensOptions) {
        let fill = |slot: &mut Option<Attribute>, from: &Option<Attribute>| {
            if slot.is_none() {
                slot.clone_from(from);
            }
        };
        fill(&mut self.focus_distance, &other.focus_distance);
        fill(&mut self.f_stop, &other.f_stop);
        let by_angle = (self.fov_x.is_some() || given.fov_x.is_some())
            && !(self.focal_length.is_some() && self.sensor_width.is_some());
        if by_angle {
            if self.focal_length.is_none() && given.focal_length.is_none() {
                fill(&mut self.sensor_width, &other.sensor_width);
            }
        } else {
            fill(&mut self.focal_length, &other.focal_length);
            fill(&mut self.sensor_width, &other.sensor_width);
        }
    }

    /// This camera, and what it lacks from another file's.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            focus_distance: self.focus_distance.or(other.focus_distance),
            f_stop: self.f_stop.or(other.f_stop),
            focal_length: self.focal_length.or(other.focal_length),
            sensor_width: self.sensor_width.or(other.sensor_width),
            fov_x: self.fov_x.or(other.fov_x),
        }
    }
}

/// One value of the camera, and where it came from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraValue {
    /// "focus distance", "f-stop", ...
    pub name: &'static str,
    /// The value; JSON writes infinity as null, see `text`.
    pub value: f64,
    /// "m", "mm", "degrees" or nothing.
    pub unit: &'static str,
    /// The value and its unit as text.
    pub text: String,
    /// "--focus-distance", "attribute focus", "from ...".
    pub from: String,
}

/// The whole camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved {
    /// The camera.
    pub camera: Camera,
    /// Its values and where they came from.
    pub values: Vec<CameraValue>,
}

/// A value with its text.
pub fn value(name: &'static str, value: f64, unit: &'static str, from: impl Into<String>) -> CameraValue {
    let digits = if value.is_infinite() {
        "infinity".to_owned()
    } else {
        // Six digits say all that a lens is made to.
        let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
        rounded.to_string()
    };
    let text = if unit.is_empty() { digits } else { format!("{digits} {unit}") };
    CameraValue { name, value, unit, text, from: from.into() }
}

/// A lens's quantity on the way to a camera.
struct Slot<'a> {
    flag: &'static str,
    name: &'static str,
    unit: &'static str,
    given: Option<f64>,
    found: Option<&'a Attribute>,
}

impl Slot<'_> {
    fn get(&self) -> Option<CameraValue> {
        match (self.given, self.found) {
            (Some(given), _) => Some(value(self.name, given, self.unit, self.flag)),
            (None, Some(found)) => Some(value(self.name, found.value, self.unit, found.from.clone())),
            (None, None) => None,
        }
    }
}

/// Refuses what the options alone already make impossible, before any file is opened.
///
/// # Errors
/// [`Failure::Usage`]: both forms of a lens mixed, values that no lens has.
pub fn check(options: &LensOptions) -> Result<()> {
    let LensOptions { focus_distance, f_stop, focal_length, sensor_width, fov_x, aperture_diameter } =
        options;
    if f_stop.is_some() && aperture_diameter.is_some() {
        return Err(Failure::usage(
            "--f-stop and --aperture-diameter both say how wide the aperture is; give one of them",
        ));
    }
    if fov_x.is_some() && focal_length.is_some() && sensor_width.is_some() {
        return Err(Failure::usage(
            "--fov-x, --focal-length and --sensor-width say one thing twice; give two of them at most",
        ));
    }
    let positive = |flag: &str, number: &Option<Number>, unit: &str, infinite: bool| match number {
        Some(Number(value)) if !(*value > 0.0 && (infinite || value.is_finite())) => {
            Err(Failure::usage(format!("{flag} is {value}; it must be a number of {unit} above 0")))
        }
        _ => Ok(()),
    };
    positive("--focus-distance", focus_distance, "metres (or inf)", true)?;
    positive("--f-stop", f_stop, "focal lengths to a diameter", true)?;
    positive("--focal-length", focal_length, "millimetres", false)?;
    positive("--sensor-width", sensor_width, "millimetres", false)?;
    positive("--fov-x", fov_x, "degrees", false)?;
    if fov_x.is_some_and(|fov| fov.0 >= 180.0) {
        return Err(Failure::usage("--fov-x must be below 180 degrees"));
    }
    match aperture_diameter {
        Some(Number(value)) if !(value.is_finite() && *value >= 0.0) => Err(Failure::usage(format!(
            "--aperture-diameter is {value}; it must be a number of metres, 0 (a pinhole) or above"
        ))),
        _ => Ok(()),
    }
}

/// Fills what the user did not give from the file, and makes a camera of it.
///
/// A field of view gives an ideal lens ([`Lens::Ideal`]); with an f-stop its aperture is focal length over
/// f-stop, with the focal length of that field of view. Otherwise the lens is physical.
///
/// # Errors
/// [`Failure::Usage`] with the flags that are missing, or with what the lens cannot be.
pub fn resolve(options: &LensOptions, file: &FileCamera, name: &str) -> Result<Resolved> {
    check(options)?;
    let number = |option: Option<Number>| option.map(|number| number.0);
    let (fov_given, focal_given, sensor_given) =
        (options.fov_x.is_some(), options.focal_length.is_some(), options.sensor_width.is_some());
    let slot = |flag, name, unit, given: Option<Number>, found| Slot {
        flag,
        name,
        unit,
        given: number(given),
        found,
    };
    let focus =
        slot("--focus-distance", "focus distance", "m", options.focus_distance, file.focus_distance.as_ref())
            .get();
    let f_stop = slot("--f-stop", "f-stop", "", options.f_stop, file.f_stop.as_ref()).get();
    let focal =
        slot("--focal-length", "focal length", "mm", options.focal_length, file.focal_length.as_ref()).get();
    let sensor =
        slot("--sensor-width", "sensor width", "mm", options.sensor_width, file.sensor_width.as_ref()).get();
    // A file's field of view steps back where a focal length and a sensor are known and the user gave one of them.
    let steps_back = focal.is_some() && sensor.is_some() && (focal_given || sensor_given);
    let found_fov = file.fov_x.as_ref().filter(|_| !steps_back);
    let fov = slot("--fov-x", "field of view", "degrees", options.fov_x, found_fov).get();
    let diameter = number(options.aperture_diameter)
        .map(|diameter| value("aperture diameter", diameter, "m", "--aperture-diameter"));

    let mut missing = Vec::new();
    if focus.is_none() {
        missing.push("--focus-distance M");
    }
    if diameter.is_none() && f_stop.is_none() {
        missing.push("--f-stop N (or --aperture-diameter M)");
    }
    // Which two of field of view, focal length and sensor width make the picture's angle.
    let prefer_fov = fov_given || (fov.is_some() && (focal.is_none() || sensor.is_none()));
    if diameter.is_some() {
        if fov.is_none() && (focal.is_none() || sensor.is_none()) {
            missing.push("--fov-x DEG (or --focal-length MM and --sensor-width MM)");
        }
    } else if prefer_fov {
        if sensor.is_none() && focal.is_none() {
            missing.push("--sensor-width MM (an f-stop needs a focal length, which follows from it)");
        }
    } else {
        if focal.is_none() {
            missing.push("--focal-length MM");
        }
        if sensor.is_none() {
            missing.push("--sensor-width MM");
        }
    }
    if !missing.is_empty() {
        let found: Vec<String> = [&focus, &f_stop, &focal, &sensor, &fov, &diameter]
            .into_iter()
            .flatten()
            .map(|found| format!("{} {} ({})", found.name, found.text, found.from))
            .collect();
        let known = if found.is_empty() {
            "no camera is known".to_owned()
        } else {
            format!("of the camera only {} is known", found.join(", "))
        };
        return Err(Failure::usage(format!("{name}: {known}; add {}", missing.join(" and "))));
    }
    let Some(focus) = focus else { return Err(Failure::usage("no focus distance")) };
    let mut values = vec![focus.clone()];
    let lens = match (diameter, f_stop) {
        (Some(diameter), _) => {
            let fov = match (prefer_fov || focal.is_none() || sensor.is_none(), fov, focal, sensor) {
                (true, Some(fov), _, _) => fov,
                (_, _, Some(focal), Some(sensor)) => fov_of(&focal, &sensor),
                _ => return Err(Failure::usage("no field of view")),
            };
            let lens = Lens::Ideal { fov_x_degrees: fov.value, aperture_diameter_m: diameter.value };
            values.extend([fov, diameter]);
            lens
        }
        (None, Some(f_stop)) if prefer_fov => {
            let Some(fov) = fov else { return Err(Failure::usage("no field of view")) };
            let half_tangent = (0.5 * fov.value).to_radians().tan();
            // What was given beside the field of view wins; else the sensor, which files state more reliably.
            let focal = match (focal_given, focal, sensor) {
                (true, Some(focal), _) | (_, Some(focal), None) => focal,
                (_, _, Some(sensor)) => value(
                    "focal length",
                    0.5 * sensor.value / half_tangent,
                    "mm",
                    format!("field of view and sensor width {} ({})", sensor.text, sensor.from),
                ),
                _ => return Err(Failure::usage("no focal length")),
            };
            let diameter =
                value("aperture diameter", focal.value * 1e-3 / f_stop.value, "m", "focal length / f-stop");
            let lens = Lens::Ideal { fov_x_degrees: fov.value, aperture_diameter_m: diameter.value };
            values.extend([fov, f_stop, focal, diameter]);
            lens
        }
        (None, Some(f_stop)) => {
            let (Some(focal), Some(sensor)) = (focal, sensor) else {
                return Err(Failure::usage("no focal length"));
            };
            let lens = Lens::Physical {
                focal_length_mm: focal.value,
                f_stop: f_stop.value,
                sensor_width_mm: sensor.value,
            };
            values.extend([f_stop, focal, sensor]);
            lens
        }
        (None, None) => return Err(Failure::usage("no aperture")),
    };
    let camera = Camera::new(lens, focus.value).map_err(|error| {
        let from: Vec<String> =
            values.iter().map(|value| format!("{} {} ({})", value.name, value.text, value.from)).collect();
        Failure::usage(format!("{name}: {error}; used were {}", from.join(", ")))
    })?;
    Ok(Resolved { camera, values })
}

fn fov_of(focal: &CameraValue, sensor: &CameraValue) -> CameraValue {
    let degrees = 2.0 * (0.5 * sensor.value / focal.value).atan().to_degrees();
    let from = format!(
        "focal length {} ({}) and sensor width {} ({})",
        focal.text, focal.from, sensor.text, sensor.from
    );
    value("field of view", degrees, "degrees", from)
}

/// Whether any option about the lens was given.
pub fn any_given(options: &LensOptions) -> bool {
    *options != LensOptions::default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lens(text: &str) -> LensOptions {
        crate::config::parse(text).unwrap().lens
    }

    fn attribute(value: f64, name: &str) -> Option<Attribute> {
        Some(Attribute { value, from: format!("attribute {name}") })
    }

    #[test]
    fn the_command_line_wins_and_the_file_fills() {
        let file = FileCamera {
            focus_distance: attribute(9.0, "focus"),
            f_stop: attribute(4.0, "aperture"),
            focal_length: attribute(35.0, "pinholeFocalLength"),
            sensor_width: attribute(36.0, "sensorOverallDimensions"),
            fov_x: None,
        };
        let resolved = resolve(&lens("focus-distance = 2\nf-stop = 2.8"), &file, "a.exr").unwrap();
        assert_eq!(
            resolved.camera.lens(),
            Lens::Physical { focal_length_mm: 35.0, f_stop: 2.8, sensor_width_mm: 36.0 }
        );
        assert_eq!(resolved.camera.focus_distance_m(), 2.0);
        let from: Vec<&str> = resolved.values.iter().map(|value| value.from.as_str()).collect();
        assert_eq!(
            from,
            [
                "--focus-distance",
                "--f-stop",
                "attribute pinholeFocalLength",
                "attribute sensorOverallDimensions"
            ]
        );
    }

    #[test]
    fn a_field_of_view_with_an_f_stop_is_the_renderers_lens() {
        // The shipped scene's own figures: 30 degrees, 36 mm, f/2.037 is an aperture of 32.978 mm.
        let resolved = resolve(
            &lens("focus-distance = 6\nfov-x = 30\nsensor-width = 36\nf-stop = 2.0369997"),
            &FileCamera::default(),
            "a.exr",
        )
        .unwrap();
        let Lens::Ideal { fov_x_degrees, aperture_diameter_m } = resolved.camera.lens() else {
            panic!("an ideal lens")
        };
        assert_eq!(fov_x_degrees, 30.0);
        // Seven digits of the f-stop were printed.
        assert!((aperture_diameter_m - 0.032978362).abs() < 1e-8, "{aperture_diameter_m}");
    }

    #[test]
    fn an_aperture_takes_its_angle_from_focal_length_and_sensor() {
        let resolved = resolve(
            &lens("focus-distance = 6\nfocal-length = 18\nsensor-width = 36\naperture-diameter = 0.01"),
            &FileCamera::default(),
            "a.exr",
        )
        .unwrap();
        let Lens::Ideal { fov_x_degrees, .. } = resolved.camera.lens() else { panic!("an ideal lens") };
        // atan(1) doubled; two roundings.
        assert!((fov_x_degrees - 90.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_missing_is_named_once_with_its_flag() {
        let error = |text: &str, file: &FileCamera| resolve(&lens(text), file, "a.exr").unwrap_err();
        let nothing = error("", &FileCamera::default());
        assert_eq!(nothing.exit_code(), 2);
        assert_eq!(
            nothing.to_string(),
            "a.exr: no camera is known; add --focus-distance M and --f-stop N (or --aperture-diameter M) \
             and --focal-length MM and --sensor-width MM"
        );
        let file =
            FileCamera { focal_length: attribute(35.0, "pinholeFocalLength"), ..FileCamera::default() };
        assert_eq!(
            error("focus-distance = 2\nf-stop = 4", &file).to_string(),
            "a.exr: of the camera only focus distance 2 m (--focus-distance), f-stop 4 (--f-stop), \
             focal length 35 mm (attribute pinholeFocalLength) is known; add --sensor-width MM"
        );
        assert!(
            error("focus-distance = 2\naperture-diameter = 0.01", &FileCamera::default())
                .to_string()
                .contains("--fov-x")
        );
        assert!(
            error("focus-distance = 2\nfov-x = 30\nf-stop = 2", &FileCamera::default())
                .to_string()
                .contains("--sensor-width")
        );
    }

    #[test]
    fn what_nobody_says_can_be_assumed() {
        let resolved = |mut file: FileCamera, text: &str| {
            file.fill(&FileCamera::assumed(), &lens(text));
            resolve(&lens(text), &file, "a.exr").unwrap()
        };
        let nothing = resolved(FileCamera::default(), "focus-distance = 2").camera;
        assert_eq!(
            nothing.lens(),
            Lens::Physical { focal_length_mm: 50.0, f_stop: 2.8, sensor_width_mm: 36.0 }
        );
        assert_eq!(nothing.focus_distance_m(), 2.0);
        // A field of view that is known stays: the sensor alone is assumed beside it.
        let fov = FileCamera { fov_x: attribute(30.0, "fov"), ..FileCamera::default() };
        for camera in [resolved(fov.clone(), ""), resolved(FileCamera::default(), "fov-x = 30")] {
            let Lens::Ideal { fov_x_degrees, .. } = camera.camera.lens() else { panic!("an ideal lens") };
            assert_eq!(fov_x_degrees, 30.0);
        }
        // Beside a focal length too: then nothing is assumed of the sensor.
        for camera in [
            resolved(fov, "focal-length = 50\nf-stop = 2"),
            resolved(FileCamera::default(), "fov-x = 30\nfocal-length = 50\nf-stop = 2"),
        ] {
            let expected = Lens::Ideal { fov_x_degrees: 30.0, aperture_diameter_m: 0.025 };
            assert_eq!(camera.camera.lens(), expected);
        }
    }

    #[test]
    fn a_files_field_of_view_steps_back_behind_a_whole_lens_only() {
        let fov = FileCamera { fov_x: attribute(30.0, "fov"), ..FileCamera::default() };
        let of = |text: &str, file: &FileCamera| {
            let text = format!("focus-distance = 3\n{text}");
            resolve(&lens(&text), file, "a.exr").unwrap().camera.lens()
        };
        let half_tangent = 15f64.to_radians().tan();
        for (text, focal) in [("sensor-width = 36", 18.0 / half_tangent), ("focal-length = 50", 50.0)] {
            let expected = Lens::Ideal { fov_x_degrees: 30.0, aperture_diameter_m: focal * 1e-3 / 2.0 };
            assert_eq!(of(&format!("{text}\nf-stop = 2"), &fov), expected, "{text}");
            let expected = Lens::Ideal { fov_x_degrees: 30.0, aperture_diameter_m: 0.01 };
            assert_eq!(of(&format!("{text}\naperture-diameter = 0.01"), &fov), expected, "{text}");
        }
        let physical = Lens::Physical { focal_length_mm: 50.0, f_stop: 2.0, sensor_width_mm: 36.0 };
        assert_eq!(of("focal-length = 50\nsensor-width = 36\nf-stop = 2", &fov), physical);
        // What the file says beside its angle makes a lens whole too.
        let focal = FileCamera { focal_length: attribute(50.0, "focalLength"), ..fov.clone() };
        assert_eq!(of("sensor-width = 36\nf-stop = 2", &focal), physical);
        let sensor = FileCamera { sensor_width: attribute(36.0, "sensorWidth"), ..fov.clone() };
        assert_eq!(of("focal-length = 50\nf-stop = 2", &sensor), physical);
        // A sensor that was assumed beside the angle, and is then taken as given, changes nothing.
        let mut assumed = fov;
        assumed.fill(&FileCamera::assumed(), &LensOptions::default());
        assert_eq!(of("f-stop = 2", &assumed), of("f-stop = 2\nsensor-width = 36", &assumed));
    }

    #[test]
    fn contradictions_and_impossible_lenses_are_usage_errors() {
        for (text, word) in [
            ("f-stop = 2\naperture-diameter = 0.01", "--aperture-diameter"),
            ("fov-x = 30\nfocal-length = 50\nsensor-width = 36", "two of them"),
            ("focus-distance = 0", "--focus-distance is 0"),
            ("focal-length = inf", "--focal-length is inf"),
            ("fov-x = 180", "180"),
            ("aperture-diameter = -1", "pinhole"),
        ] {
            let error = check(&lens(text)).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(word), "{text}: {error}");
        }
        let within = lens("focus-distance = 0.04\nf-stop = 2\nfocal-length = 50\nsensor-width = 36");
        let error = resolve(&within, &FileCamera::default(), "a.exr").unwrap_err();
        assert!(error.to_string().contains("within the focal length"), "{error}");
    }
}
