// Depth to circles of confusion: signed diameter in pixels, positive behind focus (`pullfocus_core::coc`), and the
// smallest and largest of a picture.

struct Params {
    width: u32,
    height: u32,
    // What the numbers are: 0 planar, 1 along the ray, 2 inverse, 3 disparity, 4 normalised, 5 diameters, 6 normalised with
    // white near.
    kind: u32,
    // Whether a range of diameters stays sharp.
    protect: u32,
    unit_m: f32,
    // 1 / the distance at and beyond which nothing is there, in 1/m; 0 where there is none.
    clip: f32,
    // Disparity: 1/z = scale value + shift. Normalised: z = shift + scale value.
    scale: f32,
    shift: f32,
    at_infinity: f32,
    metre_pixels: f32,
    front: f32,
    back: f32,
    largest: f32,
    near: f32,
    far: f32,
    unused: f32,
    // Tangents of the ray through the centre of pixel (0, 0), and from pixel to pixel, across and up.
    tangents: vec4f,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(2) var<storage, read_write> coc: array<f32>;
@group(0) @binding(3) var<storage, read_write> range: array<atomic<u32>, 2>;

var<workgroup> lowest: atomic<u32>;
var<workgroup> highest: atomic<u32>;

fn is_nan(x: f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u; }
fn is_finite(x: f32) -> bool { return (bitcast<u32>(x) & 0x7fffffffu) < 0x7f800000u; }

// 1/z of a distance as files write it; 0 where nothing is there.
fn of_distance(value: f32) -> f32 {
    let size = abs(value);
    if !(size > 0.0) || size == HALF_MAX || size >= NOTHING_FROM { return 0.0; }
    return 1.0 / (size * p.unit_m);
}

// 1/z in 1/m at pixel (x, y).
fn dioptres(value: f32, x: u32, y: u32) -> f32 {
    if is_nan(value) { return 0.0; }
    var w = 0.0;
    switch p.kind {
        case 0u: { w = of_distance(value); }
        case 1u: {
            let across = p.tangents.x + f32(x) * p.tangents.z;
            let up = p.tangents.y + f32(y) * p.tangents.w;
            w = of_distance(value) * sqrt(1.0 + across * across + up * up);
        }
        case 2u: { if is_finite(value) { w = abs(value) / p.unit_m; } else { w = 1e6; } }
        case 3u: {
            if is_finite(value) { w = max(value * p.scale + p.shift, 0.0); }
            else { w = select(0.0, 1e6, (value > 0.0) == (p.scale > 0.0)); }
        }
        default: {
            let part = clamp(value, 0.0, 1.0);
            w = 1.0 / (p.shift + p.scale * select(part, 1.0 - part, p.kind == 6u));
        }
    }
    // Nearer than a micrometre is a number that no scene means.
    w = min(w, 1e6);
    return select(w, 0.0, w <= p.clip);
}

fn diameter(value: f32, x: u32, y: u32) -> f32 {
    if p.kind == 5u {
        if is_nan(value) { return 0.0; }
        return shaped(clamp(value, -1e30, 1e30));
    }
    return shaped(p.at_infinity - p.metre_pixels * dioptres(value, x, y));
}

// Bits in the order of the numbers.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    if index == 0u {
        atomicStore(&lowest, 0xffffffffu);
        atomicStore(&highest, 0u);
    }
    workgroupBarrier();
    // Eight rows a thread: few numbers meet in the atomics.
    var low = 0xffffffffu;
    var high = 0u;
    if id.x < p.width {
        for (var row = 0u; row < 8u; row++) {
            let y = id.y * 8u + row;
            if y < p.height {
                let c = diameter(source_at(id.x, y), id.x, y);
                coc[y * p.width + id.x] = c;
                low = min(low, ordered(c));
                high = max(high, ordered(c));
            }
        }
    }
    atomicMin(&lowest, low);
    atomicMax(&highest, high);
    workgroupBarrier();
    if index == 0u {
        atomicMin(&range[0], atomicLoad(&lowest));
        atomicMax(&range[1], atomicLoad(&highest));
    }
}
