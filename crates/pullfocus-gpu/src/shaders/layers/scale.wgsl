// The scale of layers and what a layer has to do with a place on it; as in `pullfocus_core::split`.

// Where layers begin and end, for all passes.
struct Split {
    // Diameters up to about this are told apart linearly.
    knee: f32,
    // How many layers there are.
    count: u32,
    // Of each layer, from near to far: where it begins behind a nearer one and how steeply (x, y), and where it ends (z, w).
    ramps: array<vec4f, MOST_LAYERS>,
    // Cuts from near to far: place, half the ramp, overlap.
    cuts: array<vec4f, MOST_LAYERS>,
}

// See `fast_asinh`.
fn position(c: f32, knee: f32) -> f32 {
    let x = c / knee;
    let size = min(abs(x), 1e18);
    let y = size + sqrt(size * size + 1.0);
    let shifted = bitcast<u32>(y) + (0x3f800000u - 0x3f3504f3u);
    let exponent = i32(shifted >> 23u) - 127;
    let mantissa = bitcast<f32>((shifted & 0x007fffffu) + 0x3f3504f3u);
    let z = (mantissa - 1.0) / (mantissa + 1.0);
    let w = z * z;
    let ln = 2.0 * z * (1.0 + w * (1.0 / 3.0 + w * (0.2 + w * (1.0 / 7.0 + w / 9.0))))
        + f32(exponent) * 0.69314718;
    let small = size - size * size * size / 6.0;
    let u = select(ln, small, size < 0.02);
    return select(u, -u, x < 0.0);
}

fn soft_step(x: f32) -> f32 {
    let t = clamp(x, 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// x: coverage of the layer where nothing nearer hides it; y: 1 where all that is seen lies in it or farther.
fn member(ramps: vec4f, u: f32) -> vec2f {
    let behind = soft_step((u - ramps.x) * ramps.y);
    let beyond = soft_step((u - ramps.z) * ramps.w);
    return vec2f(behind * (1.0 - beyond), behind);
}
