// Bits of the largest negative value of each plane, without its sign.
@group(0) @binding(3) var<storage, read_write> least: array<atomic<u32>>;

fn note(value: Lane) {
    if !NOTE_LEAST { return; }
    for (var c = 0u; c < WIDTH; c++) {
        if lane_part(value, c) < 0.0 {
            atomicMax(&least[p.least_at + c], bitcast<u32>(-lane_part(value, c)));
        }
    }
}
