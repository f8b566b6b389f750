//! What can be seen of the layers from inside alone; `tests/gpu` has the rest.

use super::general::{composite, take_apart};
use super::{blur_layers, census};
use crate::context::Context;
use crate::diffusion::Tuning;
use crate::memory::Memory;
use crate::planes::{Group, Storage, groups};
use crate::recorder::{Recorder, Sink};
use crate::transfer::{download, upload, upload_plane};
use crate::work::Work;
use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::layers::general as core_layers;
use pullfocus_core::split::{self as core_split, Census, Split, fast_asinh, knee, unit};
use pullfocus_core::{Cancel, Frame, Plane, Settings, Size};
use pullfocus_testkit::random::Random;
use pullfocus_testkit::scenes;

/// A device with no more than WebGPU's default limits, or none: then there is nothing to test, and the test says so.
fn context() -> Option<Context> {
    let wanted = std::env::var("PULLFOCUS_TEST_ADAPTER").unwrap_or_default().to_lowercase();
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::PRIMARY;
    let instance = wgpu::Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::PRIMARY));
    let named = |adapter: &wgpu::Adapter| adapter.get_info().name.to_lowercase().contains(&wanted);
    let Some(adapter) = adapters.into_iter().find(named) else {
        eprintln!("skipped: no adapter was found");
        return None;
    };
    let request = adapter.request_device(&wgpu::DeviceDescriptor::default());
    let (device, queue) = pollster::block_on(request).expect("the adapter opens");
    Some(Context::new(&device, &queue))
}

/// Does something with the surroundings of a render of `size`; `in_focus` says that all of it is.
fn with_work<T>(
    context: &Context,
    size: Size,
    storage: Storage,
    in_focus: bool,
    run: impl FnOnce(&mut Work<'_, '_>) -> T,
) -> T {
    let cancel = Cancel::default();
    let mut memory = Memory::new(context).unwrap();
    let sink = Sink::Host { encoder: None, cancel: &cancel, work: 0 };
    let mut recorder = Recorder::new(context, &mut memory, sink, None).unwrap();
    let range = recorder.take(size, 8).unwrap();
    let ordered = |x: f32| if x.is_sign_negative() { !x.to_bits() } else { x.to_bits() | 0x8000_0000 };
    let most = if in_focus { 0.0 } else { 50.0 };
    context.queue().write_buffer(&range, 0, bytemuck::cast_slice(&[ordered(0.0), ordered(most)]));
    let (frame, settings) = (Frame::full(size), Settings::default());
    let mut work = Work::new(&mut recorder, &frame, &settings, storage, Tuning::default(), range);
    let result = run(&mut work);
    recorder.finish().unwrap();
    result
}

/// Bars before a textured ramp: planes and diameters.
fn busy(size: Size, planes: usize) -> (Vec<Plane>, Plane) {
    let scene = scenes::fence_over_ramp(size, -14.0, 9.0);
    let mut all = scene.base.picture.colors;
    let mut random = Random::new(5);
    while all.len() < planes {
        all.push(Plane::from_fn(size, |_, _| random.between(0.0, 2.0) as f32).unwrap());
    }
    all.truncate(planes);
    (all, scene.base.distance.plane().clone())
}

fn bring(work: &mut Work<'_, '_>, planes: &[Plane], coc: &Plane) -> (Vec<Group>, wgpu::Buffer) {
    let (size, storage) = (work.size, work.storage);
    let planes: Vec<&Plane> = planes.iter().collect();
    let sizes = groups(planes.len() + 1);
    let picture = upload(work.recorder, size, &planes, &sizes, storage, false).unwrap();
    (picture, upload_plane(work.recorder, coc).unwrap())
}

fn fetch(work: &mut Work<'_, '_>, picture: &[Group], planes: usize) -> Vec<Plane> {
    let mut all = vec![Plane::default(); planes];
    download(work.recorder, work.size, picture, all.iter_mut()).unwrap();
    all
}

#[test]
fn the_shaders_constants_are_cores() {
    use core_layers::*;
    use core_split::*;
    let text = crate::shader::part!("layers/constants").text;
    let mut lines = text.lines().skip(1);
    let mut expect = |line: String| assert_eq!(lines.next(), Some(line.as_str()));
    let pair = |name: &str, [a, b]: [f64; 2]| format!("const {name}: vec2f = vec2f({a:?}, {b:?});");
    expect(format!("const MOST_LAYERS: u32 = {MOST_LAYERS};"));
    expect(format!("const BINS: u32 = {BINS};"));
    for (name, value) in [
        ("U_MAX", U_MAX),
        ("BIN", BIN),
        ("EDGE_FROM", EDGE_FROM.into()),
        ("EDGE_TO", EDGE_TO.into()),
        ("WEIGHTS_DEVIATION", WEIGHTS_DEVIATION),
        ("PLACE_DEVIATION", PLACE_DEVIATION),
        ("LEAST_WINDOW", LEAST_WINDOW),
        ("ALL_PIXELS", ALL_PIXELS),
        ("LEAST_ENDS", LEAST_ENDS),
        ("NO_SPANS", NO_SPANS),
        ("NO_DENSITY", NO_DENSITY),
    ] {
        expect(format!("const {name}: f32 = {value:?};"));
    }
    expect(pair("HALF", HALF));
    expect(pair("OVERLAP", OVERLAP));
    expect(format!("const SHARPNESS: f32 = {SHARPNESS:?};"));
    expect(format!("const INERTIA: f32 = {INERTIA:?};"));
    expect(format!("const ROUNDS: u32 = {ROUNDS};"));
    expect(pair("EDGE_STEP", EDGE_STEP.map(f64::from)));
    for (name, value) in [
        ("EDGE_TRUST", EDGE_TRUST),
        ("COLOR_NOISE", COLOR_NOISE),
        ("VARIANCE", VARIANCE),
        ("LEAST_SHARE", LEAST_SHARE),
        ("OWN_FROM", OWN_FROM),
    ] {
        expect(format!("const {name}: f32 = {value:?};"));
    }
    assert_eq!(lines.next(), None);
}

