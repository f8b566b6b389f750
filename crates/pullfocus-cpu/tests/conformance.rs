//! The CPU passes what every backend has to pass.

use pullfocus_core::{Camera, Cancel, Diffusion, Method, Plane, Report, Result, Scene, Settings};
use pullfocus_cpu::Renderer;
use pullfocus_cpu::diffusion::{Conductivity, DiffusionBuffers, Medium, diffuse};
use pullfocus_testkit::conformance::{self, RenderSubject};

/// The diffusion with its buffers, kept from call to call.
fn diffuser() -> impl FnMut(&mut [Plane], conformance::Medium<'_>, &Diffusion, &Cancel) -> Result<()> + Send {
    let mut buffers = DiffusionBuffers::new();
    move |planes: &mut [Plane], medium: conformance::Medium<'_>, settings: &Diffusion, cancel: &Cancel| {
        let mut planes: Vec<&mut Plane> = planes.iter_mut().collect();
        let medium = Medium {
            conductivity: Conductivity::Circle(medium.diameter),
            gamma: medium.gamma,
            vertical_scale: medium.vertical_scale,
        };
        diffuse(&mut planes, &medium, settings, false, &mut buffers, cancel)
    }
}

/// The whole pipeline with its buffers, and every method.
#[derive(Default)]
struct Whole(Renderer);

impl RenderSubject for Whole {
    fn methods(&self) -> &'static [Method] {
        &Method::ALL
    }

    fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        self.0.render(scene, camera, settings, cancel)
    }
}

pullfocus_testkit::diffusion_conformance!(diffuser());
pullfocus_testkit::render_conformance!(Whole::default());
pullfocus_testkit::bokeh_conformance!(Whole::default());
pullfocus_testkit::show_conformance!(Whole::default());
