// From the picture to the systems of one term.

@group(0) @binding(1) var<storage, read> circle: array<f32>;
@group(0) @binding(2) var<storage, read> gamma: array<f32>;
@group(0) @binding(8) var<storage, read_write> rows: array<Row>;
@group(0) @binding(9) var<storage, read_write> known: array<Val>;

fn circle_at(at: u32) -> f32 {
    if HAS_CIRCLE { return circle[at]; }
    return p.diameter;
}

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= p.lines || j >= p.unknowns { return; }
    let at = i * p.across + j * p.along;
    let to = j * p.lines + i;
    var weight = 1.0;
    if HAS_GAMMA { weight = max(gamma[at], LEAST_GAMMA); }
    var before = 0.0;
    if j > 0u { before = link(circle_at(at - p.along), circle_at(at), p.terms[p.term].beta); }
    rows[to] = Row(n_own(p.terms[p.term].sigma, weight), n_real(before));
    let first = px_unpack(px_get(0u, at));
    note(first);
    known[to] = right_side(first, at);
}
