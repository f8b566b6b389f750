// As in `pullfocus_core::depth` and `pullfocus_core::picture`.
const HALF_MAX: f32 = 65504.0;
const NOTHING_FROM: f32 = 1e9;
const LARGEST: f32 = 1e9;
