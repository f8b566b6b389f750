//! Every solver at every size beside a copy; the second paper's sweeps beside exact solvers.

use super::session::{Case, Measured, Run, Session, ms, storage_name};
use crate::speed::cases::{circle, integrators};
use crate::table::Table;
use anyhow::Result;
use pullfocus::diffusion::{Calibration, JacobiStop};
use pullfocus::{Diffusion, Integrator, Plane, Size, Solver};
use pullfocus_gpu::Storage;
use pullfocus_testkit::reference::diffuse;
use pullfocus_testkit::{Grid, scenes};
use rayon::prelude::*;

/// Planes that are diffused together.
pub const PLANES: usize = 4;
/// Largest circles in pixels.
pub const CIRCLES: [f64; 3] = [5.0, 50.0, 500.0];

/// Noise.
pub fn planes(size: Size) -> Vec<Plane> {
    (0..PLANES as u64).map(|seed| scenes::noise(size, 0.0, 1.0, seed)).collect()
}

/// One backward-Euler step.
pub fn one_step(solver: Solver) -> Diffusion {
    Diffusion { integrator: Integrator::BackwardEuler { steps: 1 }, solver, ..Diffusion::default() }
}

fn exact() -> [(&'static str, Solver); 4] {
    [
        ("partitioned (`lu`)", Solver::Lu),
        ("cyclic reduction", Solver::CyclicReduction),
        ("parallel cyclic reduction", Solver::ParallelCyclicReduction),
        ("hybrid of both", Solver::Hybrid),
    ]
}

/// A row of the table.
pub struct Row {
    pub size: Size,
    pub what: String,
    pub partitioned: bool,
    pub storage: Storage,
    pub circle: f64,
    /// Systems of one value for each pixel and plane: two axes, and steps or poles.
    pub unknowns: f64,
    pub run: Measured<Run>,
}

/// All rows, small pictures first.
pub fn measure(session: &mut Session) -> Result<Vec<Row>> {
    let mut rows = vec![];
    for (width, height) in [(256, 256), (512, 512), (1024, 1024), (1920, 1080), (3840, 2160), (7680, 4320)] {
        let size = session.size(width, height);
        if let Err(why) = session.may(size) {
            let row = |why| Row {
                size,
                what: "all".into(),
                partitioned: false,
                storage: Storage::Full,
                circle: 50.0,
                unknowns: 1.0,
                run: Err(why),
            };
            rows.push(row(why));
            continue;
        }
        let planes = planes(size);
        for largest in CIRCLES {
            let circle = circle(size, largest)?;
            for (what, settings, storage) in cases(largest, width) {
                let label = format!("{what} {storage:?}");
                let case =
                    Case { label: &label, planes: &planes, circle: &circle, settings: &settings, storage };
                let mut run = session.diffusion(&case)?;
                // Only their times are wanted, and these are large.
                run.iter_mut().for_each(|run| run.planes.clear());
                let steps = match settings.integrator {
                    Integrator::BackwardEuler { steps } => f64::from(steps),
                    Integrator::Rational(_) => 1.0,
                    Integrator::Disc => 2.0,
                };
                rows.push(Row {
                    size,
                    partitioned: settings.solver == Solver::Lu,
                    what,
                    storage,
                    circle: largest,
                    unknowns: 2.0 * steps * (PLANES * size.area()) as f64,
                    run,
                });
            }
        }
    }
    Ok(rows)
}

/// What is timed with circles of up to `largest` at a width.
fn cases(largest: f64, width: usize) -> Vec<(String, Diffusion, Storage)> {
    let mut cases = vec![];
    for (name, solver) in exact() {
        // The largest pictures take long to bring there.
        if solver == Solver::Lu || largest == 50.0 || width < 7680 {
            cases.push((name.to_owned(), one_step(solver), Storage::Full));
        }
        if solver == Solver::Lu {
            cases.push((name.to_owned(), one_step(solver), Storage::Half));
        }
    }
    if largest == 50.0 || width < 7680 {
        let sweeps = Solver::Jacobi(JacobiStop::Sweeps(50));
        cases.push(("Jacobi, 50 sweeps an axis".into(), one_step(sweeps), Storage::Full));
    }
    if largest == 50.0 {
        let three = Diffusion { integrator: Integrator::BackwardEuler { steps: 3 }, ..Diffusion::default() };
        let [_, rational, disc] = integrators();
        for (name, settings) in [("backward Euler, 3 steps", three), rational, disc] {
            for storage in [Storage::Full, Storage::Half] {
                cases.push((format!("partitioned, {name}"), settings, storage));
            }
        }
    }
    cases
}

/// Whether a row is the partitioned solver's one step.
pub fn is_one_step(row: &Row) -> bool {
    row.partitioned && row.what == exact()[0].0
}

/// The largest ratio to the copy of the partitioned solver's one step, of pictures from 1920 x 1080 on.
pub fn worst_ratio(rows: &[Row]) -> Option<f64> {
    let large = rows.iter().filter(|row| is_one_step(row) && row.size.area() >= 1920 * 1080);
    large.filter_map(|row| row.run.as_ref().ok()).map(|run| run.seconds / run.copy).reduce(f64::max)
}

/// The section.
pub fn section(rows: &[Row]) -> String {
    let mut table = Table::new([
        "picture",
        "solver",
        "storage",
        "largest circle, px",
        "ms",
        "ns per unknown",
        "copy of the same bytes, ms",
        "times the copy",
        "GB/s",
    ]);
    for row in rows {
        let cells = match &row.run {
            Ok(run) => [
                ms(run.seconds),
                format!("{:.4}", run.seconds * 1e9 / row.unknowns),
                ms(run.copy),
                format!("{:.2}", run.seconds / run.copy),
                format!("{:.1}", run.bytes as f64 / run.seconds / 1e9),
            ],
            Err(why) => [why.clone(), String::new(), String::new(), String::new(), String::new()],
        };
        let storage = storage_name(row.storage).to_owned();
        let head = [row.size.to_string(), row.what.clone(), storage, row.circle.to_string()];
        table.row(head.into_iter().chain(cells));
    }
    format!(
        "## Solvers\n\nFour planes, both axes, one backward-Euler step where nothing else is said. An unknown is one value of one plane in one system:\n\
         two for each pixel, plane and step or pair of poles. *Bytes* are those that must be read and written at least: for each axis and step every\n\
         plane once in and once out, and the circles; the disc has four fields between its axes. The copy, by a kernel on the same device in the\n\
         same run, reads half as many and writes half as many. Small pictures stay in the device's cache, the copy's buffers less so. The papers'\n\
         three-layer picture of 1024 x 768 is among the frames below.\n\n{}\n",
        table.to_markdown()
    )
}

/// A row of the sweeps' table.
pub struct Sweeps {
    pub what: String,
    pub theirs: &'static str,
    pub seconds: Measured<f64>,
    /// Largest and mean error in parts of the largest value, by the second paper's calibration and by variance.
    pub errors: [[f64; 2]; 2],
}

/// The second paper's table 3.1: its counts, then the exact solvers.
pub fn measure_sweeps(session: &mut Session) -> Result<(Size, Vec<Sweeps>)> {
    let sizes = [(1920, 1080), (1024, 768), (512, 512), (256, 256)].map(|(w, h)| session.size(w, h));
    // A software device would take minutes for a thousand sweeps of a large one.
    let fits = |size: &Size| session.may(*size).is_ok() && (!session.software || size.area() <= 256 * 256);
    let size = sizes.into_iter().find(fits).unwrap_or(sizes[3]);
    let planes = planes(size);
    let circle = circle(size, 50.0)?;
    let jacobi = |sweeps| Solver::Jacobi(JacobiStop::Sweeps(sweeps));
    let theirs = [(50, "0.028"), (100, "0.055"), (200, "0.221"), (1000, "0.600")];
    let mut cases: Vec<(String, Solver, &'static str)> = theirs
        .into_iter()
        .map(|(n, time)| (format!("Jacobi, {n} sweeps an axis"), jacobi(n), time))
        .collect();
    cases.extend(exact().map(|(name, solver)| (name.to_owned(), solver, "")));
    let calibrations = [Calibration::Beck, Calibration::Variance];
    let references = calibrations.map(|calibration| {
        let settings = Diffusion { calibration, ..one_step(Solver::Lu) };
        references(&planes, &circle, &settings)
    });
    let mut rows = vec![];
    for (what, solver, theirs) in cases {
        let mut errors = [[0.0; 2]; 2];
        let mut seconds = Err(String::new());
        for (i, calibration) in calibrations.into_iter().enumerate() {
            let settings = Diffusion { calibration, ..one_step(solver) };
            let label = format!("{what} sweeps");
            let storage = Storage::Full;
            let case = Case { label: &label, planes: &planes, circle: &circle, settings: &settings, storage };
            let run = session.diffusion(&case)?;
            if let Ok(run) = &run {
                errors[i] = from_exact(&run.planes, &references[i]);
            }
            seconds = run.map(|run| run.seconds);
        }
        rows.push(Sweeps { what, theirs, seconds, errors });
    }
    Ok((size, rows))
}

fn references(planes: &[Plane], circle: &Plane, settings: &Diffusion) -> Vec<Grid> {
    let circle = Grid::from_plane(circle);
    planes.par_iter().map(|plane| diffuse(&Grid::from_plane(plane), &circle, None, 1.0, settings)).collect()
}

/// Largest and mean error in parts of the largest value.
fn from_exact(planes: &[Plane], exact: &[Grid]) -> [f64; 2] {
    let top = exact.iter().map(Grid::largest).fold(f64::MIN_POSITIVE, f64::max);
    let largest = planes.iter().zip(exact).map(|(plane, grid)| grid.distance_to(plane)).fold(0.0, f64::max);
    let values = planes.iter().zip(exact).flat_map(|(plane, grid)| plane.data().iter().zip(&grid.data));
    let (sum, count) = values.fold((0.0, 0), |(sum, n), (&a, b)| (sum + (f64::from(a) - b).abs(), n + 1));
    [largest / top, sum / f64::from(count.max(1)) / top]
}

/// The section of the sweeps.
pub fn sweeps_section(size: Size, rows: &[Sweeps]) -> String {
    let mut table = Table::new([
        "solver",
        "second paper (GTX 660), s",
        "here, s",
        "its calibration: largest error",
        "mean",
        "calibrated by variance: largest error",
        "mean",
    ]);
    for row in rows {
        let time = match &row.seconds {
            Ok(seconds) => format!("{seconds:.6}"),
            Err(why) => why.clone(),
        };
        let errors = row
            .errors
            .iter()
            .flatten()
            .map(|e| if row.seconds.is_ok() { format!("{e:.1e}") } else { String::new() });
        table.row([row.what.clone(), row.theirs.to_owned(), time].into_iter().chain(errors));
    }
    format!(
        "## Jacobi's sweeps (the second paper's table 3.1)\n\n{size}, four planes, circles up to 50 px, one backward-Euler step, f32. The paper states neither its\n\
         picture's size nor its circles, nor whether it counts both axes; here a count is the sweeps along each axis. Errors are from the exact\n\
         solution in f64, in parts of its largest value; the first sweep starts at the picture, which is noise.\n\n{}\n",
        table.to_markdown()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(size: Size, what: &str, run: Measured<Run>) -> Row {
        let (partitioned, storage) = (true, Storage::Full);
        Row { size, what: what.into(), partitioned, storage, circle: 5.0, unknowns: 1e6, run }
    }

    fn run(seconds: f64) -> Measured<Run> {
        Ok(Run { seconds, bytes: 1_000_000_000, copy: 0.001, planes: vec![] })
    }

    #[test]
    fn the_table_has_times_and_what_did_not_fit() {
        let hd = Size::new(1920, 1080);
        let one = exact()[0].0;
        let rows = [
            row(Size::new(256, 256), one, run(0.009)),
            row(hd, one, run(0.0013)),
            row(hd, one, run(0.0012)),
            row(hd, "partitioned, disc", run(0.005)),
            row(Size::new(7680, 4320), one, Err("did not fit: x".into())),
        ];
        let text = section(&rows);
        assert!(text.contains("| f32 | 5 | 1.30 | 1.3000 | 1.00 | 1.30 | 769.2 |"), "{text}");
        assert!(text.contains("did not fit: x"), "{text}");
        // Neither small pictures nor other integrators count.
        assert_eq!(worst_ratio(&rows), Some(0.0013 / 0.001));
        assert_eq!(worst_ratio(&rows[..1]), None);
    }

    #[test]
    fn every_solver_is_timed_at_every_size() {
        for (largest, width) in [(5.0, 256), (50.0, 7680)] {
            let names: Vec<String> = cases(largest, width).into_iter().map(|(name, ..)| name).collect();
            for (name, _) in exact() {
                assert!(names.iter().any(|n| n == name), "{name} at {width}");
            }
            assert!(names.iter().any(|n| n.contains("Jacobi")));
        }
    }

    #[test]
    fn errors_are_parts_of_the_largest_value() {
        let size = Size::new(4, 1);
        let plane = scenes::plane(size, |x, _| [2.0, 1.0, 0.0, 0.5][x]);
        let exact = Grid::from_fn(4, 1, |x, _| [2.0, 1.0, 0.0, 0.0][x]);
        assert_eq!(from_exact(&[plane], &[exact]), [0.25, 0.0625]);
        let sweeps = Sweeps { what: "a".into(), theirs: "0.1", seconds: Ok(0.5), errors: [[0.25, 0.1]; 2] };
        let text = sweeps_section(size, &[sweeps]);
        assert!(text.contains("| a | 0.1 | 0.500000 | 2.5e-1 | 1.0e-1 |"), "{text}");
    }
}
