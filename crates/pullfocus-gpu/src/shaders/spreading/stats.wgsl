// What `measure.wgsl` found.

@group(0) @binding(2) var<storage, read> stats: array<u32>;

fn most_level() -> u32 { return stats[0]; }

fn lowest(lane: u32) -> f32 { return -from_ordered(stats[1u + 2u * lane]); }

fn highest(lane: u32) -> f32 { return from_ordered(stats[2u + 2u * lane]); }

// Exponent of the largest value of a channel; weights are 1 at most.
fn exponent(channel: u32) -> i32 {
    if channel >= LANES { return 0; }
    let most = max(abs(lowest(p.first + channel)), abs(highest(p.first + channel)));
    return clamp(i32(bitcast<u32>(most) >> 23u) - 127, -60, 127);
}

// What a value is multiplied by to be in units of the high word: 2^26 of them are more than the largest value, and 2^31 have room.
fn to_units(channel: u32) -> f32 { return power(25 - exponent(channel)); }

// A number of two words.
fn from_words(low: u32, high: u32, channel: u32) -> f32 {
    // Without the sign first: a small negative number is the difference of two large ones.
    let negative = high >= 0x80000000u;
    let words = select(vec2u(low, high), negated(vec2u(low, high)), negative);
    let e = exponent(channel);
    let size = f32(words.y) * power(e - 25) + f32(words.x) * power(e - 57);
    return select(size, -size, negative);
}

// Low and high word of a number of units.
fn to_words(x: f32) -> vec2u {
    let size = abs(x);
    let whole = floor(size);
    let words = vec2u(u32((size - whole) * 4294967296.0), u32(whole));
    return select(words, negated(words), x < 0.0);
}

fn negated(a: vec2u) -> vec2u { return vec2u(0u - a.x, ~a.y + select(0u, 1u, a.x == 0u)); }

fn plus(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn minus(a: vec2u, b: vec2u) -> vec2u {
    return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}
