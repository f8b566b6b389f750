// What one layer is filled from, as means over the cells of the finest grid: the planes of one group of the picture where
// the layer is seen; with the first group the diameter and the squared brightness, and the layer's coverage where nothing
// nearer hides it. The border's pixels stand in for those beyond.

struct Params {
    width: u32,
    height: u32,
    grid_width: u32,
    grid_height: u32,
    step: u32,
    // Which layer, from far to near.
    layer: u32,
    // Planes of this group.
    planes: u32,
    // Planes that decide over edges.
    leading: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> split: Split;
@group(0) @binding(2) var<storage, read> coc: array<f32>;
@group(0) @binding(3) var<storage, read> edge: array<f32>;
@group(0) @binding(4) var<storage, read> picture: array<Px>;
// Three planes and their weight.
@group(0) @binding(5) var<storage, read_write> colors: array<vec4f>;
// Diameter, squared brightness, the fourth plane; or that alone.
@group(0) @binding(6) var<storage, read_write> others: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> coverage: array<vec4f>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.grid_width || id.y >= p.grid_height { return; }
    var color_sum = vec4f(0.0);
    var other_sum = vec4f(0.0);
    var cover_sum = vec2f(0.0);
    if p.layer < min(split.count, MOST_LAYERS) {
        let ramps = split.ramps[split.count - 1u - p.layer];
        let there = vec4u(0u, 1u, 2u, 3u) < vec4u(p.planes);
        let bright = select(vec4f(0.0), vec4f(1.0 / f32(max(p.leading, 1u))), vec4u(0u, 1u, 2u, 3u) < vec4u(p.leading));
        for (var dy = 0u; dy < p.step; dy++) {
            let y = min(id.y * p.step + dy, p.height - 1u);
            for (var dx = 0u; dx < p.step; dx++) {
                let at = y * p.width + min(id.x * p.step + dx, p.width - 1u);
                let c = coc[at];
                let own = member(ramps, position(c, split.knee));
                let trust = 1.0 - edge[at] * (1.0 - EDGE_TRUST);
                let weight = own.x * trust;
                let behind = own.y * trust;
                cover_sum += vec2f(own.x * behind, behind);
                if weight > 0.0 {
                    let value = select(vec4f(0.0), px_unpack(picture[at]), there);
                    color_sum += vec4f(value.xyz * weight, weight);
                    if FIRST {
                        let mean = dot(bright, value);
                        other_sum += vec4f(abs(c), mean * mean, value.w, 1.0) * weight;
                    } else {
                        other_sum += vec4f(value.w, 0.0, 0.0, 1.0) * weight;
                    }
                }
            }
        }
    }
    let part = 1.0 / f32(p.step * p.step);
    let to = id.y * p.grid_width + id.x;
    colors[to] = color_sum * part;
    if OTHERS { others[to] = other_sum * part; }
    if COVERAGE { coverage[to] = vec4f(cover_sum.x, 0.0, 0.0, cover_sum.y) * part; }
}
