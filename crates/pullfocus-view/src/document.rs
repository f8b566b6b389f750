//! What the user makes: a shot, and a second take to look at beside it. The shot is a settings file in memory, so that what is saved
//! renders to the pixels that were seen.

use crate::clip::Plate;
use crate::engine::Take;
use pullfocus_core::Lens;
use pullfocus_core::pull::{Easing, Key};
use pullfocus_job::camera::{self, ASSUMED, Attribute, FileCamera, Resolved};
use pullfocus_job::config::Options;
use pullfocus_job::values::Number;
use pullfocus_job::{settings, shot};

/// Quantities of a lens that have keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// In metres from the entrance pupil.
    FocusDistance,
    /// f-number.
    FStop,
    /// In millimetres.
    FocalLength,
}

/// The shot (take A) and the take beside it (B).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Document {
    /// The takes. Files and depth are the first one's.
    pub takes: [Options; 2],
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::FocusDistance, Self::FStop, Self::FocalLength];
}

impl Document {
    /// Both takes from the same options.
    pub fn new(options: Options) -> Self {
        Self { takes: [options.clone(), options] }
    }

    /// The shot.
    pub fn shot(&self) -> &Options {
        &self.takes[0]
    }

    /// The lens of a take at a frame.
    ///
    /// # Errors
    /// One sentence: a lens that cannot be.
    pub fn lens(&self, side: usize, plate: &Plate, frame: i64) -> Result<Resolved, String> {
        let options = &self.takes[side];
        let lens = shot::lens_at(&options.lens, &options.keys, Some(frame));
        let name = crate::clip::file_name(&plate.path);
        camera::resolve(&lens, &plate.found, &name).map_err(|failure| failure.to_string())
    }

    /// The values of a take's lens at a frame, be it a lens or not: what the file says where nobody gives another.
    pub fn values(&self, side: usize, plate: &Plate, frame: i64) -> LensValues {
        if let Ok(resolved) = self.lens(side, plate, frame) {
            return LensValues::of(&resolved);
        }
        let options = &self.takes[side];
        let lens = shot::lens_at(&options.lens, &options.keys, Some(frame));
        let found = &plate.found;
        let one = |given: Option<Number>, found: &Option<Attribute>| {
            given.map(|given| given.0).or(found.as_ref().map(|found| found.value))
        };
        let f_stop = one(lens.f_stop, &found.f_stop);
        LensValues {
            focus_m: one(lens.focus_distance, &found.focus_distance).unwrap_or(1.0),
            f_stop: f_stop.filter(|_| lens.aperture_diameter.is_none()),
            focal_mm: one(lens.focal_length, &found.focal_length),
            sensor_mm: one(lens.sensor_width, &found.sensor_width),
            fov_degrees: one(lens.fov_x, &found.fov_x),
        }
    }

    /// What is to be rendered for a take at a frame.
    ///
    /// # Errors
    /// One sentence: a lens or settings that cannot be.
    pub fn take(&self, side: usize, plate: &Plate, frame: i64) -> Result<Take, String> {
        let options = &self.takes[side];
        let settings = settings::settings(&options.blur, &options.circle, &self.takes[0].depth)
            .map_err(|failure| failure.to_string())?;
        let camera = if plate.has_coc { None } else { Some(self.lens(side, plate, frame)?.camera) };
        Ok(Take { camera, settings })
    }

    /// Whether a quantity of a take moves by keys.
    pub fn is_keyed(&self, side: usize, quantity: Quantity) -> bool {
        self.takes[side].keys.keys().iter().any(|key| of(key, quantity).is_some())
    }

