// Two of four planes in memory as f16; f16's largest number stands for all that is larger.
alias Px = u32;
fn px_unpack(value: Px) -> Lane { return unpack2x16float(value); }
fn px_pack(value: Lane) -> Px { return pack2x16float(clamp(value, vec2f(-65504.0), vec2f(65504.0))); }
