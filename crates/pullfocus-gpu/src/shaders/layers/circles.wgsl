// Signed diameters of some layers: the picture's own where the layer is seen, elsewhere its fill, on the layer's side of focus.

alias Out = f32;

// Whether a layer, counted from far to near, lies in front of focus with all that it has.
fn in_front(layer: u32) -> bool { return layer > 0u && split.cuts[split.count - 1u - layer].x <= 0.0; }

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
            let side = select(1.0, -1.0, in_front(layer));
            put(k, at, select(circle, -circle, select(side, c, own > 0.0) < 0.0));
        }
    }
}
