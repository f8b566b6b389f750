//! What lives as long as a picture's size: buffers, their bind groups, room for uniforms.

use crate::context::{Context, Kernel};
use crate::shader::Slot;
use pullfocus_core::{Error, Result, Size};
use std::collections::{BTreeMap, HashMap};

/// Bytes between two uniforms: every device's offsets may be multiples of this.
pub const UNIFORM_STEP: u64 = 256;
/// Bytes of uniforms for one recording.
const SLOT: u64 = 1 << 20;
/// Recordings that may wait for one submission.
pub const MOST_PENDING: u64 = 4;
/// Twice as many have room: failed ones take some, too.
const SLOTS: u64 = 2 * MOST_PENDING;
/// Least values that one recording can keep.
pub const LEASTS: u32 = 4096;

/// Buffers of one size and more, given and taken back; and what is made of them.
#[derive(Debug)]
pub struct Memory {
    /// By size, then in the order in which they were made: the same frame gets the same buffers.
    spare: HashMap<u64, BTreeMap<u64, wgpu::Buffer>>,
    /// When each was made.
    born: HashMap<wgpu::Buffer, u64>,
    bind_groups: HashMap<Bound, wgpu::BindGroup>,
    /// Uniforms of the last recordings.
    pub uniforms: wgpu::Buffer,
    next_slot: u64,
    /// See `partition.wgsl`.
    pub least: wgpu::Buffer,
    /// The range of no diameters: what comes first is smaller and larger.
    pub empty_range: wgpu::Buffer,
    /// Stands where a kernel does not look.
    pub nothing: wgpu::Buffer,
    /// The shape of the last highlights.
    pub shape: Option<(crate::bokeh::ShapeOf, crate::bokeh::Shape)>,
    /// What results are brought back through.
    readable: Option<wgpu::Buffer>,
    /// The aperture that was spread last.
    pub spans: Option<crate::spreading::Kept>,
    /// Bytes of all buffers that were made.
    bytes: u64,
    made: u64,
}

#[derive(Debug, PartialEq, Eq, Hash)]
struct Bound {
    kernel: u64,
    buffers: Vec<wgpu::Buffer>,
}

impl Memory {
    /// # Errors
    /// [`Error::DeviceLimit`] for a device that cannot blur at all; [`Error::OutOfMemory`].
    pub fn new(context: &Context) -> Result<Self> {
        context.check_limits()?;
        use wgpu::BufferUsages as Use;
        let size = Size::new(1, 1);
        let small = |bytes, usage| create(context, "working memory of a GPU", size, bytes, usage);
        let empty_range = small(8, Use::COPY_SRC | Use::COPY_DST)?;
        context.queue().write_buffer(&empty_range, 0, bytemuck::bytes_of(&[u32::MAX, 0]));
        Ok(Self {
            spare: HashMap::new(),
            born: HashMap::new(),
            shape: None,
            readable: None,
            spans: None,
            bind_groups: HashMap::new(),
            uniforms: small(SLOT * SLOTS, Use::UNIFORM | Use::COPY_DST)?,
            next_slot: 0,
            least: small(4 * u64::from(LEASTS), Use::STORAGE | Use::COPY_DST)?,
            empty_range,
            nothing: small(64, Use::STORAGE | Use::COPY_DST)?,
            bytes: SLOT * SLOTS,
            made: 0,
        })
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.bytes + self.spans.as_ref().map_or(0, crate::spreading::Kept::bytes)
    }

    /// How many buffers were made so far; stays while the size does.
    pub fn made(&self) -> u64 {
        self.made
    }

    /// Where the next recording's uniforms begin, and how many bytes they may take.
    pub fn next_slot(&mut self) -> (u64, u64) {
        let slot = self.next_slot;
        self.next_slot = (slot + 1) % SLOTS;
        (slot * SLOT, SLOT)
    }

    /// Which slot comes next.
    pub fn slot(&self) -> u64 {
        self.next_slot
    }

    /// Goes back to what [`Memory::slot`] was: what was recorded since is thrown away.
    pub fn back_to_slot(&mut self, slot: u64) {
        self.next_slot = slot;
    }

