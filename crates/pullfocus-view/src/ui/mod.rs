//! The window.

mod browser;
mod canvas;
mod color;
mod controls;
mod files;
mod keyboard;
mod reference;
mod status;
mod timeline;
mod windows;

pub use canvas::Place;

use crate::clip::{Clip, Plate};
use crate::document::{Document, Quantity};
use crate::engine::read_back;
use crate::engine::{Ask, Choice, Engine, Take};
use crate::export::{Export, Order};
use crate::loader::{How, Loader, Request};
use crate::look::{Look, View};
use crate::screen::Display;
use crate::session::{Keeper, Session};
use crate::ui;
use eframe::egui::util::undoer::{self, Undoer};
use eframe::{egui, egui_wgpu};
use pullfocus_core::{Cancel, Picture, Settings};
use pullfocus_job::config::Options;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How the program is started.
#[derive(Debug, Clone)]
pub struct Start {
    /// What to open: a picture, a folder, a pattern, a shot; the last session's shot if not given.
    pub path: Option<PathBuf>,
    /// Options from the command line.
    pub options: Options,
    /// What renders.
    pub device: Choice,
    /// Where the session is kept; nowhere if not given.
    pub session: Option<PathBuf>,
    /// What the environment variable OCIO holds: the studio's colour config.
    pub ocio: Option<String>,
    /// Bytes of frames that are kept in memory ([`crate::loader::ROOM`] is a good choice).
    pub frame_memory: usize,
    /// Raised from outside (a signal), it closes the window.
    pub quit: Cancel,
}

/// The program.
pub struct App {
    pub(crate) document: Document,
    pub(crate) look: Look,
    pub(crate) session: Session,
    session_path: Option<PathBuf>,
    keeper: Option<Keeper>,
    /// Why the session cannot be kept, as it was told.
    session_fault: Option<String>,
    ctx: egui::Context,
    base: Options,
    engine: Engine,
    loader: Loader,
    display: Arc<Display>,
    colors: color::Panel,
    device: (eframe::wgpu::Device, eframe::wgpu::Queue),
    undo: Undoer<Document>,
    /// What is open, and the frame in front.
    clip: Option<Arc<Clip>>,
    plate: Option<Arc<Plate>>,
    /// The number of the frame wanted.
    frame: i64,
    /// The number of the frame that the plate is of.
    plate_frame: i64,
    references: reference::References,
    /// Where the picture is in the window.
    place: Option<Place>,
    /// The pixel under the cursor, and the take that is seen there.
    hovered: Option<([usize; 2], usize)>,
    /// Where a drag began, and on which take.
    rack_from: Option<([f32; 2], usize)>,
    dragging_wipe: bool,
    selected_key: Option<f64>,
    playing: Option<(Instant, i64)>,
    saved: Option<files::ShotFile>,
    message: Option<(String, Instant)>,
    windows: windows::Windows,
    export: Option<Export>,
    /// Whether there is no device any more.
    ends: bool,
    /// Why a take cannot be rendered.
    lens_faults: [Option<String>; 2],
    kept: Instant,
    /// What was remembered last, and the file as it was written.
    kept_state: (Document, Look, i64),
    written: Session,
    /// When it began, until the first picture is there.
    began: Option<Instant>,
}

/// Changes that follow one another sooner are one step to undo.
const STEP: Duration = Duration::from_millis(500);

/// Steps to undo; none yet.
fn steps() -> Undoer<Document> {
    Undoer::with_settings(undoer::Settings { stable_time: STEP.as_secs_f32(), ..Default::default() })
}

/// How often the session is kept while something changes.
const KEEP_EVERY: Duration = Duration::from_secs(5);
/// How long a message stays.
const MESSAGE: Duration = Duration::from_secs(8);

impl App {
    /// The program in a window of `cc`.
    ///
    /// # Errors
    /// One sentence: no device to draw with, no threads.
    pub fn new(cc: &eframe::CreationContext<'_>, start: Start) -> Result<Self, String> {
        let render_state = cc.wgpu_render_state.as_ref().ok_or("the window has no device to draw with")?;
        Self::with(&cc.egui_ctx, render_state, start)
    }

