// A coarse level's cells are for the next finer one.

fn give(cell: u32, at: vec2i, light: array<f32, CHANNELS>) {
    /* unroll */ for (var c = 0u; c < CHANNELS; c++) {
        cells[(cell - p.places[1].x) * CHANNELS + c] = light[c];
    }
}
