// The ends of every point's spans, as differences along the rows of its level.
//
// A workgroup has a tile of pixels. Row of cells by row of cells it adds what all of its points have there in its own memory,
// and that to the level: neighbours' ends fall into the same cells, so few sums leave the workgroup.

// First the heads of all entries: where its rows begin, the first row that has any light, the one after the last, bits of the
// area; then rows: what of it is covered, the left and the right end times that.
@group(0) @binding(3) var<storage, read> table: array<vec4u>;
@group(0) @binding(4) var<storage, read> source: array<Px>;
@group(0) @binding(5) var<storage, read> circle: array<f32>;
@group(0) @binding(6) var<storage, read> gamma: array<f32>;
// Of each channel of each cell: low and high word.
@group(0) @binding(7) var<storage, read_write> ends: array<atomic<u32>>;

// Cells of a row that a workgroup has in its memory.
const SEGMENT: u32 = 128u;
const THREADS: u32 = 256u;

var<workgroup> sums: array<atomic<u32>, 2u * SEGMENT * CHANNELS>;
// One bit for each level that the tile has points for.
var<workgroup> levels: atomic<u32>;
// What all points of one level reach: the first row and column of cells, complemented, and those after the last.
var<workgroup> extent: array<atomic<u32>, 4>;
// Copies of both: what barriers depend on must be known to be the same for all threads, and an atomic never is.
var<workgroup> levels_there: u32;
var<workgroup> reached: vec4u;

// A thread's point.
var<private> values: array<f32, CHANNELS>;
var<private> entry_small: vec4u;
var<private> entry_large: vec4u;
var<private> mix_large: f32;
var<private> middle: f32;
// The row of cells where the table's first row falls.
var<private> base: i32;

fn row_of(entry: vec4u, k: u32) -> vec4f {
    if k < entry.y || k >= entry.z { return vec4f(0.0); }
    return bitcast<vec4f>(table[entry.x + k - entry.y]);
}

// Finds all that is known of a point.
fn find(at: vec2u, drawn: Drawn) {
    let cell = power(-i32(drawn.level));
    let edge = p.places[drawn.level].w;
    middle = (f32(at.x) + 0.5) * cell - 0.5 + f32(edge);
    let steps = u32(((f32(at.y) + 0.5) * cell + 0.5) * f32(PHASES) + 0.5);
    base = i32(steps / PHASES) - 1 - i32(HALF) + i32(edge);
    let pixel = at.y * p.width + at.x;
    let size = min(drawn.rows, f32(MOST_ROWS)) * f32(STEPS);
    let first = (steps % PHASES) * SIZES + u32(size) + select(0u, p.front, circle[pixel] < 0.0);
    entry_small = table[first];
    entry_large = table[first + 1u];
    mix_large = size - floor(size);
    let area = bitcast<f32>(entry_small.w) + (bitcast<f32>(entry_large.w) - bitcast<f32>(entry_small.w)) * mix_large;
    let factor = cell * cell / area;
    var own_gamma = 1.0;
    if HAS_GAMMA { own_gamma = max(gamma[pixel], LEAST_GAMMA); }
    let value = px_unpack(source[pixel]);
    /* unroll */ for (var c = 0u; c < LANES; c++) {
        let x = lane_part(value, p.first + c);
        values[c] = select(0.0, x * own_gamma * factor, is_finite(x)) * to_units(c);
    }
    if WEIGHT { values[CHANNELS - 1u] = own_gamma * factor * to_units(CHANNELS - 1u); }
}

// The first row of cells that the point has light on, and the one after the last.
fn rows_of(place: vec4u) -> vec2i {
    let start = base + i32(min(entry_small.y, entry_large.y));
    let stop = base + i32(max(entry_small.z, entry_large.z));
    return clamp(vec2i(start, stop), vec2i(0), vec2i(i32(place.z)));
}

fn add(cell: u32, channel: u32, words: vec2u) {
    let at = 2u * (cell * CHANNELS + channel);
    var high = words.y;
    if words.x != 0u {
        let before = atomicAdd(&sums[at], words.x);
        if before + words.x < before { high += 1u; }
    }
    if high != 0u { atomicAdd(&sums[at + 1u], high); }
}

