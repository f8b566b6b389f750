// Coverage of some layers, where it is a group of its own.

alias Out = f32;

@group(0) @binding(8) var<storage, read> edge: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = vec2u(id.x, p.first_y + id.y);
    if place.x >= p.width || place.y >= min(p.end_y, p.height) { return; }
    let at = place.y * p.width + place.x;
    var pixel = pixel_at(place, edge[at]);
    if pixel.edge > 0.0 { pixel.share = edge[p.width * p.height + at]; }
    let t = own_taps(place);
    for (var k = 0u; k < OUTS; k++) {
        let layer = p.first + k;
        if layer < layer_count() { put(k, at, coverage_of(pixel, t, layer).z); }
    }
}
