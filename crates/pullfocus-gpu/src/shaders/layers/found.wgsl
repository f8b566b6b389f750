// What is known of a picture's layers.

// Ordered bits of the smallest and the largest diameter, then how many layers were found.
@group(0) @binding(1) var<storage, read> range: vec3u;

fn from_ordered(key: u32) -> f32 {
    return bitcast<f32>(select(~key, key ^ 0x80000000u, key >= 0x80000000u));
}

fn in_focus() -> bool { return from_ordered(range.x) == 0.0 && from_ordered(range.y) == 0.0; }

// A picture that is all in focus is one layer.
fn layers_found() -> u32 { return select(range.z, 1u, in_focus()); }
