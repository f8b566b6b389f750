// Means over `ratio` x `ratio` values; the border's values stand in for those beyond.

struct Params {
    fine_width: u32,
    fine_height: u32,
    width: u32,
    height: u32,
    ratio: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> fine: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> coarse: array<vec4f>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    var sum = vec4f(0.0);
    for (var dy = 0u; dy < p.ratio; dy++) {
        let y = min(id.y * p.ratio + dy, p.fine_height - 1u);
        for (var dx = 0u; dx < p.ratio; dx++) {
            sum += fine[y * p.fine_width + min(id.x * p.ratio + dx, p.fine_width - 1u)];
        }
    }
    coarse[id.y * p.width + id.x] = sum / f32(p.ratio * p.ratio);
}
