// Running sums along the rows of a level: light out of the ends of spans. A workgroup has a row.

// Of each channel of each cell: low and high word.
@group(0) @binding(3) var<storage, read> ends: array<u32>;

// Cells of a thread, and threads.
const OWN: u32 = 4u;
const THREADS: u32 = 64u;

var<workgroup> lows: array<u32, THREADS * CHANNELS>;
var<workgroup> highs: array<u32, THREADS * CHANNELS>;

fn words_at(cell: u32, channel: u32) -> vec2u {
    let at = 2u * (cell * CHANNELS + channel);
    return vec2u(ends[at], ends[at + 1u]);
}

@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) index: u32, @builtin(workgroup_id) group: vec3u) {
    if missing() || p.level > most_level() { return; }
    let place = p.places[p.level];
    let row = group.x;
    if row >= place.z { return; }
    let first = place.x + row * place.y;
    var before: array<vec2u, CHANNELS>;
    /* unroll */ for (var c = 0u; c < CHANNELS; c++) { before[c] = vec2u(0u); }
    for (var start = 0u; start < place.y; start += OWN * THREADS) {
        let begin = start + index * OWN;
        let end = min(begin + OWN, place.y);
        /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
            var total = vec2u(0u);
            for (var x = begin; x < end; x++) { total = plus(total, words_at(first + x, c)); }
            lows[c * THREADS + index] = total.x;
            highs[c * THREADS + index] = total.y;
        }
        workgroupBarrier();
        for (var step = 1u; step < THREADS; step *= 2u) {
            var more: array<vec2u, CHANNELS>;
            /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
                let other = c * THREADS + index - step;
                more[c] = vec2u(0u);
                if index >= step { more[c] = vec2u(lows[other], highs[other]); }
            }
            workgroupBarrier();
            /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
                let at = c * THREADS + index;
                let sum = plus(vec2u(lows[at], highs[at]), more[c]);
                lows[at] = sum.x;
                highs[at] = sum.y;
            }
            workgroupBarrier();
        }
        var running: array<vec2u, CHANNELS>;
        /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
            running[c] = before[c];
            let at = c * THREADS + index;
            if index > 0u { running[c] = plus(running[c], vec2u(lows[at - 1u], highs[at - 1u])); }
            let last = c * THREADS + THREADS - 1u;
            before[c] = plus(before[c], vec2u(lows[last], highs[last]));
        }
        for (var x = begin; x < end; x++) {
            let at = vec2i(i32(x), i32(row)) - i32(place.w);
            var light: array<f32, CHANNELS>;
            /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
                running[c] = plus(running[c], words_at(first + x, c));
                light[c] = from_words(running[c].x, running[c].y, c) + enlarged(at, c);
            }
            give(first + x, at, light);
        }
        workgroupBarrier();
    }
}
