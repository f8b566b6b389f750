// Where a pixel of a fine picture lies on a grid `ratio` times as coarse (1 or an even number): the four nodes around it, and
// how far it is from the first ones. Bilinear; the border's nodes stand in for those beyond.

struct Taps {
    i00: u32,
    i10: u32,
    i01: u32,
    i11: u32,
    across: f32,
    down: f32,
}

struct Tap {
    first: u32,
    second: u32,
    part: f32,
}

fn tap(at: u32, ratio: u32, count: u32) -> Tap {
    let cell = at / ratio;
    let part = (f32(at % ratio) + 0.5 - 0.5 * f32(ratio)) / f32(ratio);
    let last = count - 1u;
    if part < 0.0 { return Tap(min(max(cell, 1u) - 1u, last), min(cell, last), 1.0 + part); }
    return Tap(min(cell, last), min(cell + 1u, last), part);
}

fn taps(x: u32, y: u32, ratio: u32, coarse: vec2u) -> Taps {
    let across = tap(x, ratio, coarse.x);
    let down = tap(y, ratio, coarse.y);
    let above = down.first * coarse.x;
    let below = down.second * coarse.x;
    return Taps(
        above + across.first,
        above + across.second,
        below + across.first,
        below + across.second,
        across.part,
        down.part,
    );
}

fn enlarged(t: Taps, v00: vec4f, v10: vec4f, v01: vec4f, v11: vec4f) -> vec4f {
    let left = v00 + (v01 - v00) * t.down;
    let right = v10 + (v11 - v10) * t.down;
    return left + (right - left) * t.across;
}
