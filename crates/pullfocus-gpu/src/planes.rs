//! Planes on the device: groups of four, one vector for each pixel, or one alone.

use crate::recorder::Recorder;
use crate::shader::{Part, part};
use pullfocus_core::{Result, Size};

pub use pullfocus_core::Storage;

/// Some planes of one size, interleaved: a vector of four for each pixel, or one number.
#[derive(Debug, Clone)]
pub struct Group {
    /// The values, row by row.
    pub buffer: wgpu::Buffer,
    /// 1 or 4.
    pub planes: u32,
    /// How they lie in memory.
    pub storage: Storage,
}

impl Group {
    /// Bytes of a pixel.
    pub fn pixel_bytes(planes: u32, storage: Storage) -> u64 {
        match (planes, storage) {
            (1, _) => 4,
            (_, Storage::Full) => 16,
            (_, Storage::Half) => 8,
        }
    }

    /// A group of 1 or 4 planes, with whatever was in its memory.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`].
    pub fn take(recorder: &mut Recorder<'_>, size: Size, planes: u32, storage: Storage) -> Result<Self> {
        let storage = if planes == 1 { Storage::Full } else { storage };
        let bytes = size.area() as u64 * Self::pixel_bytes(planes, storage);
        Ok(Self { buffer: recorder.take(size, bytes)?, planes, storage })
    }
}

impl Group {
    /// The parts of a shader that reads or writes this group's pixels: `Lane`, `WIDTH`, `Px`, `px_unpack`, `px_pack`.
    pub fn parts(&self) -> [Part; 2] {
        let lanes = if self.planes == 1 { part!("diffusion/lane_1") } else { part!("diffusion/lane_4") };
        let px = match self.storage {
            Storage::Full => part!("diffusion/px_f32"),
            Storage::Half => part!("diffusion/px_f16_4"),
        };
        [lanes, px]
    }
}

/// Workgroups of 64 x 4 pixels.
pub fn workgroups(size: Size) -> [u32; 3] {
    [size.width.div_ceil(64) as u32, size.height.div_ceil(4) as u32, 1]
}

/// Into which groups `planes` planes go: fours, and one alone where one is left.
pub fn groups(planes: usize) -> Vec<u32> {
    let mut groups = vec![4; planes / 4];
    match planes % 4 {
        0 => {}
        1 => groups.push(1),
        _ => groups.push(4),
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_have_room_for_every_plane() {
        for planes in 0..20 {
            let groups = groups(planes);
            let room: u32 = groups.iter().sum();
            assert!(room as usize >= planes && (room as usize) < planes + 3, "{planes}: {groups:?}");
        }
    }
}
