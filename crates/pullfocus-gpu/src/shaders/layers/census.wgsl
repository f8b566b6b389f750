// Counts a picture's diameters and its depth edges over the scale of layers. In whole numbers: the same sums in any order.
//
// A workgroup counts its part in its own memory, then adds it to the totals, which have two words each.

struct Params {
    width: u32,
    height: u32,
    knee: f32,
    // Units in a pixel.
    per_step: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> coc: array<f32>;
// Of each kind for each bin: the low and the high word.
@group(0) @binding(2) var<storage, read_write> totals: array<atomic<u32>>;

// The weight of a pixel. A workgroup's 2048 pixels have at most two pairs with two ends each: 2^13 weights.
const ONE: f32 = 262144.0;
// Rows of a thread.
const ROWS: u32 = 8;

// Kinds of counts.
const PIXELS: u32 = 0;
const ENDS: u32 = 1;
const SPANS_BEGIN: u32 = 2;
const SPANS_END: u32 = 3;

var<workgroup> counts: array<atomic<u32>, 2240>;

struct Place {
    bin: u32,
    part: f32,
}

// The two bins beside `u`: the first one, and the second one's part. `u / BIN` is taken in two pieces: one product in f32
// would lose the last digits of the part.
fn place(u: f32) -> Place {
    let per_bin = 1.0 / BIN;
    let middle = 0.5 * f32(BINS) - 0.5;
    let x = clamp(u * per_bin + middle, 0.0, f32(BINS) - 1.001);
    if x <= 0.0 { return Place(0u, 0.0); }
    if x >= f32(BINS) - 1.001 { return Place(BINS - 2u, 0.999); }
    let head = bitcast<f32>(bitcast<u32>(u) & 0xfffff000u);
    var bin = u32(x);
    var part = (per_bin * head - (f32(bin) - middle)) + per_bin * (u - head);
    if part < 0.0 {
        bin = max(bin, 1u) - 1u;
        part += 1.0;
    } else if part >= 1.0 {
        bin += 1u;
        part -= 1.0;
    }
    return Place(min(bin, BINS - 2u), clamp(part, 0.0, 1.0));
}

fn count(kind: u32, place: Place, weight: u32) {
    let second = min(u32(round(place.part * f32(weight))), weight);
    if second < weight { atomicAdd(&counts[kind * BINS + place.bin], weight - second); }
    if second > 0u { atomicAdd(&counts[kind * BINS + place.bin + 1u], second); }
}

fn pair(u: f32, c: f32, other: f32) {
    let weight = clamp((abs(c - other) * p.per_step - EDGE_FROM) / (EDGE_TO - EDGE_FROM), 0.0, 1.0);
    if weight <= 0.0 { return; }
    let fixed = u32(round(weight * ONE));
    let u_other = position(other, p.knee);
    let near = place(min(u, u_other));
    let far = place(max(u, u_other));
    count(ENDS, near, fixed);
    count(ENDS, far, fixed);
    count(SPANS_BEGIN, near, fixed);
    count(SPANS_END, far, fixed);
}

@compute @workgroup_size(64, 4)
fn main(
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) index: u32,
    @builtin(workgroup_id) group: vec3u,
) {
    for (var k = index; k < 4u * BINS; k += 256u) {
        atomicStore(&counts[k], 0u);
    }
    workgroupBarrier();
    let x = group.x * 64u + local.x;
    let first = (group.y * 4u + local.y) * ROWS;
    if x < p.width {
        // Pixels below each other often share their bins: those are counted at once.
        var bin = 0u;
        var low = 0u;
        var high = 0u;
        for (var y = first; y < min(first + ROWS, p.height); y++) {
            let at = y * p.width + x;
            let c = coc[at];
            let u = position(c, p.knee);
            let here = place(u);
            if here.bin != bin {
                if low > 0u { atomicAdd(&counts[bin], low); }
                if high > 0u { atomicAdd(&counts[bin + 1u], high); }
                bin = here.bin;
                low = 0u;
                high = 0u;
            }
            // A bin in which anything lies is never empty.
            let least = select(0u, 1u, here.part > 0.0);
            let second = clamp(u32(round(here.part * ONE)), least, u32(ONE) - 1u);
            low += u32(ONE) - second;
            high += second;
            if x + 1u < p.width { pair(u, c, coc[at + 1u]); }
            if y + 1u < p.height { pair(u, c, coc[at + p.width]); }
        }
        if low > 0u { atomicAdd(&counts[bin], low); }
        if high > 0u { atomicAdd(&counts[bin + 1u], high); }
    }
    workgroupBarrier();
    for (var k = index; k < 4u * BINS; k += 256u) {
        let own = atomicLoad(&counts[k]);
        if own > 0u {
            let before = atomicAdd(&totals[2u * k], own);
            if before + own < before { atomicAdd(&totals[2u * k + 1u], 1u); }
        }
    }
}
