//! The diffusion of a picture: rows, then columns, as often as the integrator says.

use super::line::{Line, Method};
use crate::grid::Grid;
use num_complex::Complex64;
use pullfocus_core::diffusion::{Diffusion, Integrator, JACOBI_MOST_SWEEPS, JacobiStop, Solver};
use pullfocus_core::response::DiscResponse;

/// Conductivities between the pixels of one line, from diameters in pixels: `factor * min(|c_i|, |c_{i+1}|)^2` (first
/// paper, end of section 3: the smaller of the link's two diameters).
pub fn links(diameters: &[f64], factor: f64) -> Vec<f64> {
    diameters.windows(2).map(|pair| factor * pair[0].abs().min(pair[1].abs()).powi(2)).collect()
}

/// The solver of the settings as a [`Method`].
pub fn method(solver: Solver) -> Method {
    match solver {
        Solver::Lu => Method::Lu,
        Solver::CyclicReduction => Method::CyclicReduction,
        Solver::ParallelCyclicReduction => Method::ParallelCyclicReduction,
        Solver::Hybrid => Method::Hybrid,
        Solver::Jacobi(JacobiStop::Sweeps(count)) => Method::Jacobi(count),
        Solver::Jacobi(JacobiStop::Tolerance(t)) => Method::JacobiUntil(f64::from(t), JACOBI_MOST_SWEEPS),
    }
}

/// Diffuses `x`. `diameter` holds signed diameters in pixels of width, `gamma` the specific heat (1 where none is
/// given); a column's diameters are `vertical_scale` times as large (pixels that are not square).
pub fn diffuse(
    x: &Grid,
    diameter: &Grid,
    gamma: Option<&Grid>,
    vertical_scale: f64,
    settings: &Diffusion,
) -> Grid {
    let beta = settings.calibration;
    diffuse_between(x, gamma, settings, |across, i| {
        let (line, scale) =
            if across { (diameter.row(i), 1.0) } else { (diameter.column(i), vertical_scale) };
        links(&line, f64::from(beta.factor()) * scale * scale)
    })
}

/// Diffuses `x` with the same conductivity on every link (first paper, 3.1: the diameters' own diffusion).
pub fn diffuse_evenly(x: &Grid, beta: f64, gamma: Option<&Grid>, settings: &Diffusion) -> Grid {
    let (width, height) = (x.width, x.height);
    diffuse_between(x, gamma, settings, |across, _| vec![beta; if across { width } else { height } - 1])
}

/// # Panics
/// If the rational integrator has no pair of complex poles.
fn diffuse_between(
    x: &Grid,
    gamma: Option<&Grid>,
    settings: &Diffusion,
    conductivity: impl Fn(bool, usize) -> Vec<f64>,
) -> Grid {
    let ones = Grid::filled(x.width, x.height, 1.0);
    let gamma = gamma.unwrap_or(&ones);
    let method = method(settings.solver);
    let row = |y: usize, share: f64| Line {
        gamma: gamma.row(y),
        beta: conductivity(true, y).iter().map(|b| b / share).collect(),
    };
    let column = |x: usize, share: f64| Line {
        gamma: gamma.column(x),
        beta: conductivity(false, x).iter().map(|b| b / share).collect(),
    };
    match settings.integrator {
        Integrator::BackwardEuler { steps } => (0..steps).fold(x.clone(), |y, _| {
            let share = f64::from(steps);
            let y = y.by_rows(|i, line| row(i, share).step(line, method));
            y.by_columns(|i, line| column(i, share).step(line, method))
        }),
        Integrator::Rational(rational) => {
            let pole = rational.pole().expect("a pair of complex poles");
            let y = x.by_rows(|i, line| row(i, 1.0).rational(line, pole, method));
            y.by_columns(|i, line| column(i, 1.0).rational(line, pole, method))
        }
        Integrator::Disc => disc(x, &|i| row(i, 1.0), &|i| column(i, 1.0), method),
    }
}

