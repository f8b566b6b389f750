// Four planes in memory as f16; f16's largest number stands for all that is larger.
alias Px = vec2u;
fn px_unpack(value: Px) -> Lane { return vec4f(unpack2x16float(value.x), unpack2x16float(value.y)); }
fn px_pack(value: Lane) -> Px {
    let v = clamp(value, vec4f(-65504.0), vec4f(65504.0));
    return vec2u(pack2x16float(v.xy), pack2x16float(v.zw));
}
