//! The pass as an engine embeds it: its own device, textures and encoder.

use crate::device::{choice, with_host};
use pullfocus_core::diffusion::{JacobiStop, Solver};
use pullfocus_core::{
    Bokeh, Camera, Cancel, DepthDecoding, Diffusion, Distance, Error, Frame, Integrator, Layering, Lens,
    Plane, Preset, Scene, Settings, Show, Size,
};
use pullfocus_gpu::{Buffers, Context, Depth, FrameSettings, Host, Inputs, Picture, Storage};
use pullfocus_testkit::scenes;
use wgpu::{TextureFormat as Format, TextureUsages as Use};

/// Name and test.
pub fn tests() -> Vec<(&'static str, fn())> {
    vec![
        ("textures_give_what_planes_give", textures_give_what_planes_give),
        ("eight_bits_in_and_out", eight_bits_in_and_out),
        ("a_hardware_depth_buffer_is_depth", a_hardware_depth_buffer_is_depth),
        ("a_foreground_of_textures", a_foreground_of_textures),
        ("each_layer_of_textures_alone", each_layer_of_textures_alone),
        ("later_frames_allocate_nothing", later_frames_allocate_nothing),
        ("frames_may_wait_for_one_submission", frames_may_wait_for_one_submission),
        ("half_storage_is_close", half_storage_is_close),
        ("half_storage_has_bright_lights", half_storage_has_bright_lights),
        ("an_output_may_be_an_srgb_view", an_output_may_be_an_srgb_view),
        ("what_does_not_fit_is_refused", what_does_not_fit_is_refused),
        ("small_limits_are_errors_with_numbers", small_limits_are_errors_with_numbers),
        ("webgpus_default_limits_are_enough", webgpus_default_limits_are_enough),
        ("a_lost_device_is_an_error", a_lost_device_is_an_error),
        ("an_engine_hears_of_its_lost_device", an_engine_hears_of_its_lost_device),
    ]
}

fn camera(focus_m: f64) -> Camera {
    Camera::new(Lens::Ideal { fov_x_degrees: 40.0, aperture_diameter_m: 0.06 }, focus_m).expect("a lens")
}

/// Three planes and depth with edges.
fn scene(size: Size) -> Scene {
    let depth =
        scenes::plane(size, |x, y| if (x / 11 + y / 9) % 3 == 0 { 1.0 } else { 2.0 + x as f32 * 0.1 });
    let colors =
        vec![scenes::noise(size, 0.0, 1.0, 1), scenes::checker(size, 5), scenes::ramp(size, 0.1, 0.9)];
    scenes::by_depth(colors, depth)
}

fn texture(device: &wgpu::Device, size: Size, format: Format, usage: Use) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
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
        usage,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&Default::default())
}

fn filled(context: &Context, size: Size, format: Format, bytes: &[u8]) -> wgpu::Texture {
    let texture = texture(context.device(), size, format, Use::TEXTURE_BINDING | Use::COPY_DST);
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some((bytes.len() / size.height) as u32),
        rows_per_image: None,
    };
    context.queue().write_texture(texture.as_image_copy(), bytes, layout, texture.size());
    texture
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// R, G, B and alpha (1 where there is none) as f32.
fn rgba(picture: &pullfocus_core::Picture) -> Vec<u8> {
    let value = |plane: Option<&Plane>, i: usize| plane.map_or(1.0, |plane| plane.data()[i]);
    let area = picture.size().area();
    floats((0..area).flat_map(|i| {
        [0, 1, 2]
            .map(|c| value(picture.colors.get(c), i))
            .into_iter()
            .chain([value(picture.alpha.as_ref(), i)])
    }))
}

/// The texels of a texture, row by row.
fn read(context: &Context, texture: &wgpu::Texture, texel: u32) -> Vec<u8> {
    let row = (texture.width() * texel).next_multiple_of(256);
    let buffer = context.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * texture.height()),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = context.device().create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    let to = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(texture.as_image_copy(), to, texture.size());
    context.queue().submit([encoder.finish()]);
    buffer.slice(..).map_async(wgpu::MapMode::Read, |result| result.expect("the buffer maps"));
    context.device().poll(wgpu::PollType::wait_indefinitely()).expect("the device works");
    let bytes = buffer.slice(..).get_mapped_range().expect("it is mapped").to_vec();
    bytes.chunks(row as usize).flat_map(|line| &line[..(texture.width() * texel) as usize]).copied().collect()
}

