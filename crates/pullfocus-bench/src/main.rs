//! Unpublished: benchmarks, the quality table, the papers' figures. Each command writes tables into `docs/results` and
//! pictures into `docs/pictures`, with the machine, the commit and the command that made them.

mod adapter;
mod bokeh;
mod chart;
mod data;
mod difference;
mod figures;
mod frames;
mod gpu;
mod growing;
mod jacobi;
mod panels;
mod place;
mod quality;
mod same;
mod speed;
mod spreading;
mod spreading_figures;
mod squares;
mod table;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Measures pullfocus and draws the papers' figures.
#[derive(Parser)]
#[command(name = "pullfocus-bench")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The second paper's appendix: error of Jacobi against sweeps and against size.
    Jacobi(jacobi::Options),
    /// Scores every method against path-traced references.
    Quality(quality::Options),
    /// The papers' figures with our scenes: each failure and its cure.
    Figures(figures::Options),
    /// A blur that grows across a picture, by both of the pyramid's choices and by naive spreading.
    Growing(growing::Options),
    /// The third paper's figures 8 to 12: what spreading costs and how far it is from naive spreading.
    Spreading(spreading::Options),
    /// What square spreading's family costs, and how close it comes.
    Squares(squares::Options),
    /// The third paper's figures 2 to 7: levels, matrices, sites.
    SpreadingFigures(spreading_figures::Options),
    /// Frames per second, time per unknown, memory.
    Speed(speed::Options),
    /// A GPU: solvers, whole frames, storage; beside the papers, a memory copy and cuSPARSE.
    Gpu(gpu::Options),
    /// Highlights beside path-traced lights, and their shapes.
    Bokeh(bokeh::Options),
    /// Whether the GPU makes the CPU's pictures; fails where it does not.
    Same(same::Options),
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::Jacobi(options) => jacobi::run(&options),
        Command::Quality(options) => quality::run(&options),
        Command::Figures(options) => figures::run(&options),
        Command::Growing(options) => growing::run(&options),
        Command::Spreading(options) => spreading::run(&options),
        Command::Squares(options) => squares::run(&options),
        Command::SpreadingFigures(options) => spreading_figures::run(&options),
        Command::Speed(options) => speed::run(&options),
        Command::Gpu(options) => gpu::run(&options),
        Command::Bokeh(options) => bokeh::run(&options),
        Command::Same(options) => same::run(&options),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_fit_together() {
        Arguments::command().debug_assert();
    }
}
