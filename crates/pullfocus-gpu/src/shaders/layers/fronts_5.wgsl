// Up to five layers that have their coverage in the same group.
const FRONTS: u32 = 5;
@group(0) @binding(3) var<storage, read> front_0: array<Px>;
@group(0) @binding(4) var<storage, read> front_1: array<Px>;
@group(0) @binding(5) var<storage, read> front_2: array<Px>;
@group(0) @binding(6) var<storage, read> front_3: array<Px>;
@group(0) @binding(7) var<storage, read> front_4: array<Px>;

fn front(layer: u32, at: u32) -> Lane {
    switch layer {
        case 0u: { return px_unpack(front_0[at]); }
        case 1u: { return px_unpack(front_1[at]); }
        case 2u: { return px_unpack(front_2[at]); }
        case 3u: { return px_unpack(front_3[at]); }
        default: { return px_unpack(front_4[at]); }
    }
}

fn coverage(layer: u32, at: u32, own: Lane) -> f32 { return lane_part(own, p.coverage); }
