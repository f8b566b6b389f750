//! The table of a display transform, on the device that draws the window.

use crate::color::{SIDE, Table};
use crate::locked::lock;
use eframe::wgpu;
use std::sync::{Arc, Mutex};

/// The last table, which is brought to the device once.
#[derive(Debug)]
pub struct Cube {
    nothing: wgpu::TextureView,
    last: Mutex<Option<(Arc<Table>, wgpu::TextureView)>>,
}

impl Cube {
    pub fn new(device: &wgpu::Device) -> Self {
        Self { nothing: texture(device, 1), last: Mutex::default() }
    }

    /// The table as a texture; where there is none, one that is not looked at.
    pub fn view(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        table: Option<&Arc<Table>>,
    ) -> wgpu::TextureView {
        let Some(table) = table else { return self.nothing.clone() };
        let mut last = lock(&self.last);
        if let Some((_, view)) = last.as_ref().filter(|(known, _)| Arc::ptr_eq(known, table)) {
            return view.clone();
        }
        let view = texture(device, SIDE as u32);
        queue.write_texture(
            view.texture().as_image_copy(),
            bytemuck::cast_slice(table.points()),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((size_of::<[f32; 4]>() * SIDE) as u32),
                rows_per_image: Some(SIDE as u32),
            },
            view.texture().size(),
        );
        *last = Some((Arc::clone(table), view.clone()));
        view
    }
}

/// Full floats: what is read between them is computed by the shader, as on the processor.
fn texture(device: &wgpu::Device, side: u32) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("display transform"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: side },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
