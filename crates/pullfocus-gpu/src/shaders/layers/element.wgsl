// A foreground element: its coverage, its circles of confusion, and those of what is behind it, as the lens alone makes them.

struct Params {
    width: u32,
    height: u32,
    grid_width: u32,
    grid_height: u32,
    step: u32,
    // Which of the group's planes is alpha.
    coverage: u32,
    // What the settings make of circles (`shape.wgsl`).
    protect: u32,
    near: f32,
    far: f32,
    front: f32,
    back: f32,
    largest: f32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> covering: array<CoverPx>;
@group(0) @binding(2) var<storage, read> coc: array<f32>;
@group(0) @binding(3) var<storage, read> behind: array<f32>;

// How much the depth of a pixel says about the element.
fn weight_at(at: u32) -> f32 {
    // Farther away is a larger signed diameter, whatever the focus; not so once settings have cut it.
    if coc[at] < behind[at] { return clamp(cover(covering[at]), 0.0, 1.0); }
    return 0.0;
}
