//! What every backend has to do, as tests written once.
//!
//! A backend implements [`DiffusionSubject`] and [`RenderSubject`] (closures do) and puts into its own tests:
//!
//! ```ignore
//! pullfocus_testkit::diffusion_conformance!(Diffuser::new());
//! pullfocus_testkit::render_conformance!(Renderer::new());
//! ```
//!
//! Each check becomes one `#[test]`. A harness that makes its tests at run time takes the same checks as values:
//!
//! ```ignore
//! for (name, check) in pullfocus_testkit::diffusion_checks!(Diffuser) {
//!     tests.push(Trial::test(name, move || Ok(check(&mut Diffuser::new()))));
//! }
//! ```
//!
//! Which invariant holds for which method:
//!
//! | method | constants | energy (sum of gamma y) | stays within the input's range | zero blur keeps every bit |
//! |---|---|---|---|---|
//! | backward Euler, an exact solver | yes | yes | yes | yes |
//! | rational or disc, an exact solver | yes | yes | no: a lobe of some -0.003 of a bright point | yes |
//! | Jacobi, few sweeps | yes | no | yes with backward Euler | yes |
//! | layers (background, general) | yes | no: they are blended or composited | backward Euler | yes |
//! | foreground with behind | yes (same colour on both) | the foreground's coverage | backward Euler | yes |
//! | naive, square, pyramid, before the division by the weight | no | yes | no | yes |
//! | gather, before the division | yes, away from borders | no | yes, away from borders | yes |
//! | tensor, before the division | no | where every pixel is a site; elsewhere nearly, where the blur is even | no | yes |
//! | every spreading method, divided | yes, to the bit | no | yes | yes |
//! | highlights | no: they are divided by nothing | yes, with gain 1 and without a cat's eye | no | yes |

pub mod bokeh;
mod compare;
pub mod diffusion;
mod foreground;
pub mod render;
pub mod show;

pub use compare::compare_pictures;

use pullfocus_core::{Camera, Cancel, Diffusion, Method, Plane, Report, Result, Scene, Settings};

/// What one diffusion gets beside its planes.
#[derive(Debug, Clone, Copy)]
pub struct Medium<'a> {
    /// Signed diameters in pixels of width.
    pub diameter: &'a Plane,
    /// Specific heat; 1 where none is given.
    pub gamma: Option<&'a Plane>,
    /// A column's diameters in parts of a row's.
    pub vertical_scale: f32,
}

impl<'a> Medium<'a> {
    /// Specific heat 1 and square pixels.
    pub fn plain(diameter: &'a Plane) -> Self {
        Self { diameter, gamma: None, vertical_scale: 1.0 }
    }
}

/// A backend's diffusion.
pub trait DiffusionSubject {
    /// Diffuses `planes` in place.
    ///
    /// # Errors
    /// What the backend refuses; [`pullfocus_core::Error::Cancelled`].
    fn diffuse(
        &mut self,
        planes: &mut [Plane],
        medium: Medium<'_>,
        settings: &Diffusion,
        cancel: &Cancel,
    ) -> Result<()>;
}

impl<F> DiffusionSubject for F
where
    F: FnMut(&mut [Plane], Medium<'_>, &Diffusion, &Cancel) -> Result<()>,
{
    fn diffuse(
        &mut self,
        planes: &mut [Plane],
        medium: Medium<'_>,
        settings: &Diffusion,
        cancel: &Cancel,
    ) -> Result<()> {
        self(planes, medium, settings, cancel)
    }
}

/// A backend's whole pipeline.
pub trait RenderSubject {
    /// The methods that it has; the checks run with each of them. Diffusion alone, if a backend says nothing.
    fn methods(&self) -> &'static [Method] {
        &[Method::Diffusion]
    }

    /// Replaces `scene.base.picture` by the picture through the lens.
    ///
    /// # Errors
    /// What the backend refuses; [`pullfocus_core::Error::Cancelled`].
    fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report>;
}

impl<F> RenderSubject for F
where
    F: FnMut(&mut Scene, Option<&Camera>, &Settings, &Cancel) -> Result<Report>,
{
    fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        self(scene, camera, settings, cancel)
    }
}

/// The bits of a plane, which are equal where `==` on f32 is not (NaN) and differ where it is (-0).
pub(crate) fn bits(plane: &Plane) -> Vec<u32> {
    plane.data().iter().map(|v| v.to_bits()).collect()
}

/// Runs `work` in a rayon pool of its own with that many threads.
pub(crate) fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads for a test").install(work)
}

/// One `#[test]` per check of a diffusion; the argument makes a fresh [`DiffusionSubject`].
#[macro_export]
macro_rules! diffusion_conformance {
    ($subject:expr) => {
        $crate::diffusion_list!(conformance_tests, $subject);
    };
}

/// One `#[test]` per check of a whole render; the argument makes a fresh [`RenderSubject`].
#[macro_export]
macro_rules! render_conformance {
    ($subject:expr) => {
        $crate::render_list!(conformance_tests, $subject);
    };
}

/// One `#[test]` per check of highlights; the argument makes a fresh [`RenderSubject`].
#[macro_export]
macro_rules! bokeh_conformance {
    ($subject:expr) => {
        $crate::bokeh_list!(conformance_tests, $subject);
    };
}