fn read_floats(context: &Context, texture: &wgpu::Texture) -> Vec<f32> {
    let bytes = read(context, texture, 16);
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect()
}

/// A frame of textures, made once.
struct Frame32 {
    size: Size,
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    output: wgpu::Texture,
    alpha: bool,
}

impl Frame32 {
    fn new(context: &Context, scene: &Scene) -> Self {
        let size = scene.frame.data.size;
        let picture = &scene.base.picture;
        let Distance::Depth { plane, .. } = &scene.base.distance else { panic!("scenes here have depth") };
        Self {
            size,
            color: view(&filled(context, size, Format::Rgba32Float, &rgba(picture))),
            depth: view(&filled(context, size, Format::R32Float, &floats(plane.data().iter().copied()))),
            output: texture(
                context.device(),
                size,
                Format::Rgba32Float,
                Use::RENDER_ATTACHMENT | Use::COPY_SRC,
            ),
            alpha: picture.alpha.is_some(),
        }
    }

    fn picture(&self) -> Picture<'_> {
        let depth = Depth { view: &self.depth, decoding: Some(DepthDecoding::default()) };
        Picture { color: &self.color, alpha: self.alpha, depth }
    }

    /// Renders at once.
    fn render(
        &self,
        context: &Context,
        buffers: &mut Buffers,
        camera: &Camera,
        settings: &Settings,
    ) -> Vec<f32> {
        let mut encoder = context.device().create_command_encoder(&Default::default());
        self.record(context, &mut encoder, buffers, camera, settings, &self.output).expect("it records");
        context.queue().submit([encoder.finish()]);
        read_floats(context, &self.output)
    }

    fn record(
        &self,
        context: &Context,
        encoder: &mut wgpu::CommandEncoder,
        buffers: &mut Buffers,
        camera: &Camera,
        settings: &Settings,
        output: &wgpu::Texture,
    ) -> pullfocus_core::Result<()> {
        let output = view(output);
        let inputs = Inputs { base: self.picture(), foreground: None, output: &output, output_format: None };
        let frame = FrameSettings { frame: Frame::full(self.size), camera: Some(camera), settings };
        context.record(encoder, buffers, &inputs, &frame, None)
    }
}

fn planes(scene: &Scene, camera: &Camera, settings: &Settings) -> Vec<f32> {
    let mut scene = scene.clone();
    with_host(|host| host.render(&mut scene, Some(camera), settings, &Cancel::new())).expect("it renders");
    let bytes = rgba(&scene.base.picture);
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect()
}

fn largest_difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, d| if d.is_nan() { f32::INFINITY } else { most.max(d) })
}

fn every_layering() -> Vec<Settings> {
    let single = Settings { layering: Layering::Single, ..Settings::default() };
    vec![single, Settings::preset(Preset::Preview), Settings::default(), Settings::preset(Preset::Final)]
}

fn context() -> Context {
    with_host(|host| host.context().clone())
}

fn textures_give_what_planes_give() {
    let mut with_alpha = scene(Size::new(70, 45));
    with_alpha.base.picture.alpha = Some(scenes::ramp(Size::new(70, 45), 0.0, 1.0));
    for scene in [scene(Size::new(70, 45)), scene(Size::new(1, 1)), with_alpha] {
        let context = context();
        let textures = Frame32::new(&context, &scene);
        let mut buffers = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
        for settings in every_layering() {
            let by_textures = textures.render(&context, &mut buffers, &camera(2.5), &settings);
            let by_planes = planes(&scene, &camera(2.5), &settings);
            // The same passes over the same numbers.
            assert_eq!(largest_difference(&by_textures, &by_planes), 0.0, "{settings:?}");
            let mended = Settings { repair_depth: true, ..settings };
            let by_textures = textures.render(&context, &mut buffers, &camera(2.5), &mended);
            assert_eq!(largest_difference(&by_textures, &planes(&scene, &camera(2.5), &mended)), 0.0);
        }
    }
}

