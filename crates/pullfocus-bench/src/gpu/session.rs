//! The device that is measured, and how long each case may take.

use anyhow::Result;
use pullfocus::{Cancel, Diffusion, Error, Plane, Size};
use pullfocus_gpu::{Host, Storage, Timing};
use std::collections::HashMap;
use std::time::{Duration, Instant};

/// Seconds of rounds that a case aims at.
const CASE_SECONDS: f64 = 0.3;
/// A case has at least as many rounds, if they do not take seconds.
const LEAST_ROUNDS: usize = 3;

/// A measurement, or why there is none.
pub type Measured<T> = std::result::Result<T, String>;

/// A device and its time.
pub struct Session {
    pub host: Host,
    pub software: bool,
    pub quick: bool,
    /// Whether times come from the device's clock; known after the first.
    pub by_device: Option<bool>,
    rounds: usize,
    largest: Size,
    deadline: Instant,
    pace: Pace,
    copies: HashMap<u64, f64>,
}

/// How long things took so far, to tell how many rounds the next one gets.
#[derive(Debug, Default)]
struct Pace(HashMap<String, f64>);

impl Pace {
    /// Rounds for something that has taken so long for each unit, or has not run yet.
    fn rounds(&self, label: &str, units: f64, most: usize) -> usize {
        let Some(each) = self.0.get(label) else { return LEAST_ROUNDS.min(most) };
        let least = if each * units > 1.0 { 1 } else { LEAST_ROUNDS };
        ((CASE_SECONDS / (each * units).max(1e-9)).round() as usize).clamp(least.min(most), most)
    }
}

/// A diffusion to time.
pub struct Case<'a> {
    /// What has the same cost for each unknown: solver, integrator, storage.
    pub label: &'a str,
    pub planes: &'a [Plane],
    pub circle: &'a Plane,
    pub settings: &'a Diffusion,
    pub storage: Storage,
}

/// A timed diffusion.
#[derive(Debug, Clone)]
pub struct Run {
    pub seconds: f64,
    pub bytes: u64,
    /// Seconds of a copy of the same bytes.
    pub copy: f64,
    /// The planes after one diffusion.
    pub planes: Vec<Plane>,
}

impl Session {
    pub fn new(host: Host, (rounds, largest, quick): (usize, Size, bool), limit: Duration) -> Self {
        let software = crate::adapter::is_software(host.info());
        Self {
            host,
            software,
            quick,
            by_device: None,
            rounds,
            largest,
            deadline: Instant::now() + limit,
            pace: Pace::default(),
            copies: HashMap::new(),
        }
    }

    /// Whether pictures of this size are measured, and there is time.
    pub fn may(&self, size: Size) -> Measured<()> {
        if size.width > self.largest.width || size.height > self.largest.height {
            return Err(format!("left out: larger than {}", self.largest));
        }
        if Instant::now() > self.deadline {
            return Err("left out: the time was up".into());
        }
        Ok(())
    }

    /// A size of the tables; a sixteenth of it in a quick run.
    pub fn size(&self, width: usize, height: usize) -> Size {
        let part = if self.quick { 16 } else { 1 };
        Size::new(width / part, height / part)
    }

    /// Times a diffusion beside a copy of as many bytes.
    pub fn diffusion(&mut self, case: &Case<'_>) -> Result<Measured<Run>> {
        if let Err(why) = self.may(case.circle.size()) {
            return Ok(Err(why));
        }
        let units = (case.circle.size().area() * case.planes.len()) as f64;
        let count = self.pace.rounds(case.label, units, self.rounds);
        self.host.set_storage(case.storage);
        let timed = self.host.time_diffusion(case.planes, case.circle, case.settings, count, &Cancel::new());
        let (timing, planes) = match refused(timed)? {
            Ok(timed) => timed,
            Err(why) => return Ok(Err(why)),
        };
        let seconds = self.note(case.label, units, &timing);
        let bytes = timing.bytes;
        Ok(match self.copy(bytes)? {
            Ok(copy) => Ok(Run { seconds, bytes, copy, planes }),
            Err(why) => Err(why),
        })
    }

