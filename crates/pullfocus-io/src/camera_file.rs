//! The lens of a shot, frame by frame, for other programs: a table (CSV) or a USD layer with one camera (text, `.usda`).

use pullfocus_core::{Camera, Lens};
use std::io::{self, Write};

/// A lens at one frame. What is missing is not known and does not follow from the rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraSample {
    /// The frame's number; parts of frames are allowed.
    pub frame: f64,
    /// Distance from the lens to what is in focus, in metres; may be infinite.
    pub focus_distance_m: f64,
    /// f-number; infinite for a pinhole.
    pub f_stop: Option<f64>,
    /// Focal length in millimetres.
    pub focal_length_mm: Option<f64>,
    /// Width of the sensor (horizontal aperture) in millimetres.
    pub sensor_width_mm: Option<f64>,
    /// Horizontal field of view of the display window in degrees.
    pub fov_x_degrees: Option<f64>,
    /// Diameter of the aperture in metres.
    pub aperture_diameter_m: Option<f64>,
    /// Nearest distance that is sharp, in metres from the lens ([`pullfocus_core::focus::limits`]).
    pub near_m: f64,
    /// Farthest distance that is sharp, in metres from the lens; may be infinite.
    pub far_m: f64,
}

impl CameraSample {
    /// What a camera says of itself; `sharp` are the nearest and the farthest sharp distance in metres.
    pub fn new(frame: f64, camera: &Camera, sharp: [f64; 2]) -> Self {
        let fov = (2.0 * camera.half_width_tangent().atan()).to_degrees();
        let of = |f_stop, focal_length_mm, sensor_width_mm, fov_x_degrees, aperture_diameter_m| Self {
            frame,
            focus_distance_m: camera.focus_distance_m(),
            f_stop,
            focal_length_mm,
            sensor_width_mm,
            fov_x_degrees: Some(fov_x_degrees),
            aperture_diameter_m: Some(aperture_diameter_m),
            near_m: sharp[0],
            far_m: sharp[1],
        };
        match camera.lens() {
            Lens::Physical { focal_length_mm: focal, f_stop, sensor_width_mm } => {
                of(Some(f_stop), Some(focal), Some(sensor_width_mm), fov, 1e-3 * focal / f_stop)
            }
            Lens::Ideal { fov_x_degrees, aperture_diameter_m } => {
                of(None, None, None, fov_x_degrees, aperture_diameter_m)
            }
        }
    }
}

/// Writes a table: one line a frame, the fields of [`CameraSample`] as columns under their names, nothing for what is
/// missing, `inf` for infinity.
///
/// # Errors
/// Those of `out`.
pub fn write_csv(samples: &[CameraSample], mut out: impl Write) -> io::Result<()> {
    writeln!(
        out,
        "frame,focus_distance_m,f_stop,focal_length_mm,sensor_width_mm,fov_x_degrees,aperture_diameter_m,near_m,far_m"
    )?;
    for sample in samples {
        let fields = [
            Some(sample.frame),
            Some(sample.focus_distance_m),
            sample.f_stop,
            sample.focal_length_mm,
            sample.sensor_width_mm,
            sample.fov_x_degrees,
            sample.aperture_diameter_m,
            Some(sample.near_m),
            Some(sample.far_m),
        ];
        let fields = fields.map(|field| field.map_or_else(String::new, |value| value.to_string()));
        writeln!(out, "{}", fields.join(","))?;
    }
    Ok(())
}

/// Width in millimetres of the sensor that [`write_usda`] gives to a camera of which only the field of view is known.
/// Any would show the same picture; this is full frame.
pub const SENSOR_IF_UNKNOWN_MM: f64 = 36.0;

/// What USD has in place of an infinite focus distance, in scene units of a centimetre: programs that read it calculate in 32
/// bits, and few of them expect infinity.
const INFINITELY_FAR_CM: f64 = 1e9;

/// A lens as USD has it: focal length and horizontal aperture in millimetres, f-stop.
struct UsdLens {
    focal: f64,
    width: f64,
    f_stop: Option<f64>,
}