/// The response of both axes, term by term: `u_i = (K_x - p_i Gamma)^-1 Gamma x` along the rows, then along the columns
/// `y = 2 Re sum_j (K_y - p_j Gamma)^-1 Gamma sum_i (A_ij u_i + B_ij conj(u_i))`.
fn disc(x: &Grid, row: &dyn Fn(usize) -> Line, column: &dyn Fn(usize) -> Line, method: Method) -> Grid {
    let response = DiscResponse::LENS;
    let complex = |[re, im]: [f64; 2]| Complex64::new(re, im);
    let fields: Vec<Vec<Complex64>> = response
        .poles
        .iter()
        .map(|&pole| {
            let lines = (0..x.height).flat_map(|y| {
                let line: Vec<_> = x.row(y).iter().map(|&v| Complex64::from(v)).collect();
                row(y).resolvent(&line, complex(pole), method)
            });
            lines.collect()
        })
        .collect();
    let mut sum = Grid::filled(x.width, x.height, 0.0);
    for (j, &pole) in response.poles.iter().enumerate() {
        for cx in 0..x.width {
            let mixed: Vec<Complex64> = (0..x.height)
                .map(|y| {
                    let terms = fields.iter().enumerate().map(|(i, u)| {
                        let u = u[y * x.width + cx];
                        complex(response.a[i][j]) * u + complex(response.b[i][j]) * u.conj()
                    });
                    terms.sum()
                })
                .collect();
            for (y, z) in column(cx).resolvent(&mixed, complex(pole), method).into_iter().enumerate() {
                sum.data[y * x.width + cx] += 2.0 * z.re;
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::diffusion::Calibration;
    use pullfocus_core::response::Rational;

    fn settings(integrator: Integrator) -> Diffusion {
        Diffusion { integrator, ..Diffusion::default() }
    }

    /// Mass, variance across and variance down of a picture's values around its centre.
    fn moments(grid: &Grid) -> [f64; 3] {
        let (cx, cy) = ((grid.width / 2) as f64, (grid.height / 2) as f64);
        let mut moments = [0.0; 3];
        for y in 0..grid.height {
            for x in 0..grid.width {
                let v = grid.at(x, y);
                moments[0] += v;
                moments[1] += v * (x as f64 - cx).powi(2);
                moments[2] += v * (y as f64 - cy).powi(2);
            }
        }
        moments
    }

    #[test]
    fn every_integrator_has_the_disc_s_variance() {
        let (n, c) = (241, 12.0);
        let point = Grid::from_fn(n, n, |x, y| f64::from(u8::from((x, y) == (n / 2, n / 2))));
        let diameter = Grid::filled(n, n, -c);
        for integrator in [
            Integrator::BackwardEuler { steps: 1 },
            Integrator::BackwardEuler { steps: 4 },
            Integrator::Rational(Rational::GAUSSIAN),
            Integrator::Disc,
        ] {
            let [mass, across, down] = moments(&diffuse(&point, &diameter, None, 0.5, &settings(integrator)));
            // c^2 / 16; half the diameter along the columns. The borders lie 40 decay lengths away; the disc's printed
            // coefficients are good to 1e-9 of its variance and more.
            assert!((mass - 1.0).abs() < 1e-12, "{integrator:?}: {mass}");
            assert!((across - c * c / 16.0).abs() < 1e-7, "{integrator:?}: {across}");
            assert!((down - c * c / 64.0).abs() < 1e-7, "{integrator:?}: {down}");
        }
    }

    #[test]
    fn a_step_s_response_is_the_paper_s_equation_8() {
        // Cosines are the eigenvectors of an insulated line: x = cos(w (i + 1/2)) is scaled by
        // 1 / (1 + beta (2 sin(w/2))^2), equation 8 with the differences' own omega.
        let (n, c): (usize, f64) = (64, 6.0);
        let w = std::f64::consts::PI * 5.0 / n as f64;
        let x = Grid::from_fn(n, 1, |i, _| (w * (i as f64 + 0.5)).cos());
        let letter = Diffusion {
            calibration: Calibration::Kass,
            integrator: Integrator::BackwardEuler { steps: 1 },
            solver: Solver::Lu,
        };
        let y = diffuse(&x, &Grid::filled(n, 1, c), None, 1.0, &letter);
        let gain = 1.0 / (1.0 + c * c * (2.0 * (0.5 * w).sin()).powi(2));
        let s = c * c / 32.0 * (2.0 * (0.5 * w).sin()).powi(2);
        let by = |integrator| diffuse(&x, &Grid::filled(n, 1, c), None, 1.0, &settings(integrator));
        let (rational, disc) = (by(Integrator::Rational(Rational::GAUSSIAN)), by(Integrator::Disc));
        for i in 0..n {
            assert!((y.at(i, 0) - gain * x.at(i, 0)).abs() < 1e-12);
            assert!((rational.at(i, 0) - Rational::GAUSSIAN.response(s) * x.at(i, 0)).abs() < 1e-12);
            assert!((disc.at(i, 0) - DiscResponse::LENS.response(s, 0.0) * x.at(i, 0)).abs() < 1e-11);
        }
    }

    #[test]
    fn the_disc_mixes_both_axes_as_its_response_says() {
        let (w, h, c) = (24, 20, 5.0);
        let wave = |n: usize, k: f64| std::f64::consts::PI * k / n as f64;
        let (wx, wy) = (wave(w, 3.0), wave(h, 4.0));
        let x = Grid::from_fn(w, h, |x, y| (wx * (x as f64 + 0.5)).cos() * (wy * (y as f64 + 0.5)).cos());
        let y = diffuse(&x, &Grid::filled(w, h, c), None, 1.0, &settings(Integrator::Disc));
        let s = |w: f64| c * c / 32.0 * (2.0 * (0.5 * w).sin()).powi(2);
        let gain = DiscResponse::LENS.response(s(wx), s(wy));
        let error = x.zip(&y, |x, y| (gain * x - y).abs()).largest();
        assert!(error < 1e-11, "{error}");
    }

    #[test]
    fn the_smaller_diameter_rules_a_link() {
        assert_eq!(links(&[2.0, -1.0, 0.0, 5.0], 1.0), [1.0, 0.0, 0.0]);
    }
}
