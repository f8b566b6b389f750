//! An aperture's table of spans on the device.

use crate::context::Context;
use crate::memory::{self, Memory};
use pullfocus_core::spans::{Spans, Tables};
use pullfocus_core::{Aperture, Result, Size};

/// A table on the device; see `draw.wgsl`.
#[derive(Debug, Clone)]
pub struct Table {
    /// Heads of all entries, then their rows.
    pub buffer: wgpu::Buffer,
    /// See [`Spans::least`].
    pub least: f32,
    /// See [`Spans::wide`].
    pub wide: f32,
    /// The head of the first entry in front of focus.
    pub front: u32,
}

/// A table and what it was made of.
#[derive(Debug)]
pub struct Kept {
    aperture: Aperture,
    vertical_scale: f32,
    table: Table,
}

impl Kept {
    /// Bytes on the device.
    pub fn bytes(&self) -> u64 {
        self.table.buffer.size()
    }
}

impl Memory {
    /// The table of an aperture on pixels of this height for each pixel of width; the last one if it is the same. Commands that
    /// wait for their submission keep theirs.
    ///
    /// # Errors
    /// As [`Tables::new`]; [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`].
    pub fn spans(&mut self, context: &Context, size: Size, of: (&Aperture, f32)) -> Result<Table> {
        let (aperture, vertical_scale) = of;
        let same = |kept: &&Kept| kept.vertical_scale == vertical_scale && kept.aperture == *aperture;
        if let Some(kept) = self.spans.as_ref().filter(same) {
            return Ok(kept.table.clone());
        }
        let tables = Tables::new(aperture, vertical_scale)?;
        let (words, front) = words(&tables);
        let bytes = (words.len() * 16) as u64;
        memory::check_binding(context, bytes)?;
        use wgpu::BufferUsages as Use;
        let usage = Use::STORAGE | Use::COPY_DST;
        let buffer = memory::create(context, "a table of the aperture's spans", size, bytes, usage)?;
        context.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(&words));
        let Spans { least, wide, .. } = tables.behind;
        let table = Table { buffer, least, wide, front };
        self.spans = Some(Kept { aperture: aperture.clone(), vertical_scale, table: table.clone() });
        Ok(table)
    }
}

/// The table's vectors, and the first head of what is in front of focus.
fn words(tables: &Tables) -> (Vec<[u32; 4]>, u32) {
    let mut heads = Vec::new();
    let mut rows: Vec<[u32; 4]> = Vec::new();
    for spans in std::iter::once(&tables.behind).chain(&tables.front) {
        for entry in spans.entries() {
            let [from, to] = entry.rows;
            heads.push([rows.len() as u32, from as u32, to as u32, entry.area.to_bits()]);
            rows.extend(
                (from..to).map(|k| {
                    [entry.covered[k].to_bits(), entry.left[k].to_bits(), entry.right[k].to_bits(), 0]
                }),
            );
        }
    }
    let count = heads.len() as u32;
    heads.iter_mut().for_each(|head| head[0] += count);
    let front = if tables.front.is_some() { count / 2 } else { 0 };
    heads.extend(rows);
    (heads, front)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::spans::{HALF, PHASES, SIZES};

    #[test]
    fn heads_say_where_rows_are() {
        for (aperture, heads) in
            [(Aperture::DISC, PHASES * SIZES), (Aperture::blades(5, 3.0), 2 * PHASES * SIZES)]
        {
            let tables = Tables::new(&aperture, 1.0).unwrap();
            let (words, front) = words(&tables);
            assert_eq!(front as usize, heads - PHASES * SIZES);
            for in_front in [false, true] {
                let of = if in_front { front as usize } else { 0 };
                for (i, entry) in tables.of(in_front).entries().iter().enumerate() {
                    let [at, from, to, area] = words[of + i];
                    assert!(at as usize >= heads && (at + to - from) as usize <= words.len());
                    assert_eq!(f32::from_bits(area), entry.area);
                    assert!((from..to).contains(&(HALF as u32)), "{from} {to}");
                    let middle = words[(at + HALF as u32 - from) as usize];
                    assert_eq!(middle.map(f32::from_bits)[..2], [entry.covered[HALF], entry.left[HALF]]);
                }
            }
        }
    }
}
