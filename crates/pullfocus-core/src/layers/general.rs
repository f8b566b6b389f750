//! Constants of the general layers; the same for every backend. See `pullfocus_cpu`'s `layers::general` for what
//! they do, and `docs/methods/diffusion.md` for why.

/// Diameters, in units ([`crate::split::unit`]), between which a step becomes an edge.
pub const EDGE_STEP: [f32; 2] = [0.5, 2.0];
/// How little an edge pixel is trusted as a source of fills.
pub const EDGE_TRUST: f32 = 0.1;
/// Colours closer than this part of their size cannot be told apart on an edge.
pub const COLOR_NOISE: f32 = 0.05;
/// Weight of the layers' own variance in telling them apart.
pub const VARIANCE: f32 = 8.0;
/// An edge pixel keeps at least this share of the layer that its depth names.
pub const LEAST_SHARE: f32 = 0.4;
/// From this share of a pixel on a layer shows the pixel's own colour, in a ramp from the fill's.
pub const OWN_FROM: f32 = 0.2;
/// Colour planes that decide over edges: R, G, B; further planes follow.
pub const LEADING: usize = 3;
