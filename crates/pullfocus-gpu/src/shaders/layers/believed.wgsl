// A foreground's diameters where its depth can be believed: weighted by alpha (light alone by 1), in front of what is behind. Means over the
// cells of the finest grid; the border's pixels stand in for those beyond.

@group(0) @binding(5) var<storage, read_write> cells: array<vec4f>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.grid_width || id.y >= p.grid_height { return; }
    var sum = vec2f(0.0);
    for (var dy = 0u; dy < p.step; dy++) {
        let y = min(id.y * p.step + dy, p.height - 1u);
        for (var dx = 0u; dx < p.step; dx++) {
            let at = y * p.width + min(id.x * p.step + dx, p.width - 1u);
            let weight = weight_at(at);
            sum += vec2f(abs(shaped(coc[at])) * weight, weight);
        }
    }
    let mean = sum / f32(p.step * p.step);
    cells[id.y * p.grid_width + id.x] = vec4f(mean.x, 0.0, 0.0, mean.y);
}
