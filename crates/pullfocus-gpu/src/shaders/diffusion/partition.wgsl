// Elimination in chunks: every value is read once and written once for each axis.
//
// A thread has K unknowns of one line in registers. It eliminates all but the last: what they weigh goes to that last
// one and to the last one of the chunk before, and a link between these two remains. The small system of one unknown
// per chunk is solved in workgroup memory; then the eliminated ones follow from their two neighbours that are known.
// All of it in weights, links and means: sums of positive terms.

struct Params {
    unknowns: u32,
    lines: u32,
    along: u32,
    across: u32,
    chunks: u32,
    per_group: u32,
    // Of all unknowns where circles are no plane, in pixels along the line.
    diameter: f32,
    // Where the least value of each plane stands.
    least_at: u32,
    // Which layer this is, from far to near; where SKIPS.
    layer: u32,
    unused_0: u32,
    unused_1: u32,
    unused_2: u32,
    terms: array<Term, 2>,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> circle: array<f32>;
@group(0) @binding(2) var<storage, read> gamma: array<f32>;
// The third word says how many layers there are: `Work::range`.
@group(0) @binding(8) var<storage, read> found: array<u32>;

var<private> own_index: u32;
var<private> own_line: u32;
var<private> own_chunk: u32;
var<private> own_first: u32;
var<private> own_active: bool;
var<private> first_line: u32;

fn at_line(at: u32) -> u32 {
    return ((first_line + own_line) / HALVES) * p.across + at * p.along;
}

fn circle_at(at: u32) -> f32 {
    if HAS_CIRCLE { return circle[at_line(at)]; }
    return p.diameter;
}

// The values of the chunk become the solution.
fn solve(values: ptr<function, array<Val, K>>, term: u32) {
    let beta = p.terms[term].beta;
    let sigma = p.terms[term].sigma;
    // Before elimination: own weight and the link onward; after it: the two shares.
    var one: array<Num, K>;
    var two: array<Num, K>;
    var before = 0.0;
    var first_link = 0.0;
    if own_active && own_first < p.unknowns {
        before = circle_at(own_first);
        if own_first > 0u {
            first_link = link(circle_at(own_first - 1u), before, beta);
        }
    }
    /* unroll */ for (var j = 0u; j < K; j++) {
        let at = own_first + j;
        var weight = 1.0;
        var onward = 0.0;
        if own_active && at < p.unknowns {
            if HAS_GAMMA { weight = max(gamma[at_line(at)], LEAST_GAMMA); }
            if at + 1u < p.unknowns {
                let next = circle_at(at + 1u);
                onward = link(before, next, beta);
                before = next;
            }
        }
        one[j] = n_own(sigma, weight);
        two[j] = n_real(onward);
    }

    var left = n_real(first_link);
    var given = Mean(n_zero(), v_zero());
    var own = Mean(one[0], (*values)[0]);
    // Which of the three neighbours a value counts from: the heaviest.
    var from_before = 0u;
    var from_after = 0u;
    /* unroll */ for (var j = 0u; j < K - 1u; j++) {
        let right = two[j];
        let r = n_recip(own.weight + left + right);
        let to_own = n_mul(own.weight, r);
        let to_left = n_mul(left, r);
        let to_right = n_mul(right, r);
        given = join(given, Mean(n_mul(to_left, own.weight), own.value));
        (*values)[j] = own.value;
        let sizes = vec3f(n_size(to_own), n_size(to_left), n_size(to_right));
        let after = sizes.z > max(sizes.x, sizes.y);
        let back = !after && sizes.y > sizes.x;
        from_after |= select(0u, 1u << j, after);
        from_before |= select(0u, 1u << j, back);
        one[j] = select(to_left, to_own, after || back);
        two[j] = select(to_right, to_left, after);
        own = join(Mean(one[j + 1u], (*values)[j + 1u]), Mean(n_mul(to_right, own.weight), own.value));
        left = n_mul(to_right, left);
    }

    // What the next chunk gave to this one's last unknown.
    let slot = own_index;
    let apart = select(SIDE, p.per_group, NEIGHBOUR_IS_LINES_APART);
    node_weight[slot] = given.weight;
    node_value[slot] = given.value;
    workgroupBarrier();
    if own_active && own_chunk + 1u < p.chunks {
        own = join(own, Mean(node_weight[slot + apart], node_value[slot + apart]));
    }
    workgroupBarrier();
    let last = solve_reduced(own, left, own_chunk, p.chunks, slot, apart);
    node_value[slot] = last;
    workgroupBarrier();
    var before_chunk = v_zero();
    if own_active && own_chunk > 0u {
        before_chunk = node_value[slot - apart];
    }
    workgroupBarrier();

    var next = last;
    (*values)[K - 1u] = last;
    /* unroll */ for (var i = 1u; i < K; i++) {
        let j = K - 1u - i;
        let gathered = (*values)[j];
        let after = (from_after & (1u << j)) != 0u;
        let back = (from_before & (1u << j)) != 0u;
        let base = v_select(v_select(gathered, before_chunk, back), next, after);
        let near = v_select(before_chunk, gathered, after || back);
        let far = v_select(next, before_chunk, after);
        next = v_towards_both(base, one[j], near, two[j], far);
        (*values)[j] = next;
    }
}

@compute @workgroup_size(THREADS)
fn main(
    @builtin(local_invocation_index) index: u32,
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    if SKIPS {
        // By way of workgroup memory, so that all of the workgroup goes or stays.
        if index == 0u { node_weight[0] = n_real(select(1.0, 0.0, found[2] <= p.layer)); }
        if n_size(workgroupUniformLoad(&node_weight[0])) == 0.0 { return; }
    }
    own_index = index;
    own_line = line_of(index);
    own_chunk = select(p.chunks, chunk_of(index), index < p.per_group * p.chunks);
    own_first = own_chunk * K;
    first_line = (group.y * groups.x + group.x) * p.per_group;
    own_active = index < p.per_group * p.chunks && first_line + own_line < p.lines;
    work(p.least_at + ((first_line + own_line) % HALVES) * WIDTH);
}
