// Anti-aliased depth noticed and mended: the CPU's `depth_repair` has the theory.

struct Params {
    width: u32,
    height: u32,
    // 1: numbers are distances, of which some mean that nothing is there.
    distances: u32,
    // Every so many rows edges are counted.
    stride: u32,
    step: f32,
    slope: f32,
    blended_low: f32,
    blended_high: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> depth: array<f32>;
@group(0) @binding(2) var<storage, read_write> mended_depth: array<f32>;
// Edges that are clean, and those that are blended.
@group(0) @binding(3) var<storage, read_write> counts: array<atomic<u32>, 2>;

fn plateau(value: f32) -> f32 {
    let size = bitcast<u32>(value) & 0x7fffffffu;
    if p.distances != 0u {
        let there = size > 0u && size <= 0x7f800000u && abs(value) < NOTHING_FROM;
        return select(NOTHING_FROM, abs(value), there);
    }
    return select(0.0, value, size < 0x7f800000u);
}

fn range(x: u32, y: u32, reach: u32) -> vec2f {
    var low = 3.4e38;
    var high = -3.4e38;
    for (var v = max(y, reach) - reach; v <= min(y + reach, p.height - 1u); v++) {
        for (var u = max(x, reach) - reach; u <= min(x + reach, p.width - 1u); u++) {
            let value = plateau(depth[v * p.width + u]);
            low = min(low, value);
            high = max(high, value);
        }
    }
    return vec2f(low, high);
}

// 0 no edge, 1 an edge, 2 a blended edge; and the value that covers more of the pixel.
fn place(x: u32, y: u32) -> vec2f {
    let own = depth[y * p.width + x];
    let around = range(x, y, 1u);
    let step = around.y - around.x;
    if step <= p.step * max(abs(around.y), abs(around.x)) { return vec2f(0.0, own); }
    let wider = range(x, y, 2u);
    if wider.y - wider.x > p.slope * step { return vec2f(0.0, own); }
    let part = (plateau(own) - around.x) / step;
    if part > p.blended_low && part < p.blended_high {
        return vec2f(2.0, select(around.y, around.x, part < 0.5));
    }
    return vec2f(1.0, own);
}

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width { return; }
    if COUNT {
        let y = id.y * p.stride;
        if y >= p.height { return; }
        let found = place(id.x, y).x;
        if found == 1.0 { atomicAdd(&counts[0], 1u); }
        if found == 2.0 { atomicAdd(&counts[1], 1u); }
    } else {
        if id.y >= p.height { return; }
        mended_depth[id.y * p.width + id.x] = place(id.x, id.y).y;
    }
}
