//! Cutting a picture into strips of sixteen lines, and handing their values to the solvers.
//!
//! A strip's unknowns are seen as rows of sixteen values, one for each line. Along columns the picture itself has
//! that shape and is read and written in place; along rows, and where fewer than sixteen lines are left, blocks
//! of 16 x 16 go through a small buffer.

use super::forms::{Constants, Fields, Form};
use super::lanes::{LANES, Lanes};
use super::number::Number;
use pullfocus_core::diffusion::Solver;
use pullfocus_core::scheme::{FIELDS, Scheme};
use pullfocus_core::{Cancel, Error, Result, Size};

/// Unknowns of a row that are brought at a time: four cache lines, which the hardware's prefetchers like.
const ROW_CHUNK: usize = 4 * LANES;

/// Unknowns of a column that are brought at a time; each lies in another page.
const COLUMN_CHUNK: usize = LANES;

/// How far ahead rows are asked for, in pixels.
const AHEAD: usize = 2 * LANES;

/// The lines of one axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lines {
    /// Unknowns in a line.
    pub unknowns: usize,
    /// Number of lines.
    pub lines: usize,
    /// From one unknown to the next in memory.
    pub along: usize,
    /// From one line to the next in memory.
    pub across: usize,
    /// Unknowns brought at a time.
    pub chunk: usize,
    /// Lines in the first strip, so that the others start on a cache line; 0 for a full one.
    pub first: usize,
}

impl Lines {
    pub fn rows(size: Size) -> Self {
        Self {
            unknowns: size.width,
            lines: size.height,
            along: 1,
            across: size.width,
            chunk: ROW_CHUNK,
            first: 0,
        }
    }

    /// The columns of a picture whose first plane is at `at`.
    pub fn columns(size: Size, at: *const f32) -> Self {
        let first = if size.width.is_multiple_of(LANES) { at.align_offset(64) % LANES } else { 0 };
        Self {
            unknowns: size.height,
            lines: size.width,
            along: size.width,
            across: 1,
            chunk: COLUMN_CHUNK,
            first,
        }
    }

    /// How many strips there are.
    pub fn strips(&self) -> usize {
        let first = self.first.min(self.lines);
        usize::from(first > 0) + (self.lines - first).div_ceil(LANES)
    }

    pub fn strip(&self, index: usize) -> Strip {
        let first = self.first.min(self.lines);
        if first > 0 && index == 0 {
            return Strip { line: 0, lines: first };
        }
        let line = first + (index - usize::from(first > 0)) * LANES;
        Strip { line, lines: LANES.min(self.lines - line) }
    }
}

/// Up to sixteen lines beside each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strip {
    pub line: usize,
    pub lines: usize,
}

/// Everything that one pass along one axis needs, for P planes.
pub(super) struct Pass<'a, const P: usize> {
    /// The plane itself, then the fields that it becomes on the way (null where the form has none).
    pub planes: [[*mut f32; FIELDS]; P],
    /// Diameters; none where they are `uniform`.
    pub circle: Option<*const f32>,
    pub uniform: f32,
    /// Specific heat; none where it is 1.
    pub gamma: Option<*const f32>,
    pub lines: Lines,
    /// Whether the lines are columns.
    pub columns: bool,
    /// beta of a diameter of 1.
    pub beta: f64,
    pub scheme: &'a Scheme,
    pub solver: Solver,
    /// Results below this are raised to it.
    pub lower: [f32; P],
    pub cancel: &'a Cancel,
}

// SAFETY: threads share a pass, but each touches the planes' values in its own strips only, and circle and gamma
// are only read.
unsafe impl<const P: usize> Sync for Pass<'_, P> {}

/// One cache line, which is also one row of a strip.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Row([f32; LANES]);

/// What one worker needs; kept from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    rows: Vec<Row>,
}