// An end in its two cells, as far as they lie in the segment.
fn end(place: f32, covered: f32, segment: u32, columns: u32, turned: bool) {
    let cell = u32(clamp(place, 0.0, f32(columns)));
    let part = covered * (clamp(place, 0.0, f32(columns)) - f32(cell));
    let in_first = cell >= segment && cell < min(segment + SEGMENT, columns);
    let in_second = cell + 1u >= segment && cell + 1u < min(segment + SEGMENT, columns);
    if !(in_first || in_second) { return; }
    /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
        // The two ends of a span add up to nothing, word by word: each is the same whole less its own part.
        let second = to_words(values[c] * part);
        let first = minus(to_words(values[c] * covered), second);
        if in_first { add(cell - segment, c, select(first, negated(first), turned)); }
        if in_second { add(cell + 1u - segment, c, select(second, negated(second), turned)); }
    }
}

fn spans(row: i32, segment: u32, columns: u32) {
    let k = u32(row - base);
    let small = row_of(entry_small, k);
    let mixed = small + (row_of(entry_large, k) - small) * mix_large;
    let covered = mixed.x;
    let inverse = 1.0 / max(covered, 1e-20);
    end(mixed.y * inverse + (middle + 0.5), covered, segment, columns, false);
    end(mixed.z * inverse + (middle + 0.5), covered, segment, columns, true);
}

@compute @workgroup_size(16, 16)
fn main(
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) index: u32,
    @builtin(workgroup_id) group: vec3u,
) {
    if missing() { return; }
    for (var i = index; i < 2u * SEGMENT * CHANNELS; i += THREADS) { atomicStore(&sums[i], 0u); }
    if index == 0u { atomicStore(&levels, 0u); }
    workgroupBarrier();
    let at = vec2u(group.x * 16u + local.x, p.first_y + group.y * 16u + local.y);
    var drawn = Drawn(0u, 0.0);
    if at.x < p.width && at.y < min(p.end_y, p.height) { drawn = drawn_as(circle[at.y * p.width + at.x]); }
    let there = drawn.rows > 0.0;
    if there {
        find(at, drawn);
        atomicOr(&levels, 1u << drawn.level);
    }
    workgroupBarrier();
    if index == 0u { levels_there = atomicLoad(&levels); }
    var left = workgroupUniformLoad(&levels_there);
    while left != 0u {
        let level = firstTrailingBit(left);
        left &= left - 1u;
        let place = p.places[level];
        let own = there && drawn.level == level;
        if index < 4u { atomicStore(&extent[index], 0u); }
        workgroupBarrier();
        var rows = vec2i(0);
        if own {
            rows = rows_of(place);
            let reach = p.wide * drawn.rows;
            let columns = clamp(vec2f(middle - reach - 1.0, middle + reach + 3.0), vec2f(0.0), vec2f(f32(place.y)));
            if rows.x < rows.y {
                atomicMax(&extent[0], ~u32(rows.x));
                atomicMax(&extent[1], u32(rows.y));
                atomicMax(&extent[2], ~u32(columns.x));
                atomicMax(&extent[3], u32(columns.y));
            }
        }
        workgroupBarrier();
        if index == 0u {
            reached = vec4u(
                ~atomicLoad(&extent[0]), atomicLoad(&extent[1]),
                ~atomicLoad(&extent[2]), atomicLoad(&extent[3]),
            );
        }
        let whole = workgroupUniformLoad(&reached);
        let first_row = whole.x;
        let end_row = whole.y;
        let first_column = whole.z;
        let end_column = min(whole.w + 1u, place.y);
        if end_row > 0u {
            for (var segment = first_column; segment < end_column; segment += SEGMENT) {
                let cells = min(end_column - segment, SEGMENT);
                for (var row = first_row; row < end_row; row++) {
                    if own && i32(row) >= rows.x && i32(row) < rows.y { spans(i32(row), segment, place.y); }
                    workgroupBarrier();
                    let out = (place.x + row * place.y + segment) * CHANNELS;
                    for (var i = index; i < cells * CHANNELS; i += THREADS) {
                        let low = atomicLoad(&sums[2u * i]);
                        var high = atomicLoad(&sums[2u * i + 1u]);
                        if low != 0u {
                            atomicStore(&sums[2u * i], 0u);
                            let before = atomicAdd(&ends[2u * (out + i)], low);
                            if before + low < before { high += 1u; }
                        }
                        atomicStore(&sums[2u * i + 1u], 0u);
                        if high != 0u { atomicAdd(&ends[2u * (out + i) + 1u], high); }
                    }
                    workgroupBarrier();
                }
            }
        }
    }
}
