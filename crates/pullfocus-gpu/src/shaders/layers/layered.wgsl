// What every pass from fills to layers has to know.

@group(0) @binding(1) var<storage, read> split: Split;
@group(0) @binding(2) var<storage, read> coc: array<f32>;
@group(0) @binding(3) var<storage, read> packed: array<vec4f>;

// Taps of a pixel, among the rows that are here.
fn own_taps(at: vec2u) -> Taps {
    var t = taps(at.x, at.y, p.step, vec2u(p.grid_width, p.grid_height));
    let before = p.first_row * p.grid_width;
    t.i00 -= before;
    t.i10 -= before;
    t.i01 -= before;
    t.i11 -= before;
    return t;
}

fn filled(t: Taps, layer: u32, of_what: u32) -> vec4f {
    let base = section(layer, of_what);
    return enlarged(t, packed[base + t.i00], packed[base + t.i10], packed[base + t.i01], packed[base + t.i11]);
}

fn layer_count() -> u32 { return min(min(split.count, p.layers), MOST_LAYERS); }

// From far to near.
fn layer_ramps(layer: u32) -> vec4f { return split.ramps[split.count - 1u - layer]; }

fn covering(own: vec2f, hidden: f32) -> f32 { return own.x + (1.0 - own.y) * hidden; }

// A pixel's place on the scale; on an edge the places of both sides too, and the near one's share.
struct Pixel {
    u: f32,
    edge: f32,
    near: f32,
    far: f32,
    share: f32,
}

fn pixel_at(at: vec2u, strength: f32) -> Pixel {
    var pixel = Pixel(position(coc[at.y * p.width + at.x], split.knee), strength, 0.0, 0.0, 0.0);
    if strength > 0.0 {
        let range = near_far(at);
        pixel.near = position(range.x, split.knee);
        pixel.far = position(range.y, split.knee);
    }
    return pixel;
}

// x, y: `member` at the pixel's place; z: the layer's coverage.
fn coverage_of(pixel: Pixel, t: Taps, layer: u32) -> vec3f {
    let ramps = layer_ramps(layer);
    let own = member(ramps, pixel.u);
    if layer == 0u { return vec3f(own, 1.0); }
    var hidden = 0.0;
    if own.y < 1.0 || pixel.edge > 0.0 { hidden = filled(t, layer, SHAPES).z; }
    var coverage = covering(own, hidden);
    if pixel.edge > 0.0 {
        let near = covering(member(ramps, pixel.near), hidden);
        let far = covering(member(ramps, pixel.far), hidden);
        let mixed = pixel.share * near + (1.0 - pixel.share) * far;
        coverage += (mixed - coverage) * pixel.edge;
    }
    return vec3f(own, coverage);
}
