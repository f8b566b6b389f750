//! The papers' solvers: systems in memory, and passes over them.

use super::{Pass, TermUniform, lanes_part, limits_part, terms};
use crate::recorder::Recorder;
use crate::shader::{Constant, Part, Spec, part, uniform};
use pullfocus_core::Result;
use pullfocus_core::diffusion::{HYBRID_REST, JACOBI_MOST_SWEEPS, JacobiStop, Solver};

uniform! {
    /// See `system_params.wgsl`.
    SystemParams {
        unknowns: u32,
        lines: u32,
        along: u32,
        across: u32,
        diameter: f32,
        term: u32,
        least_at: u32,
        unused: u32,
        terms: [TermUniform; 2],
    }
}

uniform! {
    /// See `cyclic_reduction.wgsl`.
    CyclicParams {
        fine: u32,
        unknowns: u32,
        coarse: u32,
        coarse_unknowns: u32,
        lines: u32,
    }
}

uniform! {
    /// See `parallel_cyclic_reduction.wgsl`.
    ParallelParams {
        unknowns: u32,
        lines: u32,
        distance: u32,
        unused: u32,
    }
}

uniform! {
    /// See `jacobi.wgsl`.
    SweepParams {
        unknowns: u32,
        lines: u32,
    }
}

/// Sweeps between two looks at how much they change.
const SWEEPS_BETWEEN_LOOKS: u32 = 16;

/// One term's system in memory.
struct System<'a, 'b> {
    pass: &'a Pass<'b>,
    /// Weights and links.
    rows: wgpu::Buffer,
    /// Right-hand sides, which become solutions.
    values: wgpu::Buffer,
}

impl Pass<'_> {
    fn row_bytes(&self) -> u64 {
        if self.complex() { 16 } else { 8 }
    }

    fn value_bytes(&self) -> u64 {
        u64::from(self.group.planes) * if self.complex() { 8 } else { 4 }
    }

    fn area(&self) -> u64 {
        self.size.area() as u64
    }

    /// Number and lanes, then what solvers share.
    fn common(&self) -> Vec<Part> {
        let lanes = self.group.planes;
        vec![
            limits_part(),
            lanes_part(lanes),
            self.storage_part(lanes),
            self.number(),
            part!("diffusion/mean"),
            part!("diffusion/system"),
        ]
    }

    fn params(&self, term: u32) -> SystemParams {
        SystemParams {
            unknowns: self.axis.unknowns,
            lines: self.axis.lines,
            along: self.axis.along,
            across: self.axis.across,
            diameter: self.diameter(),
            term,
            least_at: self.least_at,
            unused: 0,
            terms: terms(self.scheme, self.beta),
        }
    }

    /// Workgroups for `unknowns` of each line.
    fn workgroups(&self, unknowns: u32) -> [u32; 3] {
        [self.axis.lines.div_ceil(64), unknowns.div_ceil(4), 1]
    }
}

/// Workgroups for `count` pieces of work, of which one dimension may not hold all.
pub(super) fn in_two_dimensions(count: u32) -> [u32; 3] {
    /// What every device allows.
    const MOST: u32 = 65535;
    let rows = count.div_ceil(MOST).max(1);
    [count.div_ceil(rows), rows, 1]
}

/// Solves all lines of a pass, term by term.
///
/// # Errors
/// As [`super::diffuse`].
pub(super) fn solve(recorder: &mut Recorder<'_>, pass: &Pass<'_>, solver: Solver) -> Result<()> {
    // A pyramid has fewer than twice its base.
    let room = match solver {
        Solver::CyclicReduction | Solver::Hybrid => 2,
        _ => 1,
    };
    let mut rows = recorder.take(pass.size, room * pass.area() * pass.row_bytes())?;
    let mut solutions = Vec::new();
    for term in 0..pass.scheme.terms.len() as u32 {
        let values = recorder.take(pass.size, room * pass.area() * pass.value_bytes())?;
        let mut system = System { pass, rows, values };
        system.set_up(recorder, term)?;
        match solver {
            Solver::Jacobi(stop) => system.jacobi(recorder, stop)?,
            Solver::ParallelCyclicReduction => system.parallel_cyclic_reduction(recorder)?,
            Solver::Hybrid => system.cyclic_reduction(recorder, HYBRID_REST as u32)?,
            Solver::CyclicReduction | Solver::Lu => system.cyclic_reduction(recorder, 1)?,
        }
        solutions.push(system.values);
        rows = system.rows;
    }
    emit(recorder, pass, &solutions)?;
    recorder.give(solutions.into_iter().chain([rows]));
    Ok(())
}