    fn with(
        ctx: &egui::Context,
        render_state: &egui_wgpu::RenderState,
        start: Start,
    ) -> Result<Self, String> {
        let told = |error: std::io::Error| format!("a thread could not be started: {error}");
        let engine = Engine::start(ctx, render_state, start.device).map_err(told)?;
        let loader = Loader::start(ctx, start.frame_memory).map_err(told)?;
        let (quit, window) = (start.quit.clone(), ctx.clone());
        // It ends with the process; a flag tells nobody when it is raised.
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(move || {
                while !quit.is_cancelled() {
                    std::thread::sleep(Duration::from_millis(250));
                }
                window.send_viewport_cmd(egui::ViewportCommand::Close);
                window.request_repaint();
            })
            .map_err(told)?;
        let session = start.session.as_deref().map(Session::read).unwrap_or_default();
        let colors = color::Panel::start(ctx, start.ocio, &session.look.color).map_err(told)?;
        let (device, queue) = (render_state.device.clone(), render_state.queue.clone());
        let display = Arc::new(Display::new(&device, &queue, render_state.target_format));
        let mut app = Self {
            document: Document::default(),
            look: session.look.clone(),
            keeper: start
                .session
                .as_deref()
                .map(|path| Keeper::start(path, ctx))
                .transpose()
                .map_err(told)?,
            session_path: start.session,
            session_fault: None,
            ctx: ctx.clone(),
            base: start.options,
            engine,
            loader,
            display,
            colors,
            device: (device, queue),
            undo: steps(),
            clip: None,
            plate: None,
            frame: 0,
            plate_frame: 0,
            references: reference::References::default(),
            place: None,
            hovered: None,
            rack_from: None,
            dragging_wipe: false,
            selected_key: None,
            playing: None,
            saved: None,
            message: None,
            windows: windows::Windows::default(),
            export: None,
            ends: false,
            lens_faults: [None, None],
            kept: Instant::now(),
            kept_state: (Document::default(), session.look.clone(), 0),
            written: session.clone(),
            began: Some(Instant::now()),
            session,
        };
        // A wipe or a reference that is not there any more would puzzle.
        for view in [View::Reference, View::Difference] {
            if app.look.shows(view) {
                (app.look.left, app.look.right) = (View::Result, None);
            }
        }
        if let Some(dark) = app.session.dark {
            ctx.set_theme(if dark { egui::Theme::Dark } else { egui::Theme::Light });
        }
        match start.path {
            Some(path) => app.open_path(&path),
            None if app.base.files.input.is_some() || app.base.files.behind.is_some() => {
                let options = app.base.clone();
                app.loader.open(Request {
                    path: None,
                    options,
                    frame: i64::MIN,
                    other: None,
                    how: How::Anew,
                });
            }
            None => app.open_last(),
        }
        Ok(app)
    }

    /// A sentence for the user, at the bottom of the window.
    pub(crate) fn say(&mut self, sentence: impl Into<String>) {
        self.message = Some((sentence.into(), Instant::now()));
    }

    fn tell(&mut self, result: Result<(), String>) {
        if let Err(sentence) = result {
            self.say(sentence);
        }
    }

    /// Changes the lens of the take in front.
    pub(crate) fn change(&mut self, quantity: Quantity, value: f64) {
        self.change_of(self.front(), quantity, value);
    }

    /// Changes the lens of a take.
    pub(crate) fn change_of(&mut self, side: usize, quantity: Quantity, value: f64) {
        let result = self.document.set(side, quantity, value, self.frame_number());
        self.tell(result);
    }

    /// Whether keys can be set here; says why not.
    pub(crate) fn may_key(&mut self) -> bool {
        let may = self.clip.as_ref().map_or(Ok(()), |clip| clip.may_key());
        let may_key = may.is_ok();
        self.tell(may);
        may_key
    }

    /// The take whose controls are shown: B where it is at the left, or alone.
    pub(crate) fn front(&self) -> usize {
        usize::from(self.look.left == View::Other)
    }

    /// The take that a view is of: of what both have, it is the one in front.
    pub(crate) fn take_of(&self, view: View) -> usize {
        match view {
            // The difference is that of take A.
            View::Result | View::Difference => 0,
            View::Other => 1,
            _ => self.front(),
        }
    }

    /// Brings a take to the front. Where it stands right of a border already, both sides change places.
    pub(crate) fn bring_to_front(&mut self, view: View) {
        if self.look.right == Some(view) {
            self.look.right = Some(self.look.left);
        }
        self.look.left = view;
    }

    /// The number of the frame in front.
    pub fn frame_number(&self) -> i64 {
        self.clip.as_ref().map_or(self.frame, |clip| clip.number(clip.nearest(self.frame as f64)))
    }

    /// First and last frame of the timeline.
    pub(crate) fn frame_range(&self) -> (i64, i64) {
        let Some(clip) = &self.clip else { return (1, 1) };
        (clip.number(0), clip.number(clip.len() - 1))
    }

