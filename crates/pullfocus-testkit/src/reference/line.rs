//! One line of pixels, its tridiagonal system, and six ways to solve it.
//!
//! The system is first paper's equation 5: `gamma_i (y_i - x_i) = beta_i (y_{i+1} - y_i) - beta_{i-1} (y_i - y_{i-1})`, for
//! a rational integrator with the factor `-pole` at gamma: `(L - pole Gamma) z = residue Gamma x`, `y = 2 Re z`, where L is
//! the right side with its sign turned. Backward Euler is the case `pole = -1`, `y = z`, so all solvers take a complex
//! shift. They carry the **row sum** (gamma times the shift) in place of the diagonal.

use num_complex::Complex64;
use pullfocus_core::diffusion::HYBRID_REST;
use pullfocus_core::response::Pole;

/// Heat capacities and links of one line; one link fewer than pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Specific heat of each pixel, 0 or above.
    pub gamma: Vec<f64>,
    /// Conductivity between pixel i and pixel i + 1, 0 or above.
    pub beta: Vec<f64>,
}

/// How a system is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The whole matrix, Gaussian elimination with pivoting: cubic, for short lines.
    Dense,
    /// Thomas's elimination.
    Lu,
    /// Cyclic reduction, gather form (first paper, figure 5).
    CyclicReduction,
    /// Parallel cyclic reduction (Zhang, Cohen, Owens 2010).
    ParallelCyclicReduction,
    /// Cyclic reduction down to [`HYBRID_REST`] pixels, parallel cyclic reduction of those (Zhang, Cohen, Owens 2010).
    Hybrid,
    /// This many Jacobi sweeps (second paper, equation 2.13).
    Jacobi(u32),
    /// Jacobi until no value changes by more than this part of the largest, at most this often.
    JacobiUntil(f64, u32),
}

/// The division of elimination: a pixel that has neither heat nor a link keeps what it has, so 0 / 0 is 0.
fn part(above: Complex64, below: Complex64) -> Complex64 {
    if below == Complex64::ZERO { Complex64::ZERO } else { above / below }
}

impl Line {
    /// One backward-Euler step of `x` (first paper, equation 5).
    pub fn step(&self, x: &[f64], method: Method) -> Vec<f64> {
        let rhs: Vec<_> = self.gamma.iter().zip(x).map(|(g, x)| Complex64::from(g * x)).collect();
        let start: Vec<_> = x.iter().map(|&x| Complex64::from(x)).collect();
        self.solve(Complex64::ONE, &rhs, &start, method).iter().map(|y| y.re).collect()
    }

    /// One application of the rational function that has `pole` and its conjugate.
    pub fn rational(&self, x: &[f64], pole: Pole, method: Method) -> Vec<f64> {
        let residue = Complex64::new(pole.residue[0], pole.residue[1]);
        let x: Vec<_> = x.iter().map(|&x| residue * x).collect();
        let z = self.resolvent(&x, Complex64::new(pole.pole[0], pole.pole[1]), method);
        z.iter().map(|z| 2.0 * z.re).collect()
    }

    /// `(L - pole Gamma)^-1 Gamma x`: what every rational integrator is a sum of. Jacobi starts at the solution of the
    /// line without links, `x / -pole`, as the second paper starts at x.
    pub fn resolvent(&self, x: &[Complex64], pole: Complex64, method: Method) -> Vec<Complex64> {
        let rhs: Vec<_> = self.gamma.iter().zip(x).map(|(g, x)| x * g).collect();
        let start: Vec<_> = x.iter().map(|x| x / -pole).collect();
        self.solve(-pole, &rhs, &start, method)
    }

