// Jacobi (second paper, equation 2.13, with the first paper's min rule): one sweep.

struct Params {
    unknowns: u32,
    lines: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> rows: array<Row>;
@group(0) @binding(2) var<storage, read> known: array<Val>;
@group(0) @binding(3) var<storage, read> old: array<Val>;
@group(0) @binding(4) var<storage, read_write> next: array<Val>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= p.lines || j >= p.unknowns { return; }
    let at = j * p.lines + i;
    let own = rows[at];
    var before = known[at];
    var after = before;
    var onward = n_zero();
    if j > 0u { before = old[at - p.lines]; }
    if j + 1u < p.unknowns {
        onward = rows[at + p.lines].link;
        after = old[at + p.lines];
    }
    let r = n_recip(own.weight + own.link + onward);
    next[at] = v_towards_both(known[at], n_mul(own.link, r), before, n_mul(onward, r), after);
}
