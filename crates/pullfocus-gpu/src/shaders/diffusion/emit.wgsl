// From the terms' solutions to the picture.

@group(0) @binding(3) var<storage, read_write> least: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read> solution_0: array<Val>;
@group(0) @binding(9) var<storage, read> solution_1: array<Val>;

fn floored(value: Lane) -> Lane {
    if !FLOOR { return value; }
    var low = Lane(0.0);
    for (var c = 0u; c < WIDTH; c++) {
        low = lane_with(low, c, -bitcast<f32>(atomicLoad(&least[p.least_at + c])));
    }
    return raised(value, low);
}

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= p.lines || j >= p.unknowns { return; }
    result(i * p.across + j * p.along, j * p.lines + i);
}
