// Up to three layers that have their coverage in another group.
const FRONTS: u32 = 3;
@group(0) @binding(3) var<storage, read> front_0: array<Px>;
@group(0) @binding(4) var<storage, read> front_1: array<Px>;
@group(0) @binding(5) var<storage, read> front_2: array<Px>;
@group(0) @binding(6) var<storage, read> covering_0: array<CoverPx>;
@group(0) @binding(7) var<storage, read> covering_1: array<CoverPx>;
@group(0) @binding(8) var<storage, read> covering_2: array<CoverPx>;

fn front(layer: u32, at: u32) -> Lane {
    switch layer {
        case 0u: { return px_unpack(front_0[at]); }
        case 1u: { return px_unpack(front_1[at]); }
        default: { return px_unpack(front_2[at]); }
    }
}

fn coverage(layer: u32, at: u32, own: Lane) -> f32 {
    switch layer {
        case 0u: { return cover(covering_0[at]); }
        case 1u: { return cover(covering_1[at]); }
        default: { return cover(covering_2[at]); }
    }
}
