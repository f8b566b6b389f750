//! Lines longer than pictures usually are, and ways to cut them.

use crate::device::with_host;
use pullfocus_core::diffusion::Solver;
use pullfocus_core::response::Rational;
use pullfocus_core::{Cancel, Diffusion, Integrator, Layering, Plane, Preset, Settings, Size};
use pullfocus_gpu::{Context, Host, Tuning};
use pullfocus_testkit::conformance::diffusion::exact;
use pullfocus_testkit::{Grid, reference, scenes};

/// Name and test.
pub fn tests() -> Vec<(&'static str, fn())> {
    vec![
        ("rows_and_columns_of_8k_and_more_are_exact", rows_and_columns_of_8k_and_more_are_exact),
        ("any_cut_gives_the_same_up_to_rounding", any_cut_gives_the_same_up_to_rounding),
        ("loops_written_out_give_the_same", loops_written_out_give_the_same),
    ]
}

/// One for each kind of system.
const INTEGRATORS: [Integrator; 3] =
    [Integrator::BackwardEuler { steps: 1 }, Integrator::Rational(Rational::GAUSSIAN), Integrator::Disc];

fn diffused(host: &mut Host, planes: &[Plane], circle: &Plane, settings: &Diffusion) -> Vec<Plane> {
    let mut planes = planes.to_vec();
    host.diffuse(&mut planes, (circle, None, 1.0), settings, &Cancel::new()).expect("it diffuses");
    planes
}

fn rows_and_columns_of_8k_and_more_are_exact() {
    for size in [Size::new(8192, 3), Size::new(3, 8200), Size::new(16384, 2)] {
        let planes = [scenes::noise(size, 0.0, 1.0, 1), scenes::checker(size, 300)];
        // From sharp to 900 px and back, many times.
        let circle = scenes::plane(size, |x, y| ((x.max(y) % 2000) as f32 - 1000.0).abs() * 0.9);
        for integrator in INTEGRATORS {
            for solver in [Solver::Lu, Solver::Hybrid] {
                let settings = Diffusion { integrator, solver, ..Diffusion::default() };
                let found = with_host(|host| diffused(host, &planes, &circle, &settings));
                for (before, after) in planes.iter().zip(&found) {
                    let (x, c) = (Grid::from_plane(before), Grid::from_plane(&circle));
                    let expected = reference::diffuse(&x, &c, None, 1.0, &settings);
                    let error = expected.distance_to(after) / x.largest();
                    // As for lines of 1920 in the suite: four times one solver's bound.
                    assert!(error <= 4.0 * exact(&settings), "{size} {settings:?} errs by {error:e}");
                }
            }
        }
    }
}

fn any_cut_gives_the_same_up_to_rounding() {
    let size = Size::new(203, 151);
    let planes: Vec<Plane> = (0..5).map(|seed| scenes::noise(size, 0.0, 1.0, seed)).collect();
    let circle = scenes::plane(size, |x, y| ((x / 20 + y / 15) % 5) as f32 * 4.0);
    for integrator in INTEGRATORS {
        let settings = Diffusion { integrator, ..Diffusion::default() };
        with_host(|host| {
            let expected = diffused(host, &planes, &circle, &settings);
            for (chunk, threads, columns) in [(4, 64, 1), (20, 128, 8)] {
                let tuning =
                    Tuning { chunk_real: chunk, chunk_complex: chunk, threads, columns, ..Tuning::default() };
                host.set_tuning(tuning);
                let found = diffused(host, &planes, &circle, &settings);
                host.set_tuning(Tuning::default());
                for (a, b) in expected.iter().zip(&found) {
                    let error = Grid::from_plane(a).distance_to(b);
                    // Both are within the bound of the solution.
                    assert!(error <= 2.0 * exact(&settings), "{tuning:?} {settings:?}: {error:e}");
                }
            }
        });
    }
}

/// What real GPUs get, on whatever is here.
fn loops_written_out_give_the_same() {
    let (device, queue) = with_host(|host| (host.context().device().clone(), host.context().queue().clone()));
    let [mut plain, mut written] = [false, true]
        .map(|loops| Host::with_context(Context::with_loops(&device, &queue, loops)).expect("a host"));
    let scene = scenes::fence_over_ramp(Size::new(101, 67), -9.0, 14.0);
    let general = Settings { layering: Layering::General { layers: 3 }, ..Settings::default() };
    for settings in [Settings::preset(Preset::Preview), general] {
        let render = |host: &mut Host| {
            let mut scene = scene.clone();
            host.render(&mut scene, None, &settings, &Cancel::new()).expect("it renders");
            scene.base.picture
        };
        let (a, b) = (render(&mut plain), render(&mut written));
        for (a, b) in a.planes().zip(b.planes()) {
            let error = Grid::from_plane(a).distance_to(b);
            // The same operations; a compiler may fuse others into one rounding.
            assert!(error <= 2.0 * exact(&settings.diffusion), "{settings:?}: {error:e}");
        }
    }
}
