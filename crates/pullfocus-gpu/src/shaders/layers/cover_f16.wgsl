// Coverage as one of four planes, f16.
alias CoverPx = vec2u;
fn cover(px: CoverPx) -> f32 { return unpack2x16float(px[p.coverage / 2u])[p.coverage % 2u]; }
