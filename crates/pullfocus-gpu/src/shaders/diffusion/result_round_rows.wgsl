fn result(at: u32, source: u32) {
    let first = solution_0[source];
    let second = solution_1[source];
    let term = p.terms[1];
    px_put(0u, at, px_pack(mixed(term.mix_0, v_re(first), v_im(first), v_re(second), v_im(second))));
    px_put(1u, at, px_pack(STORED * mixed(term.mix_1, v_re(first), v_im(first), v_re(second), v_im(second))));
    px_put(2u, at, px_pack(STORED * mixed(term.mix_2, v_re(first), v_im(first), v_re(second), v_im(second))));
    px_put(3u, at, px_pack(STORED * mixed(term.mix_3, v_re(first), v_im(first), v_re(second), v_im(second))));
}
