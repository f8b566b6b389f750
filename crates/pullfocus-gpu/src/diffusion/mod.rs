//! Blur by diffusion in compute passes. The mathematics, and how each number is kept from cancelling, stand with the CPU's
//! form (`pullfocus_cpu::diffusion`) and in `docs/methods/diffusion.md`; this is who solves it on a GPU.
//!
//! # Practice
//!
//! Planes lie in groups of four ([`Group`]), one vector for each pixel. The solver of the default settings (`partition`)
//! reads and writes every group once for each axis; the others are the papers' and go over systems in memory (`passes`).

mod partition;
mod passes;

use crate::planes::{Group, Storage};
use crate::recorder::Recorder;
use crate::shader::{Constant, Part, part};
use pullfocus_core::diffusion::{Diffusion, Integrator, Solver};
use pullfocus_core::scheme::{FIELDS, Scheme, Shape, Term};
use pullfocus_core::{Result, Size};

pub use partition::Tuning;

/// Where a medium's conductivity comes from.
#[derive(Debug, Clone, Copy)]
pub enum Conductivity<'a> {
    /// Diameters of the circle of confusion in pixels, f32, of either sign.
    Circle(&'a wgpu::Buffer),
    /// The same diameter in pixels everywhere.
    Uniform(f32),
}

/// What the planes diffuse through.
#[derive(Debug, Clone, Copy)]
pub struct Medium<'a> {
    /// How far heat goes.
    pub conductivity: Conductivity<'a>,
    /// Specific heat, f32, 0 or more; 1 everywhere if there is none.
    pub gamma: Option<&'a wgpu::Buffer>,
    /// Pixels of height for each pixel of width.
    pub vertical_scale: f32,
}

/// The lines of one axis.
#[derive(Debug, Clone, Copy)]
struct Axis {
    unknowns: u32,
    lines: u32,
    along: u32,
    across: u32,
    columns: bool,
}

impl Axis {
    fn rows(size: Size) -> Self {
        let (width, height) = (size.width as u32, size.height as u32);
        Self { unknowns: width, lines: height, along: 1, across: width, columns: false }
    }

    fn columns(size: Size) -> Self {
        let (width, height) = (size.width as u32, size.height as u32);
        Self { unknowns: height, lines: width, along: width, across: 1, columns: true }
    }
}

/// A term for the shaders; see `terms.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct TermUniform {
    sigma: [f32; 2],
    beta: f32,
    h: f32,
    mix: [[f32; 4]; FIELDS],
}

/// The terms of a scheme, for a link's beta of diameter 1.
fn terms(scheme: &Scheme, beta: f64) -> [TermUniform; 2] {
    std::array::from_fn(|t| {
        let Some(term) = scheme.terms.get(t) else { return bytemuck::Zeroable::zeroed() };
        let Term { sigma, h, mix, start, .. } = *term;
        let mix = std::array::from_fn(|f| [mix[f][0], mix[f][1], mix[f][2], start[f]]);
        TermUniform { sigma, beta: (beta * term.beta) as f32, h, mix }
    })
}

/// One pass along one axis over one group.
struct Pass<'a> {
    size: Size,
    axis: Axis,
    beta: f64,
    medium: &'a Medium<'a>,
    scheme: &'a Scheme,
    group: &'a Group,
    /// The other fields of a round response, between rows and columns.
    fields: &'a [wgpu::Buffer],
    /// Where the group's least values stand.
    least_at: u32,
    note_least: bool,
    floor: bool,
    /// Which layer this is, and where it stands how many there are.
    layer: Option<(u32, &'a wgpu::Buffer)>,
}

impl Pass<'_> {
    /// Whether the pass reads or writes all four fields.
    fn round(&self) -> bool {
        self.scheme.shape == Shape::Round
    }

    /// Whether its systems are complex.
    fn complex(&self) -> bool {
        self.scheme.shape != Shape::Real
    }

    fn number(&self) -> Part {
        if self.complex() { part!("diffusion/number_complex") } else { part!("diffusion/number_real") }
    }

    fn storage_part(&self, lanes: u32) -> Part {
        match (self.group.storage, lanes) {
            (Storage::Full, _) => part!("diffusion/px_f32"),
            (Storage::Half, 2) => part!("diffusion/px_f16_2"),
            (Storage::Half, _) => part!("diffusion/px_f16_4"),
        }
    }

    fn diameter(&self) -> f32 {
        match self.medium.conductivity {
            Conductivity::Circle(_) => 0.0,
            Conductivity::Uniform(diameter) => diameter,
        }
    }

    fn circle<'b>(&'b self, nothing: &'b wgpu::Buffer) -> &'b wgpu::Buffer {
        match self.medium.conductivity {
            Conductivity::Circle(circle) => circle,
            Conductivity::Uniform(_) => nothing,
        }
    }

    fn flags(&self) -> [(&'static str, Constant); 2] {
        [
            ("HAS_CIRCLE", Constant::Flag(matches!(self.medium.conductivity, Conductivity::Circle(_)))),
            ("HAS_GAMMA", Constant::Flag(self.medium.gamma.is_some())),
        ]
    }
}

