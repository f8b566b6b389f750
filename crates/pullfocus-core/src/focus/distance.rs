//! Distances as people write and read them: `3.2 m`, `45 cm`, `10' 6"`, `infinity`.

/// What distances are shown in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Units {
    /// Metres, and below one metre centimetres.
    #[default]
    Metres,
    /// Feet and inches.
    Feet,
}

const INCH: f64 = 0.0254;

/// Units by the names that people give them: metres, and the system that may be added up (`10 ft 6 in`, `1 m 20 cm`).
const UNITS: [(&[&str], f64, Units); 6] = [
    (&["km"], 1000.0, Units::Metres),
    (&["m", "metre", "metres", "meter", "meters"], 1.0, Units::Metres),
    (&["cm"], 0.01, Units::Metres),
    (&["mm"], 0.001, Units::Metres),
    (&["'", "′", "’", "ft", "ft.", "foot", "feet"], 12.0 * INCH, Units::Feet),
    (&["\"", "″", "”", "''", "in", "in.", "inch", "inches"], INCH, Units::Feet),
];

/// A distance above 0 in metres, from text: a number alone is metres; `m`, `cm`, `mm`, `km`, `ft` or `'`, `in` or `"`
/// behind a number are units, larger ones first (`10' 6 1/2"`, `1 m 20 cm`); `inf`, `infinity` and `∞` are infinite.
///
/// # Errors
/// One sentence with an example.
pub fn parse(text: &str) -> Result<f64, String> {
    let text = text.trim();
    if ["inf", "infinity", "∞"].iter().any(|name| text.eq_ignore_ascii_case(name)) {
        return Ok(f64::INFINITY);
    }
    let plain = text.replace('½', " 1/2").replace('¼', " 1/4").replace('¾', " 3/4");
    let metres = sum(plain.trim()).ok_or_else(|| {
        format!("'{}' is no distance; write it like 3.2, 45 cm, 10' 6\" or inf", text.escape_debug())
    })?;
    if metres > 0.0 && metres.is_finite() {
        Ok(metres)
    } else {
        Err(format!("'{}' is no distance above 0; for infinitely far write inf", text.escape_debug()))
    }
}

/// Numbers with their units, added up.
fn sum(text: &str) -> Option<f64> {
    let mut rest = text;
    let mut metres = 0.0;
    let mut last: Option<(f64, Units)> = None;
    while !rest.is_empty() {
        let (value, after) = number(rest)?;
        let end = after.find(|c: char| c.is_ascii_digit() || c.is_whitespace()).unwrap_or(after.len());
        let (name, after) = after.split_at(end);
        let name = name.to_lowercase();
        let unit = UNITS.iter().find(|(names, ..)| names.contains(&name.as_str()));
        let unit = match (unit, last) {
            (Some((_, unit, system)), _) => (*unit, *system),
            (None, None) if name.is_empty() && after.is_empty() => (1.0, Units::Metres),
            // 10' 6: inches are understood.
            (None, Some((_, Units::Feet))) if name.is_empty() && after.is_empty() => (INCH, Units::Feet),
            _ => return None,
        };
        if last.is_some_and(|(larger, system)| system != unit.1 || larger <= unit.0) {
            return None;
        }
        metres += value * unit.0;
        last = Some(unit);
        rest = after.trim_start();
    }
    last.map(|_| metres)
}

/// A number at the start of the text, with a fraction if one follows (`6 1/2`), and what comes after it.
fn number(text: &str) -> Option<(f64, &str)> {
    let digits = |text: &str| text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (whole, rest) = text.split_at(digits(text));
    let rest = rest.trim_start();
    if let Some(below) = rest.strip_prefix('/') {
        let (below, rest) = below.split_at(digits(below));
        return Some((quotient(whole, below)?, rest.trim_start()));
    }
    let value: f64 = whole.parse().ok()?;
    let (above, after) = rest.split_at(digits(rest));
    if let (Some(below), false) = (after.strip_prefix('/'), above.is_empty()) {
        let (below, rest) = below.split_at(digits(below));
        return Some((value + quotient(above, below)?, rest.trim_start()));
    }
    Some((value, rest))
}

fn quotient(above: &str, below: &str) -> Option<f64> {
    let (above, below): (u32, u32) = (above.parse().ok()?, below.parse().ok()?);
    (below > 0).then(|| f64::from(above) / f64::from(below))
}

/// A distance as people read it, to about half a per cent or better: "3.20 m", "45.0 cm", "12.5 m", `10' 6"`,
/// `9 1/4"`, "infinity". [`parse`] reads it back. "unknown" for NaN.
pub fn format(metres: f64, units: Units) -> String {
    if metres.is_nan() {
        return "unknown".into();
    }
    if metres.is_infinite() {
        return "infinity".into();
    }
    match units {
        Units::Metres => {
            // What rounds to the next band's first value belongs there.
            if metres < 0.0995 {
                format!("{:.1} mm", 1000.0 * metres)
            } else if metres < 0.9995 {
                format!("{:.1} cm", 100.0 * metres)
            } else if metres < 9.995 {
                format!("{metres:.2} m")
            } else if metres < 99.95 {
                format!("{metres:.1} m")
            } else {
                format!("{metres:.0} m")
            }
        }
        Units::Feet => feet(metres / INCH),
    }
}

