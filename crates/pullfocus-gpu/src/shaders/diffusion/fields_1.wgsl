@group(0) @binding(4) var<storage, read_write> plane: array<Px>;

fn px_get(field: u32, at: u32) -> Px { return plane[at]; }
fn px_put(field: u32, at: u32, value: Px) { plane[at] = value; }
