// Systems in real numbers: backward Euler.

alias Num = f32;
alias Val = Lane;

fn n_zero() -> Num { return 0.0; }
fn n_real(x: f32) -> Num { return x; }
fn n_own(sigma: vec2f, gamma: f32) -> Num { return gamma; }
fn n_mul(a: Num, b: Num) -> Num { return a * b; }
fn n_recip(a: Num) -> Num { return 1.0 / a; }
fn n_size(a: Num) -> f32 { return a; }

fn v_zero() -> Val { return Lane(0.0); }
fn v_make(re: Lane, im: Lane) -> Val { return re; }
fn v_re(v: Val) -> Lane { return v; }
fn v_im(v: Val) -> Lane { return Lane(0.0); }
fn v_select(a: Val, b: Val, second: bool) -> Val { return select(a, b, second); }
// base + share (other - base)
fn v_towards(base: Val, share: Num, other: Val) -> Val { return base + share * (other - base); }
// base + one (a - base) + two (b - base)
fn v_towards_both(base: Val, one: Num, a: Val, two: Num, b: Val) -> Val {
    return base + one * (a - base) + two * (b - base);
}
fn v_size(v: Val) -> Lane { return abs(v); }
fn v_minus(a: Val, b: Val) -> Val { return a - b; }
