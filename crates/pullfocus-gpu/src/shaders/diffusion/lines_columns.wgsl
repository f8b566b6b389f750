// Columns: threads that stand beside each other have columns that lie beside each other.

fn line_of(index: u32) -> u32 { return index % p.per_group; }
fn chunk_of(index: u32) -> u32 { return index / p.per_group; }
const NEIGHBOUR_IS_LINES_APART: bool = true;

fn place(at: u32) -> u32 {
    let line = first_line + own_line;
    return ((line / HALVES) * p.across + at * p.along) * HALVES + line % HALVES;
}

fn read_chunk(field: u32, to: ptr<function, array<Lane, K>>) {
    /* unroll */ for (var j = 0u; j < K; j++) {
        var value = Lane(0.0);
        if own_active && own_first + j < p.unknowns {
            value = px_unpack(px_get(field, place(own_first + j)));
        }
        (*to)[j] = value;
    }
}

fn write_chunk(field: u32, values: ptr<function, array<Lane, K>>) {
    /* unroll */ for (var j = 0u; j < K; j++) {
        if own_active && own_first + j < p.unknowns {
            px_put(field, place(own_first + j), px_pack((*values)[j]));
        }
    }
}
