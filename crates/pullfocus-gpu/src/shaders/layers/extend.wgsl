// A foreground's diameters: its own where they can be believed, carried on from there, without their sign, where not.

@group(0) @binding(5) var<storage, read> cells: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> circle: array<f32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    if weight_at(at) > 0.0 {
        circle[at] = shaped(coc[at]);
        return;
    }
    let t = taps(id.x, id.y, p.step, vec2u(p.grid_width, p.grid_height));
    circle[at] = enlarged(t, cells[t.i00], cells[t.i10], cells[t.i01], cells[t.i11]).x;
}
