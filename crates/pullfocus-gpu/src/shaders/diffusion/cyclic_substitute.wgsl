// Figure 5, lines 10 to 16: the odd unknowns take their values from above, the even ones from their neighbours.
@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= p.lines || j >= p.unknowns { return; }
    if j % 2u == 1u {
        values[fine(j, i)] = values[coarse(j / 2u, i)];
        return;
    }
    let own = rows[fine(j, i)];
    var right = n_zero();
    var before = Mean(n_zero(), v_zero());
    var after = Mean(n_zero(), v_zero());
    if j > 0u { before = Mean(own.link, values[coarse(j / 2u - 1u, i)]); }
    if j + 1u < p.unknowns { after = Mean(rows[fine(j + 1u, i)].link, values[coarse(j / 2u, i)]); }
    values[fine(j, i)] = join(join(Mean(own.weight, values[fine(j, i)]), before), after).value;
}
