@group(0) @binding(1) var<storage, read> source: array<f32>;
fn source_at(x: u32, y: u32) -> f32 { return source[y * p.width + x]; }