/// One `#[test]` per check of layers shown alone; the argument makes a fresh [`RenderSubject`].
#[macro_export]
macro_rules! show_conformance {
    ($subject:expr) => {
        $crate::show_list!(conformance_tests, $subject);
    };
}

/// The checks of layers shown alone by name, `Vec<(&'static str, fn(&mut S))>` for a [`RenderSubject`] S: for tests that are
/// made at run time.
#[macro_export]
macro_rules! show_checks {
    ($subject:ty) => {
        $crate::show_list!(conformance_checks, $subject)
    };
}

/// The checks of highlights by name, `Vec<(&'static str, fn(&mut S))>` for a [`RenderSubject`] S: for tests that are made
/// at run time.
#[macro_export]
macro_rules! bokeh_checks {
    ($subject:ty) => {
        $crate::bokeh_list!(conformance_checks, $subject)
    };
}

/// The checks of a diffusion by name, `Vec<(&'static str, fn(&mut S))>` for a [`DiffusionSubject`] S: for tests that are
/// made at run time.
#[macro_export]
macro_rules! diffusion_checks {
    ($subject:ty) => {
        $crate::diffusion_list!(conformance_checks, $subject)
    };
}

/// The checks of a whole render by name, `Vec<(&'static str, fn(&mut S))>` for a [`RenderSubject`] S: for tests that are
/// made at run time.
#[macro_export]
macro_rules! render_checks {
    ($subject:ty) => {
        $crate::render_list!(conformance_checks, $subject)
    };
}

/// Every check of a diffusion, handed to another macro with that macro's own argument.
#[doc(hidden)]
#[macro_export]
macro_rules! diffusion_list {
    ($to:ident, $subject:tt) => {
        $crate::$to! { $subject, diffusion:
            matches_the_f64_reference, matches_f64_jacobi_sweep_by_sweep, jacobi_reaches_its_tolerance,
            every_small_size_matches, long_lines_with_large_circles_stay_exact, constants_are_kept,
            heat_is_kept, one_axis_is_self_adjoint, mirrored_in_mirrored_out, has_the_variance_of_the_disc,
            stays_within_the_range, zero_blur_keeps_every_bit, pixels_in_focus_keep_every_bit,
            holes_without_heat_are_filled, large_values_stay_finite, planes_do_not_mix,
            any_number_of_threads_gives_the_same_bytes, a_second_run_gives_the_same_bytes,
            a_raised_flag_cancels, a_run_is_cancelled_from_outside, odd_settings_are_refused
        }
    };
}

/// Every check of a whole render, handed to another macro with that macro's own argument.
#[doc(hidden)]
#[macro_export]
macro_rules! render_list {
    ($to:ident, $subject:tt) => {
        $crate::$to! { $subject, render:
            a_pinhole_keeps_every_bit, one_layer_matches_the_f64_reference, constants_are_kept,
            empty_pixels_stay_empty, numbers_that_are_none_follow_the_rule, any_depth_gives_numbers,
            every_small_size_renders, a_mirrored_scene_gives_the_mirrored_picture, foreground_light_is_kept,
            the_lens_says_what_is_in_front, emission_is_blurred_too,
            one_thing_keeps_its_light, bright_lights_leave_nothing_negative,
            a_near_edge_is_soft_over_a_sharp_one, a_sliver_between_two_things_is_blurred, a_focus_pull_has_no_jumps, alpha_goes_through_the_same_lens,
            further_planes_do_not_change_the_others, any_number_of_threads_gives_the_same_bytes,
            a_second_run_gives_the_same_bytes, a_raised_flag_cancels, a_run_is_cancelled_from_outside,
            what_does_not_fit_is_refused
        }
    };
}

/// Every check of highlights, handed to another macro with that macro's own argument.
#[doc(hidden)]
#[macro_export]
macro_rules! bokeh_list {
    ($to:ident, $subject:tt) => {
        $crate::$to! { $subject, bokeh:
            no_highlights_change_nothing, a_light_alone_is_a_disc, light_keeps_the_order_of_depth,
            a_foreground_s_light_lies_over_all, a_focus_pull_over_lights_has_no_jumps, a_fading_light_has_no_jumps,
            every_scene_gives_numbers, lights_give_the_same_bytes_again, a_flag_stops_the_lights
        }
    };
}

/// Every check of layers shown alone, handed to another macro with that macro's own argument.
#[doc(hidden)]
#[macro_export]
macro_rules! show_list {
    ($to:ident, $subject:tt) => {
        $crate::$to! { $subject, show:
            shown_layers_make_up_the_result, small_pictures_have_layers, a_picture_in_focus_is_one_layer,
            lights_come_with_their_layer
        }
    };
}

/// A list as tests.
#[doc(hidden)]
#[macro_export]
macro_rules! conformance_tests {
    ($subject:expr, $module:ident: $($check:ident),* $(,)?) => {
        mod $module {
            use super::*;
            $(#[test]
            fn $check() {
                $crate::conformance::$module::$check(&mut $subject);
            })*
        }
    };
}

/// A list as values.
#[doc(hidden)]
#[macro_export]
macro_rules! conformance_checks {
    ($subject:ty, $module:ident: $($check:ident),* $(,)?) => {
        ::std::vec![$((
            ::std::stringify!($check),
            $crate::conformance::$module::$check as fn(&mut $subject),
        )),*]
    };
}
