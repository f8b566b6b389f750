// Rows and columns of a product: a plane in, a plane out.

fn work(least_at: u32) {
    var lanes: array<Lane, K>;
    var values: array<Val, K>;
    read_chunk(0u, &lanes);
    if NOTE_LEAST { note_least(&lanes, least_at); }
    /* unroll */ for (var j = 0u; j < K; j++) {
        values[j] = v_make(lanes[j], Lane(0.0));
    }
    solve(&values, 0u);
    var low = Lane(-3.4e38);
    if FLOOR { low = read_least(least_at); }
    /* unroll */ for (var j = 0u; j < K; j++) {
        lanes[j] = raised(v_re(values[j]) - p.terms[0].h * v_im(values[j]), low);
    }
    write_chunk(0u, &lanes);
}
