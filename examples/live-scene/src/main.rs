//! The window: mouse and keys, frames to the screen. See the library for what an engine does.

use anyhow::{Context as _, Result, anyhow};
use clap::Parser as _;
use eframe::egui::{self, ViewportCommand};
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use pullfocus_core::Size;
use pullfocus_example_live_scene::{Live, blur::LOOKS, camera::Shot};
use pullfocus_gpu::{Choice, Host};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    /// In pixels.
    #[arg(long, num_args = 2, value_names = ["WIDTH", "HEIGHT"], default_values = ["960", "540"],
        value_parser = clap::value_parser!(u16).range(1..=8192))]
    size: Vec<u16>,
    /// Where the focus is at first, in metres.
    #[arg(long, value_name = "METRES", default_value_t = Shot::default().focus_m)]
    focus: f64,
}

fn main() {
    // Wrong arguments end the program here, with 2.
    let options = Options::parse();
    let shot = Shot { focus_m: options.focus, ..Shot::default() };
    let done = match &options.picture {
        Some(path) => picture(path, &options, &shot),
        None => window(&options, shot),
    };
    done.unwrap_or_else(end);
}

fn end(error: anyhow::Error) {
    eprintln!("error: {error:#}");
    std::process::exit(1);
}

fn picture(path: &Path, options: &Options, shot: &Shot) -> Result<()> {
    // Every name has this in it: the best adapter, be it in software.
    let host = Host::open(&Choice::Named(String::new()))?;
    let size = Size::new(options.size[0].into(), options.size[1].into());
    let mut live = Live::new(host.context().device(), host.context().queue(), size)?;
    live.frame(shot, size)?;
    live.picture()?.save(path).with_context(|| format!("{} cannot be written", path.display()))
}

fn window(options: &Options, shot: Shot) -> Result<()> {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(|adapter| {
        let required_limits = adapter.limits();
        wgpu::DeviceDescriptor { required_limits, ..Default::default() }
    });
    // Validation layers of some systems refuse names in shaders.
    setup.instance_descriptor.flags.remove(wgpu::InstanceFlags::DEBUG);
    let wgpu_options = WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(setup), ..Default::default() };
    let size = [0, 1].map(|side| f32::from(options.size[side]));
    let viewport = egui::ViewportBuilder::default().with_inner_size(size);
    let options = eframe::NativeOptions { viewport, wgpu_options, ..Default::default() };
    eframe::run_native("pullfocus", options, Box::new(|cc| Ok(Box::new(Program::new(cc, shot)?))))
        .map_err(|error| anyhow!("no window can be opened here: {error}; --picture OUT.png needs none"))
}

struct Program {
    live: Live,
    shot: Shot,
    /// Where the focus is going.
    wanted_m: f64,
    texture: egui::TextureId,
    /// Milliseconds for a frame, as a mean over some.
    each: f64,
    title: String,
}

impl Program {
    fn new(cc: &eframe::CreationContext<'_>, mut shot: Shot) -> Result<Self> {
        let state = cc.wgpu_render_state.as_ref().context("the window has no graphics adapter")?;
        // The first frame goes over to the window's size.
        let live = Live::new(&state.device, &state.queue, Size::new(1, 1))?;
        // A processor has much to do.
        if state.adapter.get_info().device_type == wgpu::DeviceType::Cpu {
            shot.look = LOOKS.len() - 1;
        }
        let (shown, filter) = (&live.targets.shown, wgpu::FilterMode::Nearest);
        let texture = state.renderer.write().register_native_texture(&state.device, shown, filter);
        Ok(Self { live, wanted_m: shot.focus_m, shot, texture, each: 0.0, title: String::new() })
    }

    /// A frame: what mouse and keys want, then the picture.
    fn frame(&mut self, ui: &mut egui::Ui, frame: &eframe::Frame) -> Result<()> {
        let (pixels, area) = (ui.pixels_per_point(), ui.max_rect());
        let size =
            Size::new((area.width() * pixels).round() as usize, (area.height() * pixels).round() as usize);
        let mouse = ui.allocate_rect(area, egui::Sense::click_and_drag());
        if size.area() == 0 {
            return Ok(());
        }
        if let Some(at) = mouse.interact_pointer_pos().filter(|_| mouse.clicked()) {
            let at = (at - area.min) * pixels;
            self.wanted_m = self.live.distance_at(at.x as usize, at.y as usize)?;
        }
        let by = mouse.drag_delta() * pixels;
        self.shot.drag(by.x, by.y);
        let input = ui.input(egui::InputState::clone);
        self.shot.zoom(input.smooth_scroll_delta().y / 40.0);
        for event in &input.events {
            if let egui::Event::Text(text) = event {
                self.shot.key(text);
            }
        }
        if input.key_pressed(egui::Key::Escape) {
            ui.send_viewport_cmd(ViewportCommand::Close);
        }
        let seconds = f64::from(input.unstable_dt);
        self.shot.pull(self.wanted_m, seconds);

        self.live.frame(&self.shot, size)?;
        let state = frame.wgpu_render_state().context("the window has no graphics adapter")?;
        let (shown, filter) = (&self.live.targets.shown, wgpu::FilterMode::Nearest);
        (state.renderer.write()).update_egui_texture_from_wgpu_texture(
            &state.device,
            shown,
            filter,
            self.texture,
        );
        egui::Image::new((self.texture, area.size())).paint_at(ui, area);

        self.each += 0.1 * (1e3 * seconds - self.each);
        let lens = if self.shot.blur { LOOKS[self.shot.look] } else { "no lens" };
        let layers = if self.shot.foreground { "" } else { ", one picture" };
        let (focus, stop, each) = (self.shot.focus_m, self.shot.f_stop, self.each);
        let title = format!("{focus:.2} m  f/{stop:.1}  {each:.0} ms  {lens}{layers}");
        if title != self.title {
            self.title.clone_from(&title);
            ui.send_viewport_cmd(ViewportCommand::Title(title));
        }
        ui.request_repaint();
        Ok(())
    }
}

impl eframe::App for Program {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.frame(ui, frame).unwrap_or_else(end);
    }
}
