//! A camera on an orbit, and the lens on it.

use anyhow::Result;
use glam::camera::rh;
use glam::{Mat4, Vec3};
use pullfocus_core::{Camera, Lens, Size};

/// The near plane's distance in metres; there is no far plane.
pub const NEAR: f32 = 0.06;
/// A lens cannot focus within its focal length, and nothing nearer than [`NEAR`] is drawn.
const FOCAL_LENGTH_MM: f64 = 50.0;
const SENSOR_WIDTH_MM: f64 = 36.0;

/// Where the camera stands: on a sphere around what it looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orbit {
    /// What it looks at.
    pub target: Vec3,
    /// About the vertical axis, in radians.
    pub yaw: f32,
    /// Above the horizon, in radians.
    pub pitch: f32,
    /// From the target, in metres.
    pub distance: f32,
}

impl Orbit {
    /// Turns by a drag of so many pixels.
    pub fn drag(&mut self, x: f64, y: f64) {
        self.yaw -= 0.006 * x as f32;
        // Not below the table, not over the pole.
        self.pitch = (self.pitch + 0.006 * y as f32).clamp(0.03, 1.45);
    }

    /// Comes nearer by so many steps of the wheel.
    pub fn zoom(&mut self, steps: f32) {
        self.distance = (self.distance * 0.9_f32.powf(steps)).clamp(0.2, 2.0);
    }

    /// Where the camera is.
    pub fn eye(&self) -> Vec3 {
        let (sin, cos) = self.pitch.sin_cos();
        self.target + self.distance * Vec3::new(cos * self.yaw.sin(), sin, cos * self.yaw.cos())
    }

    /// World to camera: x to the right, y up, looking along -z.
    pub fn view(&self) -> Mat4 {
        rh::view::look_at_mat4(self.eye(), self.target, Vec3::Y)
    }
}

/// Everything that the keys and the mouse change.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Where the camera stands.
    pub orbit: Orbit,
    /// Distance to what is in focus, along the camera's axis, in metres; may be infinite.
    pub focus_m: f64,
    /// The lens's f-stop.
    pub f_stop: f64,
    /// Which of [`crate::blur::looks`].
    pub look: usize,
    /// Whether there is a lens at all; without, all is sharp.
    pub blur: bool,
    /// Whether near objects have textures of their own.
    pub foreground: bool,
}

impl Default for Shot {
    fn default() -> Self {
        let orbit = Orbit { target: Vec3::new(0.01, 0.06, 0.0), yaw: 0.42, pitch: 0.12, distance: 0.52 };
        // The white king.
        Self { orbit, focus_m: 0.475, f_stop: 2.8, look: 0, blur: true, foreground: true }
    }
}

impl Shot {
    /// The lens, as pullfocus takes it.
    ///
    /// # Errors
    /// A focus distance within the focal length.
    pub fn camera(&self) -> Result<Camera> {
        let (focal_length_mm, sensor_width_mm) = (FOCAL_LENGTH_MM, SENSOR_WIDTH_MM);
        let lens = Lens::Physical { focal_length_mm, f_stop: self.f_stop, sensor_width_mm };
        Ok(Camera::new(lens, self.focus_m)?)
    }

    /// Camera to clip space, of the lens's own field of view: depth is `NEAR / distance`, 1 at the near plane and 0 at infinity, which
    /// spends the bits of a float where they are needed.
    pub fn projection(&self, size: Size) -> Mat4 {
        let aspect = size.width as f32 / size.height as f32;
        let half_width = (0.5 * SENSOR_WIDTH_MM / FOCAL_LENGTH_MM) as f32;
        let fov_y = 2.0 * (half_width / aspect).atan();
        rh::proj::directx::perspective_infinite_reverse(fov_y, aspect, NEAR)
    }
}
