// A depth texture as a plane.

struct Params {
    width: u32,
    height: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(2) var<storage, read_write> plane: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    plane[id.y * p.width + id.x] = source_at(id.x, id.y);
}
