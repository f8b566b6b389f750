//! The native window.

use crate::ui::{App, Start};
use eframe::egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use eframe::{egui, wgpu};
use std::sync::Arc;

/// How the window's device is opened: with all that the adapter has, since pictures are large, and timestamps.
pub fn setup() -> WgpuSetup {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("pullfocus view"),
        required_features: wgpu::Features::TIMESTAMP_QUERY & adapter.features(),
        required_limits: adapter.limits(),
        memory_hints: wgpu::MemoryHints::Performance,
        ..Default::default()
    });
    // Validation layers of some systems refuse names in shaders; drivers need none.
    setup.instance_descriptor.flags = wgpu::InstanceFlags::empty().with_env();
    WgpuSetup::CreateNew(setup)
}

/// Opens the window and stays until it is closed.
///
/// # Errors
/// One sentence: no screen, nothing to draw with.
pub fn run(start: Start) -> Result<(), String> {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("pullfocus")
            .with_app_id("pullfocus")
            .with_inner_size([1440.0, 900.0])
            .with_min_inner_size([900.0, 560.0])
            .with_drag_and_drop(true),
        wgpu_options: WgpuConfiguration { wgpu_setup: setup(), ..Default::default() },
        ..Default::default()
    };
    eframe::run_native(
        "pullfocus",
        options,
        Box::new(move |cc| match App::new(cc, start) {
            Ok(app) => Ok(Box::new(app) as Box<dyn eframe::App>),
            Err(sentence) => Err(sentence.into()),
        }),
    )
    .map_err(|error| {
        format!("the window cannot be opened: {error}; is there a screen, and a driver for Vulkan, Metal, Direct3D 12 or OpenGL? `pullfocus render` needs none")
    })
}