fn eight_bits_in_and_out() {
    let size = Size::new(64, 40);
    let scene = scene(size);
    let context = context();
    let exact = Frame32::new(&context, &scene);
    let bytes: Vec<u8> = rgba(&scene.base.picture)
        .chunks_exact(4)
        .map(|b| (f32::from_le_bytes(b.try_into().expect("four bytes")) * 255.0).round() as u8)
        .collect();
    let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
    let settings = Settings::preset(Preset::Preview);
    let expected = exact.render(&context, &mut buffers, &camera(2.5), &settings);
    for format in [Format::Rgba8Unorm, Format::Rgba16Float] {
        let output = texture(context.device(), size, format, Use::RENDER_ATTACHMENT | Use::COPY_SRC);
        let color = view(&filled(&context, size, Format::Rgba8Unorm, &bytes));
        let out = view(&output);
        let inputs = Inputs {
            base: Picture { color: &color, ..exact.picture() },
            foreground: None,
            output: &out,
            output_format: None,
        };
        let camera = camera(2.5);
        let frame = FrameSettings { frame: Frame::full(size), camera: Some(&camera), settings: &settings };
        let mut encoder = context.device().create_command_encoder(&Default::default());
        context.record(&mut encoder, &mut buffers, &inputs, &frame, None).expect("it records");
        context.queue().submit([encoder.finish()]);
        let (found, most): (Vec<f32>, f32) = if format == Format::Rgba8Unorm {
            let found = read(&context, &output, 4).iter().map(|&b| f32::from(b) / 255.0).collect();
            // Half a step of eight bits on the way in and on the way out.
            (found, 1.01 / 255.0)
        } else {
            let bytes = read(&context, &output, 8);
            let halves = bytes.chunks_exact(2).map(|b| half(u16::from_le_bytes([b[0], b[1]])));
            // Half a step of eight bits on the way in, and of a half below 1 on the way out.
            (halves.collect(), 0.505 / 255.0 + 1.0 / 4096.0)
        };
        assert!(largest_difference(&found, &expected) < most, "{format:?}");
    }
}

/// The number that sixteen bits are as a float.
fn half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f32::from(bits & 1023) / 1024.0);
    let size = match exponent {
        0 => fraction * 2f32.powi(-14),
        31 => f32::NAN,
        _ => (1.0 + fraction) * 2f32.powi(exponent - 15),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// Draws a depth texture whose values are `at / z`.
fn hardware_depth(context: &Context, planar: &wgpu::TextureView, size: Size, near: f32) -> wgpu::Texture {
    let device = context.device();
    let depth = texture(device, size, Format::Depth32Float, Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING);
    let source = format!(
        "@group(0) @binding(0) var planar: texture_2d<f32>;
         @vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {{
             return vec4f(f32(i % 2u) * 4.0 - 1.0, f32(i / 2u) * 4.0 - 1.0, 0.0, 1.0);
         }}
         @fragment fn pixel(@builtin(position) at: vec4f) -> @builtin(frag_depth) f32 {{
             return {near} / textureLoad(planar, vec2u(at.xy), 0).x;
         }}"
    );
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: Format::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(planar) }],
    });
    let target = view(&depth);
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    context.queue().submit([encoder.finish()]);
    depth
}

fn a_hardware_depth_buffer_is_depth() {
    let size = Size::new(66, 41);
    let scene = scene(size);
    let context = context();
    let textures = Frame32::new(&context, &scene);
    let near = 0.1;
    let hardware = view(&hardware_depth(&context, &textures.depth, size, near));
    let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
    for settings in every_layering() {
        let camera = camera(2.5);
        let expected = textures.render(&context, &mut buffers, &camera, &settings);
        let decoding = Some(DepthDecoding::hardware(0.0, f64::from(near)));
        let out = view(&textures.output);
        let base = Picture { depth: Depth { view: &hardware, decoding }, ..textures.picture() };
        let inputs = Inputs { base, foreground: None, output: &out, output_format: None };
        let frame = FrameSettings { frame: Frame::full(size), camera: Some(&camera), settings: &settings };
        let mut encoder = context.device().create_command_encoder(&Default::default());
        context.record(&mut encoder, &mut buffers, &inputs, &frame, None).expect("it records");
        context.queue().submit([encoder.finish()]);
        let found = read_floats(&context, &textures.output);
        // 1/z goes through one more rounding of 6e-8, at circles of some 100 px.
        assert!(largest_difference(&found, &expected) < 2e-4, "{settings:?}");
    }
}

