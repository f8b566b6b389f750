// Depth edges: how much of an edge between layers each pixel is, 0 to 1.

struct Params {
    width: u32,
    height: u32,
    unit: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> split: Split;
@group(0) @binding(2) var<storage, read> coc: array<f32>;
// Strengths; behind them is room for `share.wgsl`.
@group(0) @binding(3) var<storage, read_write> edge: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let range = near_far(id.xy);
    let step = (range.y - range.x) / p.unit;
    var strength = 0.0;
    if step > EDGE_STEP.x {
        let near = position(range.x, split.knee);
        let far = position(range.y, split.knee);
        var apart = 0.0;
        for (var layer = 0u; layer < min(split.count, MOST_LAYERS); layer++) {
            apart += abs(member(split.ramps[layer], near).x - member(split.ramps[layer], far).x);
        }
        strength = soft_step((step - EDGE_STEP.x) / (EDGE_STEP.y - EDGE_STEP.x)) * min(apart, 1.0);
    }
    edge[id.y * p.width + id.x] = strength;
}
