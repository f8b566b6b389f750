// The highest level that circles are drawn on, and the least and the largest value of each plane of a group.

@group(0) @binding(2) var<storage, read> circle: array<f32>;
@group(0) @binding(3) var<storage, read> source: array<Px>;
// The level, then of each plane: bits in order of the least value with its sign turned, and of the largest. 0 before anything is
// known.
@group(0) @binding(4) var<storage, read_write> stats: array<atomic<u32>>;

// Rows of a thread.
const ROWS: u32 = 8u;
const WORDS: u32 = 1u + 2u * WIDTH;

var<workgroup> together: array<atomic<u32>, WORDS>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    if missing() { return; }
    if index < WORDS { atomicStore(&together[index], 0u); }
    workgroupBarrier();
    var level = 0u;
    var low = Lane(3.4e38);
    var high = Lane(-3.4e38);
    if id.x < p.width {
        for (var k = 0u; k < ROWS; k++) {
            let y = id.y * ROWS + k;
            if y < p.height {
                let at = y * p.width + id.x;
                let drawn = drawn_as(circle[at]);
                if drawn.rows > 0.0 { level = max(level, drawn.level); }
                let value = px_unpack(source[at]);
                /* unroll */ for (var c = 0u; c < WIDTH; c++) {
                    let x = lane_part(value, c);
                    if is_finite(x) {
                        low = lane_with(low, c, min(lane_part(low, c), x));
                        high = lane_with(high, c, max(lane_part(high, c), x));
                    }
                }
            }
        }
    }
    if level > 0u { atomicMax(&together[0], level); }
    /* unroll */ for (var c = 0u; c < WIDTH; c++) {
        atomicMax(&together[1u + 2u * c], ordered(-lane_part(low, c)));
        atomicMax(&together[2u + 2u * c], ordered(lane_part(high, c)));
    }
    workgroupBarrier();
    if index < WORDS {
        let own = atomicLoad(&together[index]);
        if own > 0u { atomicMax(&stats[index], own); }
    }
}
