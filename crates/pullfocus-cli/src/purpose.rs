//! The commands that run a job.

/// What a job is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// `render`.
    Render,
    /// `coc`.
    Coc,
}
