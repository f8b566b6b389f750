//! Focus pulls: a lens whose focus distance, f-stop and focal length have keys at frames.
//!
//! Between two keys each quantity moves evenly on the scale that its effect is even on: focus in dioptres (1 / metres), as the marks of a
//! lens's focus ring nearly are, so that infinity is a place like others; the f-stop in stops and the focal length in
//! ratios.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize, Serializer};

/// How a value leaves a key for the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Easing {
    /// Stays, and jumps at the next key.
    Hold,
    /// Evenly.
    Linear,
    /// Starts and ends slowly.
    #[default]
    Smooth,
    /// Starts slowly.
    In,
    /// Ends slowly.
    Out,
}

impl Easing {
    /// Which part of the way is done after the part `u` of the time; both 0 to 1.
    pub fn at(self, u: f64) -> f64 {
        let u = u.clamp(0.0, 1.0);
        match self {
            Self::Hold => {
                if u < 1.0 {
                    0.0
                } else {
                    1.0
                }
            }
            Self::Linear => u,
            Self::Smooth => u * u * (3.0 - 2.0 * u),
            Self::In => u * u,
            Self::Out => u * (2.0 - u),
        }
    }
}

/// What the lens is at a frame; what is left out goes on as if the key were not there.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Key {
    /// The frame's number; parts of frames are allowed.
    #[serde(serialize_with = "serialize_plain")]
    pub frame: f64,
    /// Distance in focus, in metres; may be infinite.
    #[serde(
        default,
        rename = "focus-distance",
        skip_serializing_if = "Option::is_none",
        serialize_with = "serialize_given"
    )]
    pub focus_distance_m: Option<f64>,
    /// f-number.
    #[serde(default, skip_serializing_if = "Option::is_none", serialize_with = "serialize_given")]
    pub f_stop: Option<f64>,
    /// In millimetres.
    #[serde(
        default,
        rename = "focal-length",
        skip_serializing_if = "Option::is_none",
        serialize_with = "serialize_given"
    )]
    pub focal_length_mm: Option<f64>,
    /// How these values go on to their next keys.
    #[serde(default)]
    pub easing: Easing,
}

/// Writes a number as people do: whole ones without a point.
///
/// # Errors
/// The serializer's.
pub fn serialize_plain<S: Serializer>(value: &f64, to: S) -> std::result::Result<S::Ok, S::Error> {
    /// Whole numbers up to this are exact in both forms.
    const EXACT: f64 = 9e15;
    if value.fract() == 0.0 && value.abs() < EXACT {
        to.serialize_i64(*value as i64)
    } else {
        to.serialize_f64(*value)
    }
}

fn serialize_given<S: Serializer>(value: &Option<f64>, to: S) -> std::result::Result<S::Ok, S::Error> {
    match value {
        Some(value) => serialize_plain(value, to),
        None => to.serialize_none(),
    }
}

/// A lens at one moment, as far as keys say.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moment {
    /// In metres; may be infinite.
    pub focus_distance_m: Option<f64>,
    /// f-number.
    pub f_stop: Option<f64>,
    /// In millimetres.
    pub focal_length_mm: Option<f64>,
}

/// Keys in the order of their frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<Key>", into = "Vec<Key>")]
pub struct Pull {
    keys: Vec<Key>,
}

impl TryFrom<Vec<Key>> for Pull {
    type Error = Error;

    fn try_from(keys: Vec<Key>) -> Result<Self> {
        Self::new(keys)
    }
}

impl From<Pull> for Vec<Key> {
    fn from(pull: Pull) -> Self {
        pull.keys
    }
}

fn refuse<T>(name: &'static str, value: f64, reason: &'static str) -> Result<T> {
    Err(Error::Setting { name, value, reason })
}

impl Key {
    fn check(&self) -> Result<()> {
        if !self.frame.is_finite() {
            return refuse("key's frame", self.frame, "must be a number");
        }
        if let Some(focus) = self.focus_distance_m.filter(|focus| focus.is_nan() || *focus <= 0.0) {
            return refuse("key's focus distance", focus, "must be above 0 (metres), or infinite");
        }
        if let Some(f_stop) = self.f_stop.filter(|f_stop| !(*f_stop > 0.0 && f_stop.is_finite())) {
            return refuse("key's f-stop", f_stop, "must be above 0");
        }
        let focal = self.focal_length_mm.filter(|focal| !(*focal > 0.0 && focal.is_finite()));
        focal.map_or(Ok(()), |focal| refuse("key's focal length", focal, "must be above 0 (millimetres)"))
    }
}

/// Half a frame is the least that is told apart; a thousandth leaves room for typed ones.
const SAME_FRAME: f64 = 1e-3;

impl Pull {
    /// Keys in any order.
    ///
    /// # Errors
    /// [`Error::Setting`] for values that no lens has, and for two keys at one frame.
    pub fn new(mut keys: Vec<Key>) -> Result<Self> {
        keys.iter().try_for_each(Key::check)?;
        keys.sort_by(|a, b| a.frame.total_cmp(&b.frame));
        if let Some(pair) = keys.windows(2).find(|pair| pair[1].frame - pair[0].frame < SAME_FRAME) {
            return refuse("key's frame", pair[1].frame, "must not be another key's, too");
        }
        Ok(Self { keys })
    }

