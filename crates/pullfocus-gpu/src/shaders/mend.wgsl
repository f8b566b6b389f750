// By the bits: compilers may take it that no number is NaN.
fn mended(x: f32) -> f32 {
    let size = bitcast<u32>(x) & 0x7fffffffu;
    let sign = bitcast<u32>(x) & 0x80000000u;
    if size > 0x7f800000u { return 0.0; }
    if size == 0x7f800000u { return bitcast<f32>(bitcast<u32>(HALF_MAX) | sign); }
    return clamp(x, -LARGEST, LARGEST);
}
