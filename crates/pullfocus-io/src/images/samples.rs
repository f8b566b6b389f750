//! Decoded samples on their way to planes.

use super::orient::oriented;
use super::{DepthMap, Image, Profile, Stored};
use crate::error::FileResult;
use pullfocus_core::{Picture, Plane, Size, srgb};

/// What the decoders give.
pub(super) struct Samples {
    pub size: Size,
    /// Samples of a pixel, alpha and others included.
    pub channels: usize,
    /// One channel after the other, not one pixel after the other.
    pub planar: bool,
    /// Grey or the first three are colour; the one after them may be alpha.
    pub grey: bool,
    pub alpha: Alpha,
    pub data: Data,
    /// EXIF's orientation, 1 to 8.
    pub orientation: u8,
    /// The colour profile's bytes.
    pub profile: Option<Vec<u8>>,
    /// What the user should know, as clauses about "it", the file.
    pub notes: Vec<String>,
}

/// The sample after the colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Alpha {
    None,
    Straight,
    Associated,
}

/// Samples, as many as pixels times channels.
pub(super) enum Data {
    U8(Vec<u8>),
    U16(Vec<u16>),
    U32(Vec<u32>),
    F32(Vec<f32>),
}

impl Data {
    fn stored(&self) -> Stored {
        match self {
            Self::U8(_) => Stored::Integer(8),
            Self::U16(_) => Stored::Integer(16),
            Self::U32(_) => Stored::Integer(32),
            Self::F32(_) => Stored::Float,
        }
    }

    /// Integers as 0..1, floats as they are.
    fn raw(&self, i: usize) -> f32 {
        match self {
            Self::U8(data) => f32::from(data[i]) / 255.0,
            Self::U16(data) => f32::from(data[i]) / 65535.0,
            Self::U32(data) => (f64::from(data[i]) / f64::from(u32::MAX)) as f32,
            Self::F32(data) => data[i],
        }
    }
}

impl Samples {
    fn colors(&self) -> usize {
        if self.grey { 1 } else { 3 }
    }

    fn plane(&self, channel: usize, value: impl Fn(usize) -> f32) -> FileResult<Plane> {
        let (stride, first) =
            if self.planar { (1, channel * self.size.area()) } else { (self.channels, channel) };
        let mut plane = Plane::filled(self.size, 0.0)?;
        for (i, out) in plane.data_mut().iter_mut().enumerate() {
            *out = value(first + i * stride);
        }
        Ok(plane)
    }

    /// Linear light, premultiplied, three colour planes.
    pub fn to_picture(&self) -> FileResult<Picture> {
        let alpha = match self.alpha {
            Alpha::None => None,
            _ => Some(self.plane(self.colors(), |i| self.data.raw(i))?),
        };
        // A curve by table, where there are fewer codes than pixels mostly.
        let curve: Vec<f32> = match &self.data {
            Data::U8(_) => (0..=255u8).map(|code| srgb::decode(f32::from(code) / 255.0)).collect(),
            Data::U16(_) => (0..=65535u16).map(|code| srgb::decode(f32::from(code) / 65535.0)).collect(),
            _ => vec![],
        };
        let mut colors = Vec::with_capacity(3);
        for channel in 0..self.colors() {
            let mut plane = match (&self.data, self.alpha) {
                (Data::F32(data), _) => self.plane(channel, |i| data[i])?,
                // Multiplied into the code: the curve is taken below, of the code alone.
                (_, Alpha::Associated) => self.plane(channel, |i| self.data.raw(i))?,
                (Data::U8(data), _) => self.plane(channel, |i| curve[usize::from(data[i])])?,
                (Data::U16(data), _) => self.plane(channel, |i| curve[usize::from(data[i])])?,
                (Data::U32(_), _) => self.plane(channel, |i| srgb::decode(self.data.raw(i)))?,
            };
            if let Some(alpha) = &alpha {
                let associated = self.alpha == Alpha::Associated;
                let float = matches!(self.data, Data::F32(_));
                for (color, &alpha) in plane.data_mut().iter_mut().zip(alpha.data()) {
                    *color = match (associated, float) {
                        (true, true) => *color,
                        (true, false) if alpha > 0.0 => srgb::decode(*color / alpha) * alpha,
                        (true, false) => srgb::decode(*color),
                        (false, _) => *color * alpha,
                    };
                }
            }
            colors.push(oriented(plane, self.orientation)?);
        }
        if let [grey] = colors.as_slice() {
            colors = vec![grey.clone(), grey.clone(), grey.clone()];
        }
        let alpha = alpha.map(|plane| oriented(plane, self.orientation)).transpose()?;
        Ok(Picture { colors, alpha })
    }

    /// The picture and what stands beside it.
    pub fn into_image(mut self) -> FileResult<Image> {
        let (picture, stored) = (self.to_picture()?, self.data.stored());
        let profile = self.profile.take().and_then(|bytes| Profile::new(bytes, stored));
        let mut notes = self.notes;
        notes.extend(profile.as_ref().map(Profile::note));
        Ok(Image { picture, stored, profile, notes })
    }

    /// The first channel, raw.
    pub fn to_depth(&self) -> FileResult<DepthMap> {
        let plane = self.plane(0, |i| self.data.raw(i))?;
        Ok(DepthMap { plane: oriented(plane, self.orientation)?, stored: self.data.stored() })
    }
}
