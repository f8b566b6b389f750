// The scene: a low sun with a shadow, a sky, and what glows by itself. Light is linear, and has no upper limit.

struct View {
    // World to clip, and back.
    projection: mat4x4f,
    unprojection: mat4x4f,
    // World to the sun's shadow map.
    sun: mat4x4f,
    // Towards the sun.
    to_sun: vec4f,
    eye: vec4f,
}

struct Object {
    place: mat4x4f,
    // w is roughness.
    color: vec4f,
    emission: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> objects: array<Object>;
@group(0) @binding(2) var shadow_map: texture_depth_2d;
@group(0) @binding(3) var shadow_sampler: sampler_comparison;

struct Surface {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) object: u32,
}

@vertex
fn vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @builtin(instance_index) index: u32,
) -> Surface {
    let place = objects[index].place;
    let at = place * vec4f(position, 1.0);
    // The inverse transpose of a turn and a scale is the matrix itself with its columns over their squares.
    let scale = vec3f(dot(place[0], place[0]), dot(place[1], place[1]), dot(place[2], place[2]));
    let turned = place * vec4f(normal / scale, 0.0);
    return Surface(view.projection * at, at.xyz, turned.xyz, index);
}

@vertex
fn shadow(@location(0) position: vec3f, @builtin(instance_index) index: u32) -> @builtin(position) vec4f {
    return view.sun * objects[index].place * vec4f(position, 1.0);
}

const SUN = vec3f(4.2, 2.5, 1.25);

// Evening: warm at the horizon, the more so towards the sun, blue above.
fn sky(direction: vec3f) -> vec3f {
    let up = max(direction.y, 0.0);
    let towards = max(dot(direction, view.to_sun.xyz), 0.0);
    let horizon = mix(vec3f(0.34, 0.27, 0.30), vec3f(1.3, 0.62, 0.25), pow(towards, 6.0));
    return mix(horizon, vec3f(0.055, 0.10, 0.22), pow(up, 0.45));
}

// How much of the sun is seen: four comparisons, each filtered by the sampler.
fn lit(at: vec3f) -> f32 {
    let clip = view.sun * vec4f(at, 1.0);
    let uv = clip.xy * vec2f(0.5, -0.5) + 0.5;
    let texel = 1.0 / vec2f(textureDimensions(shadow_map));
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let offset = (vec2f(f32(i % 2u), f32(i / 2u)) - 0.5) * 1.6 * texel;
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + offset, clip.z);
    }
    let inside = all(uv == clamp(uv, vec2f(0.0), vec2f(1.0)));
    return select(1.0, 0.25 * sum, inside);
}

// A number between 0 and 1 for each cell of space.
fn noise(cell: vec3f) -> f32 {
    return fract(sin(dot(floor(cell), vec3f(12.9898, 78.233, 37.719))) * 43758.547);
}

@fragment
fn surface(in: Surface) -> @location(0) vec4f {
    let object = objects[in.object];
    let roughness = object.color.w;
    let n = normalize(in.normal);
    let to_eye = normalize(view.eye.xyz - in.at);
    let half_way = normalize(to_eye + view.to_sun.xyz);
    // Leaves and grass are many small things: each bright or dark.
    let leafy = smoothstep(0.8, 0.9, roughness);
    let albedo = object.color.rgb * mix(1.0, 0.2 + 2.0 * noise(in.at * 31.0) * noise(in.at * 83.0) + 0.6 * noise(in.at * 47.0), leafy);
    // Lambert's law, and GGX with Schlick's Fresnel term over the eyes' cosine.
    let toward = max(dot(n, view.to_sun.xyz), 0.0);
    let seen = max(dot(n, to_eye), 0.05);
    let a2 = pow(roughness, 4.0);
    let bend = pow(max(dot(n, half_way), 0.0), 2.0) * (a2 - 1.0) + 1.0;
    let facing = pow(1.0 - max(dot(to_eye, half_way), 0.0), 5.0);
    let gloss = a2 / (4.0 * bend * bend) * mix(0.04, 1.0, facing) / max(seen, toward);
    // The normal leans back to the surface by a millimetre: no shadow on itself.
    let sun = SUN * lit(in.at + 0.001 * n) * toward * (albedo + gloss * (1.0 - leafy));
    // The sky from all sides, and its mirror image.
    let around = mix(albedo * vec3f(0.10, 0.07, 0.05), albedo * vec3f(0.26, 0.28, 0.38), 0.5 + 0.5 * n.y);
    let fresnel = 0.04 + 0.96 * pow(1.0 - seen, 5.0);
    let mirrored = sky(reflect(-to_eye, n)) * fresnel * pow(1.0 - roughness, 2.0);
    return vec4f(sun + around + mirrored + object.emission.rgb, 1.0);
}

struct Ray {
    @builtin(position) clip: vec4f,
    @location(0) at: vec4f,
}

// One triangle over the picture, at infinity: where nothing is.
@vertex
fn sky_corner(@builtin(vertex_index) index: u32) -> Ray {
    let corner = vec2f(f32(index % 2u), f32(index / 2u)) * 4.0 - 1.0;
    return Ray(vec4f(corner, 0.0, 1.0), view.unprojection * vec4f(corner, 1.0, 1.0));
}

@fragment
fn sky_pixel(in: Ray) -> @location(0) vec4f {
    return vec4f(sky(normalize(in.at.xyz / in.at.w - view.eye.xyz)), 1.0);
}
