//! Elimination in chunks (after Zhang, Cohen, Owens 2010 and Laszlo, Giles, Appleyard 2016): see `partition.wgsl`.

use super::passes::in_two_dimensions;
use super::{Pass, TermUniform, lanes_part, limits_part, terms};
use crate::recorder::Recorder;
use crate::shader::{Constant, Spec, part, uniform};
use pullfocus_core::Result;
use pullfocus_core::diffusion::Solver;

uniform! {
    /// See `partition.wgsl`.
    PartitionParams {
        unknowns: u32,
        lines: u32,
        along: u32,
        across: u32,
        chunks: u32,
        per_group: u32,
        diameter: f32,
        least_at: u32,
        layer: u32,
        unused_0: u32,
        unused_1: u32,
        unused_2: u32,
        terms: [TermUniform; 2],
    }
}

/// How work is cut for a device; any values give the same picture up to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tuning {
    /// Unknowns that a thread has in registers, for real systems; a multiple of 4, at most 32.
    pub chunk_real: u32,
    /// The same for complex ones.
    pub chunk_complex: u32,
    /// Threads that a workgroup of short lines is filled up to.
    pub threads: u32,
    /// Least number of columns beside each other in a workgroup.
    pub columns: u32,
    /// More threads than these share a workgroup only where lines are too long otherwise.
    pub most_threads: u32,
}

impl Default for Tuning {
    fn default() -> Self {
        Self { chunk_real: 16, chunk_complex: 8, threads: 256, columns: 4, most_threads: 640 }
    }
}

/// The most unknowns of a thread: their neighbours are told in the bits of a word.
const MOST_CHUNK: u32 = 32;

/// One way to cut the lines of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cut {
    /// Unknowns of a thread.
    chunk: u32,
    /// Threads of a line.
    chunks: u32,
    /// Lines of a workgroup.
    per_group: u32,
    /// Lines that are parts of the same pixels and stand side by side in workgroup memory.
    side: u32,
    /// Threads of a workgroup.
    threads: u32,
    /// Unknowns of each thread that go through workgroup memory at a time; 0 for columns.
    step: u32,
}

/// What a cut depends on.
#[derive(Debug, Clone, Copy)]
struct Need {
    unknowns: u32,
    columns: bool,
    /// Parts of a pixel that are lines of their own.
    halves: u32,
    /// f32 of one thread's values at a pixel.
    lanes: u32,
    complex: bool,
    /// Bytes of them in memory.
    memory_bytes: u32,
}

impl Need {
    /// Bytes of workgroup memory, as `naga` lays them out.
    fn workgroup_bytes(&self, threads: u32, step: u32) -> u32 {
        let parts = if self.complex { 2 } else { 1 };
        threads * (2 * 4 * parts + 4 * self.lanes * parts + step * self.memory_bytes)
    }

    fn cut(&self, tuning: &Tuning, limits: &wgpu::Limits) -> Option<Cut> {
        let most = limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
        // Many threads leave few registers for each; more than these only where lines are too long otherwise.
        self.within(tuning, limits, most.min(tuning.most_threads))
            .or_else(|| self.within(tuning, limits, most))
    }

    fn within(&self, tuning: &Tuning, limits: &wgpu::Limits, most: u32) -> Option<Cut> {
        let memory = limits.max_compute_workgroup_storage_size;
        let chunk = if self.complex { tuning.chunk_complex } else { tuning.chunk_real };
        let mut chunk = chunk.clamp(4, MOST_CHUNK).next_multiple_of(4);
        while chunk <= MOST_CHUNK {
            let chunks = self.unknowns.div_ceil(chunk);
            let wanted = (tuning.threads / chunks).max(if self.columns { tuning.columns } else { 1 });
            // Fewer lines in a workgroup, then smaller steps, then one part of the pixels alone, then longer chunks.
            let whole =
                (1..=wanted.div_ceil(self.halves)).rev().map(|pixels| (pixels * self.halves, self.halves));
            for (per_group, side) in whole.chain([(1, 1)]) {
                let used = chunks * per_group;
                // As many threads for many sizes of picture, so that they share a pipeline.
                for threads in [used.max(tuning.threads), used] {
                    let threads = threads.next_multiple_of(64).min(most);
                    for step in if self.columns { [0; 3] } else { [4, 2, 1] } {
                        if used <= threads && self.workgroup_bytes(threads, step) <= memory {
                            return Some(Cut { chunk, chunks, per_group, side, threads, step });
                        }
                    }
                }
            }
            chunk *= 2;
        }
        None
    }
}

