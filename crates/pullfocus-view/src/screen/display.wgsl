// What a picture looks like on the screen: two sides with a border between them, exposure, a display transform, and the circle of
// confusion as an overlay.

struct Curve {
    // A depth's circle of confusion: at infinity, pixels times metres, factor in front, factor behind.
    formula: vec4f,
    // Largest diameter; near and far end of what stays sharp, and whether there is such a range.
    limits: vec4f,
}

struct Params {
    // Where the picture's pixels lie on the screen: picture pixel = origin + step * (screen pixel - corner).
    corner: vec2f,
    origin: vec2f,
    step: vec2f,
    // Screen pixel from which on the right side is shown, and whether there are two sides.
    wipe: f32,
    gain: f32,
    transform: u32,
    overlay: f32,
    kinds: vec2u,
    // Of the table's sides: factor on light, factor on the logarithm.
    shaper: vec2f,
    // Left and right of the border.
    curves: array<Curve, 2>,
    // Diameter in full colour; near and far end in dioptres; whether the distances are circles already.
    ranges: vec4f,
    // Where left, right and distances lie: first pixel and size.
    areas: array<vec4f, 3>,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var left: texture_2d<f32>;
@group(0) @binding(3) var right: texture_2d<f32>;
@group(0) @binding(4) var distances: texture_2d<f32>;
@group(0) @binding(5) var cube: texture_3d<f32>;

const LINEAR_LIGHT = 0u;
const ENCODED = 1u;
const DEPTH = 2u;
const COC = 3u;

@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(4 * (index & 1u)) - 1.0, 1.0 - f32(2 * (index & 2u)), 0.0, 1.0);
}

fn picture(source: texture_2d<f32>, pixel: vec2f, area: vec4f) -> vec4f {
    let at = pixel - area.xy;
    let dims = vec2f(textureDimensions(source));
    let scale = dims / area.zw;
    let step = abs(params.step) * scale;
    if max(step.x, step.y) <= 1.0 && scale.x == 1.0 {
        // Magnified: pixels are squares.
        return textureLoad(source, vec2i(clamp(at, vec2f(0.0), dims - 1.0)), 0);
    }
    // Reduced: the mean of the pixels under the screen's.
    let taps = clamp(ceil(step), vec2f(1.0), vec2f(4.0));
    var sum = vec4f(0.0);
    for (var y = 0.0; y < taps.y; y += 1.0) {
        for (var x = 0.0; x < taps.x; x += 1.0) {
            let place = at * scale + ((vec2f(x, y) + 0.5) / taps - 0.5) * step;
            sum += textureSampleLevel(source, smooth_sampler, place / dims, 0.0);
        }
    }
    return sum / (taps.x * taps.y);
}

fn circle(distance: f32, second: bool) -> f32 {
    let curve = params.curves[select(0u, 1u, second)];
    var c = distance;
    if params.ranges.w == 0.0 {
        // Infinity is stored as such; its inverse is 0.
        c = curve.formula.x - curve.formula.y * select(1.0 / distance, 0.0, distance > 3.0e38);
        if curve.limits.w != 0.0 {
            c -= clamp(c, curve.limits.y, curve.limits.z);
        }
    }
    c *= select(curve.formula.w, curve.formula.z, c < 0.0);
    return clamp(c, -curve.limits.x, curve.limits.x);
}

// Front red, in focus green, behind blue: as `coc_color` in the pictures that `pullfocus coc` writes.
fn circle_color(c: f32) -> vec3f {
    let sharp = exp(-c * c);
    let strength = sqrt(clamp(abs(c) / params.ranges.x, 0.0, 1.0));
    let side = (1.0 - sharp) * (0.25 + 0.75 * strength);
    let wash = 0.25 * (1.0 - sharp) * strength;
    let green = max(0.85 * sharp, wash);
    return select(vec3f(wash, green, side), vec3f(side, green, wash), c < 0.0);
}

