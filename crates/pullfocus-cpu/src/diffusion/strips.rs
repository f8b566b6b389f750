//! Cutting a picture into strips of sixteen lines, and bringing strips to the solvers.
//!
//! A strip's unknowns are seen as rows of sixteen values, one for each line. Along columns the picture itself has
//! that shape and is read and written in place; along rows, and where fewer than sixteen lines are left, blocks
//! of 16 x 16 go through a small buffer. Which thread takes which strip has no influence on any value.

use super::lanes::{Instructions, Kernel, LANES, Lanes};
use super::number::{Complex, LEAST_GAMMA, Number, Real};
use super::{cyclic_reduction, jacobi, lu};
use pullfocus_core::diffusion::{JacobiStop, Solver};
use pullfocus_core::{Cancel, Error, Result, Size};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Unknowns that go through the buffer at a time.
pub(super) const CHUNK: usize = LANES;

/// The most planes solved together.
pub(super) const MOST_PLANES: usize = 4;

/// The most terms of an integrator.
pub(super) const MOST_TERMS: usize = 2;

/// One solve whose solution is one term of the integrator's sum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    /// Unit factor of gamma: 1, or minus the pole over its length.
    pub sigma: [f32; 2],
    /// What beta is multiplied with: 1, or 1 over the pole's length.
    pub beta: f64,
    /// The term's value is `re - h im` of its solution; it keeps constants.
    pub h: f32,
    /// The first term's value, then `value + share (term - value)`.
    pub share: f32,
}

/// An integrator, ready to be solved.
#[derive(Debug, Clone)]
pub(super) struct Scheme {
    pub complex: bool,
    pub terms: Vec<Term>,
    pub steps: u32,
}

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
    /// Lines in the first strip, so that the others start on a cache line; 0 for a full one.
    pub first: usize,
}

impl Lines {
    pub fn rows(size: Size) -> Self {
        Self { unknowns: size.width, lines: size.height, along: 1, across: size.width, first: 0 }
    }

    /// The columns of a picture whose first plane is at `at`.
    pub fn columns(size: Size, at: *const f32) -> Self {
        let first = if size.width.is_multiple_of(LANES) { (at.align_offset(64)) % LANES } else { 0 };
        Self { unknowns: size.height, lines: size.width, along: size.width, across: 1, first }
    }

    fn strips(&self) -> usize {
        let first = self.first.min(self.lines);
        usize::from(first > 0) + (self.lines - first).div_ceil(LANES)
    }

    fn strip(&self, index: usize) -> Strip {
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
    pub planes: [*mut f32; P],
    /// Diameters; none where they are `uniform`.
    pub circle: Option<*const f32>,
    pub uniform: f32,
    /// Specific heat; none where it is 1.
    pub gamma: Option<*const f32>,
    pub lines: Lines,
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
pub(super) struct Row(pub [f32; LANES]);

/// What one worker needs; kept from frame to frame.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    rows: Vec<Row>,
}

impl Scratch {
    /// Room for `rows` rows, with values left from before.
    fn rows(&mut self, rows: usize) -> Result<*mut f32> {
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
    pub at: *const f32,
    pub stride: usize,
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
    pub planes: [View; P],
    pub circle: View,
    pub gamma: View,
}

/// A strip's way to its solver: the pass, which lines, and memory.
pub(super) struct Bench<'a, const P: usize> {
    pub pass: &'a Pass<'a, P>,
    pub strip: Strip,
    /// 2 rows of constants, then (P + 2) CHUNK rows of buffer, then the solver's own.
    memory: *mut f32,
}

const CONSTANTS: usize = 2;

impl<const P: usize> Bench<'_, P> {
    const OWN: usize = CONSTANTS + (P + 2) * CHUNK;

    /// The solver's rows.
    #[inline(always)]
    pub fn solver_rows(&self) -> *mut f32 {
        // SAFETY: `solve_strip` made the memory larger than this.
        unsafe { self.memory.add(Self::OWN * LANES) }
    }

