// A highlight: where it is, its signed diameter in pixels, gain over the area of its sprite, and what its light is
// multiplied with in this layer. Highlights are kept by tiles of 16 x 16 pixels, 256 places for each.
struct Light {
    place: u32,
    circle: f32,
    factor: f32,
    weight: f32,
}

const SIDE: u32 = 16u;
const SLOTS: u32 = 256u;

fn column_of(light: Light) -> i32 { return i32(light.place & 0xffffu); }
fn row_of(light: Light) -> i32 { return i32(light.place >> 16u); }
