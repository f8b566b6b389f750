// From a picture's counts to the cuts between its layers: `Census::split`, in one workgroup.
//
// Sums over bins are taken of the bins themselves, around the place that is looked for: differences of running sums would
// cancel in f32. Sixteen threads share a layer, or a cut.

struct Params {
    // How many were counted.
    pixels: f32,
    // At most so many layers.
    layers: u32,
    knee: f32,
    unit: f32,
    // Bins to either side that smoothing for centres and for places reaches.
    weights_reach: u32,
    place_reach: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
// Of each kind for each bin (`census.wgsl`): low word, high word.
@group(0) @binding(1) var<storage, read> totals: array<vec2u>;
@group(0) @binding(2) var<storage, read_write> split: Split;

const THREADS: u32 = 256;
const LANES: u32 = 16;
// What `census.wgsl` counts a pixel as.
const ONE: f32 = 262144.0;
const HIGH: f32 = 4294967296.0;

var<workgroup> raw: array<f32, BINS>;
var<workgroup> weights: array<f32, BINS>;
var<workgroup> spans: array<f32, BINS>;
var<workgroup> density: array<f32, BINS>;
var<workgroup> running: array<vec2u, BINS>;
var<workgroup> partial: array<vec2f, THREADS>;
var<workgroup> centres: array<f32, MOST_LAYERS>;
var<workgroup> cuts: array<vec4f, MOST_LAYERS>;
var<workgroup> any_seen: atomic<u32>;
var<workgroup> layer_now: u32;
var<workgroup> count_now: u32;

fn bin_centre(bin: u32) -> f32 { return (f32(bin) + 0.5) * BIN - U_MAX; }

fn part_of_all(words: vec2u) -> f32 { return (f32(words.y) * HIGH + f32(words.x)) / ONE / p.pixels; }

fn minus(a: vec2u, b: vec2u) -> vec2u { return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x)); }

