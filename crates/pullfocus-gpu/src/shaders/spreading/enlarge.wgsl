// From a coarse level to the next finer one; as in `pullfocus_core::spans`.

const ENLARGING_OWN: f32 = 0.75;
const ENLARGING_OTHER: f32 = 0.25;

// The cells of all levels but the finest.
@group(0) @binding(4) var<storage, read_write> cells: array<f32>;

// What the next coarser level has for a cell. Pairs of cells lie in one of its cells; the one on a cell's own side
// has the other quarter.
fn enlarged(at: vec2i, channel: u32) -> f32 {
    if p.level >= most_level() { return 0.0; }
    let place = p.places[p.level + 1u];
    let own = (at >> vec2u(1u));
    let other = own - 1 + 2 * (at & vec2i(1));
    let edge = i32(place.w);
    let columns = i32(place.y);
    let first = i32(place.x - p.places[1].x);
    let near = first + (own.y + edge) * columns + edge;
    let far = first + (other.y + edge) * columns + edge;
    let c = channel;
    let own_column = ENLARGING_OWN * cells[u32(near + own.x) * CHANNELS + c] + ENLARGING_OTHER * cells[u32(far + own.x) * CHANNELS + c];
    let other_column = ENLARGING_OWN * cells[u32(near + other.x) * CHANNELS + c] + ENLARGING_OTHER * cells[u32(far + other.x) * CHANNELS + c];
    return ENLARGING_OWN * own_column + ENLARGING_OTHER * other_column;
}
