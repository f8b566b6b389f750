//! Sprites: the passes that add them, cut so that a host hears a wish to stop.

use super::{Lights, SIDE, Shown, tiles};
use crate::layers::cover_part;
use crate::planes::Group;
use crate::shader::{Constant, Spec, part, uniform};
use crate::work::Work;
use pullfocus_core::Result;
use std::ops::Range;

uniform! {
    /// See `sprites.wgsl`.
    SpriteParams {
        width: u32,
        height: u32,
        across: u32,
        down: u32,
        first_x: u32,
        first_y: u32,
        first_row: u32,
        end_row: u32,
        coverage: u32,
        unit_x: f32,
        unit_y: f32,
        reach: f32,
        point: f32,
        area: f32,
        sides: u32,
        columns: u32,
        rows: u32,
        longer_side: f32,
        cats_eye: f32,
        axis_x: f32,
        axis_y: f32,
        field_x: f32,
        field_y: f32,
        display_unit: f32,
    }
}

/// A part of the work: tiles of the result, and rows of tiles whose lights are looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Piece {
    columns: Range<usize>,
    lines: Range<usize>,
    rows: Range<usize>,
    /// Pixels times lights.
    work: u64,
}

/// What is known of a row of tiles.
#[derive(Debug, Clone, Copy, Default)]
struct TileRow {
    lights: u64,
    /// Rows of pixels that they reach to either side.
    reach: f64,
    /// Columns of pixels that one of them fills, at most.
    width: f64,
}

/// Cuts the work: as much of it as a device does at a time, in the order of rows.
fn pieces([across, down]: [usize; 2], rows: &[TileRow], most: u64) -> Vec<Piece> {
    let side = SIDE as f64;
    // How many pixels of a line of tiles meet lights of a row, times lights.
    let meets = |line: usize, row: usize| -> u64 {
        let TileRow { lights, reach, width } = rows[row];
        let away = line.abs_diff(row).saturating_sub(1) as f64 * side;
        if lights == 0 || reach < away {
            return 0;
        }
        let pixels = (width + 2.0 * side).min(across as f64 * side) * side;
        lights * pixels as u64
    };
    let mut pieces: Vec<Piece> = Vec::new();
    for line in 0..down {
        let all: u64 = (0..down).map(|row| meets(line, row)).sum();
        if all == 0 {
            continue;
        }
        if all <= most {
            // Together with the lines before it, if they fit.
            match pieces.last_mut() {
                Some(last)
                    if last.lines.end == line && last.rows.len() == down && last.work + all <= most =>
                {
                    last.lines.end = line + 1;
                    last.work += all;
                }
                _ => {
                    pieces.push(Piece { columns: 0..across, lines: line..line + 1, rows: 0..down, work: all })
                }
            }
            continue;
        }
        let mut first = 0;
        while first < down {
            let mut work = meets(line, first);
            let mut end = first + 1;
            while end < down && work + meets(line, end) <= most {
                work += meets(line, end);
                end += 1;
            }
            // One row of lights may still be too many for a whole line.
            let parts = (work.div_ceil(most.max(1)) as usize).clamp(1, across);
            let step = across.div_ceil(parts);
            for left in (0..across).step_by(step) {
                if work > 0 {
                    let columns = left..(left + step).min(across);
                    let work = work / parts as u64;
                    pieces.push(Piece { columns, lines: line..line + 1, rows: first..end, work });
                }
            }
            first = end;
        }
    }
    pieces
}

impl Lights {
    /// Adds sprites to groups; a layer's `coverage` counts its planes.
    ///
    /// # Errors
    /// As [`Work::take_lights`].
    pub(super) fn sprites(
        &self,
        work: &mut Work<'_, '_>,
        groups: &[&Group],
        shown: Shown<'_>,
        coverage: usize,
    ) -> Result<()> {
        let [across, down] = tiles(self.size);
        let pieces = if work.recorder.is_host() {
            let rows = self.rows(work)?;
            pieces([across, down], &rows, work.recorder.work_limit())
        } else {
            vec![Piece { columns: 0..across, lines: 0..down, rows: 0..down, work: 0 }]
        };
        if pieces.is_empty() {
            return Ok(());
        }
        for (number, (&group, taken)) in groups.iter().zip(&self.taken).enumerate() {
            self.group(work, (number, group, taken), (groups, shown, coverage), &pieces)?;
        }
        Ok(())
    }

