//! Unpublished: what the tests and the benchmarks of pullfocus measure against.
//!
//! - [`mod@reference`]: the method in f64, plain and slow: one line of code per formula of the papers.
//! - [`spread`]: brute-force blurs (Gaussian, disc by depth) that other methods are compared with.
//! - [`scenes`]: pictures whose right answer is known from a formula.
//! - [`conformance`]: checks that every backend has to pass, written once.

pub mod conformance;
pub mod grid;
pub mod random;
pub mod reference;
pub mod scenes;
pub mod spread;

pub use grid::Grid;