    /// Changes a quantity: by a key at this frame where it has keys, else for the whole shot.
    ///
    /// # Errors
    /// One sentence: a value that no lens has.
    pub fn set(&mut self, side: usize, quantity: Quantity, value: f64, frame: i64) -> Result<(), String> {
        if self.is_keyed(side, quantity) {
            return self.set_key(side, with(quantity, value), frame);
        }
        let lens = &mut self.takes[side].lens;
        let value = Some(Number(value));
        match quantity {
            Quantity::FocusDistance => lens.focus_distance = value,
            Quantity::FStop => {
                lens.f_stop = value;
                // Both say how wide the aperture is.
                lens.aperture_diameter = None;
            }
            Quantity::FocalLength => {
                lens.focal_length = value;
                if lens.sensor_width.is_some() {
                    lens.fov_x = None;
                }
            }
        }
        Ok(())
    }

    /// Sets values of a key, whose easing stays as it was if it was there.
    ///
    /// # Errors
    /// One sentence: a value that no lens has.
    pub fn set_key(&mut self, side: usize, key: Key, frame: i64) -> Result<(), String> {
        let keys = &mut self.takes[side].keys;
        let frame = frame as f64;
        let easing = keys.keys().iter().find(|known| known.frame == frame).map(|known| known.easing);
        keys.set(Key { frame, easing: easing.unwrap_or_default(), ..key }).map_err(|error| error.to_string())
    }

    /// Keys the lens of a take as it is at a frame: whatever has keys already, and the focus in any case.
    ///
    /// # Errors
    /// As [`Document::set_key`].
    pub fn key_here(&mut self, side: usize, plate: &Plate, frame: i64) -> Result<(), String> {
        let values = LensValues::of(&self.lens(side, plate, frame)?);
        let key = Key {
            focus_distance_m: Some(values.focus_m),
            f_stop: values.f_stop.filter(|_| self.is_keyed(side, Quantity::FStop)),
            focal_length_mm: values.focal_mm.filter(|_| self.is_keyed(side, Quantity::FocalLength)),
            ..Key::default()
        };
        self.set_key(side, key, frame)
    }

    /// Gives a quantity its first key, or takes all of its keys away and leaves its value here.
    ///
    /// # Errors
    /// As [`Document::set_key`].
    pub fn toggle_keyed(
        &mut self,
        side: usize,
        quantity: Quantity,
        value: f64,
        frame: i64,
    ) -> Result<(), String> {
        if !self.is_keyed(side, quantity) {
            return self.set_key(side, with(quantity, value), frame);
        }
        let keys: Vec<Key> = std::mem::take(&mut self.takes[side].keys).into();
        let left = keys.into_iter().map(|mut key| {
            match quantity {
                Quantity::FocusDistance => key.focus_distance_m = None,
                Quantity::FStop => key.f_stop = None,
                Quantity::FocalLength => key.focal_length_mm = None,
            }
            key
        });
        let says = |key: &Key| Quantity::ALL.iter().any(|&quantity| of(key, quantity).is_some());
        self.takes[side].keys = pullfocus_core::pull::Pull::new(left.filter(says).collect())
            .map_err(|error| error.to_string())?;
        self.set(side, quantity, value, frame)
    }

    /// Moves a key to another frame, over one that is there.
    pub fn move_key(&mut self, side: usize, from: f64, to: f64) {
        let keys = &mut self.takes[side].keys;
        if from != to
            && let Some(key) = keys.remove(from)
        {
            keys.remove(to);
            // The key was in range before, and its frame is a number.
            let _ = keys.set(Key { frame: to, ..key });
        }
    }

    /// How a key goes on to the next one.
    pub fn set_easing(&mut self, side: usize, frame: f64, easing: Easing) {
        let keys = &mut self.takes[side].keys;
        if let Some(key) = keys.keys().iter().find(|key| key.frame == frame).copied() {
            let _ = keys.set(Key { easing, ..key });
        }
    }

    /// Takes a key away.
    pub fn remove_key(&mut self, side: usize, frame: f64) {
        self.takes[side].keys.remove(frame);
    }
}

