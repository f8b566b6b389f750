// Adds sprites to a group of planes: a tile of 16 x 16 pixels a workgroup, which visits the tiles whose highlights reach it in
// their order, so that sums are the same each time. Sixteen highlights at a time have their sixteen rows cut into slices, a
// thread each; then every thread adds up its own pixel.

struct Params {
    width: u32,
    height: u32,
    // Tiles of the picture.
    across: u32,
    down: u32,
    // The first tile that is written here; rows of tiles whose highlights are looked at.
    first_x: u32,
    first_y: u32,
    first_row: u32,
    end_row: u32,
    // Which plane of its group is the coverage.
    coverage: u32,
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
    // Pixels that look as one does at a width of 960.
    display_unit: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> tiles: array<vec2f>;
@group(0) @binding(3) var<storage, read> taken: array<Px>;
@group(0) @binding(4) var<storage, read> shape: array<ShapePx>;
@group(0) @binding(5) var<storage, read> extents: array<vec4f>;
// With BY_CIRCLE the pixels' own circles, with COVERED 2 the layer's coverage.
@group(0) @binding(6) var<storage, read> other: array<CoverPx>;
@group(0) @binding(7) var<storage, read_write> picture: array<Px>;

const TOGETHER: u32 = 16u;
// See core's `bokeh::nodes`.
const LAST_NODE: f32 = 12.0;

var<workgroup> marks: array<atomic<u32>, 8>;
var<workgroup> words: array<u32, 8>;
var<workgroup> chosen: array<u32, 256>;
var<workgroup> chosen_count: u32;
var<workgroup> places: array<vec2i, TOGETHER>;
var<workgroup> sprites: array<Sprite, TOGETHER>;
var<workgroup> colors: array<vec4f, TOGETHER>;
var<workgroup> nodes: array<vec3f, TOGETHER>;
var<workgroup> strips: array<Strip, 256>;

fn sprite_of(slot: u32, light: Light) -> Sprite {
    let front = select(0u, 1u, light.circle < 0.0);
    var extent = extent_of(front);
    if CUT {
        let away = displacement(u32(column_of(light)), u32(row_of(light)), front);
        extent = extent_found(front, away, extents[slot]);
    }
    return Sprite(front, abs(light.circle), extent);
}

// Of a highlight behind focus the two circles by which it is told apart, and the second one's share.
fn nodes_of(circle: f32) -> vec3f {
    if circle < 0.0 { return vec3f(0.0); }
    let octaves = min(log2(max(circle / p.display_unit, 1.0)), LAST_NODE);
    let first = min(floor(octaves), LAST_NODE - 1.0);
    return vec3f(p.display_unit * exp2(first), p.display_unit * exp2(first + 1.0), octaves - first);
}

fn seen(node: f32, own: f32) -> f32 {
    let x = clamp(4.0 * abs(own) / node - 1.0, 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

@compute @workgroup_size(16, 16)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) id: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let low = vec2i(vec2u(p.first_x, p.first_y) + group.xy) * i32(SIDE);
    let high = low + i32(SIDE) - 1;
    let pixel = low + vec2i(id.xy);
    let inside = pixel.x < i32(p.width) && pixel.y < i32(p.height);
    let at = u32(pixel.y) * p.width + u32(pixel.x);
    var own = 0.0;
    if BY_CIRCLE && inside { own = cover(other[at]); }
    var sum = vec4f(0.0);
    for (var row = p.first_row; row < p.end_row; row++) {
        let farthest = reach_of(tiles[p.across * p.down + row].y).y;
        let top = i32(row * SIDE);
        if tiles[p.across * p.down + row].y == 0.0 || top > high.y + farthest || top + i32(SIDE) - 1 < low.y - farthest {
            continue;
        }
        for (var base = 0u; base < p.across; base += 256u) {
            workgroupBarrier();
            if local < 8u { atomicStore(&marks[local], 0u); }
            workgroupBarrier();
            if base + local < p.across {
                let tile = tiles[row * p.across + base + local];
                let reach = reach_of(tile.y);
                let left = i32((base + local) * SIDE);
                if tile.y > 0.0
                    && left <= high.x + reach.x && left + i32(SIDE) - 1 >= low.x - reach.x
                    && top <= high.y + reach.y && top + i32(SIDE) - 1 >= low.y - reach.y {
                    atomicOr(&marks[local / 32u], 1u << (local % 32u));
                }
            }
            workgroupBarrier();
            if local < 8u { words[local] = atomicLoad(&marks[local]); }
            for (var word = 0u; word < 8u; word++) {
                var bits = workgroupUniformLoad(&words[word]);
                while bits != 0u {
                    let tile = row * p.across + base + 32u * word + firstTrailingBit(bits);
                    bits &= bits - 1u;
                    // Those that reach this tile, in their order.
                    workgroupBarrier();
                    if local < 8u { atomicStore(&marks[local], 0u); }
                    workgroupBarrier();
                    var is_chosen = false;
                    if local < u32(tiles[tile].x) {
                        let light = lights[tile * SLOTS + local];
                        let reach = reach_of(abs(light.circle));
                        let place = vec2i(column_of(light), row_of(light));
                        is_chosen = light.weight != 0.0
                            && place.x <= high.x + reach.x && place.x >= low.x - reach.x
                            && place.y <= high.y + reach.y && place.y >= low.y - reach.y;
                        if is_chosen { atomicOr(&marks[local / 32u], 1u << (local % 32u)); }
                    }
                    workgroupBarrier();
                    var rank = 0u;
                    var count = 0u;
                    for (var i = 0u; i < 8u; i++) {
                        let marked = atomicLoad(&marks[i]);
                        count += countOneBits(marked);
                        if i < local / 32u { rank += countOneBits(marked); }
                        if i == local / 32u { rank += countOneBits(marked & ((1u << (local % 32u)) - 1u)); }
                    }
                    if is_chosen { chosen[rank] = tile * SLOTS + local; }
                    if local == 0u { chosen_count = count; }
                    let all = workgroupUniformLoad(&chosen_count);
                    for (var first = 0u; first < all; first += TOGETHER) {
                        let number = local / SIDE;
                        if first + number < all {
                            let slot = chosen[first + number];
                            let light = lights[slot];
                            let sprite = sprite_of(slot, light);
                            let place = vec2i(column_of(light), row_of(light));
                            strips[local] = strip(sprite, low.y + i32(local % SIDE) - place.y);
                            if local % SIDE == 0u {
                                places[number] = place;
                                sprites[number] = sprite;
                                colors[number] = px_unpack(taken[slot]) * light.weight;
                                if BY_CIRCLE { nodes[number] = nodes_of(light.circle); }
                            }
                        }
                        workgroupBarrier();
                        for (var i = 0u; i < min(all - first, TOGETHER); i++) {
                            let strip = strips[i * SIDE + id.y];
                            if strip.height == 0.0 { continue; }
                            let away = pixel - places[i];
                            var covered = 0.0;
                            if strip.height > 0.0 {
                                covered = covered_by(strip.ends.xy, strip.ends.zw, strip.height, away.x);
                            } else {
                                covered = covered_slowly(sprites[i], away.y, away.x);
                            }
                            if BY_CIRCLE {
                                let node = nodes[i];
                                if node.x > 0.0 { covered *= mix(seen(node.x, own), seen(node.y, own), node.z); }
                            }
                            sum += covered * colors[i];
                        }
                        workgroupBarrier();
                    }
                }
            }
        }
    }
    if !inside || all(sum == vec4f(0.0)) { return; }
    let value = px_unpack(picture[at]);
    // `composite.wgsl` will divide the layer by a coverage above 1, which these do not belong to.
    if COVERED == 1u { sum *= max(value[p.coverage], 1.0); }
    if COVERED == 2u { sum *= max(cover(other[at]), 1.0); }
    picture[at] = px_pack(value + sum);
}
