// Parallel cyclic reduction of one small system per line in workgroup memory: every node eliminates its neighbours at
// distance 1, 2, 4, ... until none is left.

var<workgroup> node_weight: array<Num, THREADS>;
var<workgroup> node_link: array<Num, THREADS>;
var<workgroup> node_value: array<Val, THREADS>;

// The node `t` of `count`, which lies at `slot`; nodes of a line are `stride` slots apart. `link` leads to node t - 1.
// All invocations of the workgroup come here together.
fn solve_reduced(mean: Mean, first_link: Num, t: u32, count: u32, slot: u32, stride: u32) -> Val {
    var own = mean;
    var left = first_link;
    for (var distance = 1u; distance < count; distance = distance * 2u) {
        node_weight[slot] = own.weight;
        node_link[slot] = left;
        node_value[slot] = own.value;
        workgroupBarrier();
        let reach = distance * stride;
        let has_left = t >= distance;
        let has_right = t + distance < count;
        let to_left = left;
        var joined = own;
        left = n_zero();
        if has_left {
            let other = slot - reach;
            let weight = node_weight[other];
            let beyond = node_link[other];
            let share = n_mul(to_left, n_recip(weight + beyond + to_left));
            joined = join(joined, Mean(n_mul(share, weight), node_value[other]));
            left = n_mul(share, beyond);
        }
        if has_right {
            let other = slot + reach;
            let weight = node_weight[other];
            let to_right = node_link[other];
            var beyond = n_zero();
            if t + 2u * distance < count {
                beyond = node_link[other + reach];
            }
            let share = n_mul(to_right, n_recip(weight + beyond + to_right));
            joined = join(joined, Mean(n_mul(share, weight), node_value[other]));
        }
        workgroupBarrier();
        own = joined;
    }
    return own.value;
}
