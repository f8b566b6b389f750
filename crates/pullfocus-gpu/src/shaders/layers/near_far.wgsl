// Smallest and largest diameter of the 3 x 3 pixels around: the nearest and the farthest thing there.
fn near_far(at: vec2u) -> vec2f {
    var range = vec2f(coc[at.y * p.width + at.x]);
    for (var y = max(at.y, 1u) - 1u; y <= min(at.y + 1u, p.height - 1u); y++) {
        for (var x = max(at.x, 1u) - 1u; x <= min(at.x + 1u, p.width - 1u); x++) {
            let c = coc[y * p.width + x];
            range = vec2f(min(range.x, c), max(range.y, c));
        }
    }
    return range;
}
