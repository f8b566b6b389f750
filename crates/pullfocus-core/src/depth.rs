//! Depth as files hold it, and its one form inside: planar metres, infinity where nothing is.

use crate::error::{Error, Result};
use crate::frame::Frame;
use serde::{Deserialize, Serialize};

/// What a depth channel's numbers mean.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthKind {
    /// Along the optical axis (OpenEXR's `Z`).
    #[default]
    Planar,
    /// Along the ray through the pixel (Mitsuba's `aov`, old Cycles, Hypersim); needs the field of view.
    Ray,
    /// 1/z (Nuke's scan-line renderer), in 1/unit.
    Inverse,
    /// `1/z = scale * value + shift`, in 1/m (phones, MiDaS, Depth Anything: bright is near).
    Disparity {
        /// Factor on the value, 1/m.
        scale: f64,
        /// Added afterwards, 1/m.
        shift: f64,
    },
    /// 0 at `near_m` to 1 at `far_m`, linear in z (V-Ray and others); the other way round with `inverted`.
    Normalized {
        /// Distance in metres where the value is 0.
        near_m: f64,
        /// Distance in metres where the value is 1.
        far_m: f64,
        /// White is near: 1 at `near_m`, 0 at `far_m`.
        inverted: bool,
    },
}

/// How to turn a file's depth into planar metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub struct DepthDecoding {
    /// What the numbers mean.
    pub kind: DepthKind,
    /// Metres in one unit of the file: 0.01 for Unreal's centimetres.
    pub unit_m: f64,
    /// Distance in metres at and beyond which nothing is there, where a renderer writes its far clip.
    pub far_clip_m: Option<f64>,
}

impl Default for DepthDecoding {
    fn default() -> Self {
        Self { kind: DepthKind::Planar, unit_m: 1.0, far_clip_m: None }
    }
}

/// Half's largest number; a depth channel that holds it means that nothing was hit.
pub const HALF_MAX: f32 = 65504.0;
/// From here on a distance means that nothing was hit (Blender writes 1e10, others 1e30 or infinity).
pub const NOTHING_FROM: f32 = 1e9;

/// Depth repair: an edge's step, as a part of the larger of its two values.
pub const REPAIR_STEP: f32 = 0.1;
/// Depth repair: a slope doubles its range from 3 to 5 pixels, an edge between plateaus keeps it; the border between the two.
pub const REPAIR_SLOPE: f32 = 1.5;
/// Depth repair: values within these parts of an edge's range are neither of the plateaus.
pub const REPAIR_BLENDED: [f32; 2] = [0.08, 0.92];
/// Depth repair: one row in so many is looked at to notice filtered depth; edges run through many rows.
pub const REPAIR_NOTICE_STRIDE: usize = 16;

impl DepthDecoding {
    /// Values that mean "nothing there" as the farthest value, so that they can be a plateau beside an edge.
    pub fn plateau(&self, value: f32) -> f32 {
        match self.kind {
            DepthKind::Planar | DepthKind::Ray => {
                let nothing = !(value.abs() > 0.0 && value.abs() < NOTHING_FROM);
                if nothing { NOTHING_FROM } else { value.abs() }
            }
            _ if value.is_finite() => value,
            _ => 0.0,
        }
    }

    /// A hardware depth buffer of a perspective projection with the depth `d = a + b / z`, z the distance in front of the
    /// camera in metres: `near`..`far` to 0..1 has `a = far / (far - near)`, `b = -near far / (far - near)`; reversed-Z
    /// swaps near and far; reversed with an infinite far plane has `a = 0`, `b = near`. A far plane's own value
    /// (1, or 0 reversed) is the far plane's distance, infinity where that is infinite.
    ///
    /// A projection matrix in column-major order that puts `-z` into w (the usual, looking down the negative axis) has
    /// `a = -m[2][2]`, `b = m[3][2]`.
    pub fn hardware(a: f64, b: f64) -> Self {
        Self { kind: DepthKind::Disparity { scale: 1.0 / b, shift: -a / b }, ..Self::default() }
    }

