//! The render thread.

use super::compare::{self, Comparison};
use super::cpu::CpuBlur;
use super::gpu::GpuBlur;
use super::{Ask, Inbox, OnDevice, Probe, Shared, Shown, Take};
use crate::clip::Plate;
use crate::locked::lock;
use crate::screen::{self, Texture};
use eframe::wgpu;
use pullfocus_core::{Error, Layering, Method, Report, Settings, Size};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What takes longer is not done while a hand moves.
const AT_ONCE: Duration = Duration::from_millis(20);

/// What a device makes of a take.
pub struct Made {
    pub texture: Texture,
    pub reduced: usize,
    pub report: Report,
}

pub struct Worker {
    shared: Arc<Shared>,
    gpu: Option<GpuBlur>,
    gpu_name: String,
    /// What the GPU could not do, and why: it is not asked again.
    refused: Option<(Size, Method, Layering, String)>,
    cpu: CpuBlur,
    device: (wgpu::Device, wgpu::Queue),
    serial: u64,
    /// What was open when the work began.
    opened: u64,
    /// How long it took to look at distances through another lens.
    looking: Duration,
}

/// Whether another device may do what this one could not.
fn is_devices(error: &Error) -> bool {
    matches!(
        error,
        Error::DeviceLimit { .. }
            | Error::OutOfMemory { .. }
            | Error::DeviceLost { .. }
            | Error::Unsupported { .. }
    )
}

impl Worker {
    pub fn new(
        shared: &Arc<Shared>,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        on_gpu: bool,
        gpu_name: &str,
    ) -> Self {
        Self {
            shared: Arc::clone(shared),
            gpu: on_gpu.then(|| GpuBlur::new(device, queue)),
            gpu_name: gpu_name.to_owned(),
            refused: None,
            cpu: CpuBlur::new(device, queue),
            device: (device.clone(), queue.clone()),
            serial: 0,
            opened: 0,
            looking: Duration::ZERO,
        }
    }

    pub fn run(mut self) {
        loop {
            let shared = Arc::clone(&self.shared);
            let mut inbox = lock(&shared.inbox);
            while !inbox.quit && inbox.probe.is_none() && inbox.serial == self.serial {
                inbox = shared.wake.wait(inbox).unwrap_or_else(std::sync::PoisonError::into_inner);
            }
            if inbox.quit {
                return;
            }
            let probe = inbox.probe.take();
            let ask = (inbox.serial != self.serial).then(|| inbox.ask.clone());
            (self.serial, self.opened) = (inbox.serial, inbox.opened);
            if ask.is_some() {
                shared.cancel.reset();
            }
            drop(inbox);
            if let Some(ask) = ask {
                if let Some(ask) = ask {
                    self.answer(&ask);
                }
                // The inbox first, as everywhere.
                let inbox = lock(&shared.inbox);
                lock(&shared.state).busy = inbox.serial != self.serial && !inbox.quit;
            }
            if let Some(probe) = probe {
                self.look_at(probe);
            }
            shared.ctx.request_repaint();
        }
    }

    /// Whether nothing newer was asked for.
    fn is_current(&self) -> bool {
        let Inbox { serial, quit, .. } = *lock(&self.shared.inbox);
        serial == self.serial && !quit
    }

    fn answer(&mut self, ask: &Ask) {
        lock(&self.shared.state).fault = None;
        if let Err(error) = self.bring(&ask.plate) {
            lock(&self.shared.state).fault = Some(error.to_string());
            return;
        }
        // First a picture soon, then a fine one.
        for fine in [false, true] {
            for side in 0..ask.takes.len() {
                let Some(take) = &ask.takes[side] else {
                    // It is looked at again at once when the eye goes back and forth.
                    let shown = &mut lock(&self.shared.state).shown[side];
                    *shown = shown.take().filter(|shown| Arc::ptr_eq(&shown.plate, &ask.plate));
                    continue;
                };
                if !self.side(ask, side, take, fine) {
                    return;
                }
            }
            if !fine && let Err(error) = self.look_through(ask) {
                lock(&self.shared.state).fault = Some(error.to_string());
                return;
            }
            if ask.hurry {
                return;
            }
        }
        self.compare(ask);
    }

