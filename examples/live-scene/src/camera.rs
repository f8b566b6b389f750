//! A camera on an orbit, and the lens on it.

use crate::blur;
use anyhow::Result;
use glam::camera::rh;
use glam::{Mat4, Vec3};
use pullfocus_core::{Camera, Lens, Size};

/// The near plane's distance in metres; there is no far plane.
pub const NEAR: f32 = 0.06;
/// Below [`NEAR`]: a lens cannot focus within its focal length.
const FOCAL_LENGTH_MM: f64 = 50.0;
const SENSOR_WIDTH_MM: f64 = 36.0;
/// What it looks at.
const TARGET: Vec3 = Vec3::new(0.01, 0.06, 0.0);

/// Everything that the keys and the mouse change.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Where the camera stands on a sphere around the scene: about the vertical axis, in radians.
    pub yaw: f32,
    /// Above the horizon, in radians.
    pub pitch: f32,
    /// The sphere's radius in metres.
    pub distance: f32,
    /// Distance to what is in focus, along the camera's axis, in metres; may be infinite.
    pub focus_m: f64,
    /// The lens's f-stop.
    pub f_stop: f64,
    /// Which of [`blur::LOOKS`].
    pub look: usize,
    /// Whether there is a lens at all; without, all is sharp.
    pub blur: bool,
    /// Whether near objects have textures of their own.
    pub foreground: bool,
}

impl Default for Shot {
    /// Focused on the white king.
    fn default() -> Self {
        let (yaw, pitch, distance) = (0.42, 0.12, 0.52);
        Self { yaw, pitch, distance, focus_m: 0.475, f_stop: 2.8, look: 0, blur: true, foreground: true }
    }
}

impl Shot {
    /// Turns by a drag of so many pixels.
    pub fn drag(&mut self, x: f32, y: f32) {
        self.yaw -= 0.006 * x;
        // Not below the table, not over the pole.
        self.pitch = (self.pitch + 0.006 * y).clamp(0.03, 1.45);
    }

    /// Comes nearer by so many steps of the wheel.
    pub fn zoom(&mut self, steps: f32) {
        self.distance = (self.distance * 0.9_f32.powf(steps)).clamp(0.2, 2.0);
    }

    /// Does what a key says, given as the text that it types.
    pub fn key(&mut self, text: &str) {
        // Three clicks of the dial are one stop, a factor of the root of two.
        let third = 2f64.powf(1.0 / 6.0);
        match text.to_lowercase().as_str() {
            " " => self.blur = !self.blur,
            "[" => self.f_stop = (self.f_stop / third).max(1.4),
            "]" => self.f_stop = (self.f_stop * third).min(22.0),
            "m" => self.look = (self.look + 1) % blur::LOOKS.len(),
            "f" => self.foreground = !self.foreground,
            _ => {}
        }
    }

    /// Focuses towards a distance, as a hand turns the ring: by a part of what is left, in dioptres, in which infinity is a number.
    pub fn pull(&mut self, to_m: f64, seconds: f64) {
        let left = (1.0 / self.focus_m - 1.0 / to_m) * (-8.0 * seconds).exp();
        self.focus_m = if left.abs() < 1e-3 { to_m } else { 1.0 / (1.0 / to_m + left) };
    }

    /// The lens, as pullfocus takes it; an error if it is focused within its focal length.
    pub fn camera(&self) -> Result<Camera> {
        let (focal_length_mm, sensor_width_mm) = (FOCAL_LENGTH_MM, SENSOR_WIDTH_MM);
        let lens = Lens::Physical { focal_length_mm, f_stop: self.f_stop, sensor_width_mm };
        Ok(Camera::new(lens, self.focus_m)?)
    }

    /// World to camera: x to the right, y up, looking along -z.
    pub fn view(&self) -> Mat4 {
        let (sin, cos) = self.pitch.sin_cos();
        let eye = TARGET + self.distance * Vec3::new(cos * self.yaw.sin(), sin, cos * self.yaw.cos());
        rh::view::look_at_mat4(eye, TARGET, Vec3::Y)
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