    /// Solves `(L + shift Gamma) y = rhs`. A pixel with neither heat nor link keeps `start`.
    fn solve(
        &self,
        shift: Complex64,
        rhs: &[Complex64],
        start: &[Complex64],
        method: Method,
    ) -> Vec<Complex64> {
        assert_eq!(self.gamma.len(), rhs.len(), "one value per pixel");
        assert_eq!(self.beta.len() + 1, self.gamma.len().max(1), "one link fewer than pixels");
        let sums: Vec<Complex64> = self.gamma.iter().map(|g| shift * g).collect();
        let beta: Vec<Complex64> = self.beta.iter().map(|&b| Complex64::from(b)).collect();
        let mut y = match method {
            Method::Dense => dense(&sums, &beta, rhs),
            Method::Lu => lu(&sums, &beta, rhs),
            Method::CyclicReduction => reduction(&sums, &beta, rhs, 1),
            Method::ParallelCyclicReduction => parallel_cyclic_reduction(&sums, &beta, rhs),
            Method::Hybrid => reduction(&sums, &beta, rhs, HYBRID_REST),
            Method::Jacobi(sweeps) => jacobi(&sums, &beta, rhs, start, 0.0, sweeps),
            Method::JacobiUntil(tolerance, most) => jacobi(&sums, &beta, rhs, start, tolerance, most),
        };
        for i in 0..y.len() {
            if sums[i] + left(&beta, i) + right(&beta, i) == Complex64::ZERO {
                y[i] = start[i];
            }
        }
        y
    }
}

/// The link from i to the left; 0 at the border.
fn left(beta: &[Complex64], i: usize) -> Complex64 {
    if i == 0 { Complex64::ZERO } else { beta[i - 1] }
}

/// The link from i to the right; 0 at the border.
fn right(beta: &[Complex64], i: usize) -> Complex64 {
    beta.get(i).copied().unwrap_or_default()
}

fn dense(sums: &[Complex64], beta: &[Complex64], rhs: &[Complex64]) -> Vec<Complex64> {
    let n = sums.len();
    let mut rows = vec![vec![Complex64::ZERO; n + 1]; n];
    for i in 0..n {
        rows[i][i] = sums[i] + left(beta, i) + right(beta, i);
        if i > 0 {
            rows[i][i - 1] = -beta[i - 1];
        }
        if i + 1 < n {
            rows[i][i + 1] = -beta[i];
        }
        rows[i][n] = rhs[i];
    }
    for column in 0..n {
        let pivot = (column..n)
            .max_by(|&a, &b| rows[a][column].norm().total_cmp(&rows[b][column].norm()))
            .unwrap_or(column);
        rows.swap(column, pivot);
        let top = rows[column].clone();
        for row in rows.iter_mut().skip(column + 1) {
            let factor = part(row[column], top[column]);
            for (value, above) in row.iter_mut().zip(&top).skip(column) {
                *value -= factor * above;
            }
        }
    }
    let mut y = vec![Complex64::ZERO; n];
    for i in (0..n).rev() {
        let known: Complex64 = (i + 1..n).map(|j| rows[i][j] * y[j]).sum();
        y[i] = part(rows[i][n] - known, rows[i][i]);
    }
    y
}

/// Thomas's elimination without subtraction: `e_i = sum_i + beta_{i-1} e_{i-1} / (e_{i-1} + beta_{i-1})`, pivot
/// `e_i + beta_i`.
fn lu(sums: &[Complex64], beta: &[Complex64], rhs: &[Complex64]) -> Vec<Complex64> {
    let n = sums.len();
    let mut pivot = vec![Complex64::ZERO; n];
    let mut z = vec![Complex64::ZERO; n];
    let mut e = Complex64::ZERO;
    for i in 0..n {
        let (carried, heat) = match i {
            0 => (Complex64::ZERO, Complex64::ZERO),
            _ => (part(beta[i - 1] * e, pivot[i - 1]), part(beta[i - 1] * z[i - 1], pivot[i - 1])),
        };
        e = sums[i] + carried;
        pivot[i] = e + right(beta, i);
        z[i] = rhs[i] + heat;
    }
    let mut y = vec![Complex64::ZERO; n];
    for i in (0..n).rev() {
        let next = y.get(i + 1).copied().unwrap_or_default();
        y[i] = part(z[i] + right(beta, i) * next, pivot[i]);
    }
    y
}

/// One level of the hierarchy of systems, each half as long as the one before.
struct Level {
    sums: Vec<Complex64>,
    beta: Vec<Complex64>,
    rhs: Vec<Complex64>,
}

