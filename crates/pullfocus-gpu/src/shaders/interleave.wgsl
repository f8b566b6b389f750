// Planes that lie behind each other become groups, and numbers that every solver can carry: NaN becomes 0, infinities
// the largest half, what is too large for a sum in f32 the largest that is not.

struct Params {
    width: u32,
    height: u32,
    planes: u32,
    // Whether values are mended.
    mend: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> planar: array<f32>;
@group(0) @binding(2) var<storage, read_write> group_values: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    var value = Lane(0.0);
    for (var c = 0u; c < min(p.planes, WIDTH); c++) {
        let x = planar[c * p.width * p.height + at];
        value = lane_with(value, c, select(x, mended(x), p.mend != 0u));
    }
    group_values[at] = px_pack(value);
}