/// A lattice before a picture.
fn layered(size: Size) -> Scene {
    let mut scene = scene(size);
    let alpha = scenes::lattice(size, 4, 17);
    let near = pullfocus_core::Picture {
        colors: [0.9, 0.5, 0.1].map(|c| scenes::plane(size, |x, y| c * alpha.at(x, y))).to_vec(),
        alpha: Some(alpha),
    };
    let distance = Distance::Depth { plane: scenes::constant(size, 0.8), decoding: DepthDecoding::default() };
    scene.foreground = Some(pullfocus_core::Element { picture: near, distance });
    scene
}

fn a_foreground_of_textures() {
    layered_textures_give_what_planes_give(every_layering());
}

fn each_layer_of_textures_alone() {
    let numbers = [0, 1, 2, 3, 5];
    let shows = numbers.map(Show::Layer).into_iter().chain(numbers.map(Show::Matte));
    let alone = |settings: Settings| {
        shows.clone().map(move |show| {
            let bokeh = Some(Bokeh { threshold: 0.5, ..Bokeh::default() });
            Settings { show, bokeh, ..settings.clone() }
        })
    };
    layered_textures_give_what_planes_give(every_layering().into_iter().flat_map(alone).collect());
}

fn layered_textures_give_what_planes_give(all: Vec<Settings>) {
    let size = Size::new(60, 44);
    let scene = layered(size);
    let context = context();
    let base = Frame32::new(&context, &scene);
    let element = scene.foreground.clone().expect("it has one");
    let front = Frame32::new(&context, &Scene::new(scene.frame, element));
    let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
    for settings in all {
        let (camera, out) = (camera(3.0), view(&base.output));
        let inputs = Inputs {
            base: base.picture(),
            foreground: Some(front.picture()),
            output: &out,
            output_format: None,
        };
        let frame = FrameSettings { frame: scene.frame, camera: Some(&camera), settings: &settings };
        let mut encoder = context.device().create_command_encoder(&Default::default());
        context.record(&mut encoder, &mut buffers, &inputs, &frame, None).expect("it records");
        context.queue().submit([encoder.finish()]);
        let found = read_floats(&context, &base.output);
        assert_eq!(largest_difference(&found, &planes(&scene, &camera, &settings)), 0.0, "{settings:?}");
    }
}

fn later_frames_allocate_nothing() {
    // Its own, so that no other test's pipelines are counted.
    let shared = context();
    let context = Context::new(shared.device(), shared.queue());
    let textures = Frame32::new(&context, &scene(Size::new(80, 50)));
    let mut buffers = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
    for settings in every_layering() {
        let out = view(&textures.output);
        let inputs = Inputs { base: textures.picture(), foreground: None, output: &out, output_format: None };
        let camera_2 = camera(2.0);
        let frame =
            FrameSettings { frame: Frame::full(textures.size), camera: Some(&camera_2), settings: &settings };
        context.prepare(&mut buffers, &inputs, &frame).expect("it prepares");
        let (made, bytes, pipelines) = (buffers.made(), buffers.bytes(), context.pipelines());
        for focus in [1.0, 2.0, 5.0] {
            textures.render(&context, &mut buffers, &camera(focus), &settings);
        }
        assert_eq!((made, bytes, pipelines), (buffers.made(), buffers.bytes(), context.pipelines()));
    }
    let before = buffers.bytes();
    buffers.resize(&context, Size::new(10, 10)).expect("it shrinks");
    assert!(buffers.bytes() < before);
}

