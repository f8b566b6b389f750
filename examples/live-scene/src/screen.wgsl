// What is done to whole pictures.

@vertex
fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(f32(index % 2u) * 4.0 - 1.0, f32(index / 2u) * 4.0 - 1.0, 0.0, 1.0);
}

@group(0) @binding(0) var samples: texture_depth_multisampled_2d;

// One depth for each pixel, of the nearest sample: a mean of depths would be a place where nothing is, in focus by chance. Colour is
// the mean of all samples, as always; the blur knows that pixels at an edge have two colours and one depth.
@fragment
fn nearest(@builtin(position) position: vec4f) -> @location(0) vec4f {
    var depth = 0.0;
    for (var i = 0u; i < textureNumSamples(samples); i++) {
        depth = max(depth, textureLoad(samples, vec2u(position.xy), i));
    }
    return vec4f(depth, 0.0, 0.0, 1.0);
}

@group(0) @binding(0) var picture: texture_2d<f32>;

// Light to what a screen can show (Narkowicz' fit of the ACES curve), encoded as sRGB.
@fragment
fn tone(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let x = 0.9 * textureLoad(picture, vec2u(position.xy), 0).rgb;
    let shown = clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), vec3f(0.0), vec3f(1.0));
    let encoded = select(1.055 * pow(shown, vec3f(1.0 / 2.4)) - 0.055, 12.92 * shown, shown < vec3f(0.0031308));
    return vec4f(encoded, 1.0);
}
