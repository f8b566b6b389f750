//! What a render tells about itself.

use std::time::Duration;

/// What one render did.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Report {
    /// Each stage of the pipeline in order, and how long it took.
    pub stages: Vec<Stage>,
    /// Smallest and largest signed diameter in the picture, in pixels.
    pub coc_range: [f32; 2],
    /// How many layers make up the result, whichever of them are shown ([`crate::Show`]): at least 1 where there are pixels. A foreground
    /// that was given on its own counts as one; a picture in focus is one.
    pub layers: usize,
    /// How many highlights were spread, where that was asked for.
    pub highlights: Option<usize>,
    /// The part of depth edges that hold in-between values, where depth was given: above
    /// [`ANTI_ALIASED_FROM`] the depth looks filtered.
    pub blended_depth_edges: Option<f32>,
}

/// From this part of [`Report::blended_depth_edges`] on, depth was probably anti-aliased.
pub const ANTI_ALIASED_FROM: f32 = 0.3;

/// One stage of a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stage {
    /// The stage's name: "circle of confusion", "layers", "blur", "composite".
    pub name: &'static str,
    /// Wall time.
    pub time: Duration,
}

impl Report {
    /// Adds time to a stage, a new one if its name is new.
    pub fn add(&mut self, name: &'static str, time: Duration) {
        match self.stages.iter_mut().find(|stage| stage.name == name) {
            Some(stage) => stage.time += time,
            None => self.stages.push(Stage { name, time }),
        }
    }

    /// Whether the depth looks anti-aliased.
    pub fn depth_looks_anti_aliased(&self) -> bool {
        self.blended_depth_edges.is_some_and(|part| part >= ANTI_ALIASED_FROM)
    }
}
