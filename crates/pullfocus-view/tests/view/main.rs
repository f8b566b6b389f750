//! The window's flows, on a device that draws: ignored where there is none.
//!
//! With `PULLFOCUS_TEST_GPU=required` no adapter is a failure.

mod color;
mod ends;
mod files;
mod flows;
mod frames;
mod kept;
mod pictures;
mod window;

use libtest_mimic::{Arguments, Trial};
use std::sync::{PoisonError, RwLock};

/// What measures the process's memory runs while nothing else does.
static COMPANY: RwLock<()> = RwLock::new(());

fn main() {
    let arguments = Arguments::from_args();
    let there = !pullfocus_gpu::adapters().is_empty();
    if !there && std::env::var("PULLFOCUS_TEST_GPU").is_ok_and(|value| value == "required") {
        eprintln!("PULLFOCUS_TEST_GPU=required, and there is no adapter");
        std::process::exit(101);
    }
    let all =
        [color::TESTS, flows::TESTS, pictures::TESTS, files::TESTS, frames::TESTS, ends::TESTS, kept::TESTS];
    let tests = all.into_iter().flatten();
    let trials = tests
        .map(|&(name, test)| {
            let run = move || {
                let alone = name.starts_with("memory");
                let _company = (!alone).then(|| COMPANY.read().unwrap_or_else(PoisonError::into_inner));
                let _solitude = alone.then(|| COMPANY.write().unwrap_or_else(PoisonError::into_inner));
                test();
                Ok(())
            };
            Trial::test(name, run).with_ignored_flag(!there)
        })
        .collect();
    libtest_mimic::run(&arguments, trials).exit();
}
