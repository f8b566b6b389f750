//! Layers: the picture taken apart by its circle of confusion, blurred, and put together again.

mod background;
mod fill;
mod foreground;
mod over;

pub use background::blur_over_background;
/// TEMP until h4
pub fn blur_layers(
    _: &mut crate::work::Work<'_, '_>,
    _: &[crate::planes::Group],
    _: usize,
    _: &wgpu::Buffer,
    _: u32,
) -> pullfocus_core::Result<()> {
    unimplemented!()
}
pub use foreground::blur_element_over;
