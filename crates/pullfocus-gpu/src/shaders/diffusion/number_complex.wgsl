// Systems in complex numbers: a pole of a rational integrator.

alias Num = vec2f;

struct Val {
    re: Lane,
    im: Lane,
}

fn n_zero() -> Num { return vec2f(0.0); }
fn n_real(x: f32) -> Num { return vec2f(x, 0.0); }
fn n_own(sigma: vec2f, gamma: f32) -> Num { return sigma * gamma; }
fn n_mul(a: Num, b: Num) -> Num { return vec2f(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }
// Scaled, so that neither a million pixels of blur nor a weight of 1e-15 leaves f32's range when squared.
fn n_recip(a: Num) -> Num {
    let scale = 1.0 / n_size(a);
    let b = a * scale;
    return vec2f(b.x, -b.y) * (scale / dot(b, b));
}
fn n_size(a: Num) -> f32 { return max(abs(a.x), abs(a.y)); }

fn v_zero() -> Val { return Val(Lane(0.0), Lane(0.0)); }
fn v_make(re: Lane, im: Lane) -> Val { return Val(re, im); }
fn v_re(v: Val) -> Lane { return v.re; }
fn v_im(v: Val) -> Lane { return v.im; }
fn v_select(a: Val, b: Val, second: bool) -> Val { return Val(select(a.re, b.re, second), select(a.im, b.im, second)); }
// base + share (other - base)
fn v_towards(base: Val, share: Num, other: Val) -> Val {
    let re = other.re - base.re;
    let im = other.im - base.im;
    return Val(base.re + share.x * re - share.y * im, base.im + share.x * im + share.y * re);
}
// base + one (a - base) + two (b - base)
fn v_towards_both(base: Val, one: Num, a: Val, two: Num, b: Val) -> Val {
    let near = v_minus(a, base);
    let far = v_minus(b, base);
    return Val(
        base.re + (one.x * near.re - one.y * near.im) + (two.x * far.re - two.y * far.im),
        base.im + (one.x * near.im + one.y * near.re) + (two.x * far.im + two.y * far.re),
    );
}
fn v_size(v: Val) -> Lane { return max(abs(v.re), abs(v.im)); }
fn v_minus(a: Val, b: Val) -> Val { return Val(a.re - b.re, a.im - b.im); }
