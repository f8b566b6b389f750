//! Values that people write in more than one way, on the command line and in a settings file alike.

use pullfocus::Device;
use pullfocus_core::{Aperture, Show, Size};
use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Lets a type with `FromStr` be written in TOML as text, as a number, as a boolean or as a list of these.
macro_rules! from_text {
    ($($name:ty),*) => {$(
        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let text = deserializer.deserialize_any($crate::values::Text)?;
                text.parse().map_err(<D::Error as serde::de::Error>::custom)
            }
        }
    )*};
}

pub(crate) use from_text;

pub(crate) struct Text;

impl<'de> Visitor<'de> for Text {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("text or a number")
    }

    fn visit_str<E>(self, text: &str) -> Result<String, E> {
        Ok(text.to_owned())
    }

    fn visit_f64<E>(self, number: f64) -> Result<String, E> {
        Ok(number.to_string())
    }

    fn visit_i64<E>(self, number: i64) -> Result<String, E> {
        Ok(number.to_string())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<String, A::Error> {
        let mut joined = String::new();
        while let Some(Item(item)) = list.next_element()? {
            if !joined.is_empty() {
                joined.push(',');
            }
            joined.push_str(&item);
        }
        Ok(joined)
    }
}

/// One entry of a list: no lists within lists.
struct Item(String);

impl<'de> Deserialize<'de> for Item {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Flat;
        impl Visitor<'_> for Flat {
            type Value = Item;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("text or a number")
            }
            fn visit_str<E>(self, text: &str) -> Result<Item, E> {
                Ok(Item(text.to_owned()))
            }
            fn visit_f64<E>(self, number: f64) -> Result<Item, E> {
                Ok(Item(number.to_string()))
            }
            fn visit_i64<E>(self, number: i64) -> Result<Item, E> {
                Ok(Item(number.to_string()))
            }
        }
        deserializer.deserialize_any(Flat)
    }
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if !value.is_nan() => Ok(value),
        _ => Err(format!("'{text}' is not a number")),
    }
}

/// Any number but "not a number"; infinity is written `inf`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Number(pub f64);

impl FromStr for Number {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        number(text).map(Self)
    }
}

/// Metres in one unit of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit(pub f64);

const UNITS: [(&str, f64); 7] =
    [("m", 1.0), ("dm", 0.1), ("cm", 0.01), ("mm", 0.001), ("km", 1000.0), ("in", 0.0254), ("ft", 0.3048)];

impl FromStr for Unit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if let Some((_, metres)) = UNITS.iter().find(|(name, _)| *name == text) {
            return Ok(Self(*metres));
        }
        match number(text) {
            Ok(value) if value.is_finite() && value > 0.0 => Ok(Self(value)),
            _ => {
                Err(format!("'{text}' is no unit; write m, cm, mm, ft, in, or metres per unit such as 0.01"))
            }
        }
    }
}

/// A largest circle of confusion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Largest {
    /// Diameter in pixels.
    Pixels(f64),
    /// Diameter as a part of the display window's width, 0 to 1.
    Width(f64),
}

impl FromStr for Largest {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let size = match text.strip_suffix('%') {
            Some(digits) => hundredth(digits).map(Self::Width),
            None => number(text.strip_suffix("px").unwrap_or(text)).ok().map(Self::Pixels),
        };
        match size {
            Some(Self::Pixels(value) | Self::Width(value)) if !(value.is_finite() && value >= 0.0) => None,
            size => size,
        }
        .ok_or_else(|| {
            format!("'{text}' is no size; write pixels such as 40, or a part of the width such as 2%")
        })
    }
}

/// A hundredth of a number, by its digits: rounded once, so that every part of a width has its percentage.
fn hundredth(text: &str) -> Option<f64> {
    let text = text.trim();
    let (digits, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let exponent = exponent.parse::<i32>().ok()?.checked_sub(2)?;
    number(&format!("{digits}e{exponent}")).ok()
}

/// The way back from [`hundredth`].
fn percentage(part: f64) -> String {
    let plain = (100.0 * part).to_string();
    if hundredth(&plain) == Some(part) {
        return plain;
    }
    // Few numbers have no such neighbour.
    let text = format!("{part:e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{digits}e{}", exponent.parse::<i32>().unwrap_or(0) + 2)
}

/// A range of distances in metres, `NEAR,FAR`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range(pub [f64; 2]);

impl FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let ends = text.split_once(',').and_then(|(near, far)| Some([number(near).ok()?, number(far).ok()?]));
        match ends {
            Some([near, far]) if near > 0.0 && near <= far => Ok(Self([near, far])),
            _ => Err(format!(
                "'{text}' is no range; write the nearest and the farthest distance in metres, such as 1.5,3"
            )),
        }
    }
}

