// Coverage in a plane of its own.
alias CoverPx = f32;
fn cover(px: CoverPx) -> f32 { return px; }
