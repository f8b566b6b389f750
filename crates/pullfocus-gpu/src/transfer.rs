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

/// Brings the first `planes` planes back from groups, one after the other.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`],
/// [`pullfocus_core::Error::DeviceLost`], [`pullfocus_core::Error::Cancelled`].
pub fn download(
    recorder: &mut Recorder<'_>,
    size: Size,
    groups: &[Group],
    planes: usize,
) -> Result<Vec<Vec<u8>>> {
    let mut all = Vec::new();
    let mut left = planes;
    for group in groups {
        let own = left.min(group.planes as usize);
        if own == 0 {
            break;
        }
        left -= own;
        let planar = recorder.take(size, size.area() as u64 * 4 * u64::from(group.planes))?;
        let params = DeinterleaveParams {
            width: size.width as u32,
            height: size.height as u32,
            planes: own as u32,
            unused: 0,
        };
        let [lane, px] = group.parts();
        let parts = [lane, px, part!("deinterleave")];
        recorder.run(&Spec::new(&parts, &[]), &params, &[&group.buffer, &planar], workgroups(size))?;
        all.push(recorder.read(&planar, size.area() as u64 * 4 * own as u64)?);
        recorder.give([planar]);
    }
    Ok(all)
}

/// Puts what [`download`] brought into planes.
///
/// # Errors
/// [`pullfocus_core::Error::OutOfMemory`].
pub fn place<'p>(values: &[Vec<u8>], planes: impl IntoIterator<Item = &'p mut Plane>) -> Result<()> {
    let mut planes = planes.into_iter();
    for bytes in values {
        let mut rest: &[u8] = bytes;
        while !rest.is_empty() {
            let Some(plane) = planes.next() else { return Ok(()) };
            let (own, after) = rest.split_at(plane.size().area() * 4);
            rest = after;
            bytemuck::cast_slice_mut::<f32, u8>(plane.data_mut()).copy_from_slice(own);
        }
    }
    Ok(())
}
