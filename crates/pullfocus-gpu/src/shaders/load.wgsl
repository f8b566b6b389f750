// A colour texture as a group of planes, of numbers that every solver can carry.

struct Params {
    width: u32,
    height: u32,
    // 0: the texture's alpha means nothing, and the plane becomes 0.
    alpha: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var<storage, read_write> group_values: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let value = textureLoad(source, id.xy, 0);
    let alpha = select(0.0, mended(value.w), p.alpha != 0u);
    group_values[id.y * p.width + id.x] =
        px_pack(vec4f(mended(value.x), mended(value.y), mended(value.z), alpha));
}
