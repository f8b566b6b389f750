// The least value of each plane: noted on the way in, or looked up for the way out.

// Bits of the largest negative value of each plane, without its sign.
@group(0) @binding(3) var<storage, read_write> least: array<atomic<u32>>;

fn note_least(values: ptr<function, array<Lane, K>>, at: u32) {
    var low = Lane(0.0);
    /* unroll */ for (var j = 0u; j < K; j++) {
        low = min(low, (*values)[j]);
    }
    for (var c = 0u; c < WIDTH; c++) {
        if lane_part(low, c) < 0.0 {
            atomicMax(&least[at + c], bitcast<u32>(-lane_part(low, c)));
        }
    }
}

fn read_least(at: u32) -> Lane {
    var low = Lane(0.0);
    for (var c = 0u; c < WIDTH; c++) {
        low = lane_with(low, c, -bitcast<f32>(atomicLoad(&least[at + c])));
    }
    return low;
}