    /// Times a frame; seconds, stages, and bytes of device memory.
    pub fn frame(
        &mut self,
        label: &str,
        size: Size,
        storage: Storage,
        run: impl FnOnce(&mut Host, usize) -> pullfocus::Result<(Timing, u64)>,
    ) -> Result<Measured<(f64, Timing, u64)>> {
        if let Err(why) = self.may(size) {
            return Ok(Err(why));
        }
        let units = size.area() as f64;
        let count = self.pace.rounds(label, units, self.rounds);
        self.host.set_storage(storage);
        let timed = refused(run(&mut self.host, count))?;
        Ok(timed.map(|(timing, bytes)| (self.note(label, units, &timing), timing, bytes)))
    }

    fn note(&mut self, label: &str, units: f64, timing: &Timing) -> f64 {
        let seconds = timing.median().as_secs_f64();
        self.pace.0.insert(label.to_owned(), seconds / units);
        self.by_device = Some(timing.by_device);
        seconds
    }

    fn copy(&mut self, bytes: u64) -> Result<Measured<f64>> {
        if let Some(&seconds) = self.copies.get(&bytes) {
            return Ok(Ok(seconds));
        }
        let count = self.pace.rounds("copy", bytes as f64, self.rounds);
        let timing = match refused(self.host.time_copy(bytes, count, &Cancel::new()))? {
            Ok(timing) => timing,
            Err(why) => return Ok(Err(why)),
        };
        // Whole vectors are copied, so some bytes more than asked for.
        let seconds = self.note("copy", bytes as f64, &timing) * bytes as f64 / timing.bytes.max(1) as f64;
        self.copies.insert(bytes, seconds);
        Ok(Ok(seconds))
    }
}

/// What the device has no room for is a row of its table; other errors end the command.
pub fn refused<T>(result: pullfocus::Result<T>) -> Result<Measured<T>> {
    match result {
        Ok(value) => Ok(Ok(value)),
        Err(error @ (Error::DeviceLimit { .. } | Error::OutOfMemory { .. } | Error::Unsupported { .. })) => {
            Ok(Err(format!("did not fit: {error}")))
        }
        Err(error) => Err(error.into()),
    }
}

/// "f32" or "f16".
pub fn storage_name(storage: Storage) -> &'static str {
    match storage {
        Storage::Full => "f32",
        Storage::Half => "f16",
    }
}

/// Milliseconds with three digits that count.
pub fn ms(seconds: f64) -> String {
    let ms = seconds * 1e3;
    if ms >= 100.0 {
        format!("{ms:.0}")
    } else if ms >= 10.0 {
        format!("{ms:.1}")
    } else if ms >= 1.0 {
        format!("{ms:.2}")
    } else {
        format!("{ms:.3}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_follow_what_was_measured() {
        let mut pace = Pace::default();
        assert_eq!(pace.rounds("a", 1e6, 20), 3);
        pace.0.insert("a".into(), 1e-9);
        // 1 ms: all; 0.025 s: twelve; 0.5 s: the least; 5 s: one.
        assert_eq!([1e6, 2.5e7, 5e8, 5e9].map(|units| pace.rounds("a", units, 20)), [20, 12, 3, 1]);
        assert_eq!(pace.rounds("a", 5e8, 1), 1);
    }

    #[test]
    fn what_does_not_fit_is_a_row() {
        let no_memory = || Error::OutOfMemory { what: "a plane", size: Size::new(9, 9), bytes: 9 };
        assert!(refused::<()>(Err(no_memory())).unwrap().unwrap_err().starts_with("did not fit: not enough"));
        assert!(refused::<()>(Err(Error::Cancelled)).is_err());
        assert_eq!(refused(Ok(5)).unwrap(), Ok(5));
    }

    #[test]
    fn milliseconds_have_three_digits() {
        assert_eq!([0.1234, 0.01234, 0.001234, 0.0001234].map(ms), ["123", "12.3", "1.23", "0.123"]);
    }
}
