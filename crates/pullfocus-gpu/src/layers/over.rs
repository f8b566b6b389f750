//! "Over": premultiplied planes with coverage onto what is behind them.

use crate::planes::{Group, Storage, workgroups};
use crate::shader::{Part, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::Result;

uniform! {
    /// See `over.wgsl`.
    OverParams { width: u32, height: u32, coverage: u32 }
}

/// The part that reads coverage from a group.
pub fn cover_part(group: &Group) -> Part {
    match (group.planes, group.storage) {
        (1, _) => part!("layers/cover_1"),
        (_, Storage::Full) => part!("layers/cover_f32"),
        (_, Storage::Half) => part!("layers/cover_f16"),
    }
}

/// Lays `front`, group by group, over `behind`; `coverage` counts the planes of `front`.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`].
pub fn over(work: &mut Work<'_, '_>, front: &[Group], coverage: usize, behind: &[&Group]) -> Result<()> {
    let Some(covering) = front.get(coverage / 4) else { return Ok(()) };
    let params = OverParams {
        width: work.size.width as u32,
        height: work.size.height as u32,
        coverage: (coverage % 4) as u32,
    };
    for (front, behind) in front.iter().zip(behind) {
        let [lane, px] = front.parts();
        let spec = Spec::new(&[lane, px, cover_part(covering), part!("layers/over")], &[]);
        let buffers = [&front.buffer, &covering.buffer, &behind.buffer];
        work.recorder.run(&spec, &params, &buffers, workgroups(work.size))?;
    }
    Ok(())
}