/// Parts of an inch below 5 feet, halves below 20 feet, whole ones to 100 feet.
fn feet(inches: f64) -> String {
    let parts = if inches < 60.0 {
        8
    } else if inches < 240.0 {
        2
    } else if inches < 1200.0 {
        1
    } else {
        return format!("{:.0}'", inches / 12.0);
    };
    // Below 1200 inches: no cast cuts.
    let count = (inches.max(0.0) * f64::from(parts)).round() as u32;
    let (feet, rest) = (count / (12 * parts), count % (12 * parts));
    let (whole, mut above, mut below) = (rest / parts, rest % parts, parts);
    while above > 0 && above % 2 == 0 {
        (above, below) = (above / 2, below / 2);
    }
    let inches = match (whole, above) {
        (whole, 0) => whole.to_string(),
        (0, above) => format!("{above}/{below}"),
        (whole, above) => format!("{whole} {above}/{below}"),
    };
    if feet == 0 { format!("{inches}\"") } else { format!("{feet}' {inches}\"") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_read_as_people_write_them() {
        for (text, metres) in [
            ("3.2", 3.2),
            (" 3.2 m ", 3.2),
            ("3.2 metres", 3.2),
            ("320cm", 3.2),
            ("45mm", 0.045),
            ("1.5 km", 1500.0),
            ("1 m 20 cm", 1.2),
            ("10'6\"", 126.0 * INCH),
            ("10 ft 6 in", 126.0 * INCH),
            ("10ft6in", 126.0 * INCH),
            ("10' 6", 126.0 * INCH),
            ("10' 6 1/2\"", 126.5 * INCH),
            ("10′ 6½″", 126.5 * INCH),
            ("10' 1/2\"", 120.5 * INCH),
            ("126in", 126.0 * INCH),
            ("126 Inches", 126.0 * INCH),
            ("1/2 m", 0.5),
            ("10.5 ft", 126.0 * INCH),
            (".5", 0.5),
            ("inf", f64::INFINITY),
            ("Infinity", f64::INFINITY),
            ("∞", f64::INFINITY),
        ] {
            let read = parse(text).unwrap();
            // Sums of products: rounding only.
            assert!(read == metres || (read / metres - 1.0).abs() < 1e-12, "{text}: {read}");
        }
    }

    #[test]
    fn what_is_no_distance_is_refused_in_a_sentence() {
        for text in [
            "",
            "m",
            "three",
            "3,2",
            "3.2.1",
            "3 furlongs",
            "6\" 10'",
            "10' 3 m",
            "3 m 2",
            "3 3",
            "1/0",
            "1//2",
            "1 2/",
            "nan",
            "1e3",
            "10' 6 1/2 1/2\"",
            "5 cm 1 m",
            "3 cm 3 cm",
            "a\nb",
            "-2",
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.contains("45 cm") && !said.contains('\n'), "{text}: {said}");
        }
        for text in ["0", "0 m", "0' 0\""] {
            assert!(parse(text).unwrap_err().contains("above 0"), "{text}");
        }
        assert!(parse(&"9".repeat(400)).is_err());
    }

    #[test]
    fn distances_are_shown_as_people_read_them() {
        for (metres, shown) in [
            (3.2, "3.20 m"),
            (0.45, "45.0 cm"),
            (0.9996, "1.00 m"),
            (0.045, "45.0 mm"),
            (12.345, "12.3 m"),
            (9.996, "10.0 m"),
            (120.4, "120 m"),
            (f64::INFINITY, "infinity"),
            (f64::NAN, "unknown"),
        ] {
            assert_eq!(format(metres, Units::Metres), shown);
        }
        for (inches, shown) in [
            (126.0, "10' 6\""),
            (126.5, "10' 6 1/2\""),
            (120.0, "10' 0\""),
            (9.26, "9 1/4\""),
            (0.5, "1/2\""),
            (11.99, "1' 0\""),
            (59.99, "5' 0\""),
            (300.4, "25' 0\""),
            (1439.0, "120'"),
            (f64::INFINITY, "infinity"),
        ] {
            assert_eq!(format(inches * INCH, Units::Feet), shown);
        }
    }

    #[test]
    fn what_is_shown_reads_back() {
        // From 2 cm to 4 km, in steps that hit no round number.
        for i in 0..4000 {
            let metres = 0.02 * (f64::from(i) * 0.003_051).exp();
            for units in [Units::Metres, Units::Feet] {
                let shown = format(metres, units);
                let read = parse(&shown).unwrap();
                // Half of the last digit: 0.05 of 10.0 in metres; a sixteenth of an inch from 2 cm on in feet.
                let worst = if units == Units::Feet && metres < 0.4 { 0.08 } else { 0.006 };
                assert!((read / metres - 1.0).abs() < worst, "{metres}: {shown} {read}");
                assert_eq!(format(read, units), shown, "{metres}");
            }
        }
    }

    #[test]
    fn no_text_panics() {
        let parts = ["1", "/", "'", "\"", " ", "ft", ".", "∞", "m", "½"];
        for a in parts {
            for b in parts {
                for c in parts {
                    for d in parts {
                        let _ = parse(&[a, b, c, d].concat());
                    }
                }
            }
        }
    }
}
