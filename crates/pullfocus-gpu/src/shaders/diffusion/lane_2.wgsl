// A thread's values at one pixel: 2 of the planes.
alias Lane = vec2f;
const WIDTH: u32 = 2u;
fn lane_part(v: Lane, c: u32) -> f32 { return v[c]; }
fn lane_with(v: Lane, c: u32, x: f32) -> Lane { var w = v; w[c] = x; return w; }
