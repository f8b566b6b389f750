// Lays blurred layers over each other, from far to near, and over the picture if some lie in it already; the farthest
// covers everything. A picture that is all in focus stays as it is. See `over.wgsl` for coverage above 1. With ALONE there is one
// layer, and nothing behind it; with MATTE its coverage is what is shown.

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
@group(0) @binding(2) var<storage, read_write> picture: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    if in_focus() {
        // The picture itself is the only layer.
        if ALONE && (MATTE || p.first > 0u) { picture[at] = px_pack(Lane(select(0.0, 1.0, p.first == 0u))); }
        return;
    }
    var behind = Lane(0.0);
    if !FARTHEST { behind = px_unpack(picture[at]); }
    for (var layer = 0u; layer < FRONTS; layer++) {
        let number = p.first + layer;
        if layer < p.layers && number < range.z {
            let own = front(layer, at);
            var covers = 1.0;
            if number > 0u { covers = coverage(layer, at, own); }
            if MATTE {
                behind = Lane(clamp(covers, 0.0, 1.0));
            } else if number == 0u {
                behind = own;
            } else {
                behind = own / max(covers, 1.0) + (1.0 - clamp(covers, 0.0, 1.0)) * behind;
            }
        }
    }
    picture[at] = px_pack(behind);
}
