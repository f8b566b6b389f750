// Figure 5, lines 1 to 8: the level above gathers from the one below.
@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let k = id.y;
    if i >= p.lines || k >= p.coarse_unknowns { return; }
    let j = 2u * k + 1u;
    let own = rows[fine(j, i)];
    let before = rows[fine(j - 1u, i)];
    let part_left = n_mul(own.link, n_recip(before.link + before.weight + own.link));
    var mean = join(
        Mean(own.weight, values[fine(j, i)]),
        Mean(n_mul(part_left, before.weight), values[fine(j - 1u, i)]),
    );
    if j + 1u < p.unknowns {
        let after = rows[fine(j + 1u, i)];
        var beyond = n_zero();
        if j + 2u < p.unknowns { beyond = rows[fine(j + 2u, i)].link; }
        let part_right = n_mul(after.link, n_recip(after.link + after.weight + beyond));
        mean = join(mean, Mean(n_mul(part_right, after.weight), values[fine(j + 1u, i)]));
    }
    rows[coarse(k, i)] = Row(mean.weight, n_mul(part_left, before.link));
    values[coarse(k, i)] = mean.value;
}
