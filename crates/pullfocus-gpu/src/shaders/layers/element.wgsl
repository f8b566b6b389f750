// A foreground element: its planes, its circles of confusion, and those of what is behind it.

struct Params {
    width: u32,
    height: u32,
    grid_width: u32,
    grid_height: u32,
    step: u32,
    // Which of the group's planes is alpha.
    alpha: u32,
}

@group(0) @binding(0) var<uniform> p: Params;
@group(0) @binding(1) var<storage, read> element: array<Px>;
@group(0) @binding(2) var<storage, read> coc: array<f32>;
@group(0) @binding(3) var<storage, read> behind: array<f32>;
