fn result(at: u32, source: u32) {
    let q = px_unpack(px_get(0u, at));
    let re = MEANT * px_unpack(px_get(1u, at));
    px_put(0u, at, px_pack(floored(summed(q, re, v_re(solution_0[source]), v_re(solution_1[source])))));
}
