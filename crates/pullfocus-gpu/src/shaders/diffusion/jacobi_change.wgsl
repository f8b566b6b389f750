// How much the last sweep changed: of each plane the bits of the largest change and of the largest value.

struct Params {
    unknowns: u32,
    lines: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> old: array<Val>;
@group(0) @binding(2) var<storage, read> next: array<Val>;
@group(0) @binding(3) var<storage, read_write> largest: array<atomic<u32>, 8>;

var<workgroup> group_largest: array<atomic<u32>, 8>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    if index < 8u { atomicStore(&group_largest[index], 0u); }
    workgroupBarrier();
    if id.x < p.lines && id.y < p.unknowns {
        let at = id.y * p.lines + id.x;
        let change = v_size(v_minus(next[at], old[at]));
        let value = v_size(next[at]);
        for (var c = 0u; c < WIDTH; c++) {
            atomicMax(&group_largest[2u * c], bitcast<u32>(lane_part(change, c)));
            atomicMax(&group_largest[2u * c + 1u], bitcast<u32>(lane_part(value, c)));
        }
    }
    workgroupBarrier();
    if index < 8u { atomicMax(&largest[index], atomicLoad(&group_largest[index])); }
}