/// The aperture's shape: disc, blades:N, image:FILE.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Shape {
    /// A round hole.
    Disc,
    /// So many blades.
    Blades(u32),
    /// A picture of the aperture.
    Image(PathBuf),
}

impl FromStr for Shape {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        match text.split_once(':') {
            None if text == "disc" => Ok(Self::Disc),
            Some(("blades", count)) => {
                let count = count.trim().parse().map_err(|_| format!("'{count}' is no number of blades"))?;
                Aperture::blades(count, 0.0).check().map_err(|error| error.to_string())?;
                Ok(Self::Blades(count))
            }
            Some(("image", file)) if !file.trim().is_empty() => Ok(Self::Image(file.trim().into())),
            _ => Err(format!("'{text}' is no aperture; write disc, blades:6, or image:FILE")),
        }
    }
}

/// Which layers are laid down: result, layer:N, matte:N.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown(pub Show);

impl FromStr for Shown {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (what, number) = text.split_once(':').unwrap_or((text, ""));
        let number = number.trim();
        let shown = match (what.trim(), number.parse()) {
            ("result", _) if number.is_empty() => Some(Show::Result),
            ("layer", Ok(number)) => Some(Show::Layer(number)),
            ("matte", Ok(number)) => Some(Show::Matte(number)),
            _ => None,
        };
        shown.map(Self).ok_or_else(|| {
            format!("'{text}' cannot be shown; write result, or layer:0 or matte:0 with the layer's number from the farthest, 0")
        })
    }
}

/// Names separated by commas, or a list in TOML.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Names(pub Vec<String>);

impl FromStr for Names {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names: Vec<String> =
            text.split(',').map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned).collect();
        if names.is_empty() { Err("no name was given".into()) } else { Ok(Self(names)) }
    }
}

/// A part of an OpenEXR file, by its name or its number from 0, or a name of frames: any text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label(pub String);

impl FromStr for Label {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.is_empty() { Err("the name is empty".into()) } else { Ok(Self(text.to_owned())) }
    }
}

/// Width and height as `1920x1080`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BenchSize(pub Size);

/// Frames above this many pixels are no quick table.
const MOST_PIXELS: usize = 1 << 28;

impl FromStr for BenchSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let size = text.split_once(['x', 'X', '*']).and_then(|(width, height)| {
            Some(Size::new(width.trim().parse().ok()?, height.trim().parse().ok()?))
        });
        match size {
            Some(size) if (1..=MOST_PIXELS).contains(&size.area()) => Ok(Self(size)),
            _ => Err(format!(
                "'{text}' is no size; write width and height such as 1920x1080, up to 16384x16384"
            )),
        }
    }
}

/// Which device renders: `auto`, `cpu`, `gpu` or `gpu:NAME`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DeviceChoice(pub Device);

impl FromStr for DeviceChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.parse().map(Self).map_err(|error: pullfocus::ParseDeviceError| error.to_string())
    }
}

from_text!(Number, Unit, Largest, Range, Shape, Shown, Names, Label, DeviceChoice);

/// Says how a value is written in TOML, so that it reads back as it was.
macro_rules! to_toml {
    ($($name:ty: |$value:ident, $to:ident| $write:expr;)*) => {$(
        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, $to: S) -> Result<S::Ok, S::Error> {
                let $value = self;
                $write
            }
        }
    )*};
}

