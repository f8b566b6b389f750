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
    /// Nanoseconds in a tick.
    period: f32,
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
            stage: "",
            period: context.queue().get_timestamp_period(),
        })
    }

    /// Begins a recording anew.
    pub fn reset(&mut self) {
        self.pieces.clear();
    }

    pub(crate) fn stage(&mut self, name: &'static str) {
        self.stage = name;
    }

    pub(crate) fn writes(&mut self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let at = self.pieces.len() as u32;
        if at >= MOST {
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

    /// The time of each stage, in order, once the recording is submitted; waits for it.
    ///
    /// # Errors
    /// [`pullfocus_core::Error::DeviceLost`].
    pub fn read(&self, context: &Context) -> pullfocus_core::Result<Vec<(&'static str, Duration)>> {
        let count = 2 * self.pieces.len();
        if count == 0 {
            return Ok(Vec::new());
        }
        let bytes = crate::host::read_buffer(context, &self.readable, count as u64 * 8)?;
        let ticks: Vec<u64> =
            bytes.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default())).collect();
        let mut stages: Vec<(&'static str, Duration)> = Vec::new();
        for (name, pair) in self.pieces.iter().zip(ticks.chunks_exact(2)) {
            let nanoseconds = pair[1].saturating_sub(pair[0]) as f64 * f64::from(self.period);
            let time = Duration::from_nanos(nanoseconds as u64);
            match stages.iter_mut().find(|(stage, _)| stage == name) {
                Some((_, sum)) => *sum += time,
                None => stages.push((name, time)),
            }
        }
        Ok(stages)
    }
}
