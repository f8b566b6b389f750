//! One layer alone, over nothing, or its matte ([`pullfocus_core::Show`]).

use super::over::cover_part;
use crate::planes::{Group, workgroups};
use crate::shader::{Constant, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::Result;

uniform! {
    /// See `alone.wgsl`.
    AloneParams { width: u32, height: u32 }
}

uniform! {
    /// See `last.wgsl`.
    LastParams { width: u32, height: u32, coverage: u32, number: u32, farther: u32 }
}

/// How many layers a picture has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// So many.
    Known(u32),
    /// One or more, at most so many; the device knows.
    Found(u32),
}

/// Nothing at all.
pub fn clear(work: &mut Work<'_, '_>, groups: &[&Group]) {
    for group in groups {
        work.recorder.encoder().clear_buffer(&group.buffer, 0, None);
    }
}

/// Leaves of `layer`, which covers everything, what a nearer one does not take away, if there is one; where a matte is shown, that one's.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`].
pub fn leave(work: &mut Work<'_, '_>, layer: &[&Group], nearer: Option<&wgpu::Buffer>) -> Result<()> {
    let nothing = work.recorder.memory.nothing.clone();
    let constants =
        [("NEARER", Constant::Flag(nearer.is_some())), ("MATTE", Constant::Flag(work.show.is_matte()))];
    let params = AloneParams { width: work.size.width as u32, height: work.size.height as u32 };
    for group in layer {
        let [lane, px] = group.parts();
        let spec = Spec::new(&[lane, px, part!("layers/alone")], &constants);
        let buffers = [nearer.unwrap_or(&nothing), &group.buffer];
        work.recorder.run(&spec, &params, &buffers, workgroups(work.size))?;
    }
    Ok(())
}

/// Puts `last`, which lies over nothing, into `picture` if number `number` is asked for behind which `farther` layers lie, or its coverage
/// where a matte is shown.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`].
pub fn take_place(
    work: &mut Work<'_, '_>,
    last: &[&Group],
    (covering, coverage): (&Group, u32),
    picture: &[&Group],
    (number, farther): (u32, Count),
) -> Result<()> {
    let range = work.range.clone();
    let (known, found) = match farther {
        Count::Known(count) => (count, false),
        Count::Found(_) => (0, true),
    };
    let params = LastParams {
        width: work.size.width as u32,
        height: work.size.height as u32,
        coverage,
        number,
        farther: known,
    };
    let constants = [("FOUND", Constant::Flag(found)), ("MATTE", Constant::Flag(work.show.is_matte()))];
    for (last, picture) in last.iter().zip(picture) {
        let [lane, px] = picture.parts();
        let parts = [lane, px, cover_part(covering), part!("layers/found"), part!("layers/last")];
        let buffers = [&range, &last.buffer, &covering.buffer, &picture.buffer];
        work.recorder.run(&Spec::new(&parts, &constants), &params, &buffers, workgroups(work.size))?;
    }
    Ok(())
}
