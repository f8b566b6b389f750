// Lays blurred layers over each other, from far to near, and over the picture if some lie in it already; the farthest
// covers everything. A picture that is all in focus stays as it is. See `over.wgsl` for coverage above 1.

struct Params {
    width: u32,
    height: u32,
    // Which plane of its group is the coverage.
    coverage: u32,
    // How many layers there are here, and which is the first.
    layers: u32,
    first: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
// Ordered bits of the smallest and the largest diameter, then how many layers were found.
@group(0) @binding(1) var<storage, read> range: vec3u;
@group(0) @binding(2) var<storage, read_write> picture: array<Px>;

fn from_ordered(key: u32) -> f32 {
    return bitcast<f32>(select(~key, key ^ 0x80000000u, key >= 0x80000000u));
}

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    if from_ordered(range.x) == 0.0 && from_ordered(range.y) == 0.0 { return; }
    let at = id.y * p.width + id.x;
    var behind = Lane(0.0);
    if !FARTHEST { behind = px_unpack(picture[at]); }
    for (var layer = 0u; layer < FRONTS; layer++) {
        if layer < p.layers && p.first + layer < range.z {
            let own = front(layer, at);
            if FARTHEST && layer == 0u {
                behind = own;
            } else {
                let covers = coverage(layer, at, own);
                behind = own / max(covers, 1.0) + (1.0 - clamp(covers, 0.0, 1.0)) * behind;
            }
        }
    }
    picture[at] = px_pack(behind);
}