fn encode(linear: vec3f) -> vec3f {
    let low = 12.92 * linear;
    let high = 1.055 * pow(max(linear, vec3f(0.0)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3f(0.0031308));
}

// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
fn filmic(x: vec3f) -> vec3f {
    return (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
}

// Between the table's points by tetrahedra: as `Table::apply`, which exports use.
fn looked_up(light: vec3f) -> vec3f {
    let last = vec3f(textureDimensions(cube)) - 1.0;
    let at = min(log2(light * params.shaper.x + 1.0) * params.shaper.y, vec3f(1.0)) * last;
    let low = min(floor(at), last - 1.0);
    let part = at - low;
    let corner = vec3i(low);
    // From the low corner to the high one, along the axis with the largest part first.
    var first = vec3i(1, 0, 0);
    var last_axis = vec3i(0, 0, 1);
    if part.x >= part.y {
        if part.y < part.z {
            last_axis = vec3i(0, 1, 0);
            if part.x < part.z {
                first = vec3i(0, 0, 1);
            }
        }
    } else if part.y >= part.z {
        first = vec3i(0, 1, 0);
        if part.x < part.z {
            last_axis = vec3i(1, 0, 0);
        }
    } else {
        first = vec3i(0, 0, 1);
        last_axis = vec3i(1, 0, 0);
    }
    let second = vec3i(1) - first - last_axis;
    let a = textureLoad(cube, corner, 0).rgb;
    let b = textureLoad(cube, corner + first, 0).rgb;
    let c = textureLoad(cube, corner + first + second, 0).rgb;
    let d = textureLoad(cube, corner + vec3i(1), 0).rgb;
    let along = vec3f(dot(part, vec3f(first)), dot(part, vec3f(second)), dot(part, vec3f(last_axis)));
    return clamp(a + (b - a) * along.x + (c - b) * along.y + (d - c) * along.z, vec3f(0.0), vec3f(1.0));
}

fn shown(linear: vec3f) -> vec3f {
    let raised = linear * params.gain;
    // What is no number is black; what is infinite is brighter than all that is told apart.
    let light = select(vec3f(0.0), min(raised, vec3f(1e30)), raised > vec3f(0.0));
    switch params.transform {
        case 0u: { return encode(min(light, vec3f(1.0))); }
        case 1u: { return encode(clamp(filmic(min(light, vec3f(1e4))), vec3f(0.0), vec3f(1.0))); }
        case 2u: { return min(light, vec3f(1.0)); }
        default: { return looked_up(light); }
    }
}

fn distance_at(at: vec2f) -> f32 {
    let dims = vec2f(textureDimensions(distances));
    let area = params.areas[2];
    return textureLoad(distances, vec2i(clamp((at - area.xy) * dims / area.zw, vec2f(0.0), dims - 1.0)), 0).x;
}

@fragment
fn pixel(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let at = params.origin + params.step * (position.xy - params.corner);
    let second = position.x - params.corner.x >= params.wipe;
    let area = select(params.areas[0], params.areas[1], second);
    if any(at < area.xy) || any(at >= area.xy + area.zw) {
        discard;
    }
    let kind = select(params.kinds.x, params.kinds.y, second);
    var color: vec3f;
    if kind == DEPTH {
        let z = distance_at(at);
        let dioptres = select(1.0 / z, 0.0, z > 3.0e38);
        let near = (dioptres - params.ranges.z) / max(params.ranges.y - params.ranges.z, 1e-6);
        color = vec3f(clamp(near, 0.0, 1.0));
    } else if kind == COC {
        color = circle_color(circle(distance_at(at), second));
    } else {
        if second {
            color = picture(right, at, area).rgb;
        } else {
            color = picture(left, at, area).rgb;
        }
        if kind == LINEAR_LIGHT {
            color = shown(color);
        }
    }
    if params.overlay > 0.0 && kind == LINEAR_LIGHT {
        color = mix(color, circle_color(circle(distance_at(at), second)), params.overlay);
    }
    // A line where one side ends.
    if abs(position.x - params.corner.x - params.wipe) < 1.0 {
        color = mix(color, vec3f(1.0), 0.7);
    }
    return vec4f(color, 1.0);
}