    /// Refuses values outside their ranges.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn check(&self) -> Result<()> {
        let positive = |name, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(Error::Setting { name, value, reason: "must be a number above 0" })
            }
        };
        positive("depth unit (m)", self.unit_m)?;
        positive("depth far clip (m)", self.far_clip_m.unwrap_or(1.0))?;
        match self.kind {
            DepthKind::Disparity { scale, shift } => {
                if !(scale.is_finite() && scale != 0.0 && shift.is_finite()) {
                    return Err(Error::Setting {
                        name: "disparity scale",
                        value: scale,
                        reason: "must be a number other than 0, beside a finite shift",
                    });
                }
            }
            DepthKind::Normalized { near_m, far_m, .. } => {
                positive("depth near (m)", near_m)?;
                if !(far_m.is_finite() && far_m > near_m) {
                    return Err(Error::Setting {
                        name: "depth far (m)",
                        value: far_m,
                        reason: "must be beyond depth near",
                    });
                }
            }
            DepthKind::Planar | DepthKind::Ray | DepthKind::Inverse => {}
        }
        Ok(())
    }

    /// Planar metres of one value; infinity where nothing is there.
    ///
    /// The rule for odd values, the same for every pixel so that nothing switches from frame to frame:
    /// - NaN is nothing there.
    /// - A negative distance counts by its size (cameras that look down the negative axis); a negative
    ///   disparity lies beyond infinity and is nothing there.
    /// - As a distance, 0, 65504 (half's largest), 1e9 and more, and infinity are nothing there; so is
    ///   anything at or beyond `far_clip_m` (less one part in 10,000, since files round).
    /// - A normalised value is clamped to 0..1; nothing there is then the far clip alone.
    ///
    /// `tangents` is where the pixel's ray runs ([`Frame::ray_tangents`]); only [`DepthKind::Ray`] reads it.
    pub fn to_metres(&self, value: f32, tangents: impl FnOnce() -> [f64; 2]) -> f64 {
        if value.is_nan() {
            return f64::INFINITY;
        }
        let distance = |value: f32| {
            let size = value.abs();
            if size == 0.0 || size == HALF_MAX || size >= NOTHING_FROM {
                f64::INFINITY
            } else {
                f64::from(size) * self.unit_m
            }
        };
        let metres = match self.kind {
            DepthKind::Planar => distance(value),
            DepthKind::Ray => {
                let [across, up] = tangents();
                distance(value) / (1.0 + across * across + up * up).sqrt()
            }
            DepthKind::Inverse => self.unit_m / f64::from(value.abs()),
            DepthKind::Disparity { scale, shift } => {
                let dioptres = f64::from(value) * scale + shift;
                if dioptres > 0.0 { 1.0 / dioptres } else { f64::INFINITY }
            }
            DepthKind::Normalized { near_m, far_m, inverted } => {
                let part = f64::from(value).clamp(0.0, 1.0);
                near_m + (far_m - near_m) * if inverted { 1.0 - part } else { part }
            }
        };
        let clip = self.far_clip_m.map_or(f64::INFINITY, |far| far * (1.0 - 1e-4));
        if metres.is_nan() || metres >= clip {
            f64::INFINITY
        } else {
            // Nearer than a micrometre is a number that no scene means; keep 1/z finite.
            metres.max(1e-6)
        }
    }

    /// Whether [`Self::to_metres`] needs a camera's field of view.
    pub fn needs_field_of_view(&self) -> bool {
        self.kind == DepthKind::Ray
    }

    /// [`Self::to_metres`] for the pixel (x, y) of a frame whose half field of view has this tangent.
    pub fn metres_at(&self, frame: &Frame, half_width: f64, value: f32, x: usize, y: usize) -> f64 {
        self.to_metres(value, || frame.ray_tangents(half_width, x, y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metres(kind: DepthKind, value: f32) -> f64 {
        DepthDecoding { kind, ..DepthDecoding::default() }.to_metres(value, || [0.75, 0.0])
    }

    #[test]
    fn every_convention_finds_two_metres() {
        let disparity = DepthKind::Disparity { scale: 0.5, shift: 0.25 };
        let normalized = |inverted| DepthKind::Normalized { near_m: 1.0, far_m: 5.0, inverted };
        for (kind, value) in [
            (DepthKind::Planar, 2.0),
            (DepthKind::Ray, 2.5),
            (DepthKind::Inverse, 0.5),
            (disparity, 0.5),
            (normalized(false), 0.25),
            (normalized(true), 0.75),
        ] {
            assert!((metres(kind, value) - 2.0).abs() < 1e-12, "{kind:?}");
        }
        let centimetres = DepthDecoding { unit_m: 0.01, ..DepthDecoding::default() };
        assert!((centimetres.to_metres(200.0, || [0.0, 0.0]) - 2.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_there_is_infinity_however_it_is_written() {
        for value in [0.0, -0.0, 65504.0, 1e10, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(metres(DepthKind::Planar, value), f64::INFINITY, "{value}");
        }
        assert_eq!(metres(DepthKind::Inverse, 0.0), f64::INFINITY);
        assert_eq!(metres(DepthKind::Disparity { scale: 1.0, shift: 0.0 }, -0.3), f64::INFINITY);
        let clipped = DepthDecoding { far_clip_m: Some(1000.0), ..DepthDecoding::default() };
        assert_eq!(clipped.to_metres(999.95, || [0.0, 0.0]), f64::INFINITY);
        assert_eq!(clipped.to_metres(999.0, || [0.0, 0.0]), 999.0);
    }

    #[test]
    fn hardware_depth_is_what_the_projection_says() {
        let (near, far) = (0.1, 50.0);
        let standard = DepthDecoding::hardware(far / (far - near), -near * far / (far - near));
        let reversed = DepthDecoding::hardware(-near / (far - near), near * far / (far - near));
        let infinite = DepthDecoding::hardware(0.0, near);
        for z in [0.1, 1.0, 7.0, 49.0] {
            let d = far / (far - near) * (1.0 - near / z);
            for (decoding, d) in [(standard, d), (reversed, 1.0 - d), (infinite, near / z)] {
                decoding.check().unwrap();
                let found = decoding.to_metres(d as f32, || [0.0, 0.0]);
                // f32's last digit of d, seen through 1 / (1 - d) at 49 m of 50: a part in ten thousand.
                assert!((found / z - 1.0).abs() < 1e-3, "{z} {found}");
            }
        }
        assert_eq!(infinite.to_metres(0.0, || [0.0, 0.0]), f64::INFINITY);
    }

    #[test]
    fn a_negative_distance_counts_by_its_size() {
        assert_eq!(metres(DepthKind::Planar, -2.0), 2.0);
    }
}
