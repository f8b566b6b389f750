//! Sensors and film gates by name: widths and heights of what a camera exposes, in millimetres.

/// A sensor, or a film camera's gate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// What people call it.
    pub name: &'static str,
    /// Width in millimetres.
    pub width_mm: f64,
    /// Height in millimetres.
    pub height_mm: f64,
}

const fn sensor(name: &'static str, width_mm: f64, height_mm: f64) -> Sensor {
    Sensor { name, width_mm, height_mm }
}

/// Usual sensors, the most usual of a kind first. Digital ones have the makers' data sheets' figures for the largest area that they
/// record (open gate), film has the camera aperture of SMPTE and ISO standards, as the American Cinematographer
/// Manual prints them; defaults are those of the programs' own manuals.
pub const SENSORS: &[Sensor] = &[
    sensor("Full frame (Blender, Maya, Unity)", 36.0, 24.0),
    sensor("APS-C", 23.5, 15.6),
    sensor("APS-C (Canon)", 22.3, 14.9),
    sensor("Micro Four Thirds", 17.3, 13.0),
    sensor("Medium format 44 x 33", 43.8, 32.9),
    sensor("1-inch", 13.2, 8.8),
    sensor("Phone 1/1.3-inch", 9.8, 7.3),
    sensor("Phone 1/2.55-inch", 5.64, 4.23),
    sensor("Super 35, 4-perf", 24.89, 18.66),
    sensor("Super 35, 3-perf", 24.89, 13.87),
    sensor("35 mm Academy", 21.95, 16.0),
    sensor("VistaVision, 8-perf", 37.72, 24.92),
    sensor("65 mm, 5-perf", 52.63, 23.01),
    sensor("IMAX, 15-perf", 70.41, 52.63),
    sensor("16 mm", 10.26, 7.49),
    sensor("Super 16", 12.52, 7.41),
    sensor("Super 8", 5.79, 4.01),
    sensor("ARRI Alexa 35", 27.99, 19.22),
    sensor("ARRI Alexa Mini", 28.25, 18.17),
    sensor("ARRI Alexa 16:9", 23.76, 13.37),
    sensor("ARRI Alexa LF, Mini LF", 36.70, 25.54),
    sensor("ARRI Alexa 65, 265", 54.12, 25.58),
    sensor("RED Monstro 8K VV", 40.96, 21.60),
    sensor("RED V-Raptor 8K VV", 40.96, 21.60),
    sensor("RED Komodo 6K", 27.03, 14.26),
    sensor("RED Helium 8K S35", 29.90, 15.77),
    sensor("RED V-Raptor 8K S35", 26.21, 13.82),
    sensor("Sony Venice, full frame", 35.9, 24.0),
    sensor("Sony Venice, Super 35", 24.3, 18.0),
    sensor("Blackmagic Pocket 4K", 18.96, 10.0),
    sensor("Blackmagic Pocket 6K", 23.10, 12.99),
    sensor("Blackmagic URSA Mini 4.6K", 25.34, 14.25),
    sensor("Blackmagic Pyxis 6K, Cinema Camera 6K", 36.0, 24.0),
    sensor("Canon C70, C300 Mark III", 26.2, 13.8),
    sensor("USD default", 20.955, 15.2908),
    sensor("Nuke default", 24.576, 18.672),
    sensor("Unreal default (16:9 digital film)", 23.76, 13.365),
];

/// Makers print tenths of a millimetre, and files round to hundredths.
const SAME_MM: f64 = 0.05 + 1e-9;

/// The sensor of this width, in millimetres: the nearest within half a tenth, and of several the first in [`SENSORS`].
pub fn find(width_mm: f64) -> Option<&'static Sensor> {
    let off = |sensor: &&Sensor| (sensor.width_mm - width_mm).abs();
    SENSORS.iter().filter(|sensor| off(sensor) <= SAME_MM).min_by(|a, b| off(a).total_cmp(&off(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_are_found_by_their_width() {
        assert_eq!(find(36.0).unwrap().name, SENSORS[0].name);
        assert_eq!(find(35.9).unwrap().name, "Sony Venice, full frame");
        assert_eq!(find(24.892).unwrap().name, "Super 35, 4-perf");
        assert_eq!(find(36.7).unwrap().name, "ARRI Alexa LF, Mini LF");
        assert_eq!((find(30.7), find(f64::NAN), find(0.0)), (None, None, None));
    }

    #[test]
    fn the_table_is_sound() {
        for (index, sensor) in SENSORS.iter().enumerate() {
            let aspect = sensor.width_mm / sensor.height_mm;
            // Academy film is the squarest here, Alexa 65 and 65 mm film the widest.
            assert!((1.2..2.3).contains(&aspect) && sensor.width_mm > 5.0, "{sensor:?}");
            assert!(SENSORS[..index].iter().all(|other| other.name != sensor.name), "{}", sensor.name);
            assert!(find(sensor.width_mm).unwrap().width_mm == sensor.width_mm);
        }
    }
}
