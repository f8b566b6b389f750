// Three layers' results.
const OUTS: u32 = 3;
@group(0) @binding(5) var<storage, read_write> out_0: array<Out>;
@group(0) @binding(6) var<storage, read_write> out_1: array<Out>;
@group(0) @binding(7) var<storage, read_write> out_2: array<Out>;

fn put(layer: u32, at: u32, value: Out) {
    switch layer {
        case 0u: { out_0[at] = value; }
        case 1u: { out_1[at] = value; }
        default: { out_2[at] = value; }
    }
}
