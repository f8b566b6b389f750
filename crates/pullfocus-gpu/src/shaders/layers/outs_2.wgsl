// Two layers' results.
const OUTS: u32 = 2;
@group(0) @binding(5) var<storage, read_write> out_0: array<Out>;
@group(0) @binding(6) var<storage, read_write> out_1: array<Out>;

fn put(layer: u32, at: u32, value: Out) {
    if layer == 0u { out_0[at] = value; } else { out_1[at] = value; }
}