    #[inline(always)]
    fn buffer(&self, which: usize) -> *mut f32 {
        // SAFETY: within OWN rows.
        unsafe { self.memory.add((CONSTANTS + which * CHUNK) * LANES) }
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

    /// The inputs of unknowns `start..start + len`, `len` at most [`CHUNK`].
    ///
    /// # Safety
    /// The unknowns must be there, and the processor must have the instructions.
    #[inline(always)]
    pub unsafe fn inputs<V: Lanes>(&self, start: usize, len: usize) -> Inputs<P> {
        let pass = self.pass;
        // SAFETY: the caller's promise.
        unsafe {
            let constant = |row: usize| View { at: self.memory.add(row * LANES), stride: 0 };
            let view =
                |plane: *const f32, which: usize| self.view::<V>(plane, start, len, self.buffer(which));
            let mut planes = [constant(0); P];
            for (p, to) in planes.iter_mut().enumerate() {
                *to = view(pass.planes[p], p);
            }
            Inputs {
                planes,
                circle: pass.circle.map_or(constant(0), |c| view(c, P)),
                gamma: pass.gamma.map_or(constant(1), |g| view(g, P + 1)),
            }
        }
    }

    #[inline(always)]
    unsafe fn view<V: Lanes>(&self, plane: *const f32, start: usize, len: usize, buffer: *mut f32) -> View {
        let Lines { unknowns, along, across, .. } = self.pass.lines;
        // SAFETY: lines and unknowns of the strip are in the plane; the buffer has CHUNK rows.
        unsafe {
            let from = plane.add(self.offset(start));
            if self.direct() {
                for i in CHUNK..(2 * CHUNK).min(unknowns - start) {
                    V::prefetch(from.add(i * along));
                }
                return View { at: from, stride: along };
            }
            if along == 1 && self.strip.lines == LANES && len == CHUNK {
                let mut block = [V::splat(0.0); LANES];
                for (l, row) in block.iter_mut().enumerate() {
                    *row = V::load(from.add(l * across));
                    V::prefetch(from.wrapping_add(l * across + 3 * LANES));
                }
                V::transpose(&mut block);
                for (i, row) in block.iter().enumerate() {
                    row.store(buffer.add(i * LANES));
                }
            } else {
                buffer.write_bytes(0, CHUNK * LANES);
                for i in 0..len {
                    for l in 0..self.strip.lines {
                        *buffer.add(i * LANES + l) = *from.add(i * along + l * across);
                    }
                }
            }
        }
        View { at: buffer, stride: LANES }
    }

    /// Where to write the results of unknowns `start..`, up to CHUNK of them, and the stride;
    /// [`Bench::written`] must follow.
    #[inline(always)]
    pub fn outputs<V: Lanes>(&self, start: usize) -> ([*mut f32; P], usize) {
        let along = self.pass.lines.along;
        let mut to = [std::ptr::null_mut(); P];
        for (p, to) in to.iter_mut().enumerate() {
            if self.direct() {
                // SAFETY: the strip's unknowns are in the plane.
                *to = unsafe { self.pass.planes[p].add(self.offset(start)) };
                for i in 1..=CHUNK.min(start) {
                    V::prefetch(to.wrapping_sub(i * along));
                }
            } else {
                *to = self.buffer(p);
            }
        }
        (to, if self.direct() { along } else { LANES })
    }

    /// Takes results out of the buffer, if they went there.
    ///
    /// # Safety
    /// The unknowns must be there, and the processor must have the instructions.
    #[inline(always)]
    pub unsafe fn written<V: Lanes>(&self, start: usize, len: usize) {
        if self.direct() {
            return;
        }
        let Lines { along, across, .. } = self.pass.lines;
        // SAFETY: as in `view`.
        unsafe {
            for p in 0..P {
                let to = self.pass.planes[p].add(self.offset(start));
                let buffer = self.buffer(p);
                if along == 1 && self.strip.lines == LANES && len == CHUNK {
                    let mut block = [V::splat(0.0); LANES];
                    for (i, row) in block.iter_mut().enumerate() {
                        *row = V::load(buffer.add(i * LANES));
                    }
                    V::transpose(&mut block);
                    for (l, row) in block.iter().enumerate() {
                        row.store(to.add(l * across));
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
}

impl<const P: usize> Bench<'_, P> {
    /// Adds a term of the integrator, whose solution is `value(unknown, plane)`, to the sum at `sum`, P rows an
    /// unknown.
    ///
    /// # Safety
    /// The processor must have the instructions, and `sum` the rows.
    #[inline(always)]
    pub unsafe fn add_term<V: Lanes, N: Number<V>>(
        &self,
        sum: *mut f32,
        first: bool,
        k: &Constants<V, N>,
        value: impl Fn(usize, usize) -> N,
    ) {
        for j in 0..self.pass.lines.unknowns {
            for p in 0..P {
                let mut y = value(j, p).project(k.h);
                // SAFETY: the caller's promise.
                unsafe {
                    let to = sum.add((j * P + p) * LANES);
                    if !first {
                        let before = V::load(to);
                        y = k.share.mul_add(y.sub(before), before);
                    }
                    y.store(to);
                }
            }
        }
    }

    /// Writes the sum of terms into the planes.
    ///
    /// # Safety
    /// As [`Bench::add_term`].
    #[inline(always)]
    pub unsafe fn put_sum<V: Lanes>(&self, sum: *const f32) {
        let n = self.pass.lines.unknowns;
        for from in (0..n).step_by(CHUNK) {
            let len = CHUNK.min(n - from);
            let (to, stride) = self.outputs::<V>(from);
            // SAFETY: `outputs` has room for `len` unknowns; the sum is the caller's promise.
            unsafe {
                for i in 0..len {
                    for (p, to) in to.iter().enumerate() {
                        let value = V::load(sum.add(((from + i) * P + p) * LANES));
                        value.max(V::splat(self.pass.lower[p])).store(to.add(i * stride));
                    }
                }
                self.written::<V>(from, len);
            }
        }
    }
}

struct LuKernel<'a, const P: usize, const COMPLEX: bool>(Bench<'a, P>);

impl<const P: usize, const COMPLEX: bool> Kernel for LuKernel<'_, P, COMPLEX> {
    type Output = [f32; P];
    #[inline(always)]
    unsafe fn run<V: Lanes>(self) -> Self::Output {
        // SAFETY: the caller promises the instructions; `solve_strip` made the memory.
        unsafe {
            if COMPLEX { lu::solve::<V, Complex<V>, P>(&self.0) } else { lu::solve::<V, Real<V>, P>(&self.0) }
        }
    }
}

/// The two solvers that hold a whole strip in memory.
struct WholeKernel<'a, const P: usize, const COMPLEX: bool>(Bench<'a, P>);

impl<const P: usize, const COMPLEX: bool> WholeKernel<'_, P, COMPLEX> {
    #[inline(always)]
    unsafe fn solve<V: Lanes, N: Number<V>>(&self) -> Result<[f32; P]> {
        // SAFETY: the caller promises the instructions; `solve_strip` made the memory.
        unsafe {
            match self.0.pass.solver {
                Solver::Jacobi(stop) => jacobi::solve::<V, N, P>(&self.0, stop),
                _ => Ok(cyclic_reduction::solve::<V, N, P>(&self.0)),
            }
        }
    }
}

impl<const P: usize, const COMPLEX: bool> Kernel for WholeKernel<'_, P, COMPLEX> {
    type Output = Result<[f32; P]>;
    #[inline(always)]
    unsafe fn run<V: Lanes>(self) -> Self::Output {
        // SAFETY: the caller's promise.
        unsafe { if COMPLEX { self.solve::<V, Complex<V>>() } else { self.solve::<V, Real<V>>() } }
    }
}