fn frames_may_wait_for_one_submission() {
    let context = context();
    let textures = Frame32::new(&context, &scene(Size::new(72, 48)));
    let mut buffers = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
    let settings = Settings::preset(Preset::Preview);
    let focuses = [1.0, 1.5, 3.0, 8.0];
    assert_eq!(focuses.len() as u64, Buffers::MOST_PENDING);
    let one_by_one = focuses.map(|focus| textures.render(&context, &mut buffers, &camera(focus), &settings));
    let outputs = focuses.map(|_| {
        texture(context.device(), textures.size, Format::Rgba32Float, Use::RENDER_ATTACHMENT | Use::COPY_SRC)
    });
    let commands = [0, 1, 2, 3].map(|i| {
        let mut encoder = context.device().create_command_encoder(&Default::default());
        let camera = camera(focuses[i]);
        // What is thrown away or refused in between takes nobody's place.
        let out = view(&textures.output);
        let inputs = Inputs { base: textures.picture(), foreground: None, output: &out, output_format: None };
        let full = Frame::full(textures.size);
        let frame = FrameSettings { frame: full, camera: Some(&camera), settings: &settings };
        context.prepare(&mut buffers, &inputs, &frame).expect("it prepares");
        let refused = context.prepare(&mut buffers, &inputs, &FrameSettings { camera: None, ..frame });
        assert_eq!(refused, Err(Error::NoCamera));
        textures
            .record(&context, &mut encoder, &mut buffers, &camera, &settings, &outputs[i])
            .expect("it records");
        encoder.finish()
    });
    context.queue().submit(commands);
    for (output, expected) in outputs.iter().zip(&one_by_one) {
        assert_eq!(largest_difference(&read_floats(&context, output), expected), 0.0);
    }
    assert!(largest_difference(&one_by_one[0], &one_by_one[3]) > 0.1, "the focus matters");
}

fn half_storage_is_close() {
    let context = context();
    let textures = Frame32::new(&context, &scene(Size::new(90, 60)));
    let mut full = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
    let mut half = Buffers::new(&context, textures.size, Storage::Half).expect("buffers");
    for settings in every_layering() {
        let a = textures.render(&context, &mut full, &camera(2.5), &settings);
        let b = textures.render(&context, &mut half, &camera(2.5), &settings);
        let difference = largest_difference(&a, &b);
        // f16 rounds by 5e-4 of values up to 1, some ten times over; the disc's fields are some ten times their sum.
        assert!(difference > 0.0 && difference < 5e-2, "{settings:?}: {difference}");
    }
    assert!(half.bytes() < full.bytes());
}

/// The disc's fields are twice as large as what is blurred; halves end at 65504.
fn half_storage_has_bright_lights() {
    let size = Size::new(90, 60);
    let lamp =
        |x: usize, y: usize| if (20..70).contains(&x) && (10..50).contains(&y) { 60000.0 } else { 1.0 };
    let scene = scenes::by_depth(vec![scenes::plane(size, lamp); 3], scenes::constant(size, 0.3));
    let context = context();
    let textures = Frame32::new(&context, &scene);
    let mut full = Buffers::new(&context, size, Storage::Full).expect("buffers");
    let mut half = Buffers::new(&context, size, Storage::Half).expect("buffers");
    for solver in [Solver::Lu, Solver::CyclicReduction] {
        let diffusion = Diffusion { integrator: Integrator::Disc, solver, ..Diffusion::default() };
        let settings = Settings { diffusion, layering: Layering::Single, ..Settings::default() };
        let a = textures.render(&context, &mut full, &camera(2.5), &settings);
        let b = textures.render(&context, &mut half, &camera(2.5), &settings);
        let difference = largest_difference(&a, &b);
        // Some ten roundings by 5e-4.
        assert!(difference > 0.0 && difference < 5e-3 * 60000.0, "{solver:?}: {difference}");
    }
}

fn an_output_may_be_an_srgb_view() {
    let size = Size::new(64, 40);
    let context = context();
    let exact = Frame32::new(&context, &scene(size));
    let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
    let settings = Settings::preset(Preset::Preview);
    let camera = camera(2.5);
    let expected = exact.render(&context, &mut buffers, &camera, &settings);
    let descriptor =
        texture_of(&exact, Format::Rgba8Unorm, Use::RENDER_ATTACHMENT | Use::TEXTURE_BINDING | Use::COPY_SRC);
    let srgb = Some(Format::Rgba8UnormSrgb);
    let descriptor = wgpu::TextureDescriptor { view_formats: &[Format::Rgba8UnormSrgb], ..descriptor };
    let output = context.device().create_texture(&descriptor);
    let out = output.create_view(&wgpu::TextureViewDescriptor { format: srgb, ..Default::default() });
    let inputs = Inputs { base: exact.picture(), foreground: None, output: &out, output_format: srgb };
    let frame = FrameSettings { frame: Frame::full(size), camera: Some(&camera), settings: &settings };
    let mut encoder = context.device().create_command_encoder(&Default::default());
    context.record(&mut encoder, &mut buffers, &inputs, &frame, None).expect("it records");
    context.queue().submit([encoder.finish()]);
    let bytes = read(&context, &output, 4);
    for (texel, expected) in bytes.chunks_exact(4).zip(expected.chunks_exact(4)) {
        for (&byte, &expected) in texel[..3].iter().zip(expected) {
            let linear = expected.clamp(0.0, 1.0);
            let shown =
                if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
            // Devices may round by somewhat more than half a step.
            assert!((f32::from(byte) - 255.0 * shown).abs() < 0.75, "{byte}, {expected}");
        }
    }
    let other = Inputs { output_format: Some(Format::Bgra8UnormSrgb), ..inputs };
    let mut encoder = context.device().create_command_encoder(&Default::default());
    let refused = context.record(&mut encoder, &mut buffers, &other, &frame, None);
    assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");
}

