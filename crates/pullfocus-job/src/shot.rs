//! A shot: a settings file with keys, between which the lens moves from frame to frame.

use crate::camera::CameraValue;
use crate::failure::{Failure, Result};
use crate::frames::FrameFiles;
use crate::options::Lens;
use crate::values::Number;
use pullfocus_core::pull::{Key, Moment, Pull};
use pullfocus_io::sequence::Frames;

/// Takes away from a file's keys what `flags` say for the whole shot; keys that say nothing any more are gone.
pub fn under(file: Pull, flags: &Lens) -> Pull {
    let Lens { focus_distance, f_stop, focal_length, aperture_diameter, .. } = flags;
    let keys = Vec::from(file).into_iter().map(|key: Key| Key {
        focus_distance_m: key.focus_distance_m.filter(|_| focus_distance.is_none()),
        f_stop: key.f_stop.filter(|_| f_stop.is_none() && aperture_diameter.is_none()),
        focal_length_mm: key.focal_length_mm.filter(|_| focal_length.is_none()),
        ..key
    });
    saying(keys)
}

/// The keys that say anything.
fn saying(keys: impl Iterator<Item = Key>) -> Pull {
    let says =
        |key: &Key| key.focus_distance_m.is_some() || key.f_stop.is_some() || key.focal_length_mm.is_some();
    // The frames are as they were, so nothing can be refused.
    Pull::new(keys.filter(says).collect()).unwrap_or_default()
}

/// Whether keys say how long the lens is.
pub fn has_focal_length(keys: &Pull) -> bool {
    keys.keys().iter().any(|key| key.focal_length_mm.is_some())
}

/// The keys without how long the lens is; those that say nothing any more are gone.
pub fn without_focal_length(keys: Pull) -> Pull {
    saying(Vec::from(keys).into_iter().map(|key: Key| Key { focal_length_mm: None, ..key }))
}

/// Refuses keys that do not go with the rest.
///
/// # Errors
/// [`Failure::Usage`].
pub fn check(keys: &Pull, lens: &Lens, frames: &[FrameFiles]) -> Result<()> {
    if keys.is_empty() {
        return Ok(());
    }
    if let Some(frame) = frames.iter().find(|frame| frame.number.is_none()) {
        return Err(Failure::usage(format!(
            "the lens has keys at frames, and {} is no frame with a number; name a sequence (shot.####.exr), hold the picture \
             for some frames (--frames 1-48 -o out.####.exr), or take the keys out",
            frame.name()
        )));
    }
    check_lens(keys, lens)
}

/// Refuses keys that say of the lens what is said already.
///
/// # Errors
/// [`Failure::Usage`].
pub fn check_lens(keys: &Pull, lens: &Lens) -> Result<()> {
    if lens.aperture_diameter.is_some() && keys.keys().iter().any(|key| key.f_stop.is_some()) {
        return Err(Failure::usage(
            "aperture-diameter and the keys' f-stop both say how wide the aperture is; give one of them",
        ));
    }
    if lens.fov_x.is_some() && lens.sensor_width.is_some() && has_focal_length(keys) {
        return Err(Failure::usage(
            "fov-x, sensor-width and the keys' focal-length say one thing twice; give two of them at most",
        ));
    }
    Ok(())
}

/// The frames from the first key to the last; none without keys.
///
/// # Errors
/// [`Failure::Usage`] where these are too many, or no frame's number.
pub fn span(keys: &Pull) -> Result<Option<Frames>> {
    let (Some(first), Some(last)) = (keys.keys().first(), keys.keys().last()) else { return Ok(None) };
    Ok(Some(format!("{:.0}-{:.0}", first.frame.floor(), last.frame.ceil()).parse::<Frames>()?))
}

/// Whether a frame lies between the first key and the last, so that a name with its number may well be that frame's.
pub fn covers(keys: &Pull, frame: i64) -> bool {
    match (keys.keys().first(), keys.keys().last()) {
        (Some(first), Some(last)) => (first.frame.floor()..=last.frame.ceil()).contains(&(frame as f64)),
        _ => false,
    }
}

