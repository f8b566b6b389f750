// Lays premultiplied planes over others. Where a blur's lobes bring coverage above 1 the colour, which went with it, is
// brought back with it: what was even stays even.

struct Params {
    width: u32,
    height: u32,
    // Which plane of its group is the coverage.
    coverage: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> front: array<Px>;
@group(0) @binding(2) var<storage, read> covering: array<CoverPx>;
@group(0) @binding(3) var<storage, read_write> behind: array<Px>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= p.width || id.y >= p.height { return; }
    let at = id.y * p.width + id.x;
    let coverage = cover(covering[at]);
    let far = px_unpack(behind[at]);
    behind[at] = px_pack(px_unpack(front[at]) / max(coverage, 1.0) + (1.0 - clamp(coverage, 0.0, 1.0)) * far);
}
