// The scene: a low sun with shadows of what stands there, light from a sky, and what glows by itself. Light is linear, and has no
// upper limit.

struct View {
    // World to clip.
    projection: mat4x4f,
    // Camera to world.
    camera: mat4x4f,
}

struct Object {
    place: mat4x4f,
    // w is roughness.
    color: vec4f,
    // w is the height of what throws a shadow, else 0.
    emission: vec4f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> objects: array<Object>;

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

const SUN = vec3f(4.2, 2.5, 1.25);
// Towards it, of length 1.
const TO_SUN = vec3f(-0.8955, 0.4378, 0.0796);

// Evening: warm at the horizon, the more so towards the sun, blue above.
fn sky(direction: vec3f) -> vec3f {
    let up = max(direction.y, 0.0);
    let towards = max(dot(direction, TO_SUN), 0.0);
    let horizon = mix(vec3f(0.34, 0.27, 0.30), vec3f(1.3, 0.62, 0.25), pow(towards, 6.0));
    return mix(horizon, vec3f(0.055, 0.10, 0.22), pow(up, 0.45));
}

// How much of the sun (x) and of the sky (y) is seen past what stands there: each is a post about a vertical axis, thick at its foot
// and a little thicker again at its head. Objects with a height come first.
fn seen_past(at: vec3f, own: u32) -> vec2f {
    var light = vec2f(1.0);
    for (var i = 0u; objects[i].emission.w > 0.0; i++) {
        if i == own {
            continue;
        }
        let height = objects[i].emission.w;
        let from_foot = at - objects[i].place[3].xyz;
        // Where on the axis the ray to the sun comes nearest.
        let along = dot(from_foot, TO_SUN);
        let up = clamp((from_foot.y - along * TO_SUN.y) / (1.0 - TO_SUN.y * TO_SUN.y) / height, 0.0, 1.0);
        let radius = 0.007 + 0.0085 * pow(1.0 - up, 3.0) + 0.005 * smoothstep(0.2, 0.0, abs(up - 0.82));
        let to_axis = vec3f(0.0, up * height, 0.0) - from_foot;
        let far = max(dot(to_axis, TO_SUN), 0.0001);
        // The sun is a disc: shadows get softer with distance.
        let beside = length(to_axis - far * TO_SUN) - radius;
        light.x *= smoothstep(-0.5, 0.5, beside / (0.001 + 0.02 * far));
        // Near a foot there is less sky.
        let gap = max(length(from_foot - vec3f(0.0, clamp(from_foot.y, 0.0, height), 0.0)) - 0.014, 0.0);
        light.y *= 1.0 - 0.5 * exp(-gap / 0.012);
    }
    return light;
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
    let to_eye = normalize(view.camera[3].xyz - in.at);
    let half_way = normalize(to_eye + TO_SUN);
    // Leaves and grass are many small things: each bright or dark.
    let leafy = smoothstep(0.8, 0.9, roughness);
    let albedo = object.color.rgb * mix(1.0, 0.2 + 2.0 * noise(in.at * 31.0) * noise(in.at * 83.0) + 0.6 * noise(in.at * 47.0), leafy);
    // Lambert's law, and GGX with Schlick's Fresnel term over the eyes' cosine.
    let toward = max(dot(n, TO_SUN), 0.0);
    let seen = max(dot(n, to_eye), 0.05);
    let a2 = pow(roughness, 4.0);
    let bend = pow(max(dot(n, half_way), 0.0), 2.0) * (a2 - 1.0) + 1.0;
    let facing = pow(1.0 - max(dot(to_eye, half_way), 0.0), 5.0);
    let gloss = a2 / (4.0 * bend * bend) * mix(0.04, 1.0, facing) / max(seen, toward);
    let light = seen_past(in.at, in.object);
    let sun = SUN * light.x * toward * (albedo + gloss * (1.0 - leafy));
    // The sky from all sides, and its mirror image.
    let around = mix(albedo * vec3f(0.10, 0.07, 0.05), albedo * vec3f(0.26, 0.28, 0.38), 0.5 + 0.5 * n.y);
    let fresnel = 0.04 + 0.96 * pow(1.0 - seen, 5.0);
    let mirrored = sky(reflect(-to_eye, n)) * fresnel * pow(1.0 - roughness, 2.0);
    return vec4f(sun + light.y * (around + mirrored) + object.emission.rgb, 1.0);
}