to_toml! {
    Number: |number, to| pullfocus_core::pull::serialize_plain(&number.0, to);
    Unit: |unit, to| match UNITS.iter().find(|(_, metres)| *metres == unit.0) {
        Some((name, _)) => to.serialize_str(name),
        None => Number(unit.0).serialize(to),
    };
    Largest: |largest, to| match largest {
        Self::Pixels(value) => Number(*value).serialize(to),
        Self::Width(part) => to.serialize_str(&format!("{}%", percentage(*part))),
    };
    Shown: |shown, to| to.serialize_str(&match shown.0 {
        Show::Result => "result".to_owned(),
        Show::Layer(number) => format!("layer:{number}"),
        Show::Matte(number) => format!("matte:{number}"),
    });
    Range: |range, to| range.0.map(Number).serialize(to);
    Shape: |shape, to| match shape {
        Self::Disc => to.serialize_str("disc"),
        Self::Blades(count) => to.serialize_str(&format!("blades:{count}")),
        Self::Image(file) => to.serialize_str(&format!("image:{}", file.display())),
    };
    Names: |names, to| names.0.serialize(to);
    Label: |label, to| to.serialize_str(&label.0);
    DeviceChoice: |choice, to| to.collect_str(&choice.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_units_are_read_as_people_write_them() {
        assert_eq!("40".parse(), Ok(Largest::Pixels(40.0)));
        assert_eq!("40px".parse(), Ok(Largest::Pixels(40.0)));
        assert_eq!("2%".parse(), Ok(Largest::Width(0.02)));
        assert_eq!("2e1 %".parse(), Ok(Largest::Width(0.2)));
        assert_eq!("cm".parse(), Ok(Unit(0.01)));
        assert_eq!("0.25".parse(), Ok(Unit(0.25)));
        assert_eq!("inf".parse(), Ok(Number(f64::INFINITY)));
        assert_eq!("1.5, 3".parse(), Ok(Range([1.5, 3.0])));
        assert_eq!("a, b,".parse(), Ok(Names(vec!["a".into(), "b".into()])));
    }

    #[test]
    fn sizes_to_measure_are_read() {
        assert_eq!("1920x1080".parse(), Ok(BenchSize(Size::new(1920, 1080))));
        for text in ["1920", "0x5", "axb", "99999x99999", "18446744073709551615x2"] {
            assert!(text.parse::<BenchSize>().is_err(), "{text}");
        }
    }

    #[test]
    fn apertures_are_read() {
        assert_eq!("disc".parse(), Ok(Shape::Disc));
        assert_eq!("blades: 6".parse(), Ok(Shape::Blades(6)));
        assert_eq!("image:stars/a:b.png".parse(), Ok(Shape::Image("stars/a:b.png".into())));
        for (text, word) in [
            ("star", "blades:6"),
            ("blades:2", "3 and 32"),
            ("blades:x", "number"),
            ("image: ", "image:FILE"),
        ] {
            assert!(text.parse::<Shape>().unwrap_err().contains(word), "{text}");
        }
    }

    #[test]
    fn what_is_shown_is_read() {
        assert_eq!("result".parse(), Ok(Shown(Show::Result)));
        assert_eq!("layer:0".parse(), Ok(Shown(Show::Layer(0))));
        assert_eq!("matte: 12".parse(), Ok(Shown(Show::Matte(12))));
        for text in ["", "layer", "layer:", "layer:-1", "layer:x", "matte:1.5", "result:1", "3"] {
            assert!(text.parse::<Shown>().unwrap_err().contains("layer:0"), "{text}");
        }
    }

    #[test]
    fn devices_are_read() {
        assert_eq!("gpu:RTX 4090".parse(), Ok(DeviceChoice(Device::Gpu(Some("RTX 4090".into())))));
        assert_eq!("cpu".parse(), Ok(DeviceChoice(Device::Cpu)));
        assert!("gpu0".parse::<DeviceChoice>().unwrap_err().contains("gpu:NAME"));
    }

    #[test]
    fn nonsense_is_refused_with_an_example() {
        for (text, error) in [("3,1", "1.5,3"), ("4", "1.5,3"), ("nan,2", "1.5,3")] {
            assert!(text.parse::<Range>().unwrap_err().contains(error), "{text}");
        }
        for text in ["-1", "-1%", "inf%", "nan%", "1e400%", "1e-99999999999%", "%", "e%"] {
            assert!(text.parse::<Largest>().unwrap_err().contains("2%"), "{text}");
        }
        assert!("furlong".parse::<Unit>().unwrap_err().contains("metres per unit"));
        assert!("nan".parse::<Number>().is_err());
    }
}