    /// Goes some frames on, or back.
    pub(crate) fn step(&mut self, by: isize) {
        let Some(clip) = &self.clip else { return };
        let index = clip.nearest(self.frame as f64).saturating_add_signed(by).min(clip.len() - 1);
        let frame = clip.number(index);
        self.go_to(frame);
    }

    /// Goes to a frame.
    pub fn go_to(&mut self, frame: i64) {
        let (first, last) = self.frame_range();
        let before = self.frame_number();
        self.frame = frame.clamp(first, last);
        if let Some(clip) = self.clip.as_ref().filter(|_| self.frame_number() != before) {
            // A frame that could not be read may be whole by now.
            self.loader.retry(clip.source(clip.nearest(self.frame as f64)));
        }
    }

    /// Whether everything that was asked for is on the screen.
    pub fn is_settled(&self) -> bool {
        let state = self.engine.state();
        let is_compared = || match (&state.comparison, &self.references.now, &state.shown[0]) {
            (Some(comparison), Some(reference), Some(shown)) => comparison.is_of(reference, shown),
            _ => false,
        };
        self.loader.is_idle()
            && !state.busy
            && !self.references.are_coming()
            && !self.colors.is_busy()
            && self.export.as_ref().is_none_or(Export::is_done)
            && (self.references.now.is_none() || !self.look.shows(View::Difference) || is_compared())
    }

    /// The device that draws the window.
    pub fn device(&self) -> &eframe::wgpu::Device {
        &self.device.0
    }

    /// How many pictures were rendered so far.
    pub fn rendered(&self) -> u64 {
        self.engine.state().count
    }

    /// The picture of take A as it was rendered last, at the precision of the screen's.
    pub fn rendered_picture(&self) -> Option<Picture> {
        let texture = self.engine.state().shown[0].as_ref().map(|shown| shown.texture.clone())?;
        read_back(&self.device.0, &self.device.1, &texture).ok()
    }

    /// The run that writes files, if there was one.
    pub fn export(&self) -> Option<&Export> {
        self.export.as_ref()
    }

    /// Begins to write the shot to files.
    ///
    /// # Errors
    /// One sentence: nothing is open, no thread is to be had.
    pub fn start_export(&mut self, order: Order) -> Result<(), String> {
        let clip = self.clip.clone().ok_or("nothing is open")?;
        let export = Export::start(&self.ctx, clip, self.document.clone(), order);
        self.export = Some(export.map_err(|error| format!("a thread could not be started: {error}"))?);
        Ok(())
    }

    /// Mean FLIP of take A to the reference, once it is known.
    pub fn flip(&self) -> Option<f64> {
        self.engine.state().comparison.as_ref().map(|comparison| comparison.flip)
    }

    /// Sets the f-stop of the take in front.
    pub fn set_f_stop(&mut self, f_stop: f64) {
        self.change(Quantity::FStop, f_stop);
    }

    /// Sets the focal length in millimetres of the take in front.
    pub fn set_focal_length(&mut self, millimetres: f64) {
        self.change(Quantity::FocalLength, millimetres);
    }

    /// What is made.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// How it is looked at.
    pub fn look_mut(&mut self) -> &mut Look {
        &mut self.look
    }

    /// Where the picture is in the window.
    pub fn place(&self) -> Option<Place> {
        self.place
    }

    /// The message at the bottom of the window.
    pub fn message(&self) -> Option<&str> {
        self.message.as_ref().map(|(text, _)| text.as_str())
    }

    /// Takes what was read, and asks for what is missing.
    fn take_in(&mut self, ctx: &egui::Context) {
        let (opened, fault) = {
            let mut shelf = self.loader.shelf();
            (shelf.opened.take(), shelf.fault.take())
        };
        if let Some(sentence) = fault {
            self.say(sentence);
        }
        if let Some(request) = opened {
            self.take_opened(request, ctx);
        }
        let Some(clip) = &self.clip else { return };
        let index = clip.nearest(self.frame as f64);
        // The frame in front, those that come next, and the one before.
        let (playing, last) = (self.playing.is_some(), clip.len());
        let ahead = if playing { 24 } else { 4 };
        let near = (index..(index + ahead).min(last)).chain(index.checked_sub(1));
        // While it plays, the frame of now comes too late if it is not there.
        let near = near.skip(usize::from(playing && last > 1));
        let mut wanted: Vec<usize> = near.map(|index| clip.source(index)).collect();
        wanted.dedup();
        self.loader.want(wanted);
        let shelf = self.loader.shelf();
        let there = |index: usize| Some((index, shelf.plate(clip.source(index))?));
        // Then the one before it is shown, as what it is.
        let before = index.saturating_sub(if playing { ahead } else { 0 });
        let Some((index, plate)) = (before..=index).rev().find_map(there) else { return };
        drop(shelf);
        (self.plate, self.plate_frame) = (Some(plate), clip.number(index));
    }

