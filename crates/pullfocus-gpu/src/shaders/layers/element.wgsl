// A foreground element: its colours and coverage, its circles of confusion, and those of what is behind it, as the lens alone makes them.

struct Params {
    width: u32,
    height: u32,
    grid_width: u32,
    grid_height: u32,
    step: u32,
    // Which of the group's planes is alpha.
    coverage: u32,
    // How many of the first planes are colours that say what is light.
    leading: u32,
    // What the settings make of circles (`shape.wgsl`).
    protect: u32,
    near: f32,
    far: f32,
    front: f32,
    back: f32,
    largest: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> element: array<Px>;
@group(0) @binding(2) var<storage, read> covering: array<CoverPx>;
@group(0) @binding(3) var<storage, read> coc: array<f32>;
@group(0) @binding(4) var<storage, read> behind: array<f32>;

// How much the depth of a pixel says about the element.
fn weight_at(at: u32) -> f32 {
    // Farther away is a larger signed diameter, whatever the focus; not so once settings have cut it.
    if coc[at] >= behind[at] { return 0.0; }
    let alpha = cover(covering[at]);
    if alpha > 0.0 { return min(alpha, 1.0); }
    // Light that covers nothing, as of sparks, has a depth, too.
    let shining = px_unpack(element[at]) > vec4f(0.0);
    return select(0.0, 1.0, any(shining & (vec4u(0u, 1u, 2u, 3u) < vec4u(p.leading))));
}
