// A thread's values at one pixel: 1 of the planes.
alias Lane = f32;
const WIDTH: u32 = 1u;
fn lane_part(v: Lane, c: u32) -> f32 { return v; }
fn lane_with(v: Lane, c: u32, x: f32) -> Lane { return x; }
