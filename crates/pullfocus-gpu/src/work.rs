//! What every step of a render has at hand.

use crate::bokeh::Look;
use crate::diffusion::{self, Conductivity, How, Medium, Tuning};
use crate::planes::{Group, Storage};
use crate::recorder::Recorder;
use crate::spreading::{self, Spread};
use pullfocus_core::diffusion::Calibration;
use pullfocus_core::{Aperture, Diffusion, Frame, Integrator, Method, Result, Settings, Show, Size, Solver};
use std::borrow::Cow;

/// One render's surroundings.
pub struct Work<'w, 'r> {
    /// Where passes go.
    pub recorder: &'w mut Recorder<'r>,
    /// The picture's size.
    pub size: Size,
    /// Which method blurs a layer.
    pub method: Method,
    /// The aperture's shape, where it is spread.
    pub aperture: Cow<'w, Aperture>,
    /// Which layers are laid down.
    pub show: Show,
    /// How diffusion blurs a layer.
    pub diffusion: Diffusion,
    /// Pixels of height for one pixel of width.
    pub vertical_scale: f32,
    /// Width of the display window in pixels: what thresholds are parts of.
    pub display_width: f32,
    /// What highlights look like, where they were asked for.
    pub look: Option<Look>,
    /// How planes lie in memory.
    pub storage: Storage,
    /// How work is cut.
    pub tuning: Tuning,
    /// Smallest and largest diameter of the picture, as ordered bits (`coc.wgsl`), then how many layers were found; three
    /// words.
    pub range: wgpu::Buffer,
}

/// One backward-Euler step by elimination: what fills and extends, whatever the method of the blur.
const FILL: Diffusion = Diffusion {
    calibration: Calibration::Variance,
    integrator: Integrator::BackwardEuler { steps: 1 },
    solver: Solver::Lu,
};

impl<'w, 'r> Work<'w, 'r> {
    /// The surroundings of a render of `frame`.
    pub fn new(
        recorder: &'w mut Recorder<'r>,
        frame: &Frame,
        settings: &'w Settings,
        storage: Storage,
        tuning: Tuning,
        range: wgpu::Buffer,
    ) -> Self {
        Self {
            recorder,
            size: frame.data.size,
            method: settings.method,
            aperture: settings.spread_aperture(),
            show: settings.show,
            diffusion: settings.diffusion,
            vertical_scale: frame.vertical_scale(),
            display_width: frame.display_width() as f32,
            look: None,
            storage,
            tuning,
            range,
        }
    }

    /// From here on highlights are taken out and brought back, if the settings ask for that.
    ///
    /// # Errors
    /// As [`Look::new`].
    pub fn look_for_lights(&mut self, frame: &Frame, settings: &Settings) -> Result<()> {
        self.look = Look::new(self.recorder, frame, settings)?;
        Ok(())
    }

    /// Blurs groups by the circle of confusion `circle` (f32; its sign turns an aperture over, and matters nowhere else) with
    /// the method of the settings; `gamma` says how much a pixel's own value counts. Small negative lobes do not bring a plane below 0, nor below its own least value.
    pub fn blur(
        &mut self,
        groups: &[&Group],
        circle: &wgpu::Buffer,
        gamma: Option<&wgpu::Buffer>,
    ) -> Result<()> {
        if self.method == Method::Aperture {
            let limits = self.recorder.context.limits();
            let spread = Spread {
                circle,
                gamma,
                vertical_scale: self.vertical_scale,
                aperture: &self.aperture,
                found: &self.range,
                most_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
            };
            return spreading::spread(self.recorder, self.size, groups, &spread);
        }
        let conductivity = Conductivity::Circle(circle);
        let medium = Medium { conductivity, gamma, vertical_scale: self.vertical_scale };
        let how = How { floor_at_zero: true, tuning: self.tuning, found: Some(&self.range) };
        diffusion::diffuse(self.recorder, self.size, groups, &medium, &self.diffusion, &how)
    }

    /// Smooths groups of planes of `size` evenly, as a circle of `diameter` of their pixels would; where `gamma` is given it
    /// fills from where that is.
    pub fn smooth(
        &mut self,
        size: Size,
        groups: &[&Group],
        diameter: f32,
        gamma: Option<&wgpu::Buffer>,
    ) -> Result<()> {
        let conductivity = Conductivity::Uniform(diameter);
        let medium = Medium { conductivity, gamma, vertical_scale: self.vertical_scale };
        let how = How { floor_at_zero: false, tuning: self.tuning, found: Some(&self.range) };
        diffusion::diffuse(self.recorder, size, groups, &medium, &FILL, &how)
    }
}
