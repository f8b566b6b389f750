//! The window: mouse and keys, frames to the screen. See the library for what an engine does.

use anyhow::{Context as _, Result, anyhow, bail};
use clap::Parser as _;
use pullfocus_core::Size;
use pullfocus_example_live_scene::{Live, Studio, adapter, blur, camera::Shot, instance};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalPosition};
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoop};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Window, WindowId};

const KEYS: &str = "\
drag: orbit   wheel: nearer, farther   click: focus there   [ ]: f-stop   M: method
F: near objects in textures of their own, or not   Space: a lens, or none   Esc: end";

/// A chess board at dusk, rendered every frame and seen through a lens.
#[derive(Debug, clap::Parser)]
#[command(after_help = KEYS)]
struct Options {
    /// No window: write a picture, and end.
    #[arg(long, value_name = "OUT.png")]
    picture: Option<PathBuf>,
    /// The picture's size in pixels.
    #[arg(long, default_value = "640x360", value_parser = size, requires = "picture")]
    size: Size,
    /// Render so many frames, and say how long one takes.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), requires = "picture")]
    frames: u32,
    /// The first graphics adapter whose name contains this.
    #[arg(long, value_name = "NAME-PART")]
    device: Option<String>,
}

fn size(text: &str) -> Result<Size, String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=8192).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some(Size::new(side(width)?, side(height)?)));
    sides.ok_or_else(|| "give width and height, as in 640x360, up to 8192x8192".into())
}