    /// The keys, in the order of their frames.
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.keys.is_empty()
    }

    /// Adds a key, or changes the one at its frame: what the new one leaves out stays.
    ///
    /// # Errors
    /// As [`Pull::new`]; the keys are then as they were.
    pub fn set(&mut self, key: Key) -> Result<()> {
        key.check()?;
        if let Some(known) = self.keys.iter_mut().find(|known| (known.frame - key.frame).abs() < SAME_FRAME) {
            known.focus_distance_m = key.focus_distance_m.or(known.focus_distance_m);
            known.f_stop = key.f_stop.or(known.f_stop);
            known.focal_length_mm = key.focal_length_mm.or(known.focal_length_mm);
            known.easing = key.easing;
            return Ok(());
        }
        let at = self.keys.partition_point(|known| known.frame < key.frame);
        self.keys.insert(at, key);
        Ok(())
    }

    /// Takes the key at a frame away, if there is one.
    pub fn remove(&mut self, frame: f64) -> Option<Key> {
        let at = self.keys.iter().position(|key| (key.frame - frame).abs() < SAME_FRAME)?;
        Some(self.keys.remove(at))
    }

    /// The lens at a frame: before the first key as there, after the last one as there.
    pub fn at(&self, frame: f64) -> Moment {
        let inverse = |x: f64| 1.0 / x;
        Moment {
            focus_distance_m: self.value(frame, |key| key.focus_distance_m, inverse, inverse),
            f_stop: self.value(frame, |key| key.f_stop, f64::ln, f64::exp),
            focal_length_mm: self.value(frame, |key| key.focal_length_mm, f64::ln, f64::exp),
        }
    }

    /// One quantity, which moves evenly on the scale `to`; `back` leads from there.
    fn value(
        &self,
        frame: f64,
        of: impl Fn(&Key) -> Option<f64>,
        to: impl Fn(f64) -> f64,
        back: impl Fn(f64) -> f64,
    ) -> Option<f64> {
        let mut before: Option<(&Key, f64)> = None;
        for key in &self.keys {
            let Some(value) = of(key) else { continue };
            if key.frame <= frame {
                before = Some((key, value));
                continue;
            }
            let Some((from, start)) = before else { return Some(value) };
            let part = from.easing.at((frame - from.frame) / (key.frame - from.frame));
            // A key's own value is kept to the bit.
            if part == 0.0 || start == value {
                return Some(start);
            }
            return Some(back(to(start) + (to(value) - to(start)) * part));
        }
        before.map(|(_, value)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(frame: f64, focus: f64, easing: Easing) -> Key {
        Key { frame, focus_distance_m: Some(focus), easing, ..Key::default() }
    }

    #[test]
    fn focus_moves_in_dioptres() {
        let pull = Pull::new(vec![
            key(1010.0, f64::INFINITY, Easing::Hold),
            key(1000.0, 2.0, Easing::Linear),
            key(1020.0, 0.5, Easing::Smooth),
        ])
        .unwrap();
        let at = |frame| pull.at(frame).focus_distance_m.unwrap();
        assert_eq!((at(-5.0), at(1000.0), at(1010.0)), (2.0, 2.0, f64::INFINITY));
        assert!((at(1005.0) - 4.0).abs() < 1e-12);
        assert_eq!((at(1019.9), at(1020.0), at(9999.0)), (f64::INFINITY, 0.5, 0.5));
        assert_eq!(pull.at(1000.0).f_stop, None);
    }

    #[test]
    fn each_quantity_has_its_own_keys() {
        let mut pull = Pull::default();
        pull.set(Key { frame: 1.0, f_stop: Some(2.0), easing: Easing::Linear, ..Key::default() }).unwrap();
        pull.set(key(2.0, 3.0, Easing::Linear)).unwrap();
        pull.set(Key { frame: 3.0, f_stop: Some(8.0), focal_length_mm: Some(50.0), ..Key::default() })
            .unwrap();
        let middle = pull.at(2.0);
        assert!((middle.f_stop.unwrap() - 4.0).abs() < 1e-12);
        assert_eq!((middle.focus_distance_m, middle.focal_length_mm), (Some(3.0), Some(50.0)));
        // The same frame again: one key, both values.
        pull.set(Key { frame: 2.0, f_stop: Some(2.8), ..Key::default() }).unwrap();
        assert_eq!((pull.keys().len(), pull.at(2.0).f_stop), (3, Some(2.8)));
        assert_eq!(pull.at(2.0).focus_distance_m, Some(3.0));
        assert!(pull.remove(2.0).is_some() && pull.remove(2.0).is_none());
        assert_eq!(pull.at(2.0).focus_distance_m, None);
    }

    #[test]
    fn easings_lead_from_0_to_1() {
        for easing in [Easing::Hold, Easing::Linear, Easing::Smooth, Easing::In, Easing::Out] {
            assert_eq!((easing.at(-1.0), easing.at(0.0), easing.at(1.0)), (0.0, 0.0, 1.0), "{easing:?}");
            let steps: Vec<f64> = (0..=100).map(|i| easing.at(0.01 * f64::from(i))).collect();
            assert!(steps.windows(2).all(|pair| pair[0] <= pair[1]), "{easing:?}");
        }
        assert!(Easing::In.at(0.5) < 0.5 && Easing::Out.at(0.5) > 0.5 && Easing::Smooth.at(0.25) < 0.25);
    }

    #[test]
    fn odd_keys_are_refused() {
        for odd in [
            key(f64::NAN, 1.0, Easing::Hold),
            key(0.0, 0.0, Easing::Hold),
            key(0.0, f64::NAN, Easing::Hold),
            Key { f_stop: Some(f64::INFINITY), ..Key::default() },
            Key { focal_length_mm: Some(-1.0), ..Key::default() },
        ] {
            assert!(matches!(Pull::new(vec![odd]), Err(Error::Setting { .. })), "{odd:?}");
            assert!(Pull::default().set(odd).is_err(), "{odd:?}");
        }
        let twice = vec![key(4.0, 1.0, Easing::Hold), key(4.0, 2.0, Easing::Hold)];
        assert!(Pull::new(twice).unwrap_err().to_string().contains("another key"));
    }
}
