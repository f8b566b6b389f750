//! From kernels and buffers to a caller's command encoder.

use crate::context::{Context, Kernel};
use crate::memory::{self, Memory, UNIFORM_STEP};
use crate::shader::{Spec, Uniform};
use pullfocus_core::{Cancel, Error, Result, Size};
use std::collections::HashMap;
use std::sync::Arc;

/// Where commands go.
pub enum Sink<'a> {
    /// Into the caller's encoder; nothing is submitted and nothing waited for.
    Encoder(&'a mut wgpu::CommandEncoder),
    /// Into encoders of its own, submitted every now and then, so that a wish to stop is heard.
    Host { encoder: Option<wgpu::CommandEncoder>, cancel: &'a Cancel, work: u64 },
}

/// Work units (pixels times planes times passes) between two submissions of a host: some milliseconds of a GPU.
const WORK: u64 = 400_000_000;
/// The same where a processor plays the GPU.
const WORK_OF_PROCESSOR: u64 = 6_000_000;

/// Records dispatches, one after the other; each sees what the one before wrote.
pub struct Recorder<'a> {
    pub context: &'a Context,
    pub memory: &'a mut Memory,
    pub sink: Sink<'a>,
    pass: Option<wgpu::ComputePass<'static>>,
    uniforms: Vec<u8>,
    known: HashMap<Vec<u8>, u32>,
    slot: (u64, u64),
    written: usize,
    leasts: u32,
    pub timer: Option<&'a mut crate::timer::Timer>,
    work_limit: u64,
    finished: bool,
}

impl Drop for Recorder<'_> {
    /// A recording that ends early: a caller may submit its encoder all the same, so its uniforms must be there; its
    /// buffers are for the next one, which the device comes to later.
    fn drop(&mut self) {
        self.pass = None;
        self.write_uniforms();
        if !self.finished {
            self.memory.give_all();
        }
    }
}