impl Level {
    fn pivot(&self, i: usize) -> Complex64 {
        self.sums[i] + left(&self.beta, i) + right(&self.beta, i)
    }

    /// What eliminating pixel `i` hands over to a neighbour, per unit of link.
    fn share(&self, i: usize, values: &[Complex64]) -> Complex64 {
        part(values[i], self.pivot(i))
    }

    /// Lines 1 to 8 of figure 5: the even pixels are eliminated, element j gathers from 2j, 2j + 1 and 2j + 2.
    fn half(&self) -> Self {
        let n = self.sums.len();
        let mut next = Self { sums: vec![], beta: vec![], rhs: vec![] };
        for j in 0..n / 2 {
            let (a, m, b) = (2 * j, 2 * j + 1, 2 * j + 2);
            let mut sum = self.sums[m] + self.beta[a] * self.share(a, &self.sums);
            let mut rhs = self.rhs[m] + self.beta[a] * self.share(a, &self.rhs);
            if b < n {
                sum += self.beta[m] * self.share(b, &self.sums);
                rhs += self.beta[m] * self.share(b, &self.rhs);
            }
            if b + 1 < n {
                next.beta.push(part(self.beta[m] * self.beta[b], self.pivot(b)));
            }
            next.sums.push(sum);
            next.rhs.push(rhs);
        }
        next
    }

    /// Lines 10 to 16: odd pixels take over the shorter system's solution, even ones follow from their neighbours.
    fn back(&self, half: &[Complex64]) -> Vec<Complex64> {
        (0..self.sums.len())
            .map(|j| {
                if j % 2 == 1 {
                    return half[j / 2];
                }
                let before = if j == 0 { Complex64::ZERO } else { left(&self.beta, j) * half[j / 2 - 1] };
                let after = half.get(j / 2).map_or(Complex64::ZERO, |y| right(&self.beta, j) * y);
                part(self.rhs[j] + before + after, self.pivot(j))
            })
            .collect()
    }
}

/// Cyclic reduction in the gather form of the first paper's figure 5, for any length. The figure's loops run to
/// `2^-j (N + 1) - 2`, where `2^-L` is meant, and its lengths are 2^k - 1; here a system of n pixels halves to
/// `n / 2`. Like elimination it carries row sums: the new link is `beta beta' / pivot`, nothing is subtracted. The last
/// `rest` pixels or fewer are solved by parallel cyclic reduction, which does nothing but divide if there is one.
fn reduction(sums: &[Complex64], beta: &[Complex64], rhs: &[Complex64], rest: usize) -> Vec<Complex64> {
    let mut levels = vec![];
    let mut top = Level { sums: sums.to_vec(), beta: beta.to_vec(), rhs: rhs.to_vec() };
    while top.sums.len() > rest {
        let half = top.half();
        levels.push(std::mem::replace(&mut top, half));
    }
    let solution = parallel_cyclic_reduction(&top.sums, &top.beta, &top.rhs);
    levels.iter().rev().fold(solution, |half, level| level.back(&half))
}

/// Parallel cyclic reduction: at distance d = 1, 2, 4, ... each pixel takes over what it had from the pixels d before and d
/// behind it, and is linked to those 2 d away instead. Beyond the line's length no links are left.
fn parallel_cyclic_reduction(sums: &[Complex64], beta: &[Complex64], rhs: &[Complex64]) -> Vec<Complex64> {
    let n = sums.len();
    // The link at i leads from i to i + d.
    let (mut sums, mut beta, mut rhs) = (sums.to_vec(), beta.to_vec(), rhs.to_vec());
    let mut d = 1;
    while d < n {
        let before = |i: usize| if i < d { Complex64::ZERO } else { beta[i - d] };
        let pivot = |i: usize| sums[i] + before(i) + right(&beta, i);
        let gather = |values: &[Complex64], i: usize| {
            let from = |j: usize, link: Complex64| part(link * values[j], pivot(j));
            let left = if i < d { Complex64::ZERO } else { from(i - d, before(i)) };
            let right = if i + d < n { from(i + d, beta[i]) } else { Complex64::ZERO };
            values[i] + left + right
        };
        let next = (
            (0..n).map(|i| gather(&sums, i)).collect(),
            (0..n.saturating_sub(2 * d)).map(|i| part(beta[i] * beta[i + d], pivot(i + d))).collect(),
            (0..n).map(|i| gather(&rhs, i)).collect(),
        );
        (sums, beta, rhs) = next;
        d *= 2;
    }
    rhs.into_iter().zip(sums).map(|(rhs, sum)| part(rhs, sum)).collect()
}

