// What each highlight's light is multiplied with, and how far a tile's highlights reach. In a layer they have their share of it,
// made up for what nearer layers will take away, by coverages that are blurred by now; no layer has more than the whole.

struct Params {
    width: u32,
    tiles: u32,
    coverage: u32,
    layer: u32,
    first: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read_write> lights: array<Light>;
@group(0) @binding(2) var<storage, read_write> tiles: array<vec2f>;
@group(0) @binding(3) var<storage, read> covering: array<CoverPx>;
@group(0) @binding(4) var<storage, read> range: vec3u;
@group(0) @binding(5) var<storage, read_write> clear: array<f32>;
@group(0) @binding(6) var<storage, read> shares: array<f32>;

// Less of a layer left by nearer ones is not made up for.
const LEAST_CLEAR: f32 = 0.02;

var<workgroup> largest: array<f32, 256>;

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = tile.y * p.tiles + tile.x;
    var diameter = 0.0;
    if local < u32(tiles[number].x) {
        let slot = number * SLOTS + local;
        let light = lights[slot];
        var weight = light.factor;
        if LAYERED {
            var left = clear[slot];
            if p.first == 1u { left = 1.0; }
            var coverage = 1.0;
            if p.layer > 0u {
                let at = u32(row_of(light)) * p.width + u32(column_of(light));
                coverage = 0.0;
                if p.layer < range.z { coverage = clamp(cover(covering[at]), 0.0, 1.0); }
            }
            weight *= min(shares[slot] / max(left, LEAST_CLEAR), 1.0);
            clear[slot] = left * (1.0 - coverage);
        }
        lights[slot].weight = weight;
        if weight != 0.0 { diameter = abs(light.circle); }
    }
    largest[local] = diameter;
    for (var step = 128u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if local < step { largest[local] = max(largest[local], largest[local + step]); }
    }
    if local == 0u { tiles[number].y = largest[0]; }
}