/// What the keys say at a frame; nothing without a number.
fn moment(keys: &Pull, frame: Option<i64>) -> Moment {
    frame.map_or(Moment::default(), |frame| keys.at(frame as f64))
}

/// The lens at a frame: keys, and the options where these say nothing.
pub fn lens_at(lens: &Lens, keys: &Pull, frame: Option<i64>) -> Lens {
    let Moment { focus_distance_m, f_stop, focal_length_mm } = moment(keys, frame);
    Lens {
        focus_distance: focus_distance_m.map(Number).or(lens.focus_distance),
        f_stop: f_stop.map(Number).or(lens.f_stop),
        focal_length: focal_length_mm.map(Number).or(lens.focal_length),
        ..lens.clone()
    }
}

/// Says of the values that come from keys that they do.
pub fn name_keyed(values: &mut [CameraValue], keys: &Pull, frame: Option<i64>) {
    let Moment { focus_distance_m, f_stop, focal_length_mm } = moment(keys, frame);
    let from = frame.map_or(String::new(), |frame| format!("keys at frame {frame}"));
    for (name, keyed) in
        [("focus distance", focus_distance_m), ("f-stop", f_stop), ("focal length", focal_length_mm)]
    {
        if keyed.is_some() {
            values
                .iter_mut()
                .filter(|value| value.name == name)
                .for_each(|value| value.from.clone_from(&from));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull() -> Pull {
        let key = |frame, focus_distance_m, f_stop| Key { frame, focus_distance_m, f_stop, ..Key::default() };
        Pull::new(vec![key(1.0, Some(2.0), None), key(3.0, None, Some(2.8)), key(5.0, Some(4.0), None)])
            .unwrap()
    }

    #[test]
    fn flags_take_the_place_of_keys() {
        let flags = Lens { focus_distance: Some(Number(9.0)), ..Lens::default() };
        let left = under(pull(), &flags);
        assert_eq!(left.keys().len(), 1);
        let lens = lens_at(&flags, &left, Some(5));
        assert_eq!((lens.focus_distance, lens.f_stop), (Some(Number(9.0)), Some(Number(2.8))));
        let wide = Lens { aperture_diameter: Some(Number(0.01)), ..Lens::default() };
        assert!(under(pull(), &wide).keys().iter().all(|key| key.f_stop.is_none()));
        assert_eq!(under(pull(), &Lens::default()), pull());
    }

    #[test]
    fn the_lens_moves_with_the_frames() {
        let lens = Lens { focal_length: Some(Number(50.0)), ..Lens::default() };
        let at = |frame| lens_at(&lens, &pull(), frame);
        assert_eq!(at(Some(1)).focus_distance, Some(Number(2.0)));
        let Some(Number(middle)) = at(Some(3)).focus_distance else { panic!("a focus") };
        assert!((middle - 8.0 / 3.0).abs() < 1e-12);
        assert_eq!((at(Some(3)).focal_length, at(None).focus_distance), (Some(Number(50.0)), None));
    }

    #[test]
    fn keys_need_numbers() {
        let frame = |number| FrameFiles { number, input: Some("a.exr".into()), ..FrameFiles::default() };
        let said = check(&pull(), &Lens::default(), &[frame(Some(1)), frame(None)]).unwrap_err().to_string();
        assert!(said.contains("a.exr") && said.contains("--frames 1-48"), "{said}");
        assert!(check(&pull(), &Lens::default(), &[frame(Some(1))]).is_ok());
        assert!(check(&Pull::default(), &Lens::default(), &[frame(None)]).is_ok());
        let wide = Lens { aperture_diameter: Some(Number(0.01)), ..Lens::default() };
        assert!(check(&pull(), &wide, &[frame(Some(1))]).is_err());
        let angle = Lens { fov_x: Some(Number(30.0)), sensor_width: Some(Number(36.0)), ..Lens::default() };
        let zoom = vec![Key { frame: 1.0, focal_length_mm: Some(50.0), ..Key::default() }];
        let said = check(&Pull::new(zoom).unwrap(), &angle, &[frame(Some(1))]).unwrap_err().to_string();
        assert!(said.contains("the keys' focal-length"), "{said}");
        assert!(check(&pull(), &angle, &[frame(Some(1))]).is_ok());
    }
}
