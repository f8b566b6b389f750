// How much of each highlight belongs to a layer, from near to far: as much as is seen of it, by coverages that are not blurred
// yet. The farthest has what the others leave.

@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var<storage, read> tiles: array<vec2f>;
@group(0) @binding(6) var<storage, read_write> shares: array<f32>;

@compute @workgroup_size(256)
fn main(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) local: u32) {
    let number = tile.y * p.tiles + tile.x;
    if local >= u32(tiles[number].x) { return; }
    let slot = number * SLOTS + local;
    let seen = pass_through(slot, lights[slot]);
    shares[slot] = seen.x * seen.y;
}