fn plus(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

// Adds up, or takes the largest of, what all threads have.
fn joined(index: u32, value: vec2f, largest: bool) -> vec2f {
    partial[index] = value;
    workgroupBarrier();
    for (var reach = THREADS / 2u; reach > 0u; reach = reach / 2u) {
        if index < reach {
            let other = partial[index + reach];
            partial[index] = select(partial[index] + other, max(partial[index], other), largest);
        }
        workgroupBarrier();
    }
    let all = partial[0];
    workgroupBarrier();
    return all;
}

// The same among the threads of a layer.
fn joined_lanes(index: u32, value: vec2f) -> vec2f {
    partial[index] = value;
    workgroupBarrier();
    for (var reach = LANES / 2u; reach > 0u; reach = reach / 2u) {
        if index % LANES < reach { partial[index] += partial[index + reach]; }
        workgroupBarrier();
    }
    let all = partial[index - index % LANES];
    workgroupBarrier();
    return all;
}

// `raw`, smoothed with a Gaussian.
fn smoothed(bin: u32, reach: u32, deviation: f32) -> f32 {
    var sum = 0.0;
    var total = 0.0;
    for (var k = 0u; k <= 2u * reach; k++) {
        let off = (f32(k) - f32(reach)) * BIN / deviation;
        let weight = exp(-0.5 * off * off);
        total += weight;
        if bin + k >= reach && bin + k - reach < BINS { sum += weight * raw[bin + k - reach]; }
    }
    return sum / total;
}

// How much of a bin lies below `u`.
fn part_below(bin: u32, u: f32) -> f32 { return clamp((u + U_MAX) / BIN - f32(bin), 0.0, 1.0); }

fn ramps(layer: u32, count: u32) -> vec4f {
    var all = vec4f(-1e30, 1.0, 1e30, 1.0);
    if layer > 0u {
        let cut = cuts[layer - 1u];
        all.x = cut.x - cut.y - cut.z;
        all.y = 1.0 / cut.z;
    }
    if layer + 1u < count {
        let cut = cuts[layer];
        all.z = cut.x - cut.y;
        all.w = 0.5 / cut.y;
    }
    return all;
}

@compute @workgroup_size(THREADS)
fn main(@builtin(local_invocation_index) index: u32) {
    // What each bin weighs for the centres.
    var ends = 0.0;
    for (var bin = index; bin < BINS; bin += THREADS) {
        ends += part_of_all(totals[BINS + bin]);
        running[bin] = minus(totals[2u * BINS + bin], totals[3u * BINS + bin]);
    }
    let all_ends = max(joined(index, vec2f(ends), false).x, LEAST_ENDS);
    for (var bin = index; bin < BINS; bin += THREADS) {
        raw[bin] = part_of_all(totals[BINS + bin]) + ALL_PIXELS * part_of_all(totals[bin]) * all_ends;
    }
    workgroupBarrier();
    var own = vec2f(0.0);
    var most = vec2f(-U_MAX);
    for (var bin = index; bin < BINS; bin += THREADS) {
        let weight = smoothed(bin, p.weights_reach, WEIGHTS_DEVIATION);
        weights[bin] = weight;
        own.x += weight;
        if weight > 0.0 { most = max(most, vec2f(-bin_centre(bin), bin_centre(bin))); }
    }
    let total = max(joined(index, own, false).x, 1.17549435e-38);
    most = joined(index, most, true);

    // Running sums of the edges' spans, in whole numbers.
    for (var reach = 1u; reach < BINS; reach = reach * 2u) {
        var sums: array<vec2u, 3>;
        for (var k = 0u; k < 3u; k++) {
            let bin = index + k * THREADS;
            if bin < BINS {
                sums[k] = running[bin];
                if bin >= reach { sums[k] = plus(sums[k], running[bin - reach]); }
            }
        }
        workgroupBarrier();
        for (var k = 0u; k < 3u; k++) {
            let bin = index + k * THREADS;
            if bin < BINS { running[bin] = sums[k]; }
        }
        workgroupBarrier();
    }
    for (var bin = index; bin < BINS; bin += THREADS) {
        raw[bin] = part_of_all(running[bin]);
    }
    workgroupBarrier();
    var most_spans = 0.0;
    for (var bin = index; bin < BINS; bin += THREADS) {
        spans[bin] = smoothed(bin, p.place_reach, PLACE_DEVIATION);
        most_spans = max(most_spans, spans[bin]);
    }
    most_spans = joined(index, vec2f(most_spans), true).x + 1e-9;
    for (var bin = index; bin < BINS; bin += THREADS) {
        raw[bin] = part_of_all(totals[bin]);
    }
    workgroupBarrier();
    for (var bin = index; bin < BINS; bin += THREADS) {
        density[bin] = smoothed(bin, p.place_reach, PLACE_DEVIATION);
    }

    // Centres spread evenly between the smooth minimum and maximum.
    var ends_sum = vec2f(0.0);
    for (var bin = index; bin < BINS; bin += THREADS) {
        let u = bin_centre(bin);
        ends_sum += weights[bin] / total * exp(SHARPNESS * (vec2f(-u, u) - most));
    }
    ends_sum = max(joined(index, ends_sum, false), vec2f(1.17549435e-38));
    let extremes = log(ends_sum) / SHARPNESS + most;
    let low = -extremes.x;
    let step = (extremes.y - low) / f32(max(p.layers, 2u) - 1u);
    if index < MOST_LAYERS { centres[index] = low + step * f32(index); }
    workgroupBarrier();

    // K-means, sixteen threads for each layer; or for each cut.
    let layer = index / LANES;
    let inertia = INERTIA / f32(p.layers);
    for (var turn = 0u; turn < ROUNDS; turn++) {
        let centre = centres[layer];
        var begin = -U_MAX;
        var end = U_MAX;
        if layer > 0u { begin = 0.5 * (centres[layer - 1u] + centre); }
        if layer + 1u < p.layers { end = 0.5 * (centre + centres[min(layer + 1u, MOST_LAYERS - 1u)]); }
        var sums = vec2f(0.0);
        for (var bin = index % LANES; bin < BINS; bin += LANES) {
            let weight = weights[bin] / total * (part_below(bin, end) - part_below(bin, begin));
            sums += weight * vec2f(1.0, bin_centre(bin) - centre);
        }
        sums = joined_lanes(index, sums);
        if index % LANES == 0u { centres[layer] = centre + sums.y / (sums.x + inertia); }
        workgroupBarrier();
    }

    // Those that lie closer than layers may are one, at their mean.
    if index == 0u {
        var last = 0u;
        var of_last = 1.0;
        for (var i = 1u; i < p.layers; i++) {
            let centre = centres[i];
            let away = centre - centres[last];
            if away < LEAST_APART {
                of_last += 1.0;
                centres[last] += away / of_last;
            } else {
                last += 1u;
                centres[last] = centre;
                of_last = 1.0;
            }
        }
        layer_now = 0u;
        count_now = last + 1u;
    }
    workgroupBarrier();

    // Each cut lies at the emptiest place between two centres.
    let a = centres[layer];
    let b = centres[min(layer + 1u, MOST_LAYERS - 1u)];
    let middle = 0.5 * (a + b);
    let width = max(b - a, LEAST_WINDOW);
    var sums = vec2f(0.0);
    for (var bin = index % LANES; bin < BINS; bin += LANES) {
        let away = bin_centre(bin) - middle;
        let off = 2.0 * away / width;
        let window = max(1.0 - off * off, 0.0);
        let weight = window * (spans[bin] / most_spans + NO_SPANS) / (density[bin] / BIN + NO_DENSITY);
        sums += weight * vec2f(1.0, away);
    }
    sums = joined_lanes(index, sums);
    if index % LANES == 0u {
        cuts[layer] = vec4f(select(middle, middle + sums.y / sums.x, sums.x > 1e-12), b - a, 0.0, 0.0);
    }
    workgroupBarrier();
    if index == 0u {
        var before = -1e30;
        for (var i = 0u; i + 1u < count_now; i++) {
            let cut = cuts[i];
            let place = max(cut.x, before);
            before = place;
            // du/dc at the cut: a ramp at least some part of a unit of diameter wide.
            let slope = 2.0 / (exp(place) + exp(-place)) / p.knee;
            let half = max(HALF.x * cut.y, HALF.y * p.unit * slope);
            cuts[i] = vec4f(place, half, max(OVERLAP.x * cut.y, OVERLAP.y * half), 0.0);
        }
    }
    workgroupBarrier();

    // Without the layers of which no bin shows anything.
    for (var turn = 0u; turn < 2u * p.layers; turn++) {
        if index == 0u { atomicStore(&any_seen, 0u); }
        workgroupBarrier();
        let now = layer_now;
        let count = count_now;
        if now < count && count > 1u {
            let own_ramps = ramps(now, count);
            for (var bin = index; bin < BINS; bin += THREADS) {
                let u = bin_centre(bin);
                // A bin's pixels may lie one bin to either side.
                let seen = vec3f(
                    member(own_ramps, u - BIN).x,
                    member(own_ramps, u).x,
                    member(own_ramps, u + BIN).x,
                );
                if any(totals[bin] > vec2u(0u)) && any(seen > vec3f(0.0)) { atomicStore(&any_seen, 1u); }
            }
        }
        workgroupBarrier();
        if index == 0u && now < count && count > 1u {
            if atomicLoad(&any_seen) > 0u {
                layer_now = now + 1u;
            } else {
                // What lies on either side of an empty layer is cut by its far side, or by its near side where it is the
                // farthest.
                for (var i = min(now, count - 2u); i + 2u < count; i++) {
                    cuts[i] = cuts[i + 1u];
                }
                count_now = count - 1u;
            }
        }
        workgroupBarrier();
    }

    if index == 0u {
        split.knee = p.knee;
        split.count = count_now;
    }
    if index < MOST_LAYERS {
        split.ramps[index] = ramps(index, count_now);
        split.cuts[index] = cuts[index];
    }
}
