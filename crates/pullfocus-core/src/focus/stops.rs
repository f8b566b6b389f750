//! f-stops as they are engraved: in thirds of a stop from f/1 on, by ISO 517's series and the roundings that
//! camera makers have agreed upon.

/// The f-number `n` thirds of a stop from f/1: `2^(n / 6)`, exactly where it is a power of 2.
pub fn third(n: i32) -> f64 {
    2f64.powi(n.div_euclid(6)) * 2f64.powf(f64::from(n.rem_euclid(6)) / 6.0)
}

/// How many thirds of a stop from f/1 the engraved mark nearest to an f-number lies. What is no f-number (0 and below) is taken for
/// the smallest one, an infinite one for the largest.
pub fn nearest(f_stop: f64) -> i32 {
    // Casts cut to the type's range, and NaN is 0.
    (6.0 * f_stop.max(0.0).log2()).round() as i32
}

/// The name of a mark, `n` thirds from f/1, without `f/`: "2.8".
///
/// From 0.5 to 64 as engraved, which is not always the nearest rounding (5.6, 11 and 22 are round
/// down); beyond, two digits of [`third`].
pub fn mark(n: i32) -> String {
    let engraved = n.checked_sub(FIRST).and_then(|at| MARKS.get(usize::try_from(at).ok()?));
    engraved.map_or_else(|| two_digits(third(n)), |mark| (*mark).to_owned())
}

/// [`MARKS`]'s first, in thirds.
const FIRST: i32 = -6;

const MARKS: [&str; 43] = [
    "0.5", "0.56", "0.63", "0.7", "0.8", "0.9", "1", "1.1", "1.2", "1.4", "1.6", "1.8", "2", "2.2", "2.5",
    "2.8", "3.2", "3.5", "4", "4.5", "5", "5.6", "6.3", "7.1", "8", "9", "10", "11", "13", "14", "16", "18",
    "20", "22", "25", "29", "32", "36", "40", "45", "51", "57", "64",
];

fn two_digits(value: f64) -> String {
    format!("{value:.1e}").parse::<f64>().unwrap_or(value).to_string()
}

/// The T-stop of a lens at an f-number, where the glass lets the part `transmittance` of the light through (0 to 1):
/// `N / sqrt(transmittance)`. Exposure goes by the T-stop, blur by the f-number.
pub fn t_stop(f_stop: f64, transmittance: f64) -> f64 {
    f_stop / transmittance.sqrt()
}

/// The f-number of a lens set to a T-stop: the way back from [`t_stop`].
pub fn from_t_stop(t_stop: f64, transmittance: f64) -> f64 {
    t_stop * transmittance.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_near_what_they_name() {
        for n in -30..60 {
            let named: f64 = mark(n).parse().unwrap();
            // The worst engraved roundings are f/1.2 for 1.26 and f/22 for 22.6; a third is 12 %.
            assert!((named / third(n) - 1.0).abs() < 0.05, "{n}: {named} {}", third(n));
            assert_eq!((nearest(named), nearest(third(n))), (n, n), "{named}");
        }
        assert_eq!((third(6), third(-12), third(36)), (2.0, 0.25, 64.0));
        let full: Vec<String> = (0..=12).map(|stop| mark(3 * stop)).collect();
        assert_eq!(full, ["1", "1.4", "2", "2.8", "4", "5.6", "8", "11", "16", "22", "32", "45", "64"]);
        assert_eq!((mark(42).as_str(), mark(-7).as_str()), ("130", "0.45"));
        let names: std::collections::HashSet<String> = (-30..60).map(mark).collect();
        assert_eq!(names.len(), 90);
    }

    #[test]
    fn no_number_panics() {
        assert_eq!(
            (nearest(f64::NAN), nearest(-1.0), nearest(f64::INFINITY)),
            (i32::MIN, i32::MIN, i32::MAX)
        );
        for n in [i32::MIN, i32::MAX] {
            assert!(!mark(n).is_empty() && third(n) >= 0.0);
        }
    }

    #[test]
    fn t_stops_lose_light() {
        // A third of a stop lost.
        let transmittance = 2f64.powf(-1.0 / 3.0);
        assert!((t_stop(2.0, transmittance) - third(7)).abs() < 1e-12);
        assert!((from_t_stop(t_stop(2.8, 0.8), 0.8) - 2.8).abs() < 1e-12);
    }
}