fn what_does_not_fit_is_refused() {
    let context = context();
    let textures = Frame32::new(&context, &scene(Size::new(20, 10)));
    let mut other = Buffers::new(&context, Size::new(21, 10), Storage::Full).expect("buffers");
    let mut encoder = context.device().create_command_encoder(&Default::default());
    let settings = Settings::preset(Preset::Preview);
    let output = &textures.output;
    let refused = textures.record(&context, &mut encoder, &mut other, &camera(2.0), &settings, output);
    assert!(matches!(refused, Err(Error::SizeMismatch { .. })), "{refused:?}");

    let mut buffers = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
    let jacobi = Solver::Jacobi(JacobiStop::Tolerance(1e-3));
    let diffusion = Diffusion { solver: jacobi, ..settings.diffusion };
    let looking = Settings { diffusion, ..settings.clone() };
    let refused = textures.record(&context, &mut encoder, &mut buffers, &camera(2.0), &looking, output);
    assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");

    let whole_numbers = texture(context.device(), textures.size, Format::Rgba8Uint, Use::TEXTURE_BINDING);
    let (color, out) = (view(&whole_numbers), view(output));
    let inputs = Inputs {
        base: Picture { color: &color, ..textures.picture() },
        foreground: None,
        output: &out,
        output_format: None,
    };
    let camera = camera(2.0);
    let frame =
        FrameSettings { frame: Frame::full(textures.size), camera: Some(&camera), settings: &settings };
    let refused = context.record(&mut encoder, &mut buffers, &inputs, &frame, None);
    assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?}");
    let none = FrameSettings { camera: None, ..frame };
    let inputs = Inputs { base: textures.picture(), foreground: None, output: &out, output_format: None };
    let refused = context.record(&mut encoder, &mut buffers, &inputs, &none, None);
    assert_eq!(refused, Err(Error::NoCamera));

    // Textures that cannot be bound, in each place.
    let one = texture_of(&textures, Format::Rgba32Float, Use::STORAGE_BINDING);
    let volume = wgpu::TextureDescriptor { dimension: wgpu::TextureDimension::D3, ..one.clone() };
    let volume = wgpu::TextureDescriptor { usage: Use::TEXTURE_BINDING | Use::RENDER_ATTACHMENT, ..volume };
    let samples = wgpu::TextureDescriptor {
        sample_count: 4,
        format: Format::Rgba16Float,
        usage: Use::TEXTURE_BINDING | Use::RENDER_ATTACHMENT,
        ..one.clone()
    };
    for descriptor in [one, volume, samples] {
        let made = context.device().create_texture(&descriptor);
        let bad = view(&made);
        let base = textures.picture();
        let depth = Picture { depth: Depth { view: &bad, ..base.depth }, ..base };
        let color = Picture { color: &bad, ..base };
        let output = Inputs { output: &bad, ..inputs };
        let near = Inputs { foreground: Some(depth), ..inputs };
        for inputs in [Inputs { base: depth, ..inputs }, Inputs { base: color, ..inputs }, output, near] {
            let refused = context.record(&mut encoder, &mut buffers, &inputs, &frame, None);
            assert!(matches!(refused, Err(Error::Unsupported { .. })), "{refused:?} {descriptor:?}");
        }
    }
    // Nothing of all that is in the encoder.
    context.queue().submit([encoder.finish()]);
    assert_eq!(buffers.made(), 0);
}

fn texture_of(frame: &Frame32, format: Format, usage: Use) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: None,
        size: frame.output.size(),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// A device of its own, with the limits that `change` makes of WebGPU's defaults.
