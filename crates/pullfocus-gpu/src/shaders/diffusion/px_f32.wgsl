// Planes in memory as f32.
alias Px = Lane;
fn px_unpack(value: Px) -> Lane { return value; }
fn px_pack(value: Lane) -> Px { return value; }
