// A layer that covers everything, alone: with NEARER without what a nearer one takes away; with MATTE how much is left of it,
// in every plane.

struct Params {
    width: u32,
    height: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> nearer: array<f32>;
@group(0) @binding(2) var<storage, read_write> layer: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    var left = 1.0;
    if NEARER { left -= nearer[at]; }
    if MATTE { layer[at] = px_pack(Lane(left)); } else { layer[at] = px_pack(px_unpack(layer[at]) * left); }
}
