//! The program `pullfocus`, as a library so that its parts can be tested: arguments ([`args`]) become a job
//! ([`pullfocus_job`]), which is run ([`commands`]) and told of ([`console`], [`report`]).

pub mod args;
pub mod commands;
pub mod console;
pub mod describe;
pub mod overlap;
pub mod report;
pub mod run;
