// How much the last sweep changed: the bits of the largest change and of the largest value.

struct Params {
    unknowns: u32,
    lines: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> old: array<Val>;
@group(0) @binding(2) var<storage, read> next: array<Val>;
@group(0) @binding(3) var<storage, read_write> largest: array<atomic<u32>, 2>;

var<workgroup> group_change: atomic<u32>;
var<workgroup> group_value: atomic<u32>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    if index == 0u {
        atomicStore(&group_change, 0u);
        atomicStore(&group_value, 0u);
    }
    workgroupBarrier();
    if id.x < p.lines && id.y < p.unknowns {
        let at = id.y * p.lines + id.x;
        let change = v_size(v_minus(next[at], old[at]));
        let value = v_size(next[at]);
        var most_change = 0.0;
        var most_value = 0.0;
        for (var c = 0u; c < WIDTH; c++) {
            most_change = max(most_change, lane_part(change, c));
            most_value = max(most_value, lane_part(value, c));
        }
        atomicMax(&group_change, bitcast<u32>(most_change));
        atomicMax(&group_value, bitcast<u32>(most_value));
    }
    workgroupBarrier();
    if index == 0u {
        atomicMax(&largest[0], atomicLoad(&group_change));
        atomicMax(&largest[1], atomicLoad(&group_value));
    }
}
