@group(0) @binding(1) var source: texture_depth_2d;
fn source_at(x: u32, y: u32) -> f32 { return textureLoad(source, vec2u(x, y), 0); }
