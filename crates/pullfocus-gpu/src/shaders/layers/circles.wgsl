// Absolute diameters of some layers: the picture's own where the layer is seen, its fill elsewhere.

alias Out = f32;

@group(0) @binding(8) var<storage, read> edge: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = vec2u(id.x, p.first_y + id.y);
    if place.x >= p.width || place.y >= min(p.end_y, p.height) { return; }
    let at = place.y * p.width + place.x;
    let c = coc[at];
    let u = position(c, split.knee);
    let t = own_taps(place);
    for (var k = 0u; k < OUTS; k++) {
        let layer = p.first + k;
        // Nobody looks at layers that are not there.
        if layer < layer_count() {
            let own = member(layer_ramps(layer), u).x * (1.0 - edge[at]);
            var circle = abs(c);
            if own < 1.0 {
                let fill = filled(t, layer, SHAPES).x;
                circle = fill + (circle - fill) * own;
            }
            put(k, at, circle);
        }
    }
}