/// What `scale.wgsl` calls a `Split`.
fn read_split(work: &mut Work<'_, '_>, coc: &Plane, layers: u32) -> Split {
    let buffer = upload_plane(work.recorder, coc).unwrap();
    let split = census::split(work, &buffer, layers).unwrap();
    let bytes = work.recorder.read(&split, census::SPLIT_BYTES).unwrap();
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let float = |at: usize| f32::from_bits(words[at]);
    let first = 4 + 4 * MOST_LAYERS as usize;
    let cuts = (0..words[1] as usize - 1).map(|i| first + 4 * i);
    let cuts = cuts.map(|at| core_split::Cut { at: float(at), half: float(at + 1), overlap: float(at + 2) });
    let split = Split { cuts: cuts.collect(), knee: float(0) };
    for layer in 0..split.layers() {
        let there: Vec<f32> = (0..4).map(|k| float(4 + 4 * layer + k)).collect();
        for u in [-3.0f32, -0.4, 0.0, 0.3, 2.0] {
            let step = |start: f32, slope: f32| core_split::smoothstep((u - start) * slope);
            let behind = step(there[0], there[1]);
            let seen = behind * (1.0 - step(there[2], there[3]));
            let expected = split.membership(layer, u);
            // A ramp's ends are sums of three f32 below 8, and its slope is at most some hundreds.
            assert!((seen - expected.seen).abs() < 1e-3 && (behind - expected.behind).abs() < 1e-3);
        }
    }
    split
}

/// As the CPU's `layers::census` counts.
fn core_census(coc: &Plane, display_width: f32) -> Census {
    let Size { width, height } = coc.size();
    let position = |c: f32| fast_asinh(c / knee(display_width));
    let per_step = 1.0 / unit(display_width);
    let mut census = Census::default();
    for y in 0..height {
        for x in 0..width {
            let c = coc.at(x, y);
            census.pixel(position(c));
            let right = (x + 1 < width).then(|| coc.at(x + 1, y));
            let below = (y + 1 < height).then(|| coc.at(x, y + 1));
            for other in [right, below].into_iter().flatten() {
                census.pair(position(c), position(other), (c - other).abs() * per_step);
            }
        }
    }
    census
}

#[test]
fn cuts_are_cores() {
    let Some(context) = context() else { return };
    let mut random = Random::new(11);
    let (mut worst, mut layers_seen) = (0.0f32, 0);
    for turn in 0..6 {
        let size = Size::new(130 + 41 * turn, 97 + 20 * turn);
        // Rectangles at depths of their own on a ramp, some of them rough.
        let (low, high) = (random.between(-60.0, 0.0), random.between(0.0, 40.0));
        let mut coc =
            Plane::from_fn(size, |x, _| (low + (high - low) * x as f64 / size.width as f64) as f32).unwrap();
        for _ in 0..2 + 2 * turn {
            let at = random.between(-80.0, 60.0);
            let rough = if random.unit() < 0.5 { 0.0 } else { 3.0 };
            let (x0, y0) = (random.between(0.0, size.width as f64), random.between(0.0, size.height as f64));
            let (x1, y1) = (x0 + random.between(3.0, 80.0), y0 + random.between(3.0, 80.0));
            for y in y0 as usize..(y1 as usize).min(size.height) {
                for x in x0 as usize..(x1 as usize).min(size.width) {
                    coc.row_mut(y)[x] = (at + random.between(-rough, rough)) as f32;
                }
            }
        }
        let census = core_census(&coc, size.width as f32);
        for layers in [1, 2, 3, 5, 9, 16] {
            let expected = census.split(layers, size.width as f32);
            let split =
                with_work(&context, size, Storage::Full, false, |work| read_split(work, &coc, layers as u32));
            assert_eq!(split.layers(), expected.layers(), "{turn} {layers}: {split:?} {expected:?}");
            assert_eq!(split.knee, expected.knee);
            layers_seen += split.layers();
            for (cut, expected) in split.cuts.iter().zip(&expected.cuts) {
                let off = [cut.at - expected.at, cut.half - expected.half, cut.overlap - expected.overlap];
                worst = off.iter().fold(worst, |worst, off| worst.max(off.abs()));
                // A few parts in 1e7 of u (below 8) in positions and weights; k-means makes them larger.
                assert!(off.iter().all(|off| off.abs() < 1e-5), "{turn} {layers}: {cut:?} {expected:?}");
            }
        }
    }
    assert!(layers_seen > 100, "{layers_seen}");
    eprintln!("cuts differ by at most {worst:e} in u");
}

