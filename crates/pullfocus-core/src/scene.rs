//! What goes into one render.

use crate::depth::DepthDecoding;
use crate::error::Result;
use crate::frame::Frame;
use crate::picture::Picture;
use crate::plane::Plane;

/// How far away, or how far out of focus, each pixel is.
#[derive(Debug, Clone, PartialEq)]
pub enum Distance {
    /// Depth as the file holds it, and how to read it.
    Depth {
        /// The channel.
        plane: Plane,
        /// What its numbers mean.
        decoding: DepthDecoding,
    },
    /// Signed diameter of the circle of confusion in pixels, positive behind focus; no camera is needed.
    Coc(Plane),
}

impl Distance {
    /// The plane, whatever it means.
    pub fn plane(&self) -> &Plane {
        match self {
            Self::Depth { plane, .. } | Self::Coc(plane) => plane,
        }
    }
}

/// A picture and its distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Colour, linear and premultiplied.
    pub picture: Picture,
    /// Depth or circle of confusion, of the same size.
    pub distance: Distance,
}

impl Element {
    /// Refuses planes that differ in size.
    ///
    /// # Errors
    /// [`crate::Error::SizeMismatch`].
    pub fn check(&self) -> Result<()> {
        self.picture.check()?;
        self.distance.plane().expect_size("the depth plane", self.picture.size())
    }
}

/// One frame: the picture to blur, and what a renderer can give beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Where the pixels lie.
    pub frame: Frame,
    /// The picture with its depth: either the whole picture, or with [`Scene::foreground`] what is behind it.
    pub base: Element,
    /// Near objects on their own, with alpha, lying over [`Scene::base`]. It has as many colour planes. Colour where alpha is 0 is light
    /// that covers nothing.
    pub foreground: Option<Element>,
}

impl Scene {
    /// A picture with depth, and nothing beside it.
    pub fn new(frame: Frame, base: Element) -> Self {
        Self { frame, base, foreground: None }
    }

    /// Refuses planes that differ in size, or a foreground with other planes.
    ///
    /// # Errors
    /// [`crate::Error::SizeMismatch`], [`crate::Error::Setting`].
    pub fn check(&self) -> Result<()> {
        self.base.check()?;
        let size = self.base.picture.size();
        if size != self.frame.data.size {
            return Err(crate::Error::SizeMismatch {
                what: "the frame's data window",
                found: self.frame.data.size,
                expected: size,
            });
        }
        let Some(foreground) = &self.foreground else { return Ok(()) };
        foreground.check()?;
        foreground.distance.plane().expect_size("the foreground", size)?;
        if foreground.picture.colors.len() != self.base.picture.colors.len() {
            return Err(crate::Error::Setting {
                name: "foreground's number of colour planes",
                value: foreground.picture.colors.len() as f64,
                reason: "must be the same as the picture's",
            });
        }
        if foreground.picture.alpha.is_none() {
            return Err(crate::Error::Setting {
                name: "foreground's alpha",
                value: 0.0,
                reason: "must be there: alpha says where the foreground covers the picture",
            });
        }
        Ok(())
    }
}
