//! From the process's arguments to its exit code.

use crate::args::{Cli, Command};
use crate::commands;
use clap::{CommandFactory, Parser};
use pullfocus_core::Cancel;
use pullfocus_job::failure::Result;
use std::io::Write;
use std::process::ExitCode;

/// Runs the program.
pub fn main() -> ExitCode {
    quiet_drivers();
    start_log();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    let cancel = Cancel::new();
    let flag = cancel.clone();
    // Without a handler Ctrl-C still ends the program, only less tidily.
    let _ = ctrlc::set_handler(move || {
        if flag.is_cancelled() {
            // Asked twice: at once.
            std::process::exit(1);
        }
        flag.cancel();
    });
    match dispatch(cli.command, &cancel) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            complain(&failure.to_string());
            ExitCode::from(&failure)
        }
    }
}

/// Vulkan drivers on Linux complain on standard error, once for each device that is looked at, where a session has no
/// folder for sockets (farms, containers); nothing here needs one.
fn quiet_drivers() {
    const NAME: &str = "XDG_RUNTIME_DIR";
    if cfg!(target_os = "linux") && std::env::var_os(NAME).is_none() {
        // SAFETY: this is the start of the program, and no other thread is there to read the environment.
        unsafe { std::env::set_var(NAME, std::env::temp_dir()) };
    }
}

/// What the libraries log is shown where `PULLFOCUS_LOG` asks for it (`PULLFOCUS_LOG=debug`).
fn start_log() {
    if let Ok(filter) = tracing_subscriber::EnvFilter::try_from_env("PULLFOCUS_LOG") {
        // A logger that is already there stays.
        let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
    }
}

fn complain(sentence: &str) {
    let _ = writeln!(std::io::stderr(), "pullfocus: error: {sentence}");
}

/// Help and version go to standard output; mistakes to standard error, in this program's form.
fn refuse(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    let text = error.to_string();
    complain(text.strip_prefix("error: ").unwrap_or(&text).trim_end());
    ExitCode::from(2)
}

fn dispatch(command: Command, cancel: &Cancel) -> Result<()> {
    match command {
        Command::Render(args) => commands::render::run(*args, cancel),
        Command::Coc(args) => commands::coc::run(*args, cancel),
        Command::Camera(args) => commands::camera::run(*args),
        Command::Inspect(args) => commands::inspect::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Demo(args) => commands::demo::run(&args, cancel),
        Command::Devices(args) => commands::devices::run(&args),
        Command::View(args) => commands::view::run(*args, cancel),
        Command::Bench(args) => commands::bench::run(&args, cancel),
        Command::Completions { shell } => {
            // Into memory first: clap_complete panics where standard output is closed.
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "pullfocus", &mut script);
            let _ = std::io::stdout().write_all(&script);
            Ok(())
        }
    }
}
