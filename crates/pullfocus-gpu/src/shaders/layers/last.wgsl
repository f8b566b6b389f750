// Puts the last layer, or its matte, in the picture's place, if that is the one which is asked for.

struct Params {
    width: u32,
    height: u32,
    // Which plane of its group is the coverage.
    coverage: u32,
    // The layer that is asked for.
    number: u32,
    // How many layers are farther than the last; with FOUND the device knows.
    farther: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(2) var<storage, read> last: array<Px>;
@group(0) @binding(3) var<storage, read> covering: array<CoverPx>;
@group(0) @binding(4) var<storage, read_write> picture: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    var farther = p.farther;
    if FOUND { farther = layers_found(); }
    if p.number != farther { return; }
    let at = id.y * p.width + id.x;
    if MATTE {
        picture[at] = px_pack(Lane(clamp(cover(covering[at]), 0.0, 1.0)));
    } else {
        picture[at] = last[at];
    }
}