    /// What is known of each row of tiles, from the device.
    fn rows(&self, work: &mut Work<'_, '_>) -> Result<Vec<TileRow>> {
        let [across, down] = tiles(self.size);
        let shape = &self.look.shape;
        let bytes = work.recorder.read(&self.tiles, 8 * (across * down + down) as u64)?;
        let number = |at: usize| {
            let four = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
            f64::from(f32::from_le_bytes(four))
        };
        let row = |row: usize| {
            let at = 8 * (across * down + row);
            let diameter = number(at + 4);
            let [x, y] = shape.unit.map(|unit| f64::from(shape.reach * unit) * diameter);
            TileRow { lights: number(at) as u64, reach: y + 2.0, width: 2.0 * x + 3.0 }
        };
        Ok((0..down).map(row).collect())
    }

    fn group(
        &self,
        work: &mut Work<'_, '_>,
        (number, group, taken): (usize, &Group, &Group),
        (groups, shown, coverage): (&[&Group], Shown<'_>, usize),
        pieces: &[Piece],
    ) -> Result<()> {
        let nothing = work.recorder.memory.nothing.clone();
        let one = part!("layers/cover_1");
        let (covered, cover, other) = match shown {
            Shown::All => (0, one, &nothing),
            Shown::ByCircle(circles) => (0, one, circles),
            // The farthest covers everything, and is divided by nothing.
            Shown::InLayer(0) => (0, one, &nothing),
            Shown::InLayer(_) if coverage / 4 == number => (1, one, &nothing),
            Shown::InLayer(_) => (2, cover_part(groups[coverage / 4]), &groups[coverage / 4].buffer),
        };
        let by_circle = matches!(shown, Shown::ByCircle(_));
        let [lane, px] = group.parts();
        let shape = &self.look.shape;
        let parts = [
            lane,
            px,
            cover,
            part!("bokeh/tile"),
            part!("bokeh/cats_eye"),
            shape.part,
            part!("bokeh/sprites"),
        ];
        let constants = [
            ("CUT", Constant::Flag(self.extents.is_some())),
            ("BY_CIRCLE", Constant::Flag(by_circle)),
            ("COVERED", Constant::Count(covered)),
        ];
        let spec = Spec::new(&parts, &constants);
        let extents = self.extents.as_ref().unwrap_or(&nothing);
        let buffers =
            [&self.lights, &self.tiles, &taken.buffer, &shape.buffer, extents, other, &group.buffer];
        let [across, down] = tiles(self.size).map(|count| count as u32);
        let look = &self.look;
        for piece in pieces {
            let params = SpriteParams {
                width: self.size.width as u32,
                height: self.size.height as u32,
                across,
                down,
                first_x: piece.columns.start as u32,
                first_y: piece.lines.start as u32,
                first_row: piece.rows.start as u32,
                end_row: piece.rows.end as u32,
                coverage: (coverage % 4) as u32,
                unit_x: shape.unit[0],
                unit_y: shape.unit[1],
                reach: shape.reach,
                point: shape.point,
                area: shape.area,
                sides: shape.sides,
                columns: shape.corners[0],
                rows: shape.corners[1],
                longer_side: shape.longer_side,
                cats_eye: look.displacement(),
                axis_x: look.axis[0],
                axis_y: look.axis[1],
                field_x: look.field[0],
                field_y: look.field[1],
                display_unit: look.display_unit(),
            };
            let workgroups = [piece.columns.len() as u32, piece.lines.len() as u32, 1];
            work.recorder.run(&spec, &params, &buffers, workgroups)?;
            work.recorder.worked(piece.work)?;
        }
        Ok(())
    }
}
