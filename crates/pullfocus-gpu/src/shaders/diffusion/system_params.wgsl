// What the passes from a picture to systems and back are told.

struct Params {
    unknowns: u32,
    lines: u32,
    along: u32,
    across: u32,
    diameter: f32,
    term: u32,
    least_at: u32,
    unused: u32,
    terms: array<Term, 2>,
}

@group(0) @binding(0) var<uniform> p: Params;
