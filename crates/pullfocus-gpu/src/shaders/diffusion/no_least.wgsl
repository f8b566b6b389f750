// Nothing is bound for least values, so that passes over different planes need not wait for each other.

fn note_least(values: ptr<function, array<Lane, K>>, at: u32) {}
fn read_least(at: u32) -> Lane { return Lane(0.0); }
