// Coverage as one of four planes, f32.
alias CoverPx = vec4f;
fn cover(px: CoverPx) -> f32 { return px[p.coverage]; }