fn main() -> ExitCode {
    // Wrong arguments end the program here, with 2.
    let options = Options::parse();
    let result = match &options.picture {
        Some(path) => picture(path, &options),
        None => window(options),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Without a window: the last of some frames into a file.
fn picture(path: &std::path::Path, options: &Options) -> Result<()> {
    let adapter = adapter(&instance(), (options.device.as_deref(), true), None)?;
    let mut studio = Studio::new(&adapter, options.size)?;
    let shot = Shot::default();
    // The first frame compiles pipelines and makes buffers.
    studio.frame(&shot)?;
    let start = Instant::now();
    for _ in 1..options.frames {
        studio.frame(&shot)?;
    }
    if options.frames > 1 {
        let each = start.elapsed().as_secs_f64() * 1e3 / f64::from(options.frames - 1);
        println!("{each:.1} ms per frame of {} on {}", options.size, adapter.get_info().name);
    }
    studio.picture()?.save(path).with_context(|| format!("{} cannot be written", path.display()))
}

fn window(options: Options) -> Result<()> {
    let events = EventLoop::new()
        .map_err(|_| anyhow!("no window can be opened here; --picture OUT.png needs none"))?;
    let shot = Shot::default();
    let (wanted_m, mouse) = (shot.focus_m, Mouse::default());
    let mut program = Program { options, screen: None, shot, wanted_m, mouse, result: Ok(()) };
    events.run_app(&mut program)?;
    program.result
}

struct Program {
    options: Options,
    screen: Option<Screen>,
    shot: Shot,
    /// Where the focus is going.
    wanted_m: f64,
    mouse: Mouse,
    result: Result<()>,
}

#[derive(Default)]
struct Mouse {
    at: PhysicalPosition<f64>,
    /// Where the button went down, and whether it was a drag since.
    pressed: Option<(PhysicalPosition<f64>, bool)>,
}

impl ApplicationHandler for Program {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_none() {
            match Screen::open(events, &self.options) {
                Ok(screen) => {
                    // Diffusion is the quickest, and a processor has much to do.
                    if screen.live.device.adapter_info().device_type == wgpu::DeviceType::Cpu {
                        self.shot.look = blur::LOOKS - 1;
                    }
                    self.screen = Some(screen);
                }
                Err(error) => self.end(events, Err(error)),
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(screen) = &mut self.screen else { return };
        let done = match event {
            WindowEvent::CloseRequested => return self.end(events, Ok(())),
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                if event.logical_key == Key::Named(NamedKey::Escape) {
                    return self.end(events, Ok(()));
                }
                self.key(&event.logical_key);
                Ok(())
            }
            WindowEvent::CursorMoved { position, .. } => {
                let by = (position.x - self.mouse.at.x, position.y - self.mouse.at.y);
                self.mouse.at = position;
                if let Some((start, dragged)) = &mut self.mouse.pressed {
                    // A hand that clicks is not quite still.
                    *dragged |= (position.x - start.x).hypot(position.y - start.y) > 4.0;
                    if *dragged {
                        self.shot.orbit.drag(by.0, by.1);
                    }
                }
                Ok(())
            }
            WindowEvent::MouseInput { state, button: MouseButton::Left, .. } => match state {
                ElementState::Pressed => {
                    self.mouse.pressed = Some((self.mouse.at, false));
                    Ok(())
                }
                ElementState::Released => match self.mouse.pressed.take() {
                    Some((at, false)) => screen
                        .live
                        .distance_at(at.x.max(0.0) as usize, at.y.max(0.0) as usize)
                        .map(|distance| self.wanted_m = distance),
                    _ => Ok(()),
                },
            },
            WindowEvent::MouseWheel { delta, .. } => {
                self.shot.orbit.zoom(match delta {
                    MouseScrollDelta::LineDelta(_, lines) => lines,
                    MouseScrollDelta::PixelDelta(pixels) => (pixels.y / 40.0) as f32,
                });
                Ok(())
            }
            // The next redraw sees the size.
            WindowEvent::Resized(_) => {
                screen.window.request_redraw();
                Ok(())
            }
            WindowEvent::Occluded(hidden) => {
                screen.hidden = hidden;
                screen.window.request_redraw();
                Ok(())
            }
            WindowEvent::RedrawRequested => {
                let passed = screen.clock.passed(&screen.window, &self.shot);
                self.shot.focus_m = toward(self.shot.focus_m, self.wanted_m, passed);
                screen.redraw(&self.shot)
            }
            _ => Ok(()),
        };
        if done.is_err() {
            self.end(events, done);
        }
    }
}

impl Program {
    fn end(&mut self, events: &ActiveEventLoop, result: Result<()>) {
        self.result = result;
        events.exit();
    }

    fn key(&mut self, key: &Key) {
        let shot = &mut self.shot;
        // Three clicks of the dial are one stop, a factor of the root of two.
        let third = 2f64.powf(1.0 / 6.0);
        match key {
            Key::Named(NamedKey::Space) => shot.blur = !shot.blur,
            Key::Character(text) => match text.to_lowercase().as_str() {
                "[" => shot.f_stop = (shot.f_stop / third).max(1.4),
                "]" => shot.f_stop = (shot.f_stop * third).min(22.0),
                "m" => shot.look = (shot.look + 1) % blur::LOOKS,
                "f" => shot.foreground = !shot.foreground,
                _ => {}
            },
            _ => {}
        }
    }
}

/// A focus on its way, as a hand turns the ring: by a part of what is left, in dioptres, in which infinity is a number.
fn toward(from_m: f64, to_m: f64, seconds: f64) -> f64 {
    let left = (1.0 / from_m - 1.0 / to_m) * (-8.0 * seconds).exp();
    if left.abs() < 1e-3 { to_m } else { 1.0 / (1.0 / to_m + left) }
}

/// Counts frames for the title.
struct Clock {
    last: Instant,
    since: Instant,
    frames: u32,
}

impl Clock {
    /// Seconds since the last frame; twice a second the title says how it is.
    fn passed(&mut self, window: &Window, shot: &Shot) -> f64 {
        let passed = self.last.elapsed();
        self.last += passed;
        self.frames += 1;
        let half = self.since.elapsed().as_secs_f64();
        if half > 0.5 {
            let each = half * 1e3 / f64::from(self.frames);
            (self.since, self.frames) = (self.last, 0);
            let lens = if shot.blur { blur::looks()[shot.look].0 } else { "no lens" };
            let layers = if shot.foreground { "" } else { ", one picture" };
            let (focus, stop) = (shot.focus_m, shot.f_stop);
            window.set_title(&format!("{focus:.2} m  f/{stop:.1}  {each:.1} ms  {lens}{layers}"));
        }
        passed.as_secs_f64()
    }
}

struct Screen {
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    live: Live,
    clock: Clock,
    hidden: bool,
}

impl Screen {
    fn open(events: &ActiveEventLoop, options: &Options) -> Result<Self> {
        let attributes =
            Window::default_attributes().with_title("pullfocus").with_inner_size(LogicalSize::new(960, 540));
        let window = Arc::new(events.create_window(attributes).context("no window can be opened here")?);
        let instance = instance();
        let surface = instance.create_surface(window.clone())?;
        let adapter = adapter(&instance, (options.device.as_deref(), false), Some(&surface))?;
        let size = window.inner_size();
        let (width, height) = (size.width.max(1), size.height.max(1));
        let mut config = surface
            .get_default_config(&adapter, width, height)
            .context("the adapter cannot draw on this window")?;
        // The hardware encodes as sRGB what tone mapping leaves, whatever the surface itself says.
        let format = (surface.get_capabilities(&adapter).formats.into_iter())
            .find(|format| format.add_srgb_suffix().is_srgb())
            .context("the window has no sRGB format")?;
        config.format = format;
        let format = format.add_srgb_suffix();
        config.view_formats.push(format);
        let live = Live::new(&adapter, Size::new(width as usize, height as usize), format)?;
        surface.configure(&live.device, &config);
        let now = Instant::now();
        let clock = Clock { last: now, since: now, frames: 0 };
        window.request_redraw();
        Ok(Self { window, instance, surface, config, live, clock, hidden: false })
    }

    /// A frame, and the wish for the next one, unless nobody sees it.
    fn redraw(&mut self, shot: &Shot) -> Result<()> {
        let size = self.window.inner_size();
        if self.hidden || size.width == 0 || size.height == 0 {
            return Ok(());
        }
        if (size.width, size.height) != (self.config.width, self.config.height) {
            (self.config.width, self.config.height) = (size.width, size.height);
            self.surface.configure(&self.live.device, &self.config);
            self.live.resize(Size::new(size.width as usize, size.height as usize))?;
        }
        use wgpu::CurrentSurfaceTexture as Current;
        match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => {
                let format = Some(self.config.format.add_srgb_suffix());
                let view = texture
                    .texture
                    .create_view(&wgpu::TextureViewDescriptor { format, ..Default::default() });
                self.live.frame(shot, &view)?;
                self.window.pre_present_notify();
                self.live.present(texture);
            }
            Current::Outdated => self.surface.configure(&self.live.device, &self.config),
            Current::Lost => {
                self.surface = self.instance.create_surface(self.window.clone())?;
                self.surface.configure(&self.live.device, &self.config);
            }
            // The event that it is seen again asks for the next frame.
            Current::Occluded => return Ok(()),
            Current::Timeout => {}
            Current::Validation => bail!("the window's surface does not work"),
        }
        self.window.request_redraw();
        Ok(())
    }
}
