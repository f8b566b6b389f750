// A band of the picture's rows, and all layers' fills for it, one behind the other. First the shapes: absolute diameter (x),
// mean squared brightness (y), coverage where the layer is hidden (z). Then the colours of each group. Layers stand from far
// to near.

struct Params {
    width: u32,
    height: u32,
    // Rows of the band.
    first_y: u32,
    end_y: u32,
    // The grid of the fills, and which of its rows are here.
    grid_width: u32,
    grid_height: u32,
    step: u32,
    first_row: u32,
    rows: u32,
    // Layers that were asked for, and the first that a pass writes.
    layers: u32,
    first: u32,
    // The group, and how many planes it has.
    group: u32,
    planes: u32,
    // Which plane of the group is the coverage; 4 where none is.
    coverage: u32,
    // Planes that decide over edges.
    leading: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> p: Params;

const SHAPES: u32 = 0;

fn section(layer: u32, of_what: u32) -> u32 {
    return (of_what * p.layers + layer) * p.rows * p.grid_width;
}
