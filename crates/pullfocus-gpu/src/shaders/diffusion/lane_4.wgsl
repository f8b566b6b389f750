// A thread's values at one pixel: 4 of the planes.
alias Lane = vec4f;
const WIDTH: u32 = 4u;
fn lane_part(v: Lane, c: u32) -> f32 { return v[c]; }
fn lane_with(v: Lane, c: u32, x: f32) -> Lane { var w = v; w[c] = x; return w; }