    /// Looks at distances through the lens of now, once there is its picture; when the hand is at rest, where that takes longer.
    fn look_through(&mut self, ask: &Ask) -> Result<(), Error> {
        let Some(half_width) = ask.half_width.filter(|_| !ask.hurry || self.looking <= AT_ONCE) else {
            return Ok(());
        };
        let start = Instant::now();
        if ask.plate.look_through(half_width)? {
            self.looking = start.elapsed();
            tracing::debug!(milliseconds = 1e3 * self.looking.as_secs_f64(), "distances");
        }
        self.bring(&ask.plate)
    }

    /// Brings a frame to the device, to be looked at as it is.
    fn bring(&self, plate: &Arc<Plate>) -> Result<(), Error> {
        let known = lock(&self.shared.state).frame.clone();
        let known = known.filter(|known| Arc::ptr_eq(&known.plate, plate));
        let seen = plate.distances();
        if known.as_ref().is_some_and(|known| Arc::ptr_eq(&known.seen, &seen)) {
            return Ok(());
        }
        let (device, queue) = &self.device;
        let frame = OnDevice {
            plate: Arc::clone(plate),
            pinhole: match known {
                Some(known) => known.pinhole.clone(),
                None => screen::from_picture(device, queue, &*plate.in_focus()?)?,
            },
            distances: screen::distances(device, queue, &seen.plane, None)?,
            seen,
        };
        lock(&self.shared.state).frame = Some(Arc::new(frame));
        self.shared.ctx.request_repaint();
        Ok(())
    }

    /// Renders one side; false if the rest is not worth doing.
    fn side(&mut self, ask: &Ask, side: usize, take: &Take, fine: bool) -> bool {
        let known = lock(&self.shared.state).shown[side].clone();
        let known = known.filter(|known| known.is_of(&ask.plate, take));
        let on_gpu = self.on_gpu(&ask.plate, take);
        let reduced = if fine || on_gpu { 1 } else { self.cpu.reduction(&ask.plate, take) };
        if known.is_some_and(|known| known.reduced <= reduced) {
            return true;
        }
        let start = Instant::now();
        match self.render(&ask.plate, take, (reduced, fine)) {
            Ok((made, device)) => {
                let Made { texture, reduced, report } = made;
                let shown = Shown {
                    plate: Arc::clone(&ask.plate),
                    take: take.clone(),
                    texture,
                    reduced,
                    report,
                    time: start.elapsed(),
                    device,
                };
                let milliseconds = 1e3 * shown.time.as_secs_f64();
                tracing::debug!(milliseconds, reduced, "picture");
                // Another file may have been opened meanwhile: its pictures come alone. Another frame is no reason, else nothing would
                // be seen of a shot that plays faster than it is rendered.
                let inbox = lock(&self.shared.inbox);
                if inbox.opened != self.opened {
                    return false;
                }
                let mut state = lock(&self.shared.state);
                state.shown[side] = Some(Arc::new(shown));
                state.count += 1;
            }
            Err(Error::Cancelled) => return false,
            Err(error) => {
                lock(&self.shared.state).fault = Some(error.to_string());
                return false;
            }
        }
        self.shared.ctx.request_repaint();
        // Both sides come soon, even while something newer is asked for all the time.
        !fine || self.is_current()
    }

    fn on_gpu(&self, plate: &Plate, take: &Take) -> bool {
        self.gpu.is_some()
            && take.settings.method.expect_on_gpu().is_ok()
            && self.refusal(plate, take).is_none()
    }

