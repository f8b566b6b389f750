// How much of each highlight belongs to a layer, from near to far: as much as is seen of it, by coverages that are not blurred
// yet. The farthest has what the others leave.

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
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> tiles: array<vec2f>;
@group(0) @binding(3) var<storage, read> covering: array<CoverPx>;
// The third is how many layers were found.
@group(0) @binding(4) var<storage, read> range: vec3u;
// What nearer layers leave.
@group(0) @binding(5) var<storage, read_write> clear: array<f32>;
@group(0) @binding(6) var<storage, read_write> shares: array<f32>;

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = tile.y * p.tiles + tile.x;
    if local >= u32(tiles[number].x) { return; }
    let slot = number * SLOTS + local;
    let light = lights[slot];
    var left = clear[slot];
    if p.first == 1u { left = 1.0; }
    var coverage = 1.0;
    if p.layer > 0u {
        let at = u32(row_of(light)) * p.width + u32(column_of(light));
        coverage = 0.0;
        if p.layer < range.z { coverage = clamp(cover(covering[at]), 0.0, 1.0); }
    }
    shares[slot] = coverage * left;
    clear[slot] = left * (1.0 - coverage);
}
