fn result(at: u32, source: u32) {
    let v = solution_0[source];
    px_put(0u, at, px_pack(floored(v_re(v) - p.terms[0].h * v_im(v))));
}
