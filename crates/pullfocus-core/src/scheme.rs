//! Integrators as systems: which ones to solve along rows and columns, and how their solutions add up. Every backend solves
//! these.
//!
//! A term's system is `(K + sigma Gamma) v = sigma Gamma x`, K the insulated line's Laplacian with the links' beta,
//! |sigma| = 1 with a positive real part: real for backward Euler, complex for a pole of a rational function.

use crate::diffusion::{Diffusion, Integrator};
use crate::error::Result;
use crate::response::{Complex, DiscResponse};

/// The least specific heat: a matte's 0 counts as this, so that a line without any weight has a finite answer
/// (the line's mean where it conducts). It is so small that beside any weight it cannot be seen, and large
/// enough for its square to be a normal f32.
pub const LEAST_GAMMA: f32 = 1e-15;

/// The largest conductivity of a link; a million pixels of blur.
pub const MOST_BETA: f32 = 1e12;

/// The most terms of an integrator.
pub const MOST_TERMS: usize = 2;

/// Real fields that a plane becomes between the rows and the columns of [`Shape::Round`].
pub const FIELDS: usize = 4;

/// One solve along each line, whose solution is one term of a sum.
#[derive(Debug, Clone, Copy)]
pub struct Term {
    /// Unit factor of gamma: 1, or minus the pole over its length.
    pub sigma: [f32; 2],
    /// What beta is multiplied with: 1, or 1 over the pole's length.
    pub beta: f64,
    /// Separable: the term's value is `re - h im` of its solution; it keeps constants.
    pub h: f32,
    /// Separable: the first term's value, then `value + share (term - value)`.
    pub share: f32,
    /// Round, rows, last term: what each field gets of `Im v_0`, `Re (v_1 - v_0)` and `Im v_1`.
    pub mix: [[f32; 3]; FIELDS],
    /// Round, rows, last term: what each field gets of `Re v_0`.
    pub start: [f32; FIELDS],
}

/// How rows and columns work together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A product: rows, then columns of what the rows gave, in real numbers.
    Real,
    /// The same in complex ones.
    Complex,
    /// A sum of products that share their poles ([`DiscResponse`]): rows make four fields, columns one of them.
    Round,
}

/// An integrator, ready to be solved.
#[derive(Debug, Clone)]
pub struct Scheme {
    /// How rows and columns work together.
    pub shape: Shape,
    /// The solves along each line, at most [`MOST_TERMS`].
    pub terms: Vec<Term>,
    /// How often rows and columns follow each other.
    pub steps: u32,
}

impl Scheme {
    /// The systems of an integrator.
    ///
    /// # Errors
    /// [`crate::Error::Setting`] for a rational function without a pair of complex poles.
    pub fn new(settings: &Diffusion) -> Result<Self> {
        Ok(match settings.integrator {
            Integrator::BackwardEuler { steps } => {
                Self { shape: Shape::Real, terms: vec![Term::new([-1.0, 0.0])], steps }
            }
            Integrator::Rational(rational) => {
                let pole = rational.pole()?;
                // 2 Re(residue (K - pole Gamma)^-1 Gamma x) = 2 Re(rho v), rho = -residue / pole. Of a constant that
                // is 2 Re(rho), 1 for every such function.
                let rho = div(pole.residue, neg(pole.pole));
                let term = Term {
                    h: (rho[1] / rho[0]) as f32,
                    share: (2.0 * rho[0]) as f32,
                    ..Term::new(pole.pole)
                };
                Self { shape: Shape::Complex, terms: vec![term], steps: 1 }
            }
            Integrator::Disc => {
                Self { shape: Shape::Round, terms: round(&DiscResponse::LENS).into(), steps: 1 }
            }
        })
    }
}

impl Term {
    /// The system of a pole p: `(K - p Gamma) u = Gamma x` over |p| is `(K / |p| + sigma Gamma) v = sigma Gamma x`
    /// with `sigma = -p / |p|` and `v = -p u`, which is x where x is constant.
    fn new(pole: Complex) -> Self {
        let length = pole[0].hypot(pole[1]);
        Self {
            sigma: [(-pole[0] / length) as f32, (-pole[1] / length) as f32],
            beta: 1.0 / length,
            h: 0.0,
            share: 1.0,
            mix: [[0.0; 3]; FIELDS],
            start: [0.0; FIELDS],
        }
    }
}

/// The terms of a [`DiscResponse`], in a form that leaves a picture without blur as it is, to the bit.
///
/// In means (`v_i = -p_i u_i` along rows, `M_j` along columns) the response reads
/// `y = 2 Re sum_j M_j[w_j]`, `w_j = sum_i (A_ij v_i / p_i + B_ij conj(v_i) / conj(p_i)) / p_j`. Written with what the rows
/// change, `w_j = s_j Re v_0 + (...) Im v_0 + (...) Re (v_1 - v_0) + (...) Im v_1`, s_j the sum of its weights, and so
/// is `q = 2 Re sum_j w_j = Re v_0 + ...`: it is x where no link conducts. Then `y = q` where the columns change neither
/// w, and `2 Re sum_j M_j[w_j]` elsewhere.
///
/// Between rows and columns stand four real fields for each plane: q (in the plane itself), Re w_0, Im w_0, Im w_1;
/// Re w_1 is `q / 2 - Re w_0`.
fn round(response: &DiscResponse) -> [Term; MOST_TERMS] {
    let DiscResponse { poles, a, b } = *response;
    let mut terms = poles.map(Term::new);
    // What the fields get of Re v_i and Im v_i.
    let mut weights = [[[0.0; 2]; 2]; FIELDS];
    for i in 0..2 {
        let [first, second] = [0, 1].map(|j| {
            let plain = div(a[i][j], mul(poles[i], poles[j]));
            let conjugate = div(b[i][j], mul([poles[i][0], -poles[i][1]], poles[j]));
            // Of v and conj(v), of i v and -i conj(v).
            [
                [plain[0] + conjugate[0], plain[1] + conjugate[1]],
                [conjugate[1] - plain[1], plain[0] - conjugate[0]],
            ]
        });
        for part in 0..2 {
            let (first, second) = (first[part], second[part]);
            weights[0][i][part] = 2.0 * (first[0] + second[0]);
            weights[1][i][part] = first[0];
            weights[2][i][part] = first[1];
            weights[3][i][part] = second[1];
        }
    }
    for (field, [v0, v1]) in weights.into_iter().enumerate() {
        terms[1].mix[field] = [v0[1] as f32, v1[0] as f32, v1[1] as f32];
        terms[1].start[field] = (v0[0] + v1[0]) as f32;
    }
    terms
}

fn neg(a: Complex) -> Complex {
    [-a[0], -a[1]]
}

fn mul(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn div(a: Complex, b: Complex) -> Complex {
    let size = b[0] * b[0] + b[1] * b[1];
    let [re, im] = mul(a, [b[0], -b[1]]);
    [re / size, im / size]
}
