// From the fills to some layers' premultiplied colours and coverage, for one group of planes. What the unblurred layers put
// together lack of the picture is given to them in proportion to how much is seen of each.

alias Out = Px;

@group(0) @binding(4) var<storage, read> picture: array<Px>;
@group(0) @binding(8) var<storage, read> edge: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = vec2u(id.x, p.first_y + id.y);
    if place.x >= p.width || place.y >= min(p.end_y, p.height) { return; }
    let at = place.y * p.width + place.x;
    let there = vec4u(0u, 1u, 2u, 3u) < vec4u(p.planes);
    let value = select(vec4f(0.0), px_unpack(picture[at]), there);
    var pixel = pixel_at(place, edge[at]);
    if pixel.edge > 0.0 { pixel.share = edge[p.width * p.height + at]; }
    let t = own_taps(place);
    let count = layer_count();

    var color: array<vec4f, LAYERS>;
    var coverage: array<f32, LAYERS>;
    var weight: array<f32, LAYERS>;
    /* unroll */ for (var i = 0u; i < LAYERS; i++) {
        color[i] = vec4f(0.0);
        coverage[i] = 0.0;
        if i < count {
            let own = coverage_of(pixel, t, i);
            coverage[i] = own.z;
            // What is not covered is not looked at.
            if own.z != 0.0 {
                let shown = soft_step(own.x / OWN_FROM) * own.y * (1.0 - pixel.edge);
                color[i] = value;
                if shown < 1.0 {
                    let fill = select(vec4f(0.0), filled(t, i, 1u + p.group), there);
                    color[i] = fill + (value - fill) * shown;
                }
            }
        }
    }

    // What is seen of each layer, from near to far.
    var clear = 1.0;
    var squares = 0.0;
    /* unroll */ for (var k = 0u; k < LAYERS; k++) {
        let i = LAYERS - 1u - k;
        weight[i] = coverage[i] * clear;
        clear *= 1.0 - coverage[i];
        squares += weight[i] * weight[i];
    }
    var sum = vec4f(0.0);
    /* unroll */ for (var i = 0u; i < LAYERS; i++) {
        sum += weight[i] * color[i];
    }
    // What is missing is added, what is too much taken away as far as no layer becomes negative by it; the rest of that is
    // scaled away.
    var rest = (value - sum) / max(squares, 1e-6);
    var part = vec4f(1.0);
    /* unroll */ for (var i = 0u; i < LAYERS; i++) {
        let taken = -rest * weight[i];
        let left = max(color[i], vec4f(0.0));
        let limited = (taken > left) & (value >= vec4f(0.0));
        part = min(part, select(vec4f(1.0), left / taken, limited));
    }
    let left = sum + (value - sum) * part;
    let scale = select(vec4f(1.0), value / left, (part < vec4f(1.0)) & (left > value));
    rest *= part;
    let covers = vec4u(0u, 1u, 2u, 3u) == vec4u(p.coverage);
    /* unroll */ for (var i = 0u; i < LAYERS; i++) {
        if i >= p.first && i - p.first < OUTS && i < count {
            let full = (color[i] + rest * weight[i]) * scale * coverage[i];
            put(i - p.first, at, px_pack(select(full, vec4f(coverage[i]), covers)));
        }
    }
}