fn emit(recorder: &mut Recorder<'_>, pass: &Pass<'_>, solutions: &[wgpu::Buffer]) -> Result<()> {
    let mut parts = pass.common();
    parts.extend([part!("diffusion/terms"), part!("diffusion/system_params")]);
    parts.push(if pass.round() { part!("diffusion/fields_4") } else { part!("diffusion/fields_1") });
    parts.push(match (pass.round(), pass.axis.columns) {
        (false, _) => part!("diffusion/result_separable"),
        (true, false) => part!("diffusion/result_round_rows"),
        (true, true) => part!("diffusion/result_round_columns"),
    });
    parts.push(part!("diffusion/emit"));
    let spec = Spec::new(&parts, &[("FLOOR", Constant::Flag(pass.floor))]);
    let least = recorder.memory.least.clone();
    let mut buffers = vec![&least, &pass.group.buffer];
    buffers.extend(pass.fields);
    buffers.push(&solutions[0]);
    buffers.push(solutions.last().unwrap_or(&solutions[0]));
    let workgroups = pass.workgroups(pass.axis.unknowns);
    recorder.run(&spec, &pass.params(0), &buffers, workgroups)
}

impl System<'_, '_> {
    fn set_up(&self, recorder: &mut Recorder<'_>, term: u32) -> Result<()> {
        let pass = self.pass;
        let columns_of_round = pass.round() && pass.axis.columns;
        let mut parts = pass.common();
        parts.extend([part!("diffusion/terms"), part!("diffusion/system_params")]);
        parts.push(if columns_of_round { part!("diffusion/fields_4") } else { part!("diffusion/fields_1") });
        parts.push(if columns_of_round {
            part!("diffusion/right_round_columns")
        } else {
            part!("diffusion/right_separable")
        });
        // Least values are those of the picture, not of what rows made of it.
        parts.push(if columns_of_round {
            part!("diffusion/note_nothing")
        } else {
            part!("diffusion/note_least")
        });
        parts.push(part!("diffusion/setup"));
        let [has_circle, has_gamma] = pass.flags();
        let note = Constant::Flag(pass.note_least && term == 0);
        let spec = Spec::new(&parts, &[has_circle, has_gamma, ("NOTE_LEAST", note)]);
        let (nothing, least) = (recorder.memory.nothing.clone(), recorder.memory.least.clone());
        let mut buffers = vec![pass.circle(&nothing), pass.medium.gamma.unwrap_or(&nothing)];
        if columns_of_round {
            buffers.push(&pass.group.buffer);
            buffers.extend(pass.fields);
        } else {
            buffers.extend([&least, &pass.group.buffer]);
        }
        buffers.extend([&self.rows, &self.values]);
        recorder.run(&spec, &pass.params(term), &buffers, pass.workgroups(pass.axis.unknowns))
    }

