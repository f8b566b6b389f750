//! The program pullfocus: depth of field for rendered frames and photographs.
fn main() {}
