// The first paper's background (3.1): its matte, which ramps from 0 to 1 with the diameter behind focus, and the diameters
// that are to be carried beneath what hides it.

struct Params {
    width: u32,
    height: u32,
    low: f32,
    high: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> coc: array<f32>;
@group(0) @binding(2) var<storage, read_write> matte: array<f32>;
@group(0) @binding(3) var<storage, read_write> circle: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    matte[at] = clamp((coc[at] - p.low) / (p.high - p.low), 0.0, 1.0);
    circle[at] = max(coc[at], 0.0);
}