/// Takes what was assumed about a lens as given, so that a shot that is saved says it.
pub fn keep_assumed(lens: &mut pullfocus_job::options::Lens, found: &FileCamera) {
    let keep = |slot: &mut Option<Number>, found: &Option<Attribute>| {
        if slot.is_none()
            && let Some(found) = found.as_ref().filter(|found| found.from == ASSUMED)
        {
            *slot = Some(Number(found.value));
        }
    };
    keep(&mut lens.focus_distance, &found.focus_distance);
    if lens.aperture_diameter.is_none() {
        keep(&mut lens.f_stop, &found.f_stop);
    }
    if lens.fov_x.is_none() || lens.focal_length.is_none() {
        keep(&mut lens.sensor_width, &found.sensor_width);
    }
    if lens.fov_x.is_none() || lens.sensor_width.is_none() {
        keep(&mut lens.focal_length, &found.focal_length);
    }
}

/// A key of one value.
fn with(quantity: Quantity, value: f64) -> Key {
    let value = Some(value);
    match quantity {
        Quantity::FocusDistance => Key { focus_distance_m: value, ..Key::default() },
        Quantity::FStop => Key { f_stop: value, ..Key::default() },
        Quantity::FocalLength => Key { focal_length_mm: value, ..Key::default() },
    }
}

/// What a key says of a quantity.
pub fn of(key: &Key, quantity: Quantity) -> Option<f64> {
    match quantity {
        Quantity::FocusDistance => key.focus_distance_m,
        Quantity::FStop => key.f_stop,
        Quantity::FocalLength => key.focal_length_mm,
    }
}

/// A lens's values, as far as it has them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LensValues {
    /// In metres from the entrance pupil.
    pub focus_m: f64,
    /// f-number.
    pub f_stop: Option<f64>,
    /// In millimetres.
    pub focal_mm: Option<f64>,
    /// In millimetres.
    pub sensor_mm: Option<f64>,
    /// In degrees, where the field of view is what the file says.
    pub fov_degrees: Option<f64>,
}

impl LensValues {
    /// From what was resolved.
    pub fn of(resolved: &Resolved) -> Self {
        let value =
            |name: &str| resolved.values.iter().find(|value| value.name == name).map(|value| value.value);
        let mut values = Self {
            focus_m: resolved.camera.focus_distance_m(),
            f_stop: value("f-stop"),
            focal_mm: value("focal length"),
            sensor_mm: value("sensor width"),
            fov_degrees: value("field of view"),
        };
        if let Lens::Physical { focal_length_mm, f_stop, sensor_width_mm } = resolved.camera.lens() {
            values.focal_mm = Some(focal_length_mm);
            values.f_stop = Some(f_stop);
            values.sensor_mm = Some(sensor_width_mm);
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_shots_until_it_has_keys() {
        let mut document = Document::default();
        document.set(0, Quantity::FocusDistance, 2.0, 1).unwrap();
        assert_eq!(document.shot().lens.focus_distance, Some(Number(2.0)));
        document.toggle_keyed(0, Quantity::FocusDistance, 2.0, 1).unwrap();
        document.set(0, Quantity::FocusDistance, 4.0, 11).unwrap();
        assert_eq!(document.shot().keys.keys().len(), 2);
        assert_eq!(document.shot().lens.focus_distance, Some(Number(2.0)));
        document.set_easing(0, 1.0, Easing::Linear);
        let middle = document.shot().keys.at(6.0).focus_distance_m.unwrap();
        assert!((middle - 8.0 / 3.0).abs() < 1e-12, "{middle}");
        document.move_key(0, 11.0, 21.0);
        assert_eq!(document.shot().keys.keys()[1].frame, 21.0);
        assert!(document.set(0, Quantity::FocusDistance, -1.0, 5).is_err());
        document.toggle_keyed(0, Quantity::FocusDistance, 3.0, 5).unwrap();
        assert!(document.shot().keys.is_empty());
        assert_eq!(document.shot().lens.focus_distance, Some(Number(3.0)));
    }
}
