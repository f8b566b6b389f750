// The second disc that cuts the aperture away from the optical axis.
//
// `cats_eye` is how far it lies from the first one in the corners, in diameters; `axis` where the optical axis is;
// `field` one over the way from there to a corner, across and down.
fn displacement(x: u32, y: u32, front: u32) -> vec2f {
    var place = (vec2f(f32(x), f32(y)) - vec2f(p.axis_x, p.axis_y)) * vec2f(p.field_x, p.field_y);
    place /= max(length(place), 1.0);
    return place * select(p.cats_eye, -p.cats_eye, front == 1u);
}
