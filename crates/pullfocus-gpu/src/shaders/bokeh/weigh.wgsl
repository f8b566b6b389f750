// What each highlight's light is multiplied with, and how far a tile's highlights reach. In a layer they have their share of it,
// made up for what nearer layers will take away, by coverages that are blurred by now; no layer has more than the whole.

@group(0) @binding(1) var<storage, read_write> lights: array<Light>;
@group(0) @binding(2) var<storage, read_write> tiles: array<vec2f>;
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
            weight *= min(shares[slot] / max(pass_through(slot, light).x, LEAST_CLEAR), 1.0);
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