impl UsdLens {
    fn of(sample: &CameraSample) -> Option<Self> {
        let tangent = sample.fov_x_degrees.map(|degrees| (0.5 * degrees).to_radians().tan());
        let width = match (sample.sensor_width_mm, sample.focal_length_mm, tangent) {
            (Some(width), ..) => width,
            (None, Some(focal), Some(tangent)) => 2.0 * focal * tangent,
            (None, None, Some(_)) => SENSOR_IF_UNKNOWN_MM,
            (None, _, None) => return None,
        };
        let focal = sample.focal_length_mm.or_else(|| Some(0.5 * width / tangent?))?;
        let f_stop = sample.f_stop.or_else(|| Some(1e-3 * focal / sample.aperture_diameter_m?));
        Some(Self { focal, width, f_stop })
    }
}

/// Writes a USD layer as text, with one `Camera` prim named `Camera`, its values at the samples' frames: `focusDistance` in
/// scene units, which are centimetres here; `focalLength`, `horizontalAperture` and `verticalAperture` in
/// tenths of a scene unit (as the schema UsdGeomCamera has it), which are then millimetres; `fStop`, 0 for a
/// pinhole. What stays the same at all frames is written once. The camera stands at the origin: its place is the
/// scene's.
///
/// `sensor_height_mm` is the height of the picture on a sensor of the first sample's width ([`SENSOR_IF_UNKNOWN_MM`] where that is
/// unknown).
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] for no samples and for `frames_per_second` that is no number above 0; those of `out`.
pub fn write_usda(
    samples: &[CameraSample],
    frames_per_second: f64,
    sensor_height_mm: Option<f64>,
    mut out: impl Write,
) -> io::Result<()> {
    let refuse = |reason: &str| Err(io::Error::new(io::ErrorKind::InvalidInput, reason));
    if !(frames_per_second.is_finite() && frames_per_second > 0.0) {
        return refuse("frames per second must be a number above 0");
    }
    let frames = samples.iter().map(|sample| sample.frame);
    let Some(first) = frames.clone().min_by(f64::total_cmp) else {
        return refuse("a camera needs one frame at least");
    };
    let last = frames.fold(first, f64::max);
    write!(
        out,
        "#usda 1.0\n(\n    \
         defaultPrim = \"Camera\"\n    \
         doc = \"The lens of a shot, from pullfocus: focusDistance in centimetres, focal length and apertures in millimetres.\"\n    \
         endTimeCode = {last}\n    \
         framesPerSecond = {frames_per_second}\n    \
         metersPerUnit = 0.01\n    \
         startTimeCode = {first}\n    \
         timeCodesPerSecond = {frames_per_second}\n    \
         upAxis = \"Y\"\n)\n\n\
         def Camera \"Camera\"\n{{\n"
    )?;
    let lenses: Vec<(f64, UsdLens)> =
        samples.iter().filter_map(|sample| Some((sample.frame, UsdLens::of(sample)?))).collect();
    let of = |value: &dyn Fn(&UsdLens) -> Option<f64>| -> Vec<(f64, f64)> {
        lenses.iter().filter_map(|(frame, lens)| Some((*frame, value(lens)?))).collect()
    };
    let focus = samples.iter().map(|sample| {
        let distance = 100.0 * sample.focus_distance_m;
        (sample.frame, if distance.is_finite() { distance } else { INFINITELY_FAR_CM })
    });
    let pinhole = |f_stop: f64| if f_stop.is_finite() { f_stop } else { 0.0 };
    let height = lenses.first().and_then(|(_, first)| Some(sensor_height_mm? / first.width));
    attribute(&mut out, "focalLength", &of(&|lens| Some(lens.focal)))?;
    attribute(&mut out, "focusDistance", &focus.collect::<Vec<_>>())?;
    attribute(&mut out, "fStop", &of(&|lens| lens.f_stop.map(pinhole)))?;
    attribute(&mut out, "horizontalAperture", &of(&|lens| Some(lens.width)))?;
    writeln!(out, "    token projection = \"perspective\"")?;
    attribute(&mut out, "verticalAperture", &of(&|lens| Some(lens.width * height?)))?;
    writeln!(out, "}}")
}

