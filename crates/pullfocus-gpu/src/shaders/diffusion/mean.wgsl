// What all solvers share: a system carries weights (row sums) and means instead of a diagonal and right-hand sides, so
// that nothing cancels; see the CPU's `diffusion` for why.

// Less weight than this beside nothing is none.
const LEAST_WEIGHT: f32 = 1e-18;

struct Mean {
    weight: Num,
    value: Val,
}

// The mean of two values by weight, counted from the heavier one: what has no weight leaves no rounding error behind.
fn join(a: Mean, b: Mean) -> Mean {
    let weight = a.weight + b.weight;
    let second = n_size(b.weight) > n_size(a.weight);
    let lighter = select(b.weight, a.weight, second);
    let base = v_select(a.value, b.value, second);
    let other = v_select(b.value, a.value, second);
    var share = n_zero();
    if n_size(weight) > LEAST_WEIGHT {
        share = n_mul(lighter, n_recip(weight));
    }
    return Mean(weight, v_towards(base, share, other));
}

// beta of the link between two circles: of the smaller one, squared.
fn link(a: f32, b: f32, beta: f32) -> f32 {
    let c = min(abs(a), abs(b));
    return min(c * c * beta, MOST_BETA);
}
