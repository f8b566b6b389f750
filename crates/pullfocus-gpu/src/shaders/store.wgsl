// A group of planes into the caller's texture, of whatever format can be rendered to: one triangle over all of it.

struct Params {
    width: u32,
    height: u32,
    // 0: the picture has no alpha, and the texture's becomes 1.
    alpha: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> group_values: array<Px>;

@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index % 2u) * 4.0 - 1.0, f32(index / 2u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let x = min(u32(position.x), p.width - 1u);
    let y = min(u32(position.y), p.height - 1u);
    let value = px_unpack(group_values[y * p.width + x]);
    return vec4f(value.xyz, select(1.0, value.w, p.alpha != 0u));
}