fn small_device(change: impl FnOnce(&mut wgpu::Limits)) -> Context {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    // OpenGL, which another crate of the workspace may have switched on, complains where it has no driver.
    descriptor.backends = wgpu::Backends::PRIMARY;
    descriptor.flags = wgpu::InstanceFlags::VALIDATION;
    let instance = wgpu::Instance::new(descriptor);
    let wanted = match choice() {
        Some(pullfocus_gpu::Choice::Named(name)) => name,
        other => panic!("an adapter was found before: {other:?}"),
    };
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let adapter =
        adapters.into_iter().find(|adapter| adapter.get_info().name == wanted).expect("it is there");
    let mut limits = wgpu::Limits::default();
    change(&mut limits);
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a small device");
    Context::new(&device, &queue)
}

fn small_limits_are_errors_with_numbers() {
    let context = small_device(|limits| limits.max_storage_buffers_per_shader_stage = 4);
    assert!(!Context::is_usable(context.limits()));
    let refused = Buffers::new(&context, Size::new(8, 8), Storage::Full);
    let error = refused.expect_err("eight buffers cannot be bound");
    assert!(matches!(error, Error::DeviceLimit { needed: 8, allowed: 4, .. }), "{error}");
    let context = small_device(|limits| limits.max_storage_buffer_binding_size = 1 << 20);
    let refused = Buffers::new(&context, Size::new(512, 512), Storage::Full);
    let error = refused.expect_err("four megabytes do not fit into one");
    assert!(matches!(error, Error::DeviceLimit { needed: 4194304, allowed: 1048576, .. }), "{error}");
    assert!(Buffers::new(&context, Size::new(256, 256), Storage::Full).is_ok());
    assert!(Buffers::new(&context, Size::new(512, 256), Storage::Half).is_ok());
}

fn webgpus_default_limits_are_enough() {
    let context = small_device(|_| {});
    // Long in both directions: 256 invocations and 16 KiB must do.
    for size in [Size::new(2500, 6), Size::new(5, 2300), Size::new(70, 45)] {
        let scene = scene(size);
        let textures = Frame32::new(&context, &scene);
        let mut buffers = Buffers::new(&context, size, Storage::Full).expect("buffers");
        for settings in every_layering() {
            let found = textures.render(&context, &mut buffers, &camera(2.5), &settings);
            let expected = planes(&scene, &camera(2.5), &settings);
            // Lines are cut into other chunks there: rounding, of terms 14 times their sum.
            assert!(largest_difference(&found, &expected) < 2e-4, "{size} {settings:?}");
        }
    }
}

fn a_lost_device_is_an_error() {
    let choice = choice().expect("an adapter: the test is ignored without");
    let mut host = Host::open(&choice).expect("it opens");
    let mut scene = scene(Size::new(40, 30));
    let before = scene.clone();
    let settings = Settings::preset(Preset::Preview);
    host.render(&mut scene, Some(&camera(2.0)), &settings, &Cancel::new()).expect("it renders");
    let mut scene = before.clone();
    host.context().device().destroy();
    let lost = host.render(&mut scene, Some(&camera(2.0)), &settings, &Cancel::new());
    assert!(matches!(lost, Err(Error::DeviceLost { .. })), "{lost:?}");
    assert!(scene == before, "the picture is as it was");
    // And a new one works.
    let mut host = Host::open(&choice).expect("it opens again");
    host.render(&mut scene, Some(&camera(2.0)), &settings, &Cancel::new()).expect("it renders again");
}

fn an_engine_hears_of_its_lost_device() {
    let context = small_device(|_| {});
    let lost = context.when_lost();
    context.device().set_device_lost_callback(move |_, reason| lost(reason));
    let textures = Frame32::new(&context, &scene(Size::new(40, 30)));
    let mut buffers = Buffers::new(&context, textures.size, Storage::Full).expect("buffers");
    let settings = Settings::preset(Preset::Preview);
    textures.render(&context, &mut buffers, &camera(2.0), &settings);
    let mut encoder = context.device().create_command_encoder(&Default::default());
    context.device().destroy();
    // Callbacks are called by whoever polls or submits next.
    let _ = context.device().poll(wgpu::PollType::Poll);
    let output = &textures.output;
    let lost = textures.record(&context, &mut encoder, &mut buffers, &camera(2.0), &settings, output);
    assert!(matches!(lost, Err(Error::DeviceLost { .. })), "{lost:?}");
}
