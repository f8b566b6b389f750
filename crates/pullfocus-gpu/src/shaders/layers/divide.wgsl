// One scale of a fill: `(sum + eps f_coarser) / (weight + eps)`; at the coarsest scale the plain quotient. The weight
// stands in w.

struct Params {
    width: u32,
    height: u32,
    coarse_width: u32,
    coarse_height: u32,
    // Of the coarser scale's grid to this one's; 0 at the coarsest.
    ratio: u32,
    coarser: f32,
    least_weight: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> coarse: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> sums: array<vec4f>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    let sum = sums[at];
    if p.ratio == 0u {
        sums[at] = select(vec4f(0.0), sum / sum.w, sum.w > p.least_weight);
        return;
    }
    let t = taps(id.x, id.y, p.ratio, vec2u(p.coarse_width, p.coarse_height));
    let above = enlarged(t, coarse[t.i00], coarse[t.i10], coarse[t.i01], coarse[t.i11]);
    sums[at] = (sum + p.coarser * above) / (sum.w + p.coarser);
}
