// The rows of a sum of products: a plane in, four fields out.

fn work(least_at: u32) {
    var lanes: array<Lane, K>;
    var first: array<Val, K>;
    var second: array<Val, K>;
    read_chunk(0u, &lanes);
    if NOTE_LEAST { note_least(&lanes, least_at); }
    /* unroll */ for (var j = 0u; j < K; j++) {
        first[j] = v_make(lanes[j], Lane(0.0));
        second[j] = first[j];
    }
    solve(&first, 0u);
    solve(&second, 1u);
    /* unroll */ for (var field = 0u; field < 4u; field++) {
        var mix = p.terms[1].mix_0;
        if field == 1u { mix = p.terms[1].mix_1; }
        if field == 2u { mix = p.terms[1].mix_2; }
        if field == 3u { mix = p.terms[1].mix_3; }
        let part = select(STORED, 1.0, field == 0u);
        /* unroll */ for (var j = 0u; j < K; j++) {
            lanes[j] = part * mixed(mix, v_re(first[j]), v_im(first[j]), v_re(second[j]), v_im(second[j]));
        }
        write_chunk(field, &lanes);
    }
}