impl Scratch {
    /// Room for `rows` rows, with values left from before.
    pub fn rows(&mut self, rows: usize) -> Result<*mut f32> {
        if self.rows.len() < rows {
            let more = rows - self.rows.len();
            self.rows.try_reserve_exact(more).map_err(|_| Error::OutOfMemory {
                what: "a strip of lines to solve",
                size: Size::new(LANES, rows),
                bytes: rows as u64 * 64,
            })?;
            self.rows.resize(rows, Row([0.0; LANES]));
        }
        Ok(self.rows.as_mut_ptr().cast())
    }

    pub fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<Row>()
    }
}

/// Where a row of sixteen values per unknown begins, and how far it is to the next unknown's.
#[derive(Clone, Copy)]
pub(super) struct View {
    at: *const f32,
    stride: usize,
}

impl View {
    /// Sixteen values of unknown `i`.
    ///
    /// # Safety
    /// The view must have that unknown, and the processor the instructions.
    #[inline(always)]
    pub unsafe fn load<V: Lanes>(self, i: usize) -> V {
        // SAFETY: the caller's promise.
        unsafe { V::load(self.at.add(i * self.stride)) }
    }
}

/// The inputs of some unknowns of a strip.
#[derive(Clone, Copy)]
pub(super) struct Inputs<const P: usize> {
    fields: [[View; FIELDS]; P],
    pub circle: View,
    pub gamma: View,
}

impl<const P: usize> Inputs<P> {
    /// The form's fields of unknown `i`; the others are the first again.
    ///
    /// # Safety
    /// As [`View::load`].
    #[inline(always)]
    pub unsafe fn fields<V: Lanes, F: Form>(&self, p: usize, i: usize) -> Fields<V> {
        // SAFETY: the caller's promise.
        unsafe {
            let mut fields = [self.fields[p][0].load(i); FIELDS];
            for (field, value) in fields.iter_mut().enumerate().take(F::IN).skip(1) {
                *value = self.fields[p][field].load(i);
            }
            fields
        }
    }
}

/// Where results go: the first OUT fields of each plane, and from one unknown to the next.
#[derive(Clone, Copy)]
pub(super) struct Outputs<const P: usize> {
    pub fields: [[*mut f32; FIELDS]; P],
    pub stride: usize,
}

/// A strip's way to its solver: the pass, which lines, and memory.
pub(super) struct Bench<'a, const P: usize> {
    pub pass: &'a Pass<'a, P>,
    strip: Strip,
    /// 2 rows of constants, then a chunk of buffer for each field, circle and gamma, then the solver's own.
    memory: *mut f32,
}

const CONSTANTS: usize = 2;

impl<'a, const P: usize> Bench<'a, P> {
    const OWN: usize = CONSTANTS + (P * FIELDS + 2) * ROW_CHUNK;

    /// Takes memory for itself and for `rows` rows of the solver.
    pub fn new(pass: &'a Pass<'a, P>, strip: Strip, scratch: &mut Scratch, rows: usize) -> Result<Self> {
        let memory = scratch.rows(Self::OWN + rows)?;
        for lane in 0..LANES {
            // SAFETY: two rows of constants lead the memory.
            unsafe {
                *memory.add(lane) = pass.uniform;
                *memory.add(LANES + lane) = 1.0;
            }
        }
        Ok(Self { pass, strip, memory })
    }

    /// The solver's rows.
    #[inline(always)]
    pub fn solver_rows(&self) -> *mut f32 {
        // SAFETY: `new` made the memory larger than this.
        unsafe { self.memory.add(Self::OWN * LANES) }
    }

    #[inline(always)]
    fn buffer(&self, which: usize) -> *mut f32 {
        // SAFETY: within OWN rows.
        unsafe { self.memory.add((CONSTANTS + which * ROW_CHUNK) * LANES) }
    }

    /// Whether strips lie in memory as the solver wants them.
    #[inline(always)]
    fn direct(&self) -> bool {
        self.pass.lines.across == 1 && self.strip.lines == LANES
    }

    /// Where unknown `i` of the strip's first line is in a plane.
    #[inline(always)]
    fn offset(&self, i: usize) -> usize {
        self.strip.line * self.pass.lines.across + i * self.pass.lines.along
    }

