// Of each row of tiles, behind the tiles themselves: how many highlights shine, and the largest diameter.

struct Params {
    across: u32,
    down: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read_write> tiles: array<vec2f>;

var<workgroup> counts: array<f32, 64>;
var<workgroup> largest: array<f32, 64>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) row: vec3u, @builtin(local_invocation_index) local: u32) {
    var found = vec2f(0.0);
    for (var x = local; x < p.across; x += 64u) {
        let tile = tiles[row.x * p.across + x];
        if tile.y > 0.0 { found = vec2f(found.x + tile.x, max(found.y, tile.y)); }
    }
    counts[local] = found.x;
    largest[local] = found.y;
    for (var step = 32u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if local < step {
            counts[local] += counts[local + step];
            largest[local] = max(largest[local], largest[local + step]);
        }
    }
    if local == 0u { tiles[p.across * p.down + row.x] = vec2f(counts[0], largest[0]); }
}
