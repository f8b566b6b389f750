// A copy, for the memory's speed: half of the bytes are read, half written.

struct Params {
    count: u32,
    stride: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> source: array<vec4u>;
@group(0) @binding(2) var<storage, read_write> copied: array<vec4u>;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3u) {
    for (var at = id.x; at < p.count; at += p.stride) {
        copied[at] = source[at];
    }
}
