// Parallel cyclic reduction (Zhang, Cohen, Owens 2010), one pass for each distance 1, 2, 4, ...: every unknown eliminates
// its two neighbours at that distance.

struct Params {
    unknowns: u32,
    lines: u32,
    distance: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> rows: array<Row>;
@group(0) @binding(2) var<storage, read> values: array<Val>;
@group(0) @binding(3) var<storage, read_write> next_rows: array<Row>;
@group(0) @binding(4) var<storage, read_write> next_values: array<Val>;

@compute @workgroup_size(64, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    let j = id.y;
    if i >= p.lines || j >= p.unknowns { return; }
    let at = j * p.lines + i;
    let reach = p.distance * p.lines;
    let own = rows[at];
    var mean = Mean(own.weight, values[at]);
    var onward = n_zero();
    if j >= p.distance {
        let before = rows[at - reach];
        let share = n_mul(own.link, n_recip(before.weight + before.link + own.link));
        mean = join(mean, Mean(n_mul(share, before.weight), values[at - reach]));
        onward = n_mul(share, before.link);
    }
    if j + p.distance < p.unknowns {
        let after = rows[at + reach];
        var beyond = n_zero();
        if j + 2u * p.distance < p.unknowns { beyond = rows[at + 2u * reach].link; }
        let share = n_mul(after.link, n_recip(after.weight + beyond + after.link));
        mean = join(mean, Mean(n_mul(share, after.weight), values[at + reach]));
    }
    next_rows[at] = Row(mean.weight, onward);
    next_values[at] = mean.value;
}
