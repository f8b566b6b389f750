//! A walk through every shader without any device: everything that can be asked for is recorded on wgpu's empty backend,
//! which parses, validates (`naga`) and compares layouts as a device would, and then does nothing.

use crate::context::Context;
use crate::diffusion::{self, Conductivity, How, Medium};
use crate::embed::{Buffers, Depth, FrameSettings, Inputs, Picture};
use crate::host::Host;
use crate::memory::Memory;
use crate::planes::{Group, Storage};
use crate::recorder::{Recorder, Sink};
use crate::timer::Timer;
use pullfocus_core::aperture::Mask;
use pullfocus_core::diffusion::{JacobiStop, Solver};
use pullfocus_core::response::Rational;
use pullfocus_core::{
    Aperture, ApertureShape, Bokeh, Camera, Cancel, DepthDecoding, Diffusion, Error, Frame, Integrator,
    Layering, Lens, Method, Preset, Settings, Show, Size,
};
use std::collections::BTreeSet;
use wgpu::TextureFormat as Format;

/// A context whose device does nothing, and the faults that it finds.
fn empty() -> (Context, std::sync::Arc<std::sync::Mutex<Vec<String>>>) {
    let descriptor = wgpu::DeviceDescriptor {
        required_limits: wgpu::Limits {
            max_compute_invocations_per_workgroup: 1024,
            ..wgpu::Limits::default()
        },
        ..Default::default()
    };
    let (device, queue) = wgpu::Device::noop(&descriptor);
    let faults = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let heard = faults.clone();
    device.on_uncaptured_error(std::sync::Arc::new(move |error: wgpu::Error| {
        heard.lock().expect("no test panics in here").push(error.to_string());
    }));
    (Context::new(&device, &queue), faults)
}