impl<'a> Recorder<'a> {
    /// Begins a recording.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn new(
        context: &'a Context,
        memory: &'a mut Memory,
        mut sink: Sink<'a>,
        timer: Option<&'a mut crate::timer::Timer>,
    ) -> Result<Self> {
        context.check()?;
        let slot = memory.next_slot();
        let processor = context.device().adapter_info().device_type == wgpu::DeviceType::Cpu;
        let work_limit = if processor { WORK_OF_PROCESSOR } else { WORK };
        open(context, &mut sink).clear_buffer(&memory.least, 0, None);
        Ok(Self {
            context,
            memory,
            sink,
            pass: None,
            uniforms: Vec::new(),
            known: HashMap::new(),
            slot,
            written: 0,
            leasts: 0,
            timer,
            work_limit,
            finished: false,
        })
    }

    /// A buffer of `bytes`.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] or [`Error::OutOfMemory`].
    pub fn take(&mut self, size: Size, bytes: u64) -> Result<wgpu::Buffer> {
        self.memory.take(self.context, size, bytes)
    }

    /// A plane of f32.
    ///
    /// # Errors
    /// As [`Recorder::take`].
    pub fn take_plane(&mut self, size: Size) -> Result<wgpu::Buffer> {
        self.take(size, size.area() as u64 * 4)
    }

    /// Gives buffers back.
    pub fn give(&mut self, buffers: impl IntoIterator<Item = wgpu::Buffer>) {
        self.memory.give(buffers);
    }

    /// Where `count` least values may stand, 0 so far.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] after some thousand.
    pub fn take_leasts(&mut self, count: u32) -> Result<u32> {
        let at = self.leasts;
        self.leasts += count;
        if self.leasts > memory::LEASTS {
            return Err(self.too_many("planes in one recording", self.leasts.into(), memory::LEASTS.into()));
        }
        Ok(at)
    }

    fn too_many(&self, what: &'static str, needed: u64, allowed: u64) -> Error {
        Error::DeviceLimit {
            device: self.context.name().to_owned(),
            what,
            needed,
            allowed,
            instead: "ask for fewer layers, planes or steps",
        }
    }

    /// Dispatches a kernel over buffers.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] where a recording has too many different uniforms or workgroups.
    pub fn run<U: Uniform>(
        &mut self,
        spec: &Spec,
        uniform: &U,
        buffers: &[&wgpu::Buffer],
        workgroups: [u32; 3],
    ) -> Result<()> {
        let kernel = self.context.kernel::<U>(spec);
        let group = self.memory.bind_group(self.context, &kernel, buffers);
        self.dispatch(&kernel, &group, uniform, workgroups)
    }

    /// Dispatches a kernel over buffers and the caller's textures.
    ///
    /// # Errors
    /// As [`Recorder::run`].
    pub fn run_bound<U: Uniform>(
        &mut self,
        spec: &Spec,
        uniform: &U,
        bindings: &[wgpu::BindingResource<'_>],
        workgroups: [u32; 3],
    ) -> Result<()> {
        let kernel = self.context.kernel::<U>(spec);
        let group = memory::bind(self.context, &kernel, &self.memory.uniforms, bindings);
        self.dispatch(&kernel, &group, uniform, workgroups)
    }

    fn dispatch<U: Uniform>(
        &mut self,
        kernel: &Arc<Kernel>,
        group: &wgpu::BindGroup,
        uniform: &U,
        workgroups: [u32; 3],
    ) -> Result<()> {
        let most = self.context.limits().max_compute_workgroups_per_dimension;
        if let Some(&needed) = workgroups.iter().find(|&&n| n > most) {
            return Err(Error::DeviceLimit {
                device: self.context.name().to_owned(),
                what: "workgroups in one dimension",
                needed: needed.into(),
                allowed: most.into(),
                instead: "render a smaller picture or on the processor",
            });
        }
        let offset = self.uniform(bytemuck::bytes_of(uniform))?;
        let pass = self.pass();
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, group, &[offset]);
        pass.dispatch_workgroups(workgroups[0], workgroups[1], workgroups[2]);
        Ok(())
    }

    /// Room for a uniform in this recording; its offset in the uniforms' buffer.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] where there is no room left.
    pub fn uniform(&mut self, bytes: &[u8]) -> Result<u32> {
        if let Some(&offset) = self.known.get(bytes) {
            return Ok(offset);
        }
        let at = self.uniforms.len() as u64;
        let padded = (bytes.len() as u64).next_multiple_of(UNIFORM_STEP);
        if at + padded > self.slot.1 {
            return Err(self.too_many("bytes of uniforms in one recording", at + padded, self.slot.1));
        }
        self.uniforms.extend_from_slice(bytes);
        self.uniforms.resize((at + padded) as usize, 0);
        let offset = (self.slot.0 + at) as u32;
        self.known.insert(bytes.to_vec(), offset);
        Ok(offset)
    }

    fn pass(&mut self) -> &mut wgpu::ComputePass<'static> {
        let Self { context, sink, pass, timer, .. } = self;
        pass.get_or_insert_with(|| {
            let timestamp_writes = timer.as_mut().and_then(|timer| timer.writes());
            let descriptor = wgpu::ComputePassDescriptor { label: Some("pullfocus"), timestamp_writes };
            open(context, sink).begin_compute_pass(&descriptor).forget_lifetime()
        })
    }

    /// Ends the compute pass that is open.
    pub fn end_pass(&mut self) {
        self.pass = None;
    }

    /// The encoder, outside any pass.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.pass = None;
        open(self.context, &mut self.sink)
    }

    /// From here on the time goes to another stage.
    pub fn stage(&mut self, name: &'static str) {
        if let Some(timer) = &mut self.timer {
            self.pass = None;
            timer.stage(name);
        }
    }

    /// Tells how much was just recorded (pixels times planes times passes). A host submits now and then, waits, and hears
    /// whether the caller wants to stop.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::DeviceLost`].
    pub fn worked(&mut self, amount: u64) -> Result<()> {
        let due = match &mut self.sink {
            Sink::Encoder(_) => false,
            Sink::Host { work, cancel, .. } => {
                cancel.check()?;
                *work += amount;
                *work > self.work_limit
            }
        };
        if due { self.flush() } else { Ok(()) }
    }

    /// How much a host records before it submits.
    pub fn work_limit(&self) -> u64 {
        self.work_limit
    }

    /// How many pieces of `amount` may go between two submissions of a host, 1 or more; for a caller's encoder any number.
    pub fn most_in_one_piece(&self, amount: u64) -> usize {
        if self.is_host() { (self.work_limit / amount.max(1)).max(1) as usize } else { 1 << 20 }
    }

    /// Whether results may be looked at between two dispatches.
    pub fn is_host(&self) -> bool {
        matches!(self.sink, Sink::Host { .. })
    }

    /// What is in a buffer now; for hosts.
    ///
    /// # Errors
    /// [`Error::Unsupported`] in a caller's encoder; as [`Recorder::flush`].
    pub fn read(&mut self, buffer: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>> {
        if !self.is_host() {
            return Err(Error::Unsupported {
                what: "looking at results",
                reason: "the commands are in the caller's encoder and have not run yet",
            });
        }
        let readable = self.memory.readable(self.context, bytes)?;
        self.encoder().copy_buffer_to_buffer(buffer, 0, &readable, 0, bytes);
        self.flush()?;
        crate::host::read_buffer(self.context, &readable, bytes)
    }

    fn write_uniforms(&mut self) {
        if self.written < self.uniforms.len() {
            let at = self.slot.0 + self.written as u64;
            self.context.queue().write_buffer(&self.memory.uniforms, at, &self.uniforms[self.written..]);
            self.written = self.uniforms.len();
        }
    }

    /// A host's submission: everything so far is done when this returns.
    ///
    /// # Errors
    /// [`Error::Cancelled`], [`Error::DeviceLost`].
    pub fn flush(&mut self) -> Result<()> {
        self.pass = None;
        self.write_uniforms();
        let Sink::Host { encoder, cancel, work } = &mut self.sink else { return Ok(()) };
        *work = 0;
        if let Some(encoder) = encoder.take() {
            self.context.queue().submit([encoder.finish()]);
            wait(self.context)?;
            // All of them were read.
            self.uniforms.clear();
            self.known.clear();
            self.written = 0;
        }
        cancel.check()
    }

    /// Ends the recording. An encoder of the caller's now holds all of it.
    ///
    /// # Errors
    /// As [`Recorder::flush`].
    pub fn finish(mut self) -> Result<()> {
        self.pass = None;
        if let Some(timer) = self.timer.take() {
            timer.resolve(open(self.context, &mut self.sink));
        }
        self.write_uniforms();
        self.flush()?;
        self.finished = true;
        Ok(())
    }
}

/// The encoder of a sink.
pub fn open<'s>(context: &Context, sink: &'s mut Sink<'_>) -> &'s mut wgpu::CommandEncoder {
    match sink {
        Sink::Encoder(encoder) => encoder,
        Sink::Host { encoder, .. } => encoder.get_or_insert_with(|| {
            let descriptor = wgpu::CommandEncoderDescriptor { label: Some("pullfocus") };
            context.device().create_command_encoder(&descriptor)
        }),
    }
}

/// Waits until the device has done everything.
///
/// # Errors
/// [`Error::DeviceLost`].
pub fn wait(context: &Context) -> Result<()> {
    context.device().poll(wgpu::PollType::wait_indefinitely()).map_err(|error| Error::DeviceLost {
        device: context.name().to_owned(),
        reason: error.to_string(),
    })?;
    context.check()
}
