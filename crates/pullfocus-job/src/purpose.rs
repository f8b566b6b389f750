//! The commands that run a job.

/// What a job is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// `render`.
    Render,
    /// `coc`.
    Coc,
    /// `view`: outputs need not be named yet.
    View,
}

impl Purpose {
    /// The command's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Render => "render",
            Self::Coc => "coc",
            Self::View => "view",
        }
    }
}
