// The finest level is the picture: what arrived, divided by the weight that did.

@group(0) @binding(5) var<storage, read_write> picture: array<Px>;
@group(0) @binding(6) var<storage, read> circle: array<f32>;
@group(0) @binding(7) var<storage, read> gamma: array<f32>;
// The weight that arrived.
@group(0) @binding(8) var<storage, read_write> weights: array<f32>;

fn give(cell: u32, place: vec2i, light: array<f32, CHANNELS>) {
    let at = u32(place.y) * p.width + u32(place.x);
    let own = px_unpack(picture[at]);
    // A circle within its pixel: as it is, so that without blur every bit stays.
    let kept = drawn_as(circle[at]).rows == 0.0;
    var own_gamma = 1.0;
    if HAS_GAMMA { own_gamma = max(gamma[at], LEAST_GAMMA); }
    var weight = 0.0;
    if WEIGHT {
        weight = light[CHANNELS - 1u] + select(0.0, own_gamma, kept);
        weights[at] = weight;
    } else {
        weight = weights[at];
    }
    var result = own;
    /* unroll */ for (var c = 0u; c < LANES; c++) {
        let lane = p.first + c;
        let x = lane_part(own, lane);
        let sum = light[c] + select(0.0, x * own_gamma, kept);
        // No weight at all leaves the pixel as it is. A device's quotient by 1 may be another number.
        var mean = x;
        if weight > 0.0 { mean = select(sum / weight, sum, weight == 1.0); }
        // A mean: rounding cannot bring it out of its plane's own range.
        if lowest(lane) <= highest(lane) { mean = clamp(mean, lowest(lane), highest(lane)); }
        result = lane_with(result, lane, mean);
    }
    if LANES > 0u { picture[at] = px_pack(result); }
}
