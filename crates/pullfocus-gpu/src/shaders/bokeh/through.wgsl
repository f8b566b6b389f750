// From near to far, how much of each highlight nearer layers leave: by the coverages of layers, blurred or not.

struct Params {
    width: u32,
    tiles: u32,
    // Which plane of its group is the coverage.
    coverage: u32,
    // The layer, counted from the farthest, and whether it is the first that is asked for.
    layer: u32,
    first: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(3) var<storage, read> covering: array<CoverPx>;
// The third is how many layers were found.
@group(0) @binding(4) var<storage, read> range: vec3u;
// What nearer layers leave.
@group(0) @binding(5) var<storage, read_write> clear: array<f32>;

// What nearer layers leave of a highlight, and how much of it this layer covers; the next one has the rest. The farthest
// covers all, and what was not found nothing.
fn pass_through(slot: u32, light: Light) -> vec2f {
    var left = clear[slot];
    if p.first == 1u { left = 1.0; }
    var coverage = 1.0;
    if p.layer > 0u {
        let at = u32(row_of(light)) * p.width + u32(column_of(light));
        coverage = 0.0;
        if p.layer < range.z { coverage = clamp(cover(covering[at]), 0.0, 1.0); }
    }
    clear[slot] = left * (1.0 - coverage);
    return vec2f(left, coverage);
}
