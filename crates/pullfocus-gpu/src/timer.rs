//! How long each stage takes on the device, from its own timestamps.

use crate::context::Context;
use std::time::Duration;

/// The most pieces of stages in one recording.
const MOST: u32 = 512;

/// Timestamps at the borders of stages.
#[derive(Debug)]
pub struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    /// Stage of each piece of work.
    pieces: Vec<&'static str>,
    stage: &'static str,
    /// Whether there were more pieces than there is room for.
    overflowed: bool,
    /// Nanoseconds in a tick.
    period: f32,
}

/// What a timer read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Times {
    /// The time in the passes of each stage, in order.
    pub stages: Vec<(&'static str, Duration)>,
    /// From the beginning of the first pass to the end of the last: copies between passes and gaps included.
    pub span: Duration,
    /// Whether all of it was timed; there is room for some hundred pieces.
    pub whole: bool,
}

impl Timer {
    /// A timer, where the device has timestamps ([`wgpu::Features::TIMESTAMP_QUERY`]).
    pub fn new(context: &Context) -> Option<Self> {
        let device = context.device();
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let bytes = u64::from(2 * MOST) * 8;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        use wgpu::BufferUsages as Use;
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MOST,
            }),
            resolved: buffer(Use::QUERY_RESOLVE | Use::COPY_SRC),
            readable: buffer(Use::MAP_READ | Use::COPY_DST),
            pieces: Vec::new(),
            overflowed: false,
            stage: "",
            period: context.queue().get_timestamp_period(),
        })
    }

    /// Begins anew; [`Context::record`] does so itself.
    pub fn reset(&mut self) {
        self.pieces.clear();
        self.overflowed = false;
    }

    /// How many pieces of work were timed so far.
    #[cfg(test)]
    pub(crate) fn pieces(&self) -> usize {
        self.pieces.len()
    }

    pub(crate) fn stage(&mut self, name: &'static str) {
        self.stage = name;
    }

    pub(crate) fn writes(&mut self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let at = self.pieces.len() as u32;
        if at >= MOST {
            self.overflowed = true;
            return None;
        }
        self.pieces.push(self.stage);
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(2 * at),
            end_of_pass_write_index: Some(2 * at + 1),
        })
    }

    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let count = 2 * self.pieces.len() as u32;
        if count > 0 {
            encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, u64::from(count) * 8);
        }
    }

    /// What was timed, once the recording is submitted; waits for it.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLost`].
    pub fn read(&self, context: &Context) -> pullfocus_core::Result<Times> {
        let count = 2 * self.pieces.len();
        if count == 0 {
            return Ok(Times { whole: !self.overflowed, ..Times::default() });
        }
        let bytes = crate::host::read_buffer(context, &self.readable, count as u64 * 8)?;
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&bytes);
        let time = |from: u64, to: u64| {
            Duration::from_nanos((to.saturating_sub(from) as f64 * f64::from(self.period)) as u64)
        };
        let mut stages: Vec<(&'static str, Duration)> = Vec::new();
        for (name, pair) in self.pieces.iter().zip(ticks.chunks_exact(2)) {
            let time = time(pair[0], pair[1]);
            match stages.iter_mut().find(|(stage, _)| stage == name) {
                Some((_, sum)) => *sum += time,
                None => stages.push((name, time)),
            }
        }
        let span = time(ticks[0], ticks[count - 1]);
        Ok(Times { stages, span, whole: !self.overflowed })
    }
}