/// A `float` attribute: nothing, one value, or one for each frame.
fn attribute(out: &mut impl Write, name: &str, values: &[(f64, f64)]) -> io::Result<()> {
    // USD's type; rounded to it, fewer values differ.
    let float = |value: f64| value as f32;
    match values {
        [] => Ok(()),
        [(_, first), rest @ ..] if rest.iter().all(|(_, value)| float(*value) == float(*first)) => {
            writeln!(out, "    float {name} = {}", float(*first))
        }
        values => {
            writeln!(out, "    float {name}.timeSamples = {{")?;
            for (frame, value) in values {
                writeln!(out, "        {frame}: {},", float(*value))?;
            }
            writeln!(out, "    }}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull() -> [CameraSample; 2] {
        let at = |frame, focus, f_stop| {
            let lens = Lens::Physical { focal_length_mm: 50.0, f_stop, sensor_width_mm: 36.0 };
            CameraSample::new(frame, &Camera::new(lens, focus).unwrap(), [1.5, f64::INFINITY])
        };
        [at(1001.0, 2.5, 2.0), at(1002.0, f64::INFINITY, 4.0)]
    }

    fn text(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> String {
        let mut bytes = Vec::new();
        write(&mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn a_table_has_a_line_for_each_frame() {
        let table = text(|out| write_csv(&pull(), out));
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines.len(), 3);
        let fov = (2.0 * (18f64 / 50.0).atan()).to_degrees();
        assert_eq!(lines[1], format!("1001,2.5,2,50,36,{fov},0.025,1.5,inf"));
        assert!(lines[2].starts_with("1002,inf,4,50,36,"), "{table}");
        let columns = lines[0].split(',').count();
        assert!(lines.iter().all(|line| line.split(',').count() == columns), "{table}");
        let unknown = CameraSample { frame: 1.5, focus_distance_m: 2.0, ..CameraSample::default() };
        assert!(text(|out| write_csv(&[unknown], out)).ends_with("\n1.5,2,,,,,,0,0\n"));
    }

    #[test]
    fn a_layer_holds_one_camera_in_usds_units() {
        let expected = "#usda 1.0\n(\n    \
            defaultPrim = \"Camera\"\n    \
            doc = \"The lens of a shot, from pullfocus: focusDistance in centimetres, focal length and apertures in millimetres.\"\n    \
            endTimeCode = 1002\n    \
            framesPerSecond = 24\n    \
            metersPerUnit = 0.01\n    \
            startTimeCode = 1001\n    \
            timeCodesPerSecond = 24\n    \
            upAxis = \"Y\"\n)\n\n\
            def Camera \"Camera\"\n{\n    \
            float focalLength = 50\n    \
            float focusDistance.timeSamples = {\n        \
            1001: 250,\n        \
            1002: 1000000000,\n    }\n    \
            float fStop.timeSamples = {\n        \
            1001: 2,\n        \
            1002: 4,\n    }\n    \
            float horizontalAperture = 36\n    \
            token projection = \"perspective\"\n    \
            float verticalAperture = 24\n}\n";
        assert_eq!(text(|out| write_usda(&pull(), 24.0, Some(24.0), out)), expected);
        assert!(!text(|out| write_usda(&pull(), 23.976, None, out)).contains("verticalAperture"));
    }

    #[test]
    fn a_field_of_view_is_put_on_some_sensor() {
        let lens = Lens::Ideal { fov_x_degrees: 90.0, aperture_diameter_m: 0.009 };
        let sample = CameraSample::new(1.0, &Camera::new(lens, 2.0).unwrap(), [0.0; 2]);
        let layer = text(|out| write_usda(&[sample], 25.0, None, out));
        // tan 45 degrees is 1 but for a rounding that 32 bits do not hold: 18 mm, and 18 / 9.
        for line in ["float focalLength = 18\n", "float horizontalAperture = 36\n", "float fStop = 2\n"] {
            assert!(layer.contains(line), "{layer}");
        }
        let zoomed = CameraSample { focal_length_mm: Some(9.0), frame: 2.0, ..sample };
        let layer = text(|out| write_usda(&[sample, zoomed], 25.0, Some(20.0), out));
        assert!(layer.contains("2: 18,") && layer.contains("2: 10,"), "apertures follow: {layer}");
        let pinhole = CameraSample { aperture_diameter_m: Some(0.0), ..sample };
        assert!(text(|out| write_usda(&[pinhole], 25.0, None, out)).contains("float fStop = 0\n"));
        let unknown = CameraSample { focus_distance_m: 2.0, ..CameraSample::default() };
        let layer = text(|out| write_usda(&[unknown], 25.0, Some(20.0), out));
        assert!(layer.contains("focusDistance = 200") && !layer.contains("float focalLength"), "{layer}");
    }

    #[test]
    fn nothing_to_write_is_refused() {
        assert!(write_usda(&[], 24.0, None, Vec::new()).is_err());
        for odd in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(write_usda(&pull(), odd, None, Vec::new()).is_err(), "{odd}");
        }
    }
}