    /// A buffer of at least `bytes` that the host can read; the last one if it is large enough.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn readable(&mut self, context: &Context, bytes: u64) -> Result<wgpu::Buffer> {
        if let Some(buffer) = self.readable.as_ref().filter(|buffer| buffer.size() >= bytes) {
            return Ok(buffer.clone());
        }
        use wgpu::BufferUsages as Use;
        let usage = Use::MAP_READ | Use::COPY_DST;
        let buffer = create(context, "results of a GPU", Size::new(1, 1), bytes, usage)?;
        self.readable = Some(buffer.clone());
        Ok(buffer)
    }

    /// A storage buffer of `bytes` for a picture of `size`, with whatever was in it.
    ///
    /// # Errors
    /// [`Error::DeviceLimit`] or [`Error::OutOfMemory`].
    pub fn take(&mut self, context: &Context, size: Size, bytes: u64) -> Result<wgpu::Buffer> {
        let bytes = bytes.next_multiple_of(16).max(16);
        if let Some((_, buffer)) = self.spare.get_mut(&bytes).and_then(BTreeMap::pop_first) {
            return Ok(buffer);
        }
        check_binding(context, bytes)?;
        use wgpu::BufferUsages as Use;
        let usage = Use::STORAGE | Use::COPY_DST | Use::COPY_SRC;
        let buffer = self.make(|drops| {
            if drops {
                // What is not in use any more is freed now.
                let _ = context.device().poll(wgpu::PollType::Poll);
            }
            create(context, "a picture's planes", size, bytes, usage)
        })?;
        self.bytes += bytes;
        self.born.insert(buffer.clone(), self.made);
        self.made += 1;
        Ok(buffer)
    }

    /// What `create` makes; where the device is full, idle buffers are dropped and it is asked once more, with `true`.
    fn make<T>(&mut self, create: impl Fn(bool) -> Result<T>) -> Result<T> {
        match create(false) {
            Err(Error::OutOfMemory { .. }) if !self.spare.is_empty() => {}
            result => return result,
        }
        self.bind_groups.clear();
        for buffer in std::mem::take(&mut self.spare).into_values().flat_map(BTreeMap::into_values) {
            self.bytes -= buffer.size();
            self.born.remove(&buffer);
        }
        create(true)
    }

    /// A buffer that holds `bytes`, instead of another of its kind: what is recorded already keeps that one, and what is not
    /// forgets it.
    ///
    /// # Errors
    /// As [`Memory::take`].
    pub fn keep(&mut self, context: &Context, bytes: &[u8]) -> Result<wgpu::Buffer> {
        let length = (bytes.len() as u64).next_multiple_of(16).max(16);
        check_binding(context, length)?;
        use wgpu::BufferUsages as Use;
        let usage = Use::STORAGE | Use::COPY_DST;
        let buffer = create(context, "a shape", Size::new(1, 1), length, usage)?;
        context.queue().write_buffer(&buffer, 0, bytes);
        self.bind_groups.clear();
        Ok(buffer)
    }

    /// Takes buffers back. What was recorded before with them still holds: a device works in order.
    pub fn give(&mut self, buffers: impl IntoIterator<Item = wgpu::Buffer>) {
        for buffer in buffers {
            if let Some(&born) = self.born.get(&buffer) {
                self.spare.entry(buffer.size()).or_default().insert(born, buffer);
            }
        }
    }

    /// Takes every buffer back: those that a recording had which failed half way are nobody's any more.
    pub fn give_all(&mut self) {
        for (buffer, &born) in &self.born {
            self.spare.entry(buffer.size()).or_default().insert(born, buffer.clone());
        }
        self.readable = None;
    }

    /// Forgets every buffer: they belonged to another size. The device frees them once its commands are done with them.
    pub fn clear(&mut self) {
        self.spare.clear();
        self.bind_groups.clear();
        self.born.clear();
        self.readable = None;
        self.bytes = SLOT * SLOTS;
    }

    /// The bind group of a kernel over buffers alone; kept.
    pub fn bind_group(
        &mut self,
        context: &Context,
        kernel: &Kernel,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let bound = Bound { kernel: kernel.id, buffers: buffers.iter().map(|&b| b.clone()).collect() };
        if let Some(group) = self.bind_groups.get(&bound) {
            return group.clone();
        }
        let bindings: Vec<_> = buffers.iter().map(|buffer| buffer.as_entire_binding()).collect();
        let group = bind(context, kernel, &self.uniforms, &bindings);
        self.bind_groups.insert(bound, group.clone());
        group
    }
}

/// A bind group of a kernel: the uniform, then `bindings` in the order of their numbers.
pub fn bind(
    context: &Context,
    kernel: &Kernel,
    uniforms: &wgpu::Buffer,
    bindings: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    bind_to(context, (&kernel.label, &kernel.layout, &kernel.interface.slots), uniforms, bindings)
}

