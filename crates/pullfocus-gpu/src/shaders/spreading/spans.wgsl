// What all passes of the aperture's spans have to know; as in `pullfocus_core::spans`.
//
// Light is added up in whole numbers of 64 bits, two words each: the sum does not depend on the order, and where a span ends
// nothing is left of it. A channel's step follows from its largest value, of which 32 have room.

struct Params {
    width: u32,
    height: u32,
    // The first of the group's planes that this pass has.
    first: u32,
    // Which layer this is, from far to near; where LAYERED.
    layer: u32,
    // Where a pass over levels is, and how many there are.
    level: u32,
    levels: u32,
    // The first row of pixels of a pass over some of them, and the one after the last.
    first_y: u32,
    end_y: u32,
    // Pixels of height for each pixel of width.
    scale: f32,
    // Larger circles count as this, in pixels.
    most: f32,
    // Circles of so many cells of height lie within one cell.
    least: f32,
    // The most columns that a circle one row high reaches to either side.
    wide: f32,
    // Where the table of circles in front of focus begins.
    front: u32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
    // Of each level: its first cell, columns, rows, and how many cells its edge is wide.
    places: array<vec4u, MOST_LEVELS>,
}

@group(0) @binding(0) var<uniform> p: Params;
// The third word says how many layers there are: `Work::range`.
@group(0) @binding(1) var<storage, read> found: array<u32>;

fn missing() -> bool { return LAYERED && p.layer >= found[2]; }

fn is_finite(x: f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) < 0x7f800000u; }

// 2^e, -126 to 127.
fn power(e: i32) -> f32 { return bitcast<f32>(u32(e + 127) << 23u); }

// Bits in the order of the numbers.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn from_ordered(key: u32) -> f32 {
    return bitcast<f32>(select(~key, key ^ 0x80000000u, key >= 0x80000000u));
}

struct Drawn {
    level: u32,
    // Height of the circle in cells; 0 for a pixel that stays as it is.
    rows: f32,
}

// The least l with rows <= MOST_ROWS 2^l, where MOST_ROWS is 1.5 * 2^5.
fn level_of(rows: f32) -> u32 {
    let bits = bitcast<u32>(rows);
    let over = select(0, 1, (bits & 0x007fffffu) > 0x00400000u);
    return u32(max(i32(bits >> 23u) - 127 - 5 + over, 0));
}

fn drawn_as(c: f32) -> Drawn {
    let diameter = min(abs(c), p.most);
    let level = min(level_of(diameter * p.scale), p.levels - 1u);
    let added = (power(2 * i32(level)) - 1.0) / 6.0;
    let drawn = sqrt(max(diameter * diameter - 16.0 * added, 0.0));
    let rows = drawn * p.scale * power(-i32(level));
    return Drawn(level, select(rows, 0.0, rows <= p.least));
}
