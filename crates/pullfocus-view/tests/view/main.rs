//! The window's flows, on a device that draws: ignored where there is none.
//!
//! With `PULLFOCUS_TEST_GPU=required` no adapter is a failure.

mod color;
mod files;
mod flows;
mod pictures;
mod window;

use libtest_mimic::{Arguments, Trial};

fn main() {
    let mut arguments = Arguments::from_args();
    // One after the other: one of them measures the process's memory, which other windows would be in.
    arguments.test_threads.get_or_insert(1);
    let there = !pullfocus_gpu::adapters().is_empty();
    if !there && std::env::var("PULLFOCUS_TEST_GPU").is_ok_and(|value| value == "required") {
        eprintln!("PULLFOCUS_TEST_GPU=required, and there is no adapter");
        std::process::exit(101);
    }
    let tests = color::TESTS.iter().chain(flows::TESTS).chain(pictures::TESTS).chain(files::TESTS);
    let trials = tests
        .map(|&(name, test)| {
            let run = move || {
                test();
                Ok(())
            };
            Trial::test(name, run).with_ignored_flag(!there)
        })
        .collect();
    libtest_mimic::run(&arguments, trials).exit();
}