    /// Why the GPU cannot do this, where it was asked before.
    fn refusal(&self, plate: &Plate, take: &Take) -> Option<String> {
        let Settings { method, layering, .. } = &take.settings;
        let is_this = |(size, known, layers, _): &&(Size, Method, Layering, String)| {
            *size == plate.size() && known == method && layers == layering
        };
        self.refused.as_ref().filter(is_this).map(|(.., note)| note.clone())
    }

    fn render(
        &mut self,
        plate: &Arc<Plate>,
        take: &Take,
        (reduced, fine): (usize, bool),
    ) -> Result<(Made, String), Error> {
        let mut note = self.refusal(plate, take);
        if let Some(gpu) = self.gpu.as_mut().filter(|_| note.is_none()) {
            match gpu.render(plate, take) {
                Ok(made) => {
                    lock(&self.shared.state).note = None;
                    return Ok((made, self.gpu_name.clone()));
                }
                Err(error) if is_devices(&error) => {
                    let text = format!("on the CPU, not on {}: {error}", self.gpu_name);
                    let Settings { method, layering, .. } = take.settings;
                    self.refused = Some((plate.size(), method, layering, text.clone()));
                    note = Some(text);
                    if matches!(error, Error::DeviceLost { .. }) {
                        self.gpu = None;
                    }
                }
                Err(error) => return Err(error),
            }
        }
        lock(&self.shared.state).note = note;
        // What is shown soon is finished even if something newer was asked for: while a hand moves, something newer always
        // was, and nothing would ever be seen.
        let never = pullfocus_core::Cancel::new();
        let cancel = if fine { &self.shared.cancel } else { &never };
        Ok((self.cpu.render(plate, take, reduced, cancel)?, "CPU".into()))
    }

    fn look_at(&self, probe: Probe) {
        let shown = lock(&self.shared.state).shown[probe.side.min(1)].clone();
        let Some(shown) = shown else { return };
        let (full, size) = (shown.plate.size(), shown.texture.size);
        let at = |at: usize, full: usize, size: usize| (at * size / full.max(1)).min(size.saturating_sub(1));
        let place = [at(probe.at[0], full.width, size.width), at(probe.at[1], full.height, size.height)];
        match compare::texels(&self.device.0, &self.device.1, &shown.texture, place, [1, 1]) {
            Ok(texels) => lock(&self.shared.state).probed = Some((probe, texels[0])),
            Err(error) => tracing::debug!(%error, "a pixel could not be read"),
        }
    }

    /// Begins to compare take A with the reference, beside this thread.
    fn compare(&self, ask: &Ask) {
        let shared = Arc::clone(&self.shared);
        let shown = lock(&shared.state).shown[0].clone();
        let (Some(reference), Some(shown)) = (&ask.reference, shown) else {
            lock(&shared.state).comparison = None;
            return;
        };
        let known = lock(&shared.state).comparison.clone();
        if known.is_some_and(|known| known.is_of(reference, &shown)) {
            return;
        }
        let (reference, (device, queue)) = (Arc::clone(reference), self.device.clone());
        // A few tenths of a second: it is not worth stopping, and its result is dropped where it comes late.
        let work = move || {
            let comparison = Comparison::new(&device, &queue, &reference, &shown);
            // Another reference may have been chosen meanwhile.
            let wanted = lock(&shared.inbox).ask.as_ref().and_then(|ask| ask.reference.clone());
            let is_wanted = wanted.is_some_and(|wanted| Arc::ptr_eq(&wanted, &reference));
            let mut state = lock(&shared.state);
            if is_wanted && state.shown[0].as_ref().is_some_and(|now| Arc::ptr_eq(now, &shown)) {
                match comparison {
                    Ok(comparison) => state.comparison = Some(Arc::new(comparison)),
                    Err(sentence) => state.fault = Some(sentence),
                }
            }
            drop(state);
            shared.ctx.request_repaint();
        };
        if let Err(error) = std::thread::Builder::new().name("compare".into()).spawn(work) {
            lock(&self.shared.state).fault = Some(format!("no thread to compare on: {error}"));
        }
    }
}
