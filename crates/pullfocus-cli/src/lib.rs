//! The program `pullfocus`, as a library so that its parts can be tested and fuzzed: arguments ([`args`],
//! [`options`]) and settings files ([`config`]) become a job ([`job`]), which is run ([`commands`]) and told of
//! ([`console`], [`report`]).

pub mod args;
pub mod camera;
pub mod commands;
pub mod config;
pub mod console;
pub mod describe;
pub mod draw;
pub mod failure;
pub mod frames;
pub mod job;
pub mod load;
pub mod options;
pub mod overlap;
pub mod purpose;
pub mod report;
pub mod run;
pub mod settings;
pub mod shot;
pub mod storage;
pub mod threads;
pub mod values;
pub mod yielding;
