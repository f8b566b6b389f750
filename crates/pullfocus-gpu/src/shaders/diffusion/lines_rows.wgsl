// Rows: a thread's chunk lies together in memory, so values go through workgroup memory, where threads that stand beside
// each other bring what lies beside each other.

var<workgroup> staged: array<Px, STAGED>;

fn line_of(index: u32) -> u32 { return (index / (p.chunks * HALVES)) * HALVES + index % HALVES; }
fn chunk_of(index: u32) -> u32 { return (index / HALVES) % p.chunks; }
const NEIGHBOUR_IS_LINES_APART: bool = false;

fn read_chunk(field: u32, to: ptr<function, array<Lane, K>>) {
    let block = p.chunks * STEP * HALVES;
    /* unroll */ for (var first = 0u; first < K; first += STEP) {
        /* unroll */ for (var e = 0u; e < STEP; e++) {
            let flat = e * (p.per_group * p.chunks) + own_index;
            if own_index < p.per_group * p.chunks {
                let line = flat / block;
                let rest = flat % block;
                let at = ((rest / HALVES) / STEP) * K + first + (rest / HALVES) % STEP;
                let row = first_line / HALVES + line;
                if at < p.unknowns && row * HALVES < p.lines {
                    staged[flat] = px_get(field, (row * p.across + at * p.along) * HALVES + rest % HALVES);
                }
            }
        }
        workgroupBarrier();
        /* unroll */ for (var j = 0u; j < STEP; j++) {
            let at = (((own_line / HALVES) * p.chunks + own_chunk) * STEP + j) * HALVES + own_line % HALVES;
            var value = Lane(0.0);
            if own_active && own_first + first + j < p.unknowns {
                value = px_unpack(staged[at]);
            }
            (*to)[first + j] = value;
        }
        workgroupBarrier();
    }
}

fn write_chunk(field: u32, values: ptr<function, array<Lane, K>>) {
    let block = p.chunks * STEP * HALVES;
    /* unroll */ for (var first = 0u; first < K; first += STEP) {
        /* unroll */ for (var j = 0u; j < STEP; j++) {
            let at = (((own_line / HALVES) * p.chunks + own_chunk) * STEP + j) * HALVES + own_line % HALVES;
            if own_active {
                staged[at] = px_pack((*values)[first + j]);
            }
        }
        workgroupBarrier();
        /* unroll */ for (var e = 0u; e < STEP; e++) {
            let flat = e * (p.per_group * p.chunks) + own_index;
            if own_index < p.per_group * p.chunks {
                let line = flat / block;
                let rest = flat % block;
                let at = ((rest / HALVES) / STEP) * K + first + (rest / HALVES) % STEP;
                let row = first_line / HALVES + line;
                if at < p.unknowns && row * HALVES < p.lines {
                    px_put(field, (row * p.across + at * p.along) * HALVES + rest % HALVES, staged[flat]);
                }
            }
        }
        workgroupBarrier();
    }
}