    /// The inputs of unknowns `start..start + len`, `len` at most a chunk.
    ///
    /// # Safety
    /// The unknowns must be there, and the processor must have the instructions.
    #[inline(always)]
    pub unsafe fn inputs<V: Lanes, F: Form>(&self, start: usize, len: usize) -> Inputs<P> {
        let pass = self.pass;
        // SAFETY: the caller's promise.
        unsafe {
            let constant = |row: usize| View { at: self.memory.add(row * LANES), stride: 0 };
            let view =
                |plane: *const f32, which: usize| self.view::<V>(plane, start, len, self.buffer(which));
            // No closures of Option or arrays around vectors: they would be compiled without the instructions.
            let mut fields = [[constant(0); FIELDS]; P];
            for (p, fields) in fields.iter_mut().enumerate() {
                for (field, to) in fields.iter_mut().enumerate().take(F::IN) {
                    *to = view(pass.planes[p][field], p * FIELDS + field);
                }
            }
            let circle = match pass.circle {
                Some(circle) => view(circle, P * FIELDS),
                None => constant(0),
            };
            let gamma = match pass.gamma {
                Some(gamma) => view(gamma, P * FIELDS + 1),
                None => constant(1),
            };
            Inputs { fields, circle, gamma }
        }
    }

    #[inline(always)]
    unsafe fn view<V: Lanes>(&self, plane: *const f32, start: usize, len: usize, buffer: *mut f32) -> View {
        let Lines { along, across, .. } = self.pass.lines;
        // SAFETY: lines and unknowns of the strip are in the plane; the buffer has a row for each.
        unsafe {
            let from = plane.add(self.offset(start));
            if self.direct() {
                // Not asked for ahead: loads of sixteen rows at a time do not wait for each other anyway, and prefetches made
                // large pictures slower.
                return View { at: from, stride: along };
            }
            if along == 1 && self.strip.lines == LANES {
                let whole = len - len % LANES;
                for i in (0..whole).step_by(LANES) {
                    let mut block = [V::splat(0.0); LANES];
                    for (l, row) in block.iter_mut().enumerate() {
                        *row = V::load(from.add(l * across + i));
                        V::prefetch(from.wrapping_add(l * across + i + AHEAD));
                    }
                    V::transpose(&mut block);
                    for (j, row) in block.iter().enumerate() {
                        row.store(buffer.add((i + j) * LANES));
                    }
                }
                for i in whole..len {
                    for l in 0..LANES {
                        *buffer.add(i * LANES + l) = *from.add(i + l * across);
                    }
                }
            } else {
                buffer.write_bytes(0, len * LANES);
                for i in 0..len {
                    for l in 0..self.strip.lines {
                        *buffer.add(i * LANES + l) = *from.add(i * along + l * across);
                    }
                }
            }
        }
        View { at: buffer, stride: LANES }
    }

    /// Where to write the results of unknowns `start..`, up to a chunk of them; [`Bench::written`] must follow.
    #[inline(always)]
    pub fn outputs<F: Form>(&self, start: usize) -> Outputs<P> {
        let along = self.pass.lines.along;
        let mut fields = [[std::ptr::null_mut(); FIELDS]; P];
        for (p, fields) in fields.iter_mut().enumerate() {
            for (field, to) in fields.iter_mut().enumerate().take(F::OUT) {
                if self.direct() {
                    // SAFETY: the strip's unknowns are in the plane.
                    *to = unsafe { self.pass.planes[p][field].add(self.offset(start)) };
                } else {
                    *to = self.buffer(p * FIELDS + field);
                }
            }
        }
        Outputs { fields, stride: if self.direct() { along } else { LANES } }
    }

