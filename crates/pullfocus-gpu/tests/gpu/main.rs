//! What needs a device: run where there is one, ignored where there is none.
//!
//! `PULLFOCUS_TEST_ADAPTER=NAME` picks an adapter, a software one too; without it the first is taken, best first. With
//! `PULLFOCUS_TEST_GPU=required` no adapter is a failure.

mod device;
mod embed;
mod layers;
mod lines;
mod spreading;

use libtest_mimic::{Arguments, Trial};
use pullfocus_core::{Camera, Cancel, Diffusion, Method, Plane, Report, Result, Scene, Settings};
use pullfocus_testkit::conformance::{DiffusionSubject, Medium, RenderSubject};
use std::sync::{PoisonError, RwLock};

/// All tests share one device: one that measures how soon it stops runs while no other has it.
static COMPANY: RwLock<()> = RwLock::new(());
const ALONE: [&str; 3] =
    ["a_run_is_cancelled", "a_flag_stops_the_lights", "a_long_draw_hears_a_wish_to_stop"];

/// The device as a backend.
struct Subject;

impl DiffusionSubject for Subject {
    fn diffuse(
        &mut self,
        planes: &mut [Plane],
        medium: Medium<'_>,
        settings: &Diffusion,
        cancel: &Cancel,
    ) -> Result<()> {
        let Medium { diameter, gamma, vertical_scale } = medium;
        device::with_host(|host| host.diffuse(planes, (diameter, gamma, vertical_scale), settings, cancel))
    }
}

impl RenderSubject for Subject {
    fn methods(&self) -> &'static [Method] {
        &[Method::Diffusion, Method::Aperture]
    }

    fn render(
        &mut self,
        scene: &mut Scene,
        camera: Option<&Camera>,
        settings: &Settings,
        cancel: &Cancel,
    ) -> Result<Report> {
        device::with_host(|host| host.render(scene, camera, settings, cancel))
    }
}

fn main() {
    let arguments = Arguments::from_args();
    let there = device::there();
    let mut trials = Vec::new();
    let mut add = |name: String, test: Box<dyn FnOnce() + Send>| {
        let alone = ALONE.iter().any(|part| name.contains(part));
        let run = move || {
            let _company = (!alone).then(|| COMPANY.read().unwrap_or_else(PoisonError::into_inner));
            let _solitude = alone.then(|| COMPANY.write().unwrap_or_else(PoisonError::into_inner));
            test();
            Ok(())
        };
        trials.push(Trial::test(name, run).with_ignored_flag(!there));
    };
    for (name, check) in pullfocus_testkit::diffusion_checks!(Subject) {
        add(format!("diffusion::{name}"), Box::new(move || check(&mut Subject)));
    }
    for (name, check) in pullfocus_testkit::render_checks!(Subject) {
        add(format!("render::{name}"), Box::new(move || check(&mut Subject)));
    }
    for (name, check) in pullfocus_testkit::bokeh_checks!(Subject) {
        add(format!("bokeh::{name}"), Box::new(move || check(&mut Subject)));
    }
    for (name, check) in pullfocus_testkit::show_checks!(Subject) {
        add(format!("show::{name}"), Box::new(move || check(&mut Subject)));
    }
    for (name, test) in embed::tests() {
        add(format!("embed::{name}"), Box::new(test));
    }
    for (name, test) in layers::tests() {
        add(format!("layers::{name}"), Box::new(test));
    }
    for (name, test) in lines::tests() {
        add(format!("lines::{name}"), Box::new(test));
    }
    for (name, test) in spreading::tests() {
        add(format!("spreading::{name}"), Box::new(test));
    }
    let conclusion = libtest_mimic::run(&arguments, trials);
    let complaints = device::complaints();
    if !complaints.is_empty() {
        eprintln!("the device's layers complained {} times; first: {}", complaints.len(), complaints[0]);
        std::process::exit(101);
    }
    conclusion.exit();
}
