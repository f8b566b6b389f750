// Rows: a thread's chunk lies together in memory, so values go through workgroup memory, where threads that stand beside
// each other bring what lies beside each other. SIDE lines, parts of the same pixels, stand side by side.

var<workgroup> staged: array<Px, STAGED>;

fn line_of(index: u32) -> u32 { return (index / (p.chunks * SIDE)) * SIDE + index % SIDE; }
fn chunk_of(index: u32) -> u32 { return (index / SIDE) % p.chunks; }
const NEIGHBOUR_IS_LINES_APART: bool = false;

// Where unknown `j` of a step of chunk `t` stands: turned from chunk to chunk, so that threads meet different banks.
fn staged_at(line: u32, t: u32, j: u32) -> u32 {
    return (((line / SIDE) * p.chunks + t) * STEP + (j + t / 2u) % STEP) * SIDE + line % SIDE;
}

// The `e`th of the places that this thread brings: x where it is staged, y where it lies in memory, z 0 if it is nowhere.
fn brought(e: u32, first: u32) -> vec3u {
    let flat = e * (p.per_group * p.chunks) + own_index;
    let block = p.chunks * STEP * SIDE;
    let rest = flat % block;
    let side = rest % SIDE;
    let t = (rest / SIDE) / STEP;
    let j = (rest / SIDE) % STEP;
    let line = (flat / block) * SIDE + side;
    let at = t * K + first + j;
    let whole = first_line + line;
    let there = own_index < p.per_group * p.chunks && at < p.unknowns && whole < p.lines;
    let place = ((whole / HALVES) * p.across + at * p.along) * HALVES + whole % HALVES;
    return vec3u(staged_at(line, t, j), place, select(0u, 1u, there));
}

fn read_chunk(field: u32, to: ptr<function, array<Lane, K>>) {
    /* unroll */ for (var first = 0u; first < K; first += STEP) {
        /* unroll */ for (var e = 0u; e < STEP; e++) {
            let one = brought(e, first);
            if one.z != 0u {
                staged[one.x] = px_get(field, one.y);
            }
        }
        workgroupBarrier();
        /* unroll */ for (var j = 0u; j < STEP; j++) {
            var value = Lane(0.0);
            if own_active && own_first + first + j < p.unknowns {
                value = px_unpack(staged[staged_at(own_line, own_chunk, j)]);
            }
            (*to)[first + j] = value;
        }
        workgroupBarrier();
    }
}

fn write_chunk(field: u32, values: ptr<function, array<Lane, K>>) {
    /* unroll */ for (var first = 0u; first < K; first += STEP) {
        /* unroll */ for (var j = 0u; j < STEP; j++) {
            if own_active {
                staged[staged_at(own_line, own_chunk, j)] = px_pack((*values)[first + j]);
            }
        }
        workgroupBarrier();
        /* unroll */ for (var e = 0u; e < STEP; e++) {
            let one = brought(e, first);
            if one.z != 0u {
                px_put(field, one.y, staged[one.x]);
            }
        }
        workgroupBarrier();
    }
}
