//! Planes to the device and back.

use crate::planes::{Group, Storage, workgroups};
use crate::recorder::Recorder;
use crate::shader::{Spec, part, uniform};
use pullfocus_core::{Plane, Result, Size};

uniform! {
    /// See `interleave.wgsl`.
    InterleaveParams { width: u32, height: u32, planes: u32, mend: u32 }
}

uniform! {
    /// See `deinterleave.wgsl`.
    DeinterleaveParams { width: u32, height: u32, planes: u32, unused: u32 }
}

/// Brings one plane there as it is.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`].
pub fn upload_plane(recorder: &mut Recorder<'_>, plane: &Plane) -> Result<wgpu::Buffer> {
    let buffer = recorder.take_plane(plane.size())?;
    recorder.context.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(plane.data()));
    Ok(buffer)
}

/// Brings planes there, in groups of `sizes` planes; with `mend` what is no number follows the rule of
/// `interleave.wgsl`.
///
/// # Errors
/// As [`upload_plane`].
pub fn upload(
    recorder: &mut Recorder<'_>,
    size: Size,
    planes: &[&Plane],
    sizes: &[u32],
    storage: Storage,
    mend: bool,
) -> Result<Vec<Group>> {
    let mut made = Vec::new();
    let mut rest = planes;
    for &count in sizes {
        let (own, after) = rest.split_at(rest.len().min(count as usize));
        rest = after;
        let group = Group::take(recorder, size, count, storage)?;
        let planar = recorder.take(size, size.area() as u64 * 4 * u64::from(count))?;
        for (i, plane) in own.iter().enumerate() {
            let at = i as u64 * size.area() as u64 * 4;
            recorder.context.queue().write_buffer(&planar, at, bytemuck::cast_slice(plane.data()));
        }
        let params = InterleaveParams {
            width: size.width as u32,
            height: size.height as u32,
            planes: own.len() as u32,
            mend: mend.into(),
        };
        let [lane, px] = group.parts();
        let parts = [lane, px, part!("numbers"), part!("mend"), part!("interleave")];
        recorder.run(&Spec::new(&parts, &[]), &params, &[&planar, &group.buffer], workgroups(size))?;
        // The next planes must not be written over these before they are read.
        recorder.flush()?;
        recorder.give([planar]);
        made.push(group);
    }
    Ok(made)
}

/// Brings planes back from groups; as many as there are in `planes`.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`],
/// [`pullfocus_core::Error::DeviceLost`], [`pullfocus_core::Error::Cancelled`].
pub fn download<'p>(
    recorder: &mut Recorder<'_>,
    size: Size,
    groups: &[Group],
    planes: impl IntoIterator<Item = &'p mut Plane>,
) -> Result<()> {
    let mut planes = planes.into_iter().peekable();
    for group in groups {
        let count = group.planes as usize;
        let own: Vec<&mut Plane> = planes.by_ref().take(count).collect();
        if own.is_empty() {
            break;
        }
        let planar = recorder.take(size, size.area() as u64 * 4 * count as u64)?;
        let params = DeinterleaveParams {
            width: size.width as u32,
            height: size.height as u32,
            planes: own.len() as u32,
            unused: 0,
        };
        let [lane, px] = group.parts();
        let parts = [lane, px, part!("deinterleave")];
        recorder.run(&Spec::new(&parts, &[]), &params, &[&group.buffer, &planar], workgroups(size))?;
        let bytes = recorder.read(&planar, size.area() as u64 * 4 * own.len() as u64)?;
        recorder.give([planar]);
        let values: &[f32] = bytemuck::cast_slice(&bytes);
        for (plane, values) in own.into_iter().zip(values.chunks_exact(size.area())) {
            plane.resize(size)?;
            plane.data_mut().copy_from_slice(values);
        }
    }
    Ok(())
}
