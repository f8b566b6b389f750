// Brings one layer's fills to where all layers' are.

// As `gather.wgsl` has them.
@group(0) @binding(1) var<storage, read> colors: array<vec4f>;
@group(0) @binding(2) var<storage, read> others: array<vec4f>;
@group(0) @binding(3) var<storage, read> coverage: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> packed: array<vec4f>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.grid_width || id.y >= p.rows || p.first_row + id.y >= p.grid_height { return; }
    let at = (p.first_row + id.y) * p.grid_width + id.x;
    let to = id.y * p.grid_width + id.x;
    let color = colors[at].xyz;
    var other = vec4f(0.0);
    if OTHERS { other = others[at]; }
    if !FIRST {
        packed[section(p.first, 1u + p.group) + to] = vec4f(color, other.x);
        return;
    }
    var hidden = 1.0;
    if COVERAGE { hidden = coverage[at].x; }
    packed[section(p.first, SHAPES) + to] = vec4f(other.xy, hidden, 0.0);
    packed[section(p.first, 1u) + to] = vec4f(color, other.z);
}