fn solve_strip<const P: usize>(
    pass: &Pass<'_, P>,
    strip: Strip,
    instructions: Instructions,
    scratch: &mut Scratch,
) -> Result<[f32; P]> {
    let n = pass.lines.unknowns;
    let parts = if pass.scheme.complex { 2 } else { 1 };
    let rows = match pass.solver {
        Solver::Lu => lu::rows(n, P, parts, pass.scheme.terms.len()),
        Solver::CyclicReduction => cyclic_reduction::rows(n, P, parts),
        Solver::Jacobi(_) => jacobi::rows(n, P, parts),
    };
    let memory = scratch.rows(Bench::<P>::OWN + rows)?;
    for lane in 0..LANES {
        // SAFETY: two rows of constants lead the memory.
        unsafe {
            *memory.add(lane) = pass.uniform;
            *memory.add(LANES + lane) = 1.0;
        }
    }
    let bench = Bench { pass, strip, memory };
    match (pass.solver, pass.scheme.complex) {
        (Solver::Lu, false) => Ok(instructions.run(LuKernel::<P, false>(bench))),
        (Solver::Lu, true) => Ok(instructions.run(LuKernel::<P, true>(bench))),
        (_, false) => instructions.run(WholeKernel::<P, false>(bench)),
        (_, true) => instructions.run(WholeKernel::<P, true>(bench)),
    }
}

