//! Rendering beside the window: one thread that always works on what was asked for last.

mod compare;
mod cpu;
mod gpu;
mod worker;

pub use compare::{Comparison, Reference, read_back};

use crate::clip::{Distances, Plate};
use crate::locked::lock;
use crate::screen::Texture;
use eframe::{egui, egui_wgpu, wgpu};
use pullfocus_core::coc::CocCurve;
use pullfocus_core::{Camera, Frame, Report, Settings};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

/// A lens and how its blur is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Take {
    /// The lens; none where circles of confusion are given.
    pub camera: Option<Camera>,
    /// The settings.
    pub settings: Settings,
}

impl Take {
    /// The circles of confusion that are rendered in a frame, with what is set beside the lens; none where they cannot be.
    pub fn curve(&self, frame: &Frame) -> Option<CocCurve> {
        let settings = &self.settings.coc;
        match &self.camera {
            Some(camera) => CocCurve::new(camera.circle_of_confusion(frame), frame, settings),
            None => CocCurve::limits(frame, settings),
        }
        .ok()
    }
}

/// What is to be on the screen.
#[derive(Debug, Clone)]
pub struct Ask {
    /// The frame.
    pub plate: Arc<Plate>,
    /// The takes A and B, as far as they are looked at.
    pub takes: [Option<Take>; 2],
    /// Tangent of half the angle of the lens that distances are looked at through.
    pub half_width: Option<f64>,
    /// Whether something moves right now, so that a picture soon is better than a fine one.
    pub hurry: bool,
    /// What take A is compared with.
    pub reference: Option<Arc<Reference>>,
}

impl Ask {
    /// Whether an answer to this one answers the other too. A hand that is on the mouse and changes nothing is no reason to begin
    /// anew; one that lets go wants the fine picture.
    fn answers(&self, other: &Self) -> bool {
        let same_reference = match (&self.reference, &other.reference) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        Arc::ptr_eq(&self.plate, &other.plate)
            && self.takes == other.takes
            && self.half_width == other.half_width
            && (!self.hurry || other.hurry)
            && same_reference
    }
}

/// A rendered picture.
#[derive(Debug, Clone)]
pub struct Shown {
    /// The frame.
    pub plate: Arc<Plate>,
    /// What was rendered.
    pub take: Take,
    /// The picture.
    pub texture: Texture,
    /// One pixel stands for so many along each axis.
    pub reduced: usize,
    /// Stages and counts.
    pub report: Report,
    /// From the beginning to the end.
    pub time: Duration,
    /// The device's name.
    pub device: String,
}

impl Shown {
    fn is_of(&self, plate: &Arc<Plate>, take: &Take) -> bool {
        Arc::ptr_eq(&self.plate, plate) && self.take == *take
    }
}

/// A frame on the device, as it was read.
#[derive(Debug)]
pub struct OnDevice {
    /// The frame.
    pub plate: Arc<Plate>,
    /// In perfect focus.
    pub pinhole: Texture,
    /// Its distances, or its circles of confusion.
    pub distances: Texture,
    /// The same in memory.
    pub seen: Arc<Distances>,
}

/// A pixel of a rendered picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Take A or B.
    pub side: usize,
    /// Column and row in the whole picture.
    pub at: [usize; 2],
}

/// What there is to see.
#[derive(Debug, Default)]
pub struct State {
    /// The frame itself.
    pub frame: Option<Arc<OnDevice>>,
    /// The takes A and B.
    pub shown: [Option<Arc<Shown>>; 2],
    /// Why there is none, in one sentence.
    pub fault: Option<String>,
    /// Why the CPU did it although there is a GPU.
    pub note: Option<String>,
    /// Whether something is under way.
    pub busy: bool,
    /// Take A beside the reference.
    pub comparison: Option<Arc<Comparison>>,
    /// The pixel last asked for, and its colour.
    pub probed: Option<(Probe, [f32; 4])>,
    /// Set when the device is gone.
    pub lost: Option<String>,
    /// How many pictures were rendered.
    pub count: u64,
}

#[derive(Debug, Default)]
struct Inbox {
    ask: Option<Ask>,
    serial: u64,
    /// Of what is open: pictures of another are not shown.
    opened: u64,
    probe: Option<Probe>,
    /// The pixel last asked for, and how many pictures there were.
    probed: Option<(Probe, u64)>,
    quit: bool,
}

struct Shared {
    inbox: Mutex<Inbox>,
    wake: Condvar,
    state: Mutex<State>,
    /// Ends what is under way.
    cancel: pullfocus_core::Cancel,
    ctx: egui::Context,
}

