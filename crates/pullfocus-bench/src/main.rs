//! Unpublished: benchmarks, the quality table, the papers' figures.
fn main() {}