fn view(context: &Context, size: Size, format: Format) -> wgpu::TextureView {
    let texture = context.device().create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d {
            width: size.width as u32,
            height: size.height as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Every layering, integrator and solver, over textures.
fn frames(context: &Context, size: Size, storage: Storage) {
    let mut buffers = Buffers::new(context, size, storage).expect("buffers");
    let color = view(context, size, Format::Rgba16Float);
    let planar = view(context, size, Format::R32Float);
    let hardware = view(context, size, Format::Depth32Float);
    let lens = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
    let camera = Camera::new(lens, 2.0).expect("a lens");
    let disc = Settings::default();
    let many = Settings { layering: Layering::General { layers: 7 }, ..disc.clone() };
    let thrice = Layering::Background { layers: 3, threshold: 0.01 };
    let background = Settings { layering: thrice, repair_depth: true, ..disc.clone() };
    let spread = |base: &Settings| Settings { method: Method::Aperture, ..base.clone() };
    let [one, thick, last] = [&disc, &background, &many].map(spread);
    let one = Settings { layering: Layering::Single, aperture: Aperture::blades(5, 9.0), ..one };
    let mask = Mask::new(3, 2, vec![1.0, 2.0, 0.0, 1.0, 0.5, 1.0]).expect("a picture of an aperture");
    let heart = Aperture { shape: ApertureShape::Image(mask), ..Aperture::DISC };
    let lights = |layering, cats_eye, aperture| Settings {
        layering,
        bokeh: Some(Bokeh { cats_eye, ..Bokeh::default() }),
        aperture,
        ..Settings::default()
    };
    let highlights = [
        lights(Layering::Single, 0.0, Aperture::DISC),
        lights(Layering::PAPER, 0.5, Aperture::blades(5, 0.0)),
        lights(Layering::General { layers: 3 }, 0.0, Aperture::blades(6, 0.0)),
        lights(Layering::General { layers: 3 }, 0.5, heart.clone()),
        lights(Layering::Single, 0.5, heart),
    ];
    let preview = Settings::preset(Preset::Preview);
    let alone = |base: &Settings| {
        let shows = [Show::Layer(0), Show::Layer(2), Show::Matte(0), Show::Matte(2), Show::Layer(99)];
        shows.map(|show| Settings { show, ..base.clone() })
    };
    let alone = [&disc, &background, &thick, &highlights[0], &highlights[2]].map(alone);
    let plain = [disc, many, background, preview, one, thick, last];
    for settings in plain.into_iter().chain(highlights).chain(alone.into_iter().flatten()) {
        for alpha in [false, true] {
            for depth in [&planar, &hardware] {
                let depth = Depth { view: depth, decoding: Some(DepthDecoding::default()) };
                let base = Picture { color: &color, alpha, depth };
                let inputs = Inputs { base, foreground: Some(base), output: &color, output_format: None };
                let frame =
                    FrameSettings { frame: Frame::full(size), camera: Some(&camera), settings: &settings };
                context.prepare(&mut buffers, &inputs, &frame).expect("it records");
            }
        }
    }
}

fn diffusions(context: &Context, size: Size, storage: Storage) {
    let mut memory = Memory::new(context).expect("memory");
    let rational = Integrator::Rational(Rational::GAUSSIAN);
    for integrator in [Integrator::BackwardEuler { steps: 2 }, rational, Integrator::Disc] {
        for solver in [
            Solver::Lu,
            Solver::CyclicReduction,
            Solver::ParallelCyclicReduction,
            Solver::Hybrid,
            Solver::Jacobi(JacobiStop::Sweeps(3)),
        ] {
            let settings = Diffusion { integrator, solver, ..Diffusion::default() };
            let mut encoder = context.device().create_command_encoder(&Default::default());
            let mut recorder =
                Recorder::new(context, &mut memory, Sink::Encoder(&mut encoder), None).expect("a recorder");
            let circle = recorder.take_plane(size).expect("a plane");
            let gamma = recorder.take_plane(size).expect("a plane");
            for planes in [1, 4] {
                let group = Group::take(&mut recorder, size, planes, storage).expect("a group");
                for (conductivity, gamma) in [
                    (Conductivity::Circle(&circle), None),
                    (Conductivity::Circle(&circle), Some(&gamma)),
                    (Conductivity::Uniform(3.0), None),
                    (Conductivity::Uniform(3.0), Some(&gamma)),
                ] {
                    let medium = Medium { conductivity, gamma, vertical_scale: 1.0 };
                    let how = How { floor_at_zero: true, ..How::default() };
                    diffusion::diffuse(&mut recorder, size, &[&group], &medium, &settings, &how)
                        .expect("it records");
                }
            }
        }
    }
}

#[test]
fn every_shader_is_valid_and_lies_in_memory_as_the_program_says() {
    let (context, faults) = empty();
    let size = Size::new(64, 48);
    for storage in [Storage::Full, Storage::Half] {
        frames(&context, size, storage);
        diffusions(&context, size, storage);
    }
    // What only hosts do.
    let mut host = Host::with_context(context.clone()).expect("a host");
    let mut scene = pullfocus_testkit::scenes::fence_over_ramp(size, -5.0, 9.0);
    let cancel = Cancel::new();
    // Nothing is computed, so nothing comes back; but everything is recorded.
    let _ = host.render(&mut scene, None, &Settings::default(), &cancel);
    let plane = pullfocus_testkit::scenes::constant(size, 2.0);
    let mut by_depth = pullfocus_testkit::scenes::by_depth(vec![plane.clone()], plane.clone());
    let lens = Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.02 };
    let camera = Camera::new(lens, 2.0).expect("a lens");
    let _ = host.render(&mut by_depth, Some(&camera), &Settings::preset(Preset::Preview), &cancel);
    let tolerance = Solver::Jacobi(JacobiStop::Tolerance(1e-3));
    for integrator in [Integrator::BackwardEuler { steps: 1 }, Integrator::Disc] {
        let settings = Diffusion { integrator, solver: tolerance, ..Diffusion::default() };
        let _ = host.diffuse(&mut [plane.clone()], (&plane, None, 1.0), &settings, &cancel);
    }
    let _ = host.time_copy(1 << 16, 1, &cancel);

    let faults = faults.lock().expect("no test panics in there").clone();
    assert!(faults.is_empty(), "{} faults, the first: {}", faults.len(), faults[0]);
    let used: BTreeSet<String> =
        context.specs().iter().flat_map(|spec| &spec.parts).map(|part| part.name.to_owned()).collect();
    let written = written(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/shaders"), "");
    assert_eq!(used, written, "every file is a part of a shader");
    for spec in context.specs() {
        assert_eq!(crate::barriers::check(&spec.source()), Ok(()), "{}", spec.label());
    }
}

/// Names of all shader files.
fn written(folder: &std::path::Path, prefix: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(folder).expect("the shaders' folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            names.extend(written(&path, &format!("{prefix}{name}/")));
        } else {
            names.insert(format!("{prefix}{name}"));
        }
    }
    names
}

#[test]
fn a_timer_begins_anew_with_each_recording() {
    let required_features = wgpu::Features::TIMESTAMP_QUERY;
    let (device, queue) =
        wgpu::Device::noop(&wgpu::DeviceDescriptor { required_features, ..Default::default() });
    let context = Context::new(&device, &queue);
    let mut timer = Timer::new(&context).expect("a device with timestamps");
    let size = Size::new(16, 8);
    let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
    let color = view(&context, size, Format::Rgba16Float);
    let depth = Depth { view: &view(&context, size, Format::R32Float), decoding: None };
    let base = Picture { color: &color, alpha: false, depth };
    let inputs = Inputs { base, foreground: None, output: &color, output_format: None };
    let settings = Settings::preset(Preset::Preview);
    let frame = FrameSettings { frame: Frame::full(size), camera: None, settings: &settings };
    let mut pieces = Vec::new();
    for _ in 0..3 {
        let mut encoder = device.create_command_encoder(&Default::default());
        context.record(&mut encoder, &mut buffers, &inputs, &frame, Some(&mut timer)).expect("it records");
        pieces.push(timer.pieces());
    }
    assert!(pieces[0] > 0 && pieces.iter().all(|&count| count == pieces[0]), "{pieces:?}");
}

#[test]
fn a_frame_that_fails_again_makes_no_new_buffers() {
    let required_limits = wgpu::Limits { max_storage_buffer_binding_size: 40_000, ..wgpu::Limits::default() };
    let (device, queue) =
        wgpu::Device::noop(&wgpu::DeviceDescriptor { required_limits, ..Default::default() });
    let context = Context::new(&device, &queue);
    let size = Size::new(64, 48);
    let mut buffers = Buffers::new(&context, size, Storage::Half).expect("a group fits");
    let color = view(&context, size, Format::Rgba16Float);
    let depth = Depth { view: &view(&context, size, Format::R32Float), decoding: None };
    let base = Picture { color: &color, alpha: false, depth };
    let inputs = Inputs { base, foreground: None, output: &color, output_format: None };
    let settings = Settings { bokeh: Some(Bokeh::default()), ..Settings::default() };
    let frame = FrameSettings { frame: Frame::full(size), camera: None, settings: &settings };
    let mut counts = Vec::new();
    for _ in 0..3 {
        let refused = context.prepare(&mut buffers, &inputs, &frame);
        // Highlights have 16 bytes a pixel, a group of halves 8.
        assert!(matches!(refused, Err(Error::DeviceLimit { needed: 49_152, .. })), "{refused:?}");
        counts.push((buffers.made(), buffers.bytes()));
    }
    assert!(counts[0].0 > 0 && counts.iter().all(|&count| count == counts[0]), "{counts:?}");
}

#[test]
fn too_many_uniforms_are_an_error() {
    let (context, _) = empty();
    let mut memory = Memory::new(&context).expect("memory");
    let mut encoder = context.device().create_command_encoder(&Default::default());
    let mut recorder =
        Recorder::new(&context, &mut memory, Sink::Encoder(&mut encoder), None).expect("a recorder");
    let refused = (0u32..100_000).find_map(|i| recorder.uniform(&i.to_le_bytes()).err());
    assert!(matches!(refused, Some(Error::DeviceLimit { allowed: 1048576, .. })), "{refused:?}");
}
