//! The program pullfocus: depth of field for rendered frames and photographs.

fn main() -> std::process::ExitCode {
    pullfocus_cli::run::main()
}