/// Solves all lines of a pass. Lines too long for the device's workgroups go to the hybrid.
///
/// # Errors
/// [`pullfocus_core::Error::DeviceLimit`], [`pullfocus_core::Error::OutOfMemory`].
pub(super) fn solve(recorder: &mut Recorder<'_>, pass: &Pass<'_>, tuning: &Tuning) -> Result<()> {
    let axis = pass.axis;
    let pixel = crate::planes::Group::pixel_bytes(pass.group.planes, pass.group.storage) as u32;
    let need = |halves: u32| Need {
        unknowns: axis.unknowns,
        columns: axis.columns,
        halves,
        lanes: pass.group.planes / halves,
        complex: pass.complex(),
        memory_bytes: pixel / halves,
    };
    let limits = recorder.context.limits();
    // Two terms are in registers at once, so two planes at a time; all four where lines are too long for that.
    let halves = if pass.round() && pass.group.planes == 4 { [2, 1] } else { [1, 1] };
    let cut = halves.into_iter().find_map(|halves| Some((halves, need(halves).cut(tuning, limits)?)));
    let Some((halves, cut)) = cut else {
        return super::passes::solve(recorder, pass, Solver::Hybrid);
    };
    let lanes = pass.group.planes / halves;

    let mut parts = vec![
        limits_part(),
        lanes_part(lanes),
        pass.storage_part(lanes),
        pass.number(),
        part!("diffusion/mean"),
        part!("diffusion/reduced"),
        part!("diffusion/terms"),
        if axis.columns { part!("diffusion/lines_columns") } else { part!("diffusion/lines_rows") },
    ];
    parts.push(if pass.round() { part!("diffusion/fields_4") } else { part!("diffusion/fields_1") });
    let least = pass.note_least || pass.floor;
    parts.push(if least { part!("diffusion/least") } else { part!("diffusion/no_least") });
    parts.push(match (pass.round(), axis.columns) {
        (false, _) => part!("diffusion/form_separable"),
        (true, false) => part!("diffusion/form_round_rows"),
        (true, true) => part!("diffusion/form_round_columns"),
    });
    parts.push(part!("diffusion/partition"));
    let [has_circle, has_gamma] = pass.flags();
    let mut constants = vec![
        ("K", Constant::Count(cut.chunk)),
        ("THREADS", Constant::Count(cut.threads)),
        ("HALVES", Constant::Count(halves)),
        ("SIDE", Constant::Count(cut.side)),
        has_circle,
        has_gamma,
        ("NOTE_LEAST", Constant::Flag(pass.note_least)),
        ("FLOOR", Constant::Flag(pass.floor)),
        ("SKIPS", Constant::Flag(pass.layer.is_some())),
    ];
    if !axis.columns {
        constants.push(("STEP", Constant::Count(cut.step)));
        constants.push(("STAGED", Constant::Count(cut.step * cut.threads)));
    }
    let params = PartitionParams {
        unknowns: axis.unknowns,
        lines: axis.lines * halves,
        along: axis.along,
        across: axis.across,
        chunks: cut.chunks,
        per_group: cut.per_group,
        diameter: pass.diameter(),
        least_at: pass.least_at,
        layer: pass.layer.map_or(0, |(layer, _)| layer),
        unused_0: 0,
        unused_1: 0,
        unused_2: 0,
        terms: terms(pass.scheme, pass.beta),
    };
    let (nothing, leasts) = (recorder.memory.nothing.clone(), recorder.memory.least.clone());
    let mut buffers = vec![pass.circle(&nothing), pass.medium.gamma.unwrap_or(&nothing)];
    if least {
        buffers.push(&leasts);
    }
    buffers.push(&pass.group.buffer);
    buffers.extend(pass.fields);
    buffers.push(pass.layer.map_or(&nothing, |(_, found)| found));
    let groups = (axis.lines * halves).div_ceil(cut.per_group);
    recorder.run(&Spec::new(&parts, &constants), &params, &buffers, in_two_dimensions(groups))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_cut_within_the_limits() {
        let mut limits = vec![wgpu::Limits::default()];
        limits.push(wgpu::Limits {
            max_compute_invocations_per_workgroup: 1024,
            max_compute_workgroup_size_x: 1024,
            max_compute_workgroup_storage_size: 48 << 10,
            ..wgpu::Limits::default()
        });
        for limits in limits {
            for unknowns in (1..40).chain([255, 256, 257, 1080, 1920, 2160, 4096, 4320, 7680, 8192]) {
                for (columns, complex, lanes, halves) in [
                    (false, false, 4, 1),
                    (true, false, 4, 1),
                    (false, true, 4, 1),
                    (true, true, 4, 1),
                    (false, true, 2, 2),
                    (true, true, 2, 2),
                    (true, true, 1, 1),
                ] {
                    let need = Need { unknowns, columns, halves, lanes, complex, memory_bytes: 4 * lanes };
                    let cut = need.cut(&Tuning::default(), &limits).expect("8192 fit");
                    assert!(cut.chunks * cut.chunk >= unknowns && cut.per_group.is_multiple_of(cut.side));
                    assert!(
                        cut.chunks * cut.per_group <= cut.threads && (cut.side == halves || cut.side == 1),
                        "{cut:?}"
                    );
                    assert!(cut.threads <= limits.max_compute_invocations_per_workgroup);
                    assert!(
                        need.workgroup_bytes(cut.threads, cut.step)
                            <= limits.max_compute_workgroup_storage_size
                    );
                    assert!(columns || cut.chunk.is_multiple_of(cut.step));
                }
            }
        }
    }
}
