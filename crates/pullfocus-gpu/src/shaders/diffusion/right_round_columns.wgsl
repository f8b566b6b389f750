fn right_side(first: Lane, at: u32) -> Val {
    let re = MEANT * px_unpack(px_get(1u, at));
    if p.term == 0u { return v_make(re, MEANT * px_unpack(px_get(2u, at))); }
    return v_make(0.5 * first - re, MEANT * px_unpack(px_get(3u, at)));
}
