// One layer's result.
const OUTS: u32 = 1;
@group(0) @binding(5) var<storage, read_write> out_0: array<Out>;

fn put(layer: u32, at: u32, value: Out) { out_0[at] = value; }
