// Puts what was filled in where a layer is not seen at all.

struct Params {
    width: u32,
    height: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> matte: array<f32>;
@group(0) @binding(2) var<storage, read> unseen: array<Px>;
@group(0) @binding(3) var<storage, read_write> layer: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    if !(matte[at] > 0.0) { layer[at] = unseen[at]; }
}