#[test]
fn the_unblurred_layers_put_together_are_the_picture() {
    let Some(context) = context() else { return };
    for (size, count, layers) in
        [(Size::new(150, 61), 3, 5), (Size::new(67, 40), 4, 3), (Size::new(66, 30), 9, 16)]
    {
        let (planes, coc) = busy(size, count);
        let run = |most_bytes: u64, storage: Storage| {
            with_work(&context, size, storage, false, |work| {
                let (picture, coc) = bring(work, &planes, &coc);
                let apart = take_apart(work, &picture, count, &coc, layers, most_bytes).unwrap();
                let apart: Vec<_> = apart.into_iter().map(|layer| layer.groups).collect();
                let result: Vec<Group> = picture
                    .iter()
                    .map(|group| Group::take(work.recorder, size, group.planes, storage).unwrap())
                    .collect();
                composite(work, &result, count, &apart).unwrap();
                fetch(work, &result, count)
            })
        };
        let whole = run(1 << 27, Storage::Full);
        // In bands of a few rows it is the same, to the bit: no value depends on what lies beside it in a buffer.
        let row = 16 * u64::from(layers) * (1 + count.div_ceil(4) as u64) * size.width as u64;
        assert!(run(6 * row, Storage::Full) == whole, "{size} {count} {layers}");
        for (storage, result, tolerance) in [
            // Sums of some products of numbers below 2 in f32.
            (Storage::Full, whole, 4e-6),
            // Three roundings to eleven bits: the picture, its layers, their sum.
            (Storage::Half, run(1 << 27, Storage::Half), 3.0 * 2.0f32.powi(-10)),
        ] {
            for (p, (expected, got)) in planes.iter().zip(&result).enumerate() {
                for (i, (x, y)) in expected.data().iter().zip(got.data()).enumerate() {
                    assert!((x - y).abs() <= tolerance, "{storage:?} plane {p} at {i}: {x} {y}");
                }
            }
        }
    }
}

#[test]
fn a_picture_in_focus_keeps_its_bits() {
    let Some(context) = context() else { return };
    let size = Size::new(70, 33);
    let (planes, coc) = busy(size, 4);
    for (in_focus, kept) in [(true, true), (false, false)] {
        let result = with_work(&context, size, Storage::Full, in_focus, |work| {
            let (picture, coc) = bring(work, &planes, &coc);
            blur_layers(work, &picture, 4, &coc, 3).unwrap();
            fetch(work, &picture, 4)
        });
        assert_eq!(result == planes, kept, "{in_focus}");
    }
}

#[test]
fn constants_are_kept() {
    let Some(context) = context() else { return };
    let size = Size::new(140, 90);
    let (_, coc) = busy(size, 1);
    let values = [0.7, 3.0, 1e-3, 1.0];
    let planes: Vec<Plane> = values.iter().map(|&value| Plane::filled(size, value).unwrap()).collect();
    // Ten blurs' bound (`conformance`), composited; f16 adds roundings to eleven bits of colour and of coverage, before and
    // after the blur.
    for (storage, tolerance) in [(Storage::Full, 8e-4), (Storage::Half, 8e-4 + 4.0 * 2.0f32.powi(-11))] {
        let result = with_work(&context, size, storage, false, |work| {
            let (picture, coc) = bring(work, &planes, &coc);
            blur_layers(work, &picture, planes.len(), &coc, 5).unwrap();
            fetch(work, &picture, planes.len())
        });
        let mut worst = 0.0f32;
        for (value, plane) in values.iter().zip(&result) {
            for x in plane.data() {
                worst = worst.max((x / value - 1.0).abs());
            }
        }
        assert!(worst <= tolerance, "{storage:?} {worst}");
        eprintln!("{storage:?}: constants change by at most {worst:e}");
    }
}

#[test]
fn halves_blur_as_f32_does() {
    let Some(context) = context() else { return };
    let size = Size::new(120, 70);
    let (planes, coc) = busy(size, 4);
    let [full, half] = [Storage::Full, Storage::Half].map(|storage| {
        with_work(&context, size, storage, false, |work| {
            let (picture, coc) = bring(work, &planes, &coc);
            blur_layers(work, &picture, 4, &coc, 5).unwrap();
            fetch(work, &picture, 4)
        })
    });
    for (p, (full, half)) in full.iter().zip(&half).enumerate() {
        for (i, (x, y)) in full.data().iter().zip(half.data()).enumerate() {
            // Roundings to eleven bits of numbers below 4: the picture, its layers, two of the fields between rows and
            // columns at a time, the blurred layers.
            assert!((x - y).abs() <= 4.0 * 5.0 * 2.0f32.powi(-12), "plane {p} at {i}: {x} {y}");
        }
    }
}
