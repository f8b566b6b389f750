// What a plane is between the rows and the columns of a sum of products: four real fields. The first adds up to the plane; the
// others go up to some twice its values, and lie in memory as a quarter of that, which f16 holds.
const STORED: f32 = 0.25;
const MEANT: f32 = 4.0;

@group(0) @binding(4) var<storage, read_write> plane: array<Px>;
@group(0) @binding(5) var<storage, read_write> field_1: array<Px>;
@group(0) @binding(6) var<storage, read_write> field_2: array<Px>;
@group(0) @binding(7) var<storage, read_write> field_3: array<Px>;

fn px_get(field: u32, at: u32) -> Px {
    switch field {
        case 0u: { return plane[at]; }
        case 1u: { return field_1[at]; }
        case 2u: { return field_2[at]; }
        default: { return field_3[at]; }
    }
}

fn px_put(field: u32, at: u32, value: Px) {
    switch field {
        case 0u: { plane[at] = value; }
        case 1u: { field_1[at] = value; }
        case 2u: { field_2[at] = value; }
        default: { field_3[at] = value; }
    }
}
