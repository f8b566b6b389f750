// How much of each edge pixel the near side of its edge covers: from its colour between those of the two sides as far as
// they can be told apart, else from its depth. What the pixel's own depth has to do with neither side is taken from the edge's
// strength.

@group(0) @binding(4) var<storage, read> picture: array<Px>;
// Strengths; the shares stand behind them.
@group(0) @binding(5) var<storage, read_write> edge: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let at = vec2u(id.x, p.first_y + id.y);
    if at.x >= p.width || at.y >= min(p.end_y, p.height) { return; }
    let i = at.y * p.width + at.x;
    if edge[i] <= 0.0 { return; }
    let c = coc[i];
    let range = near_far(at);
    let u = position(c, split.knee);
    let u_near = position(range.x, split.knee);
    let u_far = position(range.y, split.knee);
    let t = own_taps(at);
    let leads = vec4u(0u, 1u, 2u, 3u) < vec4u(p.leading);
    let part = select(vec4f(0.0), vec4f(1.0 / f32(max(p.leading, 1u))), leads);
    let value = select(vec4f(0.0), px_unpack(picture[i]), leads);
    var noise = 0.0;
    var away = vec2f(0.0);
    var front = vec4f(0.0);
    var back = vec4f(0.0);
    for (var layer = 0u; layer < layer_count(); layer++) {
        let shape = filled(t, layer, SHAPES);
        let color = select(vec4f(0.0), filled(t, layer, 1u), leads);
        let ramps = layer_ramps(layer);
        let near = member(ramps, u_near);
        let far = member(ramps, u_far);
        away += abs(member(ramps, u).x - vec2f(near.x, far.x));
        let mean = dot(color, part);
        let variance = max(shape.y - mean * mean, 0.0) * f32(p.leading);
        noise += variance * max(near.x, far.x);
        front += (color - front) * select(covering(near, shape.z), 1.0, layer == 0u);
        back += (color - back) * select(covering(far, shape.z), 1.0, layer == 0u);
    }
    let apart = front - back;
    let between = ((range.y - c) - (c - range.x)) / max(range.y - range.x, 1e-6);
    let own = soft_step(2.0 * between + 0.5);
    let doubt =
        COLOR_NOISE * COLOR_NOISE * (dot(front, front) + dot(back, back)) + VARIANCE * noise + 1e-6;
    let found = (dot(value - back, apart) + doubt * own) / (dot(apart, apart) + doubt);
    // Both what one layer shows less and what another shows more is counted.
    edge[i] *= 1.0 - min(0.5 * min(away.x, away.y), 1.0);
    edge[p.width * p.height + i] = clamp(found, LEAST_SHARE * own, 1.0 - LEAST_SHARE * (1.0 - own));
}
