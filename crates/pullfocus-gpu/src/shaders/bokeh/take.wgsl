// Takes the highlights out of a group of planes.

struct Params {
    width: u32,
    tiles: u32,
    // Planes of the group that are light; alpha is none.
    planes: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> tiles: array<vec2f>;
@group(0) @binding(3) var<storage, read_write> picture: array<Px>;
@group(0) @binding(4) var<storage, read_write> taken: array<Px>;

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = tile.y * p.tiles + tile.x;
    if local >= u32(tiles[number].x) { return; }
    let light = lights[number * SLOTS + local];
    let at = u32(row_of(light)) * p.width + u32(column_of(light));
    let value = px_unpack(picture[at]);
    let out = select(vec4f(0.0), value * light.weight, vec4u(0u, 1u, 2u, 3u) < vec4u(p.planes));
    taken[number * SLOTS + local] = px_pack(out);
    picture[at] = px_pack(value - out);
}
