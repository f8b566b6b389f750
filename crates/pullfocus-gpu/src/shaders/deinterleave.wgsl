// Groups become planes that lie behind each other.

struct Params {
    width: u32,
    height: u32,
    planes: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> group_values: array<Px>;
@group(0) @binding(2) var<storage, read_write> planar: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    let value = px_unpack(group_values[at]);
    for (var c = 0u; c < min(p.planes, WIDTH); c++) {
        planar[c * p.width * p.height + at] = lane_part(value, c);
    }
}
