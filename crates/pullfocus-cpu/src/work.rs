//! What every step of a render has at hand.

use crate::bokeh::{Lights, Look};
use crate::diffusion::{Conductivity, DiffusionBuffers, Medium, diffuse};
use crate::pool::PlanePool;
use crate::spreading::{Spread, SpreadBuffers, spread};
use pullfocus_core::diffusion::Calibration;
use pullfocus_core::{
    Aperture, Cancel, Diffusion, Frame, Integrator, Method, Mipmap, Plane, Psf, Quality, Report, Result,
    Settings, Show, Solver, Tensor,
};
use std::borrow::Cow;
use std::time::Instant;

/// Memory that stays from frame to frame.
#[derive(Debug, Default)]
pub struct Memory {
    /// Spare planes.
    pub planes: PlanePool,
    /// The solvers' scratch.
    pub diffusion: DiffusionBuffers,
    /// The spreading methods' sums.
    pub spreading: SpreadBuffers,
    /// Highlights.
    pub lights: Lights,
}

/// One render's surroundings: settings, memory, the caller's wish to stop.
pub struct Work<'a> {
    /// Which method blurs a layer.
    pub method: Method,
    /// The shape of a point, where the method has a choice.
    pub psf: Psf,
    /// The aperture's shape, where it is spread.
    pub aperture: Cow<'a, Aperture>,
    /// Which layers are laid down.
    pub show: Show,
    /// What becomes of highlights, if they are spread.
    pub look: Option<Look<'a>>,
    /// How finely the pyramid draws.
    pub quality: Quality,
    /// What the pyramid does between two levels.
    pub mipmap: Mipmap,
    /// How the tensor filter works.
    pub tensor: Tensor,
    /// How diffusion blurs a layer.
    pub diffusion: Diffusion,
    /// Pixels of height for one pixel of width.
    pub vertical_scale: f32,
    /// Width of the display window in pixels: what thresholds are parts of.
    pub display_width: f32,
    /// The caller's flag.
    pub cancel: &'a Cancel,
    /// Planes and scratch.
    pub memory: &'a mut Memory,
    /// What is told afterwards.
    pub report: &'a mut Report,
}

/// One backward-Euler step by elimination: what fills and extends, whatever the method of the blur.
const FILL: Diffusion = Diffusion {
    calibration: Calibration::Variance,
    integrator: Integrator::BackwardEuler { steps: 1 },
    solver: Solver::Lu,
};

impl<'a> Work<'a> {
    /// The surroundings of a render of `frame`.
    pub fn new(
        frame: &Frame,
        settings: &'a Settings,
        cancel: &'a Cancel,
        memory: &'a mut Memory,
        report: &'a mut Report,
    ) -> Self {
        Self {
            method: settings.method,
            psf: settings.psf,
            aperture: settings.spread_aperture(),
            show: settings.show,
            look: settings.bokeh.map(|bokeh| Look::new(frame, bokeh, &settings.aperture)),
            quality: settings.quality,
            mipmap: settings.mipmap,
            tensor: settings.tensor,
            diffusion: settings.diffusion,
            vertical_scale: frame.vertical_scale(),
            display_width: frame.display_width() as f32,
            cancel,
            memory,
            report,
        }
    }

    /// Blurs planes by the circle of confusion `circle` (its sign turns an aperture over, and matters nowhere else) with the
    /// method of the settings; `gamma` says how much a pixel's own value counts. Small negative lobes do not bring a plane below 0, nor
    /// below its own least value.
    pub fn blur(&mut self, planes: &mut [&mut Plane], circle: &Plane, gamma: Option<&Plane>) -> Result<()> {
        let vertical_scale = self.vertical_scale;
        if self.method == Method::Diffusion {
            let medium = Medium { conductivity: Conductivity::Circle(circle), gamma, vertical_scale };
            return diffuse(planes, &medium, &self.diffusion, true, &mut self.memory.diffusion, self.cancel);
        }
        let spreading = Spread {
            method: self.method,
            psf: self.psf,
            aperture: &self.aperture,
            quality: self.quality,
            mipmap: self.mipmap,
            tensor: self.tensor,
            circle,
            gamma,
            vertical_scale,
        };
        spread(planes, &spreading, &mut self.memory.spreading, self.cancel)
    }

    /// Fills planes from where `gamma` is, as far as a circle of `diameter` pixels reaches and, where nothing
    /// is nearer, beyond (first paper, 3.1: constant beta).
    pub fn fill(&mut self, planes: &mut [&mut Plane], diameter: f32, gamma: &Plane) -> Result<()> {
        let medium = Medium {
            conductivity: Conductivity::Uniform(diameter),
            gamma: Some(gamma),
            vertical_scale: self.vertical_scale,
        };
        diffuse(planes, &medium, &FILL, false, &mut self.memory.diffusion, self.cancel)
    }

    /// Smooths planes evenly, as a circle of `diameter` pixels would; keeps sums.
    pub fn smooth(&mut self, planes: &mut [&mut Plane], diameter: f32) -> Result<()> {
        let medium = Medium {
            conductivity: Conductivity::Uniform(diameter),
            gamma: None,
            vertical_scale: self.vertical_scale,
        };
        diffuse(planes, &medium, &FILL, false, &mut self.memory.diffusion, self.cancel)
    }

    /// Runs a stage and adds its time to the report.
    pub fn stage<T>(&mut self, name: &'static str, f: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        let start = Instant::now();
        let result = f(self);
        self.report.add(name, start.elapsed());
        result
    }
}