    /// Down to at most `rest` unknowns of each line, and up again.
    fn cyclic_reduction(&self, recorder: &mut Recorder<'_>, rest: u32) -> Result<()> {
        let pass = self.pass;
        let lines = pass.axis.lines;
        let spec = |parts: &[Part], constants: &[(&'static str, Constant)]| {
            let mut all = pass.common();
            all.push(part!("diffusion/cyclic_reduction"));
            all.extend(parts);
            Spec::new(&all, constants)
        };
        let mut levels = Vec::new();
        let (mut fine, mut unknowns) = (0, pass.axis.unknowns);
        while unknowns > rest {
            let level = CyclicParams {
                fine,
                unknowns,
                coarse: fine + unknowns * lines,
                coarse_unknowns: unknowns / 2,
                lines,
            };
            levels.push(level);
            (fine, unknowns) = (level.coarse, level.coarse_unknowns);
        }
        let reduce = spec(&[part!("diffusion/cyclic_reduce")], &[]);
        for level in &levels {
            let groups = pass.workgroups(level.coarse_unknowns);
            recorder.run(&reduce, level, &[&self.rows, &self.values], groups)?;
        }
        if rest > 1 && unknowns > 1 {
            let top = CyclicParams { fine, unknowns, coarse: 0, coarse_unknowns: 0, lines };
            let solve = spec(
                &[part!("diffusion/reduced"), part!("diffusion/rest")],
                &[("THREADS", Constant::Count(HYBRID_REST as u32))],
            );
            recorder.run(&solve, &top, &[&self.rows, &self.values], in_two_dimensions(lines))?;
        }
        // The one unknown that is left of a line has no links: its mean is its value.
        let substitute = spec(&[part!("diffusion/cyclic_substitute")], &[]);
        for level in levels.iter().rev() {
            let groups = pass.workgroups(level.unknowns);
            recorder.run(&substitute, level, &[&self.rows, &self.values], groups)?;
        }
        Ok(())
    }

    fn parallel_cyclic_reduction(&mut self, recorder: &mut Recorder<'_>) -> Result<()> {
        let pass = self.pass;
        let mut parts = pass.common();
        parts.push(part!("diffusion/parallel_cyclic_reduction"));
        let spec = Spec::new(&parts, &[]);
        let groups = pass.workgroups(pass.axis.unknowns);
        let mut rows = recorder.take(pass.size, self.rows.size())?;
        let mut values = recorder.take(pass.size, self.values.size())?;
        let mut distance = 1;
        while distance < pass.axis.unknowns {
            let params =
                ParallelParams { unknowns: pass.axis.unknowns, lines: pass.axis.lines, distance, unused: 0 };
            let buffers = [&self.rows, &self.values, &rows, &values];
            recorder.run(&spec, &params, &buffers, groups)?;
            std::mem::swap(&mut rows, &mut self.rows);
            std::mem::swap(&mut values, &mut self.values);
            distance *= 2;
        }
        recorder.give([rows, values]);
        Ok(())
    }

    fn jacobi(&mut self, recorder: &mut Recorder<'_>, stop: JacobiStop) -> Result<()> {
        let pass = self.pass;
        let (sweeps, tolerance) = match stop {
            JacobiStop::Sweeps(sweeps) => (sweeps, None),
            JacobiStop::Tolerance(tolerance) => (JACOBI_MOST_SWEEPS, Some(tolerance)),
        };
        let mut parts = pass.common();
        parts.push(part!("diffusion/jacobi"));
        let spec = Spec::new(&parts, &[]);
        let params = SweepParams { unknowns: pass.axis.unknowns, lines: pass.axis.lines };
        let groups = pass.workgroups(pass.axis.unknowns);
        let bytes = self.values.size();
        // The first guess is the right-hand side itself.
        let mut old = self.values.clone();
        let mut spare = vec![recorder.take(pass.size, bytes)?, recorder.take(pass.size, bytes)?];
        for sweep in 0..sweeps {
            let Some(next) = spare.pop() else { break };
            recorder.run(&spec, &params, &[&self.rows, &self.values, &old, &next], groups)?;
            let done = match tolerance {
                Some(tolerance) if sweep % SWEEPS_BETWEEN_LOOKS == SWEEPS_BETWEEN_LOOKS - 1 => {
                    self.change(recorder, &old, &next)? <= tolerance
                }
                _ => false,
            };
            if old != self.values {
                spare.push(old);
            }
            old = next;
            recorder.worked(pass.area() * u64::from(pass.group.planes))?;
            if done {
                break;
            }
        }
        spare.push(std::mem::replace(&mut self.values, old));
        recorder.give(spare);
        Ok(())
    }

    /// The largest change of the last sweep in parts of the largest value.
    fn change(&self, recorder: &mut Recorder<'_>, old: &wgpu::Buffer, next: &wgpu::Buffer) -> Result<f32> {
        let pass = self.pass;
        let mut parts = pass.common();
        parts.push(part!("diffusion/jacobi_change"));
        let spec = Spec::new(&parts, &[]);
        let params = SweepParams { unknowns: pass.axis.unknowns, lines: pass.axis.lines };
        let largest = recorder.take(pass.size, 32)?;
        recorder.encoder().clear_buffer(&largest, 0, None);
        recorder.run(&spec, &params, &[old, next, &largest], pass.workgroups(pass.axis.unknowns))?;
        let bytes = recorder.read(&largest, 32)?;
        recorder.give([largest]);
        let values: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        // Each plane by its own largest value.
        let parts = values.chunks_exact(2).map(|pair| if pair[0] == 0.0 { 0.0 } else { pair[0] / pair[1] });
        Ok(parts.fold(0.0, f32::max))
    }
}
