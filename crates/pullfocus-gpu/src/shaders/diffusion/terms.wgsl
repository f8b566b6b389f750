// One term of the integrator: see `pullfocus_core::scheme::Term`.
struct Term {
    sigma: vec2f,
    beta: f32,
    h: f32,
    // Of each field: what it gets of Im v_0, Re (v_1 - v_0) and Im v_1 (x, y, z), and of Re v_0 (w).
    mix_0: vec4f,
    mix_1: vec4f,
    mix_2: vec4f,
    mix_3: vec4f,
}

// A field between rows and columns from the two solutions along a row.
fn mixed(mix: vec4f, re_0: Lane, im_0: Lane, re_1: Lane, im_1: Lane) -> Lane {
    return re_0 * mix.w + mix.x * im_0 + mix.y * (re_1 - re_0) + mix.z * im_1;
}

// At least `low`; a 0 keeps its sign.
fn raised(value: Lane, low: Lane) -> Lane { return select(value, low, value < low); }

// What a column's two solutions add up to: the picture's own value where they change nothing.
fn summed(q: Lane, re: Lane, re_0: Lane, re_1: Lane) -> Lane {
    // As the right-hand side was, to the bit.
    let known = 0.5 * q - re;
    let change = abs(re_0 - re) + abs(re_1 - known);
    return select(2.0 * (re_0 + re_1), q, change < Lane(1e-30));
}
