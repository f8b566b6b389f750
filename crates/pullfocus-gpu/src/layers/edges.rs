//! Depth edges: the pixels that hold two colours and one depth.

use super::scale_parts;
use crate::planes::workgroups;
use crate::shader::{Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::Result;
use pullfocus_core::split::unit;

uniform! {
    /// See `edges.wgsl`.
    EdgesParams { width: u32, height: u32, unit: f32 }
}

/// Finds the edges of `coc`: a plane of strengths, and room for another one (the near sides' shares) behind it.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`].
pub fn find(work: &mut Work<'_, '_>, coc: &wgpu::Buffer, split: &wgpu::Buffer) -> Result<wgpu::Buffer> {
    let size = work.size;
    let edge = work.recorder.take(size, 2 * 4 * size.area() as u64)?;
    let params =
        EdgesParams { width: size.width as u32, height: size.height as u32, unit: unit(work.display_width) };
    let [constants, scale] = scale_parts();
    let spec = Spec::new(&[constants, scale, part!("layers/near_far"), part!("layers/edges")], &[]);
    work.recorder.run(&spec, &params, &[split, coc, &edge], workgroups(size))?;
    Ok(edge)
}