/// Solves every line of a pass; the smallest value that came in (0 at most) for each plane.
pub(super) fn solve<const P: usize>(
    pass: &Pass<'_, P>,
    instructions: Instructions,
    scratches: &mut Vec<Scratch>,
) -> Result<[f32; P]> {
    let strips = pass.lines.strips();
    let small = pass.lines.lines * pass.lines.unknowns < 1 << 12;
    let workers = if small { 1 } else { rayon::current_num_threads().clamp(1, strips.max(1)) };
    if scratches.len() < workers {
        scratches.resize_with(workers, Scratch::default);
    }
    let next = AtomicUsize::new(0);
    let work = |scratch: &mut Scratch| -> Result<[f32; P]> {
        let mut least = [0.0; P];
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= strips {
                return Ok(least);
            }
            pass.cancel.check()?;
            least = smaller(least, solve_strip(pass, pass.lines.strip(index), instructions, scratch)?);
        }
    };
    if workers == 1 {
        return work(&mut scratches[0]);
    }
    scratches[..workers]
        .par_iter_mut()
        .with_max_len(1)
        .map(work)
        .try_reduce(|| [0.0; P], |a, b| Ok(smaller(a, b)))
}

fn smaller<const P: usize>(a: [f32; P], b: [f32; P]) -> [f32; P] {
    std::array::from_fn(|p| a[p].min(b[p]))
}

/// The constants of one term in registers.
#[derive(Clone, Copy)]
pub(super) struct Constants<V, N> {
    pub zero: V,
    pub one: V,
    pub beta: V,
    pub most_beta: V,
    pub least_gamma: V,
    pub tiny: V,
    pub sigma: N,
    pub h: V,
    pub share: V,
}

impl<V: Lanes, N: Number<V>> Constants<V, N> {
    /// # Safety
    /// The processor must have the instructions.
    #[inline(always)]
    pub unsafe fn new(beta: f64, term: &Term) -> Self {
        // SAFETY: the caller's promise.
        unsafe {
            Self {
                zero: V::splat(0.0),
                one: V::splat(1.0),
                beta: V::splat((beta * term.beta) as f32),
                most_beta: V::splat(super::number::MOST_BETA),
                least_gamma: V::splat(LEAST_GAMMA),
                tiny: V::splat(1e-30),
                sigma: N::splat(term.sigma),
                h: V::splat(term.h),
                share: V::splat(term.share),
            }
        }
    }

    /// beta of the link between two circles: of the smaller one, squared.
    #[inline(always)]
    pub fn link(&self, a: V, b: V) -> V {
        let c = a.abs().min(b.abs());
        c.mul(c).mul(self.beta).min(self.most_beta)
    }
}

/// What Jacobi's stop means in numbers: most sweeps, and the tolerance if there is one.
pub(super) fn stop(stop: JacobiStop) -> (u32, Option<f32>) {
    match stop {
        JacobiStop::Sweeps(sweeps) => (sweeps, None),
        JacobiStop::Tolerance(t) => (pullfocus_core::diffusion::JACOBI_MOST_SWEEPS, Some(t)),
    }
}