fn jacobi(
    sums: &[Complex64],
    beta: &[Complex64],
    rhs: &[Complex64],
    start: &[Complex64],
    tolerance: f64,
    most: u32,
) -> Vec<Complex64> {
    let mut y = start.to_vec();
    for _ in 0..most {
        let next: Vec<Complex64> = (0..y.len())
            .map(|i| {
                let (l, r) = (left(beta, i), right(beta, i));
                let before = if i == 0 { Complex64::ZERO } else { l * y[i - 1] };
                let after = if i + 1 < y.len() { r * y[i + 1] } else { Complex64::ZERO };
                part(rhs[i] + before + after, sums[i] + l + r)
            })
            .collect();
        let change = next.iter().zip(&y).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let largest = next.iter().map(|v| v.norm()).fold(0.0, f64::max);
        y = next;
        if tolerance > 0.0 && change <= tolerance * largest {
            break;
        }
    }
    y
}

/// Figure 5 as printed (with its bounds put right): coefficients a, b, c, subtraction and all. Only for lengths of
/// 2^k - 1 of a matrix that is not singular.
pub fn figure_5(a: &[f64], b: &[f64], c: &[f64], y: &[f64]) -> Vec<f64> {
    let n = y.len();
    assert!((n + 1).is_power_of_two(), "figure 5 is for lengths of 2^k - 1");
    let levels = (n + 1).ilog2() as usize;
    let mut pyramid = vec![(a.to_vec(), b.to_vec(), c.to_vec(), y.to_vec())];
    for level in 1..levels {
        let (a, b, c, y) = &pyramid[level - 1];
        let mut next = (vec![], vec![], vec![], vec![]);
        for j in 0..((n + 1) >> level) - 1 {
            let alpha = a[2 * j + 1] / b[2 * j];
            let gamma = c[2 * j + 1] / b[2 * j + 2];
            next.0.push(-(alpha * a[2 * j]));
            next.1.push(b[2 * j + 1] - (alpha * c[2 * j] + gamma * a[2 * j + 2]));
            next.2.push(-(gamma * c[2 * j + 2]));
            next.3.push(y[2 * j + 1] - (alpha * y[2 * j] + gamma * y[2 * j + 2]));
        }
        pyramid.push(next);
    }
    let mut solution: Vec<f64> = {
        let (_, b, _, y) = &pyramid[levels - 1];
        vec![y[0] / b[0]]
    };
    for (a, b, c, y) in pyramid[..levels - 1].iter().rev() {
        solution = (0..y.len())
            .map(|j| {
                let after = solution.get(j / 2).copied().unwrap_or(0.0);
                let before = if j >= 2 { solution[j / 2 - 1] } else { 0.0 };
                if j % 2 == 1 { solution[j / 2] } else { (y[j] - c[j] * after - a[j] * before) / b[j] }
            })
            .collect();
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use pullfocus_core::response::Rational;

    /// The exact ones beside the whole matrix.
    const ELIMINATING: [Method; 4] =
        [Method::Lu, Method::CyclicReduction, Method::ParallelCyclicReduction, Method::Hybrid];

    fn random_line(n: usize, seed: u64) -> (Line, Vec<f64>) {
        let mut random = Random::new(seed);
        let gamma = (0..n).map(|_| random.between(0.01, 1.0)).collect();
        let beta = (0..n - 1).map(|_| random.between(0.0, 9.0).powi(2)).collect();
        let x = (0..n).map(|_| random.between(-1.0, 2.0)).collect();
        (Line { gamma, beta }, x)
    }

    fn apart(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn every_exact_method_agrees_with_the_whole_matrix_at_any_length() {
        let pole = Rational::GAUSSIAN.pole().unwrap();
        // The hybrid's first levels are above 64 and above 128.
        for n in (1..=40).chain([63, 64, 65, 127, 128, 129, 130, 131]) {
            let (line, x) = random_line(n, n as u64);
            let dense = line.step(&x, Method::Dense);
            let dense_rational = line.rational(&x, pole, Method::Dense);
            for method in ELIMINATING {
                // f64 rounding times a condition number of about 1e4 (largest beta over smallest gamma).
                assert!(apart(&dense, &line.step(&x, method)) < 1e-11, "{method:?} of {n}");
                assert!(
                    apart(&dense_rational, &line.rational(&x, pole, method)) < 1e-11,
                    "{method:?} of {n}"
                );
            }
        }
    }

    #[test]
    fn the_solution_solves_equation_5() {
        let (line, x) = random_line(50, 7);
        let y = line.step(&x, Method::Lu);
        for i in 0..50 {
            let after = if i < 49 { line.beta[i] * (y[i + 1] - y[i]) } else { 0.0 };
            let before = if i > 0 { line.beta[i - 1] * (y[i] - y[i - 1]) } else { 0.0 };
            // Both sides are of the size of beta, 81 at most.
            assert!((line.gamma[i] * (y[i] - x[i]) - (after - before)).abs() < 1e-12, "{i}");
        }
    }

    #[test]
    fn the_printed_figure_5_gives_the_same_for_its_lengths() {
        for n in [1, 3, 7, 63] {
            let (line, x) = random_line(n, 11);
            let at = |i: usize| line.beta.get(i).copied().unwrap_or(0.0);
            let a: Vec<_> = (0..n).map(|i| if i == 0 { 0.0 } else { -at(i - 1) }).collect();
            let c: Vec<_> = (0..n).map(|i| -at(i)).collect();
            let b: Vec<_> = (0..n).map(|i| line.gamma[i] - a[i] - c[i]).collect();
            let rhs: Vec<_> = (0..n).map(|i| line.gamma[i] * x[i]).collect();
            assert!(apart(&figure_5(&a, &b, &c, &rhs), &line.step(&x, Method::Lu)) < 1e-10, "{n}");
        }
    }

    #[test]
    fn jacobi_nears_the_solution_at_the_rate_that_numbers_say() {
        let n = 200;
        let beta = 4.0;
        let line = Line { gamma: vec![1.0; n], beta: vec![beta; n - 1] };
        let (_, x) = random_line(n, 5);
        let exact = line.step(&x, Method::Lu);
        let error = |sweeps| apart(&line.step(&x, Method::Jacobi(sweeps)), &exact);
        let rate = (error(80) / error(40)).powf(1.0 / 40.0);
        // 2 beta / (gamma + 2 beta) bounds the rate; smooth errors come close to it.
        assert!(rate < 2.0 * beta / (1.0 + 2.0 * beta) + 1e-9 && rate > 0.8, "{rate}");
        let until = line.step(&x, Method::JacobiUntil(1e-12, 20_000));
        assert!(apart(&until, &exact) < 1e-10);
    }

    #[test]
    fn a_pixel_without_heat_and_links_keeps_its_value() {
        let line = Line { gamma: vec![1.0, 0.0, 1.0], beta: vec![0.0, 0.0] };
        for method in ELIMINATING.into_iter().chain([Method::Jacobi(5)]) {
            assert_eq!(line.step(&[1.0, 2.0, 3.0], method), [1.0, 2.0, 3.0]);
        }
    }

    #[test]
    fn a_pixel_without_heat_is_interpolated() {
        let line = Line { gamma: vec![1e9, 0.0, 1e9], beta: vec![1.0, 3.0] };
        for method in ELIMINATING.into_iter().chain([Method::Dense]) {
            let y = line.step(&[1.0, 77.0, 2.0], method);
            assert!((y[1] - 1.75).abs() < 1e-8, "{method:?}: {y:?}");
        }
    }
}