    /// Takes results out of the buffer, if they went there.
    ///
    /// # Safety
    /// The unknowns must be there, and the processor must have the instructions.
    #[inline(always)]
    pub unsafe fn written<V: Lanes, F: Form>(&self, start: usize, len: usize) {
        if self.direct() {
            return;
        }
        for p in 0..P {
            for field in 0..F::OUT {
                // SAFETY: the caller's promise.
                unsafe {
                    self.put::<V>(self.pass.planes[p][field], start, len, self.buffer(p * FIELDS + field))
                };
            }
        }
    }

    #[inline(always)]
    unsafe fn put<V: Lanes>(&self, plane: *mut f32, start: usize, len: usize, buffer: *const f32) {
        let Lines { along, across, .. } = self.pass.lines;
        // SAFETY: as in `view`.
        unsafe {
            let to = plane.add(self.offset(start));
            if along == 1 && self.strip.lines == LANES {
                let whole = len - len % LANES;
                for i in whole..len {
                    for l in 0..LANES {
                        *to.add(i + l * across) = *buffer.add(i * LANES + l);
                    }
                }
                for i in (0..whole).step_by(LANES).rev() {
                    let mut block = [V::splat(0.0); LANES];
                    for (j, row) in block.iter_mut().enumerate() {
                        *row = V::load(buffer.add((i + j) * LANES));
                    }
                    V::transpose(&mut block);
                    for (l, row) in block.iter().enumerate() {
                        row.store(to.add(l * across + i));
                        V::prefetch(to.wrapping_add(l * across + i).wrapping_sub(2 * AHEAD));
                    }
                }
            } else {
                for i in 0..len {
                    for l in 0..self.strip.lines {
                        *to.add(i * along + l * across) = *buffer.add(i * LANES + l);
                    }
                }
            }
        }
    }
}

impl Bench<'_, 1> {
    /// Adds a term of the integrator, whose solution is `value(unknown)`, to the sum at `sum` (OUT rows an
    /// unknown), given what was kept at `kept` (KEPT rows an unknown).
    ///
    /// # Safety
    /// The processor must have the instructions, and the memory the rows.
    #[inline(always)]
    pub unsafe fn add_term<V: Lanes, N: Number<V>, F: Form, const FIRST: bool>(
        &self,
        sum: *mut f32,
        kept: *const f32,
        k: &Constants<V, N>,
        value: impl Fn(usize) -> N,
    ) {
        for j in 0..self.pass.lines.unknowns {
            // SAFETY: the caller's promise.
            unsafe {
                let mut keeps = [k.zero; 2];
                for (which, keep) in keeps.iter_mut().enumerate().take(F::KEPT) {
                    *keep = V::load(kept.add((j * F::KEPT + which) * LANES));
                }
                let to = sum.add(j * F::OUT * LANES);
                let mut fields = [k.zero; FIELDS];
                if !FIRST {
                    for (field, before) in fields.iter_mut().enumerate().take(F::OUT) {
                        *before = V::load(to.add(field * LANES));
                    }
                }
                let fields = F::result::<V, N, FIRST>(value(j), keeps, fields, k);
                for (field, value) in fields.into_iter().enumerate().take(F::OUT) {
                    value.store(to.add(field * LANES));
                }
            }
        }
    }

    /// Writes the sum of terms into the planes.
    ///
    /// # Safety
    /// As [`Bench::add_term`].
    #[inline(always)]
    pub unsafe fn put_sum<V: Lanes, F: Form>(&self, sum: *const f32) {
        let n = self.pass.lines.unknowns;
        let chunk = self.pass.lines.chunk;
        for from in (0..n).step_by(chunk) {
            let len = chunk.min(n - from);
            let to = self.outputs::<F>(from);
            // SAFETY: `outputs` has room for `len` unknowns; the sum is the caller's promise.
            unsafe {
                let lower = V::splat(self.pass.lower[0]);
                for i in 0..len {
                    for field in 0..F::OUT {
                        let mut value = V::load(sum.add(((from + i) * F::OUT + field) * LANES));
                        if field == 0 {
                            value = value.max(lower);
                        }
                        value.store(to.fields[0][field].add(i * to.stride));
                    }
                }
                self.written::<V, F>(from, len);
            }
        }
    }
}
