//! Pictures on the device that draws the window.

use eframe::wgpu;
use pullfocus_core::{Error, Picture, Plane, Result, Size};
use std::sync::Arc;

/// A picture on the device. It is dropped with the last of its owners.
#[derive(Debug, Clone)]
pub struct Texture {
    /// The whole of it.
    pub view: wgpu::TextureView,
    /// Width and height.
    pub size: Size,
    /// Told apart from others by its owners' number.
    owners: Arc<()>,
}

impl Texture {
    /// A texture without content.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`].
    pub fn new(
        device: &wgpu::Device,
        size: Size,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<Self> {
        let most = device.limits().max_texture_dimension_2d as usize;
        if size.width > most || size.height > most || size.area() == 0 {
            return Err(Error::DeviceLimit {
                device: device.adapter_info().name,
                what: "pixels along one side of a picture",
                needed: size.width.max(size.height) as u64,
                allowed: most as u64,
                instead: "render it with `pullfocus render --device cpu`",
            });
        }
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("pullfocus view"),
            size: wgpu::Extent3d {
                width: size.width as u32,
                height: size.height as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        Ok(Self { view: texture.create_view(&Default::default()), size, owners: Arc::default() })
    }

    /// `old` where that is such a texture and nobody else has it, else a new one: frames that play need no memory made anew.
    fn renewed(
        old: Option<Self>,
        device: &wgpu::Device,
        size: Size,
        format: wgpu::TextureFormat,
    ) -> Result<Self> {
        let fits = |old: &Self| old.size == size && old.is_free() && old.view.texture().format() == format;
        old.filter(fits).map_or_else(|| Self::new(device, size, format, USAGE), Ok)
    }

    /// Whether nobody else has it.
    pub fn is_free(&self) -> bool {
        Arc::strong_count(&self.owners) == 1
    }

    fn write(&self, queue: &wgpu::Queue, bytes: &[u8]) {
        let pixel = bytes.len() / self.size.area().max(1);
        queue.write_texture(
            self.view.texture().as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some((pixel * self.size.width) as u32),
                rows_per_image: None,
            },
            self.view.texture().size(),
        );
    }
}

const USAGE: wgpu::TextureUsages = wgpu::TextureUsages::TEXTURE_BINDING
    .union(wgpu::TextureUsages::COPY_DST)
    .union(wgpu::TextureUsages::COPY_SRC);

/// Red, green, blue and alpha of each pixel; a picture of one or two colours is grey.
fn interleaved<T>(picture: &Picture, convert: impl Fn(f32) -> T) -> Vec<T> {
    let colors = &picture.colors;
    let grey = colors.len() < 3;
    let plane = |i: usize| colors.get(if grey { 0 } else { i }).map(Plane::data);
    let planes = [plane(0), plane(1), plane(2), picture.alpha.as_ref().map(Plane::data)];
    let fills = [0.0, 0.0, 0.0, 1.0];
    let mut out = Vec::with_capacity(4 * picture.size().area());
    for i in 0..picture.size().area() {
        for (plane, fill) in planes.iter().zip(fills) {
            out.push(convert(plane.map_or(fill, |data| data[i])));
        }
    }
    out
}

/// Values that are no numbers have the renderer's rule: NaN is 0, infinity the largest half.
fn mended(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-65504.0, 65504.0) }
}

/// A linear picture as half floats, to look at.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn from_picture(device: &wgpu::Device, queue: &wgpu::Queue, picture: &Picture) -> Result<Texture> {
    let texture = Texture::new(device, picture.size(), wgpu::TextureFormat::Rgba16Float, USAGE)?;
    let halves = interleaved(picture, |value| half::f16::from_f32(mended(value)).to_bits());
    texture.write(queue, bytemuck::cast_slice(&halves));
    Ok(texture)
}

/// A linear picture as it is, to compute with, in `old` if that fits.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn full_precision(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &Picture,
    old: Option<Texture>,
) -> Result<Texture> {
    let texture = Texture::renewed(old, device, picture.size(), wgpu::TextureFormat::Rgba32Float)?;
    texture.write(queue, bytemuck::cast_slice(&interleaved(picture, |value| value)));
    Ok(texture)
}

/// Planes that are sRGB already, 0 to 1.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn from_srgb(device: &wgpu::Device, queue: &wgpu::Queue, planes: &[Plane; 3]) -> Result<Texture> {
    let size = planes[0].size();
    let texture = Texture::new(device, size, wgpu::TextureFormat::Rgba8Unorm, USAGE)?;
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let bytes: Vec<u8> = (0..size.area())
        .flat_map(|i| [byte(planes[0].data()[i]), byte(planes[1].data()[i]), byte(planes[2].data()[i]), 255])
        .collect();
    texture.write(queue, &bytes);
    Ok(texture)
}

/// Distances as they are, in `old` if that fits.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn distances(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    plane: &Plane,
    old: Option<Texture>,
) -> Result<Texture> {
    let texture = Texture::renewed(old, device, plane.size(), wgpu::TextureFormat::R32Float)?;
    texture.write(queue, bytemuck::cast_slice(plane.data()));
    Ok(texture)
}
