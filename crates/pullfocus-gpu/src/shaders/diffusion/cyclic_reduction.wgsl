// Cyclic reduction in the gather form of the first paper's figure 5, one pass for each level, for any length; the CPU's
// `cyclic_reduction` has the formulas. Levels lie behind each other in the pyramid; each keeps the odd unknowns of the one
// below.

struct Params {
    // Where the finer level begins, and its unknowns.
    fine: u32,
    unknowns: u32,
    // Where the coarser level begins, and its unknowns.
    coarse: u32,
    coarse_unknowns: u32,
    lines: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read_write> rows: array<Row>;
@group(0) @binding(2) var<storage, read_write> values: array<Val>;

fn fine(j: u32, i: u32) -> u32 { return p.fine + j * p.lines + i; }
fn coarse(j: u32, i: u32) -> u32 { return p.coarse + j * p.lines + i; }
