// What a user's settings (`p`) make of the lens's own diameter.
fn shaped(lens: f32) -> f32 {
    var c = lens;
    if p.protect != 0u { c -= clamp(c, p.near, p.far); }
    let factor = select(p.back, p.front, c < 0.0);
    // A factor of 0 wins over infinity.
    let diameter = select(clamp(c * factor, -p.largest, p.largest), 0.0, factor == 0.0);
    // No -0.
    return select(diameter, 0.0, diameter == 0.0);
}