/// The numbers that all forms share.
pub(crate) fn limits_part() -> Part {
    // The one place where the shaders' copies stand; a test compares them.
    part!("diffusion/limits")
}

/// A thread's lanes.
fn lanes_part(lanes: u32) -> Part {
    match lanes {
        1 => part!("diffusion/lane_1"),
        2 => part!("diffusion/lane_2"),
        _ => part!("diffusion/lane_4"),
    }
}

/// What a diffusion is told beside its settings.
#[derive(Debug, Clone, Copy, Default)]
pub struct How<'a> {
    /// Results stay at or above the least value of their plane, or 0 if that is less.
    pub floor_at_zero: bool,
    /// How work is cut.
    pub tuning: Tuning,
    /// The buffer whose third word says how many layers there are: for groups of layers beyond that the fast solver does
    /// nothing.
    pub found: Option<&'a wgpu::Buffer>,
}

/// Diffuses groups of planes, in place, through one medium.
///
/// # Errors
/// [`pullfocus_core::Error::Setting`], [`pullfocus_core::Error::DeviceLimit`],
/// [`pullfocus_core::Error::OutOfMemory`]; a host's [`pullfocus_core::Error::Cancelled`];
/// [`pullfocus_core::Error::Unsupported`] for Jacobi with a tolerance in a caller's encoder, which looks at its results.
pub fn diffuse(
    recorder: &mut Recorder<'_>,
    size: Size,
    groups: &[&Group],
    medium: &Medium<'_>,
    settings: &Diffusion,
    how: &How<'_>,
) -> Result<()> {
    settings.check()?;
    if size.area() == 0 {
        return Ok(());
    }
    let scheme = Scheme::new(settings)?;
    // Backward Euler takes means: it has no lobe to cut.
    let floor = how.floor_at_zero && !matches!(settings.integrator, Integrator::BackwardEuler { .. });
    let beta = f64::from(settings.calibration.factor()) / f64::from(scheme.steps);
    let vertical = f64::from(medium.vertical_scale);
    // A product's groups go side by side, row by row and then column by column: they do not wait for each other. A round
    // response needs three more buffers for each group, so those follow one another.
    let together = if scheme.shape == Shape::Round { 1 } else { groups.len().max(1) };
    for groups in groups.chunks(together) {
        let mut fields = Vec::new();
        if scheme.shape == Shape::Round {
            for _ in 1..FIELDS {
                fields.push(recorder.take(size, groups[0].buffer.size())?);
            }
        }
        let planes = groups.iter().map(|group| group.planes).sum();
        let mut leasts = if floor { recorder.take_leasts(planes)? } else { 0 };
        let least_at: Vec<u32> = groups
            .iter()
            .map(|group| {
                leasts += group.planes;
                leasts - group.planes
            })
            .collect();
        for step in 0..scheme.steps {
            for (axis, beta) in [(Axis::rows(size), beta), (Axis::columns(size), beta * vertical * vertical)]
            {
                if groups.len() > 1 {
                    // A new pass begins with all of its barriers; within it nothing waits for anything.
                    recorder.end_pass();
                }
                for (group, &least_at) in groups.iter().zip(&least_at) {
                    let pass = Pass {
                        size,
                        axis,
                        beta,
                        medium,
                        scheme: &scheme,
                        group,
                        fields: &fields,
                        least_at,
                        note_least: floor && step == 0 && !axis.columns,
                        floor: floor && step + 1 == scheme.steps && axis.columns,
                        layer: group.layer.zip(how.found),
                    };
                    match settings.solver {
                        Solver::Lu => partition::solve(recorder, &pass, &how.tuning)?,
                        solver => passes::solve(recorder, &pass, solver)?,
                    }
                    let work = size.area() as u64 * u64::from(group.planes);
                    recorder.worked(work * scheme.terms.len() as u64)?;
                }
            }
        }
        recorder.give(fields);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use pullfocus_core::scheme::{LEAST_GAMMA, MOST_BETA};

    #[test]
    fn the_shaders_limits_are_cores() {
        let text = limits_part().text;
        assert!(text.contains(&format!("const LEAST_GAMMA: f32 = {LEAST_GAMMA:e};")), "{text}");
        assert!(text.contains(&format!("const MOST_BETA: f32 = {MOST_BETA:e};")), "{text}");
    }
}
