// Midground and background by the matte: weights that blend, no coverages. Exactly the midground where alpha is 0.

struct Params {
    width: u32,
    height: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> matte: array<f32>;
@group(0) @binding(2) var<storage, read> background: array<Px>;
@group(0) @binding(3) var<storage, read_write> midground: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    let near = px_unpack(midground[at]);
    midground[at] = px_pack(near + (px_unpack(background[at]) - near) * matte[at]);
}