/// What renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The window's own device, if it is a GPU; else the CPU.
    Auto,
    /// The CPU.
    Cpu,
    /// The window's own device, whatever it is.
    Gpu,
}

/// The renderer beside the window.
pub struct Engine {
    shared: Arc<Shared>,
    worker: Option<JoinHandle<()>>,
    /// What renders, in a few words.
    pub device_text: String,
    /// What draws the window.
    pub window_device: String,
    /// Whether pictures are rendered on the window's device.
    pub on_gpu: bool,
}

impl Engine {
    /// Starts the thread.
    ///
    /// # Errors
    /// The system's, if there is no thread to be had.
    pub fn start(
        ctx: &egui::Context,
        render_state: &egui_wgpu::RenderState,
        choice: Choice,
    ) -> std::io::Result<Self> {
        let info = render_state.adapter.get_info();
        let real = info.device_type != wgpu::DeviceType::Cpu && info.backend != wgpu::Backend::Gl;
        let usable = pullfocus_gpu::Context::is_usable(&render_state.device.limits());
        let on_gpu = usable
            && match choice {
                Choice::Auto => real,
                Choice::Cpu => false,
                Choice::Gpu => true,
            };
        let device_text = if on_gpu {
            format!("{} ({:?})", info.name, info.backend)
        } else if choice == Choice::Cpu {
            "CPU".to_owned()
        } else {
            "CPU (no GPU)".to_owned()
        };
        let shared = Arc::new(Shared {
            inbox: Mutex::default(),
            wake: Condvar::new(),
            state: Mutex::default(),
            cancel: pullfocus_core::Cancel::new(),
            ctx: ctx.clone(),
        });
        let lost = Arc::clone(&shared);
        render_state.device.set_device_lost_callback(move |_, text| {
            // The program's own end is no loss.
            if !lock(&lost.inbox).quit {
                lock(&lost.state).lost = Some(text);
                lost.ctx.request_repaint();
            }
        });
        // An error that nobody expects would end the program, and with it what the user made. A device that is gone is told
        // of above; until then whatever is asked of it fails.
        let fails = Arc::clone(&shared);
        render_state.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            tracing::error!(%error, "the GPU refused something");
            lock(&fails.state).fault = Some(match error {
                wgpu::Error::OutOfMemory { .. } => "the GPU has no memory left; close other programs".into(),
                _ => "the GPU refused to draw; the program's messages say why".into(),
            });
            fails.ctx.request_repaint();
        }));
        let blur =
            worker::Worker::new(&shared, (&render_state.device, &render_state.queue), on_gpu, &info.name);
        let worker = std::thread::Builder::new().name("render".into()).spawn(move || blur.run())?;
        Ok(Self { shared, worker: Some(worker), device_text, window_device: info.name, on_gpu })
    }

    /// Asks for pictures. Asking for the same again is free.
    pub fn ask(&self, ask: Ask) {
        let mut inbox = lock(&self.shared.inbox);
        if inbox.ask.as_ref().is_some_and(|last| last.answers(&ask)) {
            return;
        }
        inbox.ask = Some(ask);
        inbox.serial += 1;
        // What is under way is of yesterday.
        self.shared.cancel.cancel();
        lock(&self.shared.state).busy = true;
        self.shared.wake.notify_one();
    }

    /// Forgets everything that was asked for and shown.
    pub fn clear(&self) {
        let mut inbox = lock(&self.shared.inbox);
        inbox.ask = None;
        inbox.serial += 1;
        inbox.opened += 1;
        self.shared.cancel.cancel();
        let mut state = lock(&self.shared.state);
        *state = State { lost: state.lost.clone(), count: state.count, ..State::default() };
        self.shared.wake.notify_one();
    }

    /// Asks for the colour of a rendered pixel.
    pub fn probe(&self, probe: Probe) {
        let count = lock(&self.shared.state).count;
        let mut inbox = lock(&self.shared.inbox);
        let asked = Some((probe, count));
        if inbox.probed != asked {
            inbox.probe = asked.as_ref().map(|(probe, _)| probe.clone());
            inbox.probed = asked;
            self.shared.wake.notify_one();
        }
    }

    /// What there is to see now.
    pub fn state(&self) -> MutexGuard<'_, State> {
        lock(&self.shared.state)
    }
}

impl Drop for Engine {
    fn drop(&mut self) {
        lock(&self.shared.inbox).quit = true;
        self.shared.cancel.cancel();
        self.shared.wake.notify_one();
        if let Some(worker) = self.worker.take() {
            // Its own faults are told already.
            let _ = worker.join();
        }
    }
}
