// The columns of a sum of products: four fields in, a plane out.

fn work(least_at: u32) {
    var q: array<Lane, K>;
    var re: array<Lane, K>;
    var other: array<Lane, K>;
    var values: array<Val, K>;
    read_chunk(0u, &q);
    read_chunk(1u, &re);
    read_chunk(2u, &other);
    /* unroll */ for (var j = 0u; j < K; j++) {
        re[j] *= MEANT;
        values[j] = v_make(re[j], MEANT * other[j]);
    }
    solve(&values, 0u);
    var kept: array<Lane, K>;
    read_chunk(3u, &other);
    /* unroll */ for (var j = 0u; j < K; j++) {
        kept[j] = v_re(values[j]);
        values[j] = v_make(0.5 * q[j] - re[j], MEANT * other[j]);
    }
    solve(&values, 1u);
    var low = Lane(-3.4e38);
    if FLOOR { low = read_least(least_at); }
    /* unroll */ for (var j = 0u; j < K; j++) {
        q[j] = raised(summed(q[j], re[j], kept[j], v_re(values[j])), low);
    }
    write_chunk(0u, &q);
}
