@group(0) @binding(1) var source: texture_2d<f32>;
fn source_at(x: u32, y: u32) -> f32 { return textureLoad(source, vec2u(x, y), 0).x; }
