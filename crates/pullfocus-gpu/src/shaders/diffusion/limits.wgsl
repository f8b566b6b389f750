// As in `pullfocus_core::scheme`.
const LEAST_GAMMA: f32 = 1e-15;
const MOST_BETA: f32 = 1e12;