    /// Asks for the pictures that are looked at.
    fn ask(&mut self, ctx: &egui::Context) {
        let Some(plate) = self.plate.clone() else { return };
        // Only what is looked at; the difference is the first one's.
        let sides = [!self.look.is_of_b_alone(), self.look.shows(View::Other)];
        let takes =
            [0, 1].map(|side| sides[side].then(|| self.document.take(side, &plate, self.plate_frame)));
        self.lens_faults =
            takes.each_ref().map(|take| take.as_ref().and_then(|take| take.as_ref().err().cloned()));
        let layer = self.look.layer.map(|_| self.look.show());
        let takes = takes.map(|take| {
            let take = take?.ok()?;
            let show = layer.unwrap_or(take.settings.show);
            Some(Take { settings: Settings { show, ..take.settings }, ..take })
        });
        let hurry = self.playing.is_some() || ctx.input(|input| input.pointer.any_down());
        let reference = self.references.now.clone().filter(|_| self.look.shows(View::Difference));
        let camera = takes[self.front()].as_ref().and_then(|take| take.camera.as_ref());
        let half_width = camera.map(|camera| camera.half_width_tangent());
        self.engine.ask(Ask { plate, takes, half_width, hurry, reference });
    }

    /// Goes on while the shot plays, in real time: frames that come late are left out.
    fn play(&mut self, ctx: &egui::Context) {
        let Some((since, from)) = self.playing else { return };
        let (first, last) = self.frame_range();
        let length = (last - first + 1).max(1);
        let passed = (since.elapsed().as_secs_f64() * self.look.fps) as i64;
        self.frame = first + (from - first + passed).rem_euclid(length);
        ctx.request_repaint_after(Duration::from_secs_f64(0.5 / self.look.fps.max(1.0)));
    }

    /// Starts or stops playing.
    pub fn toggle_play(&mut self) {
        self.playing = match self.playing {
            Some(_) => None,
            None if self.clip.as_ref().is_none_or(|clip| clip.is_still()) => None,
            None => Some((Instant::now(), self.frame_number())),
        };
    }

    /// One step back, or forward again.
    pub fn undo_redo(&mut self, forward: bool) {
        let step = if forward { self.undo.redo(&self.document) } else { self.undo.undo(&self.document) };
        if let Some(document) = step {
            self.document = document.clone();
        }
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        let dropped = ctx.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.open_path(&path);
        }
        let lost = self.engine.state().lost.clone();
        if let Some(reason) = lost {
            // Nothing can be drawn any more; the session brings everything back.
            if !std::mem::replace(&mut self.ends, true) {
                self.keep_session();
                tracing::error!(
                    "the GPU was lost ({reason}); start `pullfocus view` again, the session comes back"
                );
            }
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        if let Some(began) = self.began.filter(|_| self.rendered() > 0) {
            tracing::info!(seconds = began.elapsed().as_secs_f64(), "first picture");
            self.began = None;
        }
        self.play(&ctx);
        self.take_in(&ctx);
        self.take_reference();
        self.follow_reference();
        self.take_kept();
        self.take_colors();
        self.keyboard(&ctx);
        egui::Panel::top("menu").show(ui, |ui| self.menu(ui));
        egui::Panel::bottom("status").show(ui, |ui| self.status(ui));
        egui::Panel::bottom("timeline").show(ui, |ui| self.timeline(ui));
        egui::Panel::right("controls").exact_size(ui::controls::WIDTH).show(ui, |ui| self.controls(ui));
        egui::CentralPanel::no_frame().show(ui, |ui| self.canvas(ui));
        self.windows(&ctx);
        self.ask(&ctx);
        // Steps of undo are taken when a hand is off the mouse.
        let now = ctx.input(|input| input.time);
        if !ctx.input(|input| input.pointer.any_down()) {
            self.undo.feed_state(now, &self.document);
            if self.undo.is_in_flux() {
                // A step ends when nothing moves for a while, which has to be seen.
                ctx.request_repaint_after(2 * STEP);
            }
        }
        if self.has_news() {
            match KEEP_EVERY.checked_sub(self.kept.elapsed()) {
                Some(left) => ctx.request_repaint_after(left),
                None => self.keep_session(),
            }
        }
    }

    fn on_exit(&mut self) {
        self.keep_session();
        for _ in 0..2 {
            if let Some(keeper) = &self.keeper {
                keeper.finish();
            }
            // What could not be written, before or now, is told, and tried once more.
            self.take_kept();
            self.keep_session();
        }
    }
}