/// The same for any layout.
pub fn bind_to(
    context: &Context,
    (label, layout, slots): (&str, &wgpu::BindGroupLayout, &[(u32, Slot)]),
    uniforms: &wgpu::Buffer,
    bindings: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    assert_eq!(slots.len(), bindings.len() + 1, "{label}: {slots:?}");
    let Slot::Uniform { size } = slots[0].1 else { panic!("{label}: {:?} at binding 0", slots[0]) };
    let uniform = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
        buffer: uniforms,
        offset: 0,
        size: wgpu::BufferSize::new(size),
    });
    let all = std::iter::once(uniform).chain(bindings.iter().cloned());
    let entries: Vec<_> = slots
        .iter()
        .zip(all)
        .map(|(&(binding, _), resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries };
    context.device().create_bind_group(&descriptor)
}

/// Refuses what the device cannot bind.
///
/// # Errors
/// [`Error::DeviceLimit`].
pub fn check_binding(context: &Context, bytes: u64) -> Result<()> {
    let limits = context.limits();
    let limit = |what, allowed| Error::DeviceLimit {
        device: context.name().to_owned(),
        what,
        needed: bytes,
        allowed,
        instead: "render a smaller picture or on the processor, or give a device with larger limits",
    };
    if bytes > limits.max_storage_buffer_binding_size {
        return Err(limit("bytes in one storage binding", limits.max_storage_buffer_binding_size));
    }
    if bytes > limits.max_buffer_size {
        return Err(limit("bytes in one buffer", limits.max_buffer_size));
    }
    Ok(())
}

/// Makes a buffer.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn create(
    context: &Context,
    what: &'static str,
    size: Size,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer> {
    context.check()?;
    let device = context.device();
    let scope = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let descriptor =
        wgpu::BufferDescriptor { label: Some(what), size: bytes, usage, mapped_at_creation: false };
    let buffer = device.create_buffer(&descriptor);
    let invalid = pollster::block_on(invalid.pop());
    let memory = pollster::block_on(scope.pop());
    match (memory, invalid) {
        (None, None) => Ok(buffer),
        _ => Err(Error::OutOfMemory { what, size, bytes }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// A device that does nothing, with other limits than WebGPU's.
    fn empty(change: impl FnOnce(&mut wgpu::Limits)) -> Context {
        let mut required_limits = wgpu::Limits::default();
        change(&mut required_limits);
        let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
        let (device, queue) = wgpu::Device::noop(&descriptor);
        Context::new(&device, &queue)
    }

    #[test]
    fn a_device_with_too_small_limits_is_refused() {
        assert!(Memory::new(&empty(|_| {})).is_ok());
        let refused = |change: fn(&mut wgpu::Limits)| {
            let context = empty(change);
            assert!(!Context::is_usable(context.limits()));
            match Memory::new(&context) {
                Err(Error::DeviceLimit { needed, allowed, .. }) => (needed, allowed),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(refused(|limits| limits.max_storage_buffers_per_shader_stage = 7), (8, 7));
        assert_eq!(refused(|limits| limits.max_compute_invocations_per_workgroup = 128), (256, 128));
        assert_eq!(refused(|limits| limits.max_compute_workgroup_storage_size = 8192), (16384, 8192));
    }

    #[test]
    fn idle_buffers_make_room_on_a_full_device() {
        let context = empty(|_| {});
        let mut memory = Memory::new(&context).expect("memory");
        let before = memory.bytes();
        let size = Size::new(8, 8);
        let idle = memory.take(&context, size, 4096).expect("a buffer");
        let used = memory.take(&context, size, 1024).expect("a buffer");
        memory.give([idle]);
        assert_eq!(memory.bytes(), before + 5120);

        let full = || Error::OutOfMemory { what: "a plane", size, bytes: 1 };
        let asked = Cell::new(0);
        let create = |drops: bool| {
            asked.set(asked.get() + 1);
            if drops { Ok(()) } else { Err(full()) }
        };
        assert_eq!(memory.make(create), Ok(()));
        assert_eq!((asked.get(), memory.bytes()), (2, before + 1024));
        // Nothing is idle any more: it is not asked twice.
        assert_eq!(memory.make(create), Err(full()));
        assert_eq!((asked.get(), memory.bytes()), (3, before + 1024));
        memory.give([used]);
        assert_eq!(memory.make(|_| Err::<(), _>(Error::NoCamera)), Err(Error::NoCamera));
        assert_eq!(memory.make(|_| Err::<(), _>(full())), Err(full()));
        assert_eq!(memory.bytes(), before);
    }
}
