//! For this crate's own tests, which run in a harness outside: steps that are otherwise seen only together.

use crate::context::Context;
use crate::diffusion::Tuning;
use crate::layers;
use crate::memory::Memory;
use crate::planes::{Group, Storage, groups};
use crate::recorder::{Recorder, Sink};
use crate::spreading::{self, Spread};
use crate::transfer::{download, place, upload, upload_plane};
use crate::work::Work;
use pullfocus_core::layers::MOST_LAYERS;
use pullfocus_core::split::{Cut, Split};
use pullfocus_core::{Aperture, Cancel, Frame, Plane, Result, Settings, Size};

/// A picture to be taken apart.
#[derive(Debug, Clone, Copy)]
pub struct Apart<'a> {
    /// Its planes.
    pub planes: &'a [Plane],
    /// Its circles of confusion, signed diameters in pixels.
    pub coc: &'a Plane,
    /// The most layers.
    pub layers: u32,
    /// How planes are stored.
    pub storage: Storage,
}

/// Does something with the surroundings of a render of `size` whose diameters lie between 0 and `largest`.
fn with_work<T>(
    context: &Context,
    size: Size,
    storage: Storage,
    largest: f32,
    run: impl FnOnce(&mut Work<'_, '_>) -> Result<T>,
) -> Result<T> {
    let cancel = Cancel::default();
    let mut memory = Memory::new(context)?;
    let sink = Sink::Host { encoder: None, cancel: &cancel, work: 0 };
    let mut recorder = Recorder::new(context, &mut memory, sink, None)?;
    let range = recorder.take(size, 12)?;
    let ordered = |x: f32| x.to_bits() | 0x8000_0000;
    context.queue().write_buffer(&range, 0, bytemuck::cast_slice(&[ordered(0.0), ordered(largest)]));
    let (frame, settings) = (Frame::full(size), Settings::default());
    let mut work = Work::new(&mut recorder, &frame, &settings, storage, Tuning::default(), range);
    let result = run(&mut work)?;
    recorder.finish()?;
    Ok(result)
}

fn bring(work: &mut Work<'_, '_>, apart: &Apart<'_>) -> Result<(Vec<Group>, wgpu::Buffer)> {
    let planes: Vec<&Plane> = apart.planes.iter().collect();
    let sizes = groups(planes.len() + 1);
    let picture = upload(work.recorder, work.size, &planes, &sizes, work.storage, false)?;
    Ok((picture, upload_plane(work.recorder, apart.coc)?))
}

fn fetch(work: &mut Work<'_, '_>, picture: &[Group], planes: usize) -> Result<Vec<Plane>> {
    let mut all = vec![Plane::filled(work.size, 0.0)?; planes];
    let values = download(work.recorder, work.size, picture, planes)?;
    place(&values, &mut all)?;
    Ok(all)
}

/// Where the device cuts a picture as wide as its display window; and the beginnings and steepnesses of each layer's two
/// ramps, from near to far.
///
/// # Errors
/// Any [`pullfocus_core::Error`].
pub fn split(context: &Context, coc: &Plane, layers: u32) -> Result<(Split, Vec<[f32; 4]>)> {
    with_work(context, coc.size(), Storage::Full, 1.0, |work| {
        let buffer = upload_plane(work.recorder, coc)?;
        let split = layers::split(work, &buffer, layers)?;
        let bytes = work.recorder.read(&split, layers::SPLIT_BYTES)?;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        let float = |at: usize| f32::from_bits(words[at]);
        let count = words[1] as usize;
        let first = 4 + 4 * MOST_LAYERS as usize;
        let cuts = (0..count - 1).map(|i| first + 4 * i);
        let cuts =
            cuts.map(|at| Cut { at: float(at), half: float(at + 1), overlap: float(at + 2) }).collect();
        let ramps = (0..count).map(|i| [0, 1, 2, 3].map(|k| float(4 + 4 * i + k))).collect();
        Ok((Split { cuts, knee: float(0) }, ramps))
    })
}

/// The picture taken apart into layers and put together again without any blur, in bands as small as `most_bytes` of fills
/// asks for.
///
/// # Errors
/// Any [`pullfocus_core::Error`].
pub fn apart_and_together(context: &Context, apart: &Apart<'_>, most_bytes: u64) -> Result<Vec<Plane>> {
    let (size, count) = (apart.coc.size(), apart.planes.len());
    with_work(context, size, apart.storage, 50.0, |work| {
        let (picture, coc) = bring(work, apart)?;
        let layers = layers::take_apart(work, &picture, [count, count], &coc, apart.layers, most_bytes)?;
        let layers: Vec<_> = layers.into_iter().map(|layer| layer.groups).collect();
        let mut result = Vec::new();
        for group in &picture {
            result.push(Group::take(work.recorder, size, group.planes, apart.storage)?);
        }
        layers::composite(work, &result, count, &layers, 0)?;
        fetch(work, &result, count)
    })
}

/// The picture blurred in layers; `largest` is what the device is told to be its largest diameter.
///
/// # Errors
/// Any [`pullfocus_core::Error`].
pub fn blurred(context: &Context, apart: &Apart<'_>, largest: f32) -> Result<Vec<Plane>> {
    let (size, count) = (apart.coc.size(), apart.planes.len());
    with_work(context, size, apart.storage, largest, |work| {
        let (picture, coc) = bring(work, apart)?;
        layers::blur_layers(work, &picture, [count, count], &coc, apart.layers)?;
        fetch(work, &picture, count)
    })
}

/// Planes spread over an aperture through the circles `coc`, with the weight `gamma` where it is given, out of buffers
/// of at most `most_bytes`.
///
/// # Errors
/// Any [`pullfocus_core::Error`].
pub fn spread(
    context: &Context,
    apart: &Apart<'_>,
    gamma: Option<&Plane>,
    aperture: &Aperture,
    most_bytes: u64,
) -> Result<Vec<Plane>> {
    with_work(context, apart.coc.size(), apart.storage, 0.0, |work| {
        let (picture, circle) = bring(work, apart)?;
        let gamma = gamma.map(|gamma| upload_plane(work.recorder, gamma)).transpose()?;
        let (found, gamma) = (work.range.clone(), gamma.as_ref());
        let spread =
            Spread { circle: &circle, gamma, vertical_scale: 1.0, aperture, found: &found, most_bytes };
        let groups: Vec<&Group> = picture.iter().collect();
        spreading::spread(work.recorder, work.size, &groups, &spread)?;
        fetch(work, &picture, apart.planes.len())
    })
}
