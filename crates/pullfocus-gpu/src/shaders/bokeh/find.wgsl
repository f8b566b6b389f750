// Finds the highlights of a picture, tile by tile, in the order of their rows; core's `bokeh` has the formulas.

struct Params {
    width: u32,
    height: u32,
    tiles: u32,
    // Planes that brightness is taken from.
    leading: u32,
    threshold: f32,
    low: f32,
    high: f32,
    bend: f32,
    least: f32,
    gain: f32,
    // The largest diameter that counts.
    largest: f32,
    // See `outline.wgsl` and `picture.wgsl`.
    unit_x: f32,
    unit_y: f32,
    reach: f32,
    point: f32,
    area: f32,
    sides: u32,
    columns: u32,
    rows: u32,
    longer_side: f32,
    // See `cats_eye.wgsl`.
    cats_eye: f32,
    axis_x: f32,
    axis_y: f32,
    field_x: f32,
    field_y: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> picture: array<Px>;
// Diameters, and whose sign they have.
@group(0) @binding(2) var<storage, read> circles: array<f32>;
@group(0) @binding(3) var<storage, read> signs: array<f32>;
@group(0) @binding(4) var<storage, read> shape: array<ShapePx>;
@group(0) @binding(5) var<storage, read_write> lights: array<Light>;
// Of each tile: how many highlights, and the largest diameter of those that shine in a layer.
@group(0) @binding(6) var<storage, read_write> tiles: array<vec2f>;
// Top, bottom and tips of each cut sprite.
@group(0) @binding(7) var<storage, read_write> extents: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> total: atomic<u32>;

var<workgroup> before: array<u32, 256>;

fn brightness(at: u32) -> f32 {
    let values = px_unpack(picture[at]);
    var most = 0.0;
    for (var i = 0u; i < p.leading; i++) { most = max(most, lane_part(values, i)); }
    return most;
}

fn signed(at: u32) -> f32 {
    let magnitude = bitcast<u32>(circles[at]) & 0x7fffffffu;
    return bitcast<f32>(magnitude | (bitcast<u32>(signs[at]) & 0x80000000u));
}

// Which part of a pixel's light is a highlight.
fn share(bright: f32, circle: f32) -> f32 {
    let over = bright - p.low;
    let diameter = abs(circle);
    if !(over > 0.0 && diameter > p.least) { return 0.0; }
    var excess = bright - p.threshold;
    if bright < p.high { excess = over * over * p.bend; }
    var ramp = 1.0;
    if p.least > 0.0 {
        let x = clamp(diameter / p.least - 1.0, 0.0, 1.0);
        ramp = x * x * (3.0 - 2.0 * x);
    }
    return ramp * excess / bright;
}

// The circle of confusion of the light at a pixel: the mean around it, weighted by the eighth power of brightness.
fn circle_of(x: u32, y: u32) -> f32 {
    let own = signed(y * p.width + x);
    var most = 0.0;
    var even = true;
    for (var v = max(y, 1u) - 1u; v <= min(y + 1u, p.height - 1u); v++) {
        for (var u = max(x, 1u) - 1u; u <= min(x + 1u, p.width - 1u); u++) {
            let at = v * p.width + u;
            most = max(most, brightness(at));
            even = even && signed(at) == own;
        }
    }
    if even { return own; }
    var sum = 0.0;
    var weights = 0.0;
    for (var v = max(y, 1u) - 1u; v <= min(y + 1u, p.height - 1u); v++) {
        for (var u = max(x, 1u) - 1u; u <= min(x + 1u, p.width - 1u); u++) {
            let at = v * p.width + u;
            let part = brightness(at) / most;
            let square = part * part;
            let weight = square * square * square * square;
            sum += weight * signed(at);
            weights += weight;
        }
    }
    return sum / weights;
}

@compute @workgroup_size(16, 16)
fn main(
    @builtin(workgroup_id) tile: vec3u,
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    var part = 0.0;
    var circle = 0.0;
    if id.x < p.width && id.y < p.height {
        let bright = brightness(id.y * p.width + id.x);
        // Any circle: most pixels are not bright enough for the largest.
        if share(bright, 1e30) > 0.0 {
            circle = circle_of(id.x, id.y);
            part = share(bright, circle);
        }
    }
    // How many come before each: sums over 1, 2, 4, ... places.
    before[local] = select(0u, 1u, part > 0.0);
    for (var step = 1u; step < 256u; step *= 2u) {
        workgroupBarrier();
        var sum = before[local];
        if local >= step { sum += before[local - step]; }
        workgroupBarrier();
        before[local] = sum;
    }
    workgroupBarrier();
    let number = tile.y * p.tiles + tile.x;
    if local == 255u {
        tiles[number] = vec2f(f32(before[255]), 0.0);
        atomicAdd(&total, before[255]);
    }
    if part > 0.0 {
        let slot = number * SLOTS + before[local] - 1u;
        // Front and behind by the sign, as the sprite will be.
        let diameter = min(abs(circle), p.largest);
        let front = select(0u, 1u, circle < 0.0);
        lights[slot] = Light(
            id.x | (id.y << 16u),
            select(diameter, -diameter, circle < 0.0),
            p.gain / area_of(diameter),
            part,
        );
        if CUT {
            let extent = extent_cut(front, displacement(id.x, id.y, front));
            extents[slot] = vec4f(extent.top, extent.bottom, extent.tips);
        }
    }
}
