// The hybrid's middle: what cyclic reduction has left of each line is solved by parallel cyclic reduction in workgroup
// memory.
@compute @workgroup_size(THREADS)
fn main(
    @builtin(local_invocation_index) j: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let i = group.y * groups.x + group.x;
    let there = j < p.unknowns && i < p.lines;
    var mean = Mean(n_real(1.0), v_zero());
    var left = n_zero();
    if there {
        let own = rows[fine(j, i)];
        mean = Mean(own.weight, values[fine(j, i)]);
        left = own.link;
    }
    let value = solve_reduced(mean, left, select(p.unknowns, j, there), p.unknowns, j, 1u);
    if there { values[fine(j, i)] = value; }
}
