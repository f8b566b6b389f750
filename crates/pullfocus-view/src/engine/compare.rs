//! Beside a reference: how far apart, and where.

use super::Shown;
use crate::screen::{self, Texture};
use eframe::wgpu;
use pullfocus_core::{Frame, Picture, Plane};
use pullfocus_io::Limits;
use pullfocus_job::storage;
use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};

/// A picture to compare with, in memory and on the device.
#[derive(Debug)]
pub struct Reference {
    /// Its file.
    pub path: PathBuf,
    /// The picture on the device, linear.
    pub texture: Texture,
    /// The frame that it lies beside, pixel by pixel.
    pub beside: Option<Frame>,
    /// As a viewer sees it.
    display: [Plane; 3],
}

impl Reference {
    /// Reads a picture, as it lies beside one of this frame.
    ///
    /// # Errors
    /// One sentence.
    pub fn read(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        path: &Path,
        beside: Option<&Frame>,
    ) -> Result<Self, String> {
        let limits = Limits::default();
        let picture = match beside {
            Some(frame) => storage::read_picture_beside(path, frame, &limits),
            None => storage::read_picture(path, &limits),
        };
        let picture = picture.map_err(|failure| failure.to_string())?;
        let told = |error: String| format!("{}: {error}", path.display());
        Ok(Self {
            path: path.to_owned(),
            beside: beside.copied(),
            texture: screen::from_picture(device, queue, &picture)
                .map_err(|error| told(error.to_string()))?,
            display: pullfocus_metrics::display(&picture).map_err(|error| told(error.to_string()))?,
        })
    }
}

/// Take A beside the reference.
#[derive(Debug)]
pub struct Comparison {
    reference: Arc<Reference>,
    shown: Arc<Shown>,
    /// In dB; infinite where both are the same.
    pub psnr: f64,
    /// Mean FLIP, 0 to 1.
    pub flip: f64,
    /// FLIP of each pixel, as colours.
    pub map: Texture,
}

impl Comparison {
    /// Compares.
    ///
    /// # Errors
    /// One sentence: pictures of different size, a device that is lost.
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        reference: &Arc<Reference>,
        shown: &Arc<Shown>,
    ) -> Result<Self, String> {
        let (found, wanted) = (reference.display[0].size(), shown.texture.size);
        if found != wanted {
            return Err(format!(
                "{}: it is {found} and the picture is {wanted}; only pictures of one size can be compared",
                reference.path.display()
            ));
        }
        let picture = read_back(device, queue, &shown.texture)?;
        let text = |error: pullfocus_metrics::Error| error.to_string();
        let display = pullfocus_metrics::display(&picture).map_err(text)?;
        let psnr = pullfocus_metrics::psnr(&reference.display, &display).map_err(text)?;
        let flip = pullfocus_metrics::flip(&reference.display, &display).map_err(text)?;
        let colors = pullfocus_metrics::magma(&flip.map).map_err(text)?;
        let map = screen::from_srgb(device, queue, &colors).map_err(|error| error.to_string())?;
        Ok(Self { reference: Arc::clone(reference), shown: Arc::clone(shown), psnr, flip: flip.mean, map })
    }

    /// The frame whose pixels it has.
    pub fn frame(&self) -> &Frame {
        &self.shown.plate.scene.frame
    }

    /// Whether it is of these two.
    pub fn is_of(&self, reference: &Arc<Reference>, shown: &Arc<Shown>) -> bool {
        Arc::ptr_eq(&self.reference, reference) && Arc::ptr_eq(&self.shown, shown)
    }
}

/// The colours of a texture of half floats.
///
/// # Errors
/// One sentence.
pub fn read_back(device: &wgpu::Device, queue: &wgpu::Queue, texture: &Texture) -> Result<Picture, String> {
    let size = texture.size;
    let texels = texels(device, queue, texture, [0, 0], [size.width, size.height])?;
    let plane = |i: usize| {
        Plane::new(size, texels.iter().map(|texel| texel[i]).collect()).map_err(|error| error.to_string())
    };
    Ok(Picture::opaque(vec![plane(0)?, plane(1)?, plane(2)?]))
}

/// Part of a texture of half floats; waits for it.
///
/// # Errors
/// One sentence: the device is lost.
pub fn texels(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &Texture,
    [x, y]: [usize; 2],
    [width, height]: [usize; 2],
) -> Result<Vec<[f32; 4]>, String> {
    const TEXEL: usize = 8;
    let row = (TEXEL * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("texels"),
        size: (row * height) as u64,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: x as u32, y: y as u32, z: 0 },
            ..texture.view.texture().as_image_copy()
        },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row as u32),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
    );
    queue.submit([encoder.finish()]);
    let (sender, receiver) = mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // Nobody waits any more where this fails.
        let _ = sender.send(result);
    });
    device
        .poll(wgpu::PollType::wait_indefinitely())
        .map_err(|error| format!("the GPU does not answer: {error}"))?;
    match receiver.try_recv() {
        Ok(Ok(())) => {}
        _ => return Err("the GPU's memory cannot be read; it may be lost".into()),
    }
    let bytes = buffer.slice(..).get_mapped_range().map_err(|error| error.to_string())?;
    let half = |bytes: &[u8]| half::f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
    Ok(bytes
        .chunks_exact(row)
        .flat_map(|line| line[..TEXEL * width].chunks_exact(TEXEL))
        .map(|texel| [0, 2, 4, 6].map(|at| half(&texel[at..at + 2])))
        .collect())
}
