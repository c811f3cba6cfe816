//! `toponym`: talk to a mapping server, ask it where things are, play logs to it.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = cli::Args::parse();
    match tokio::runtime::Runtime::new() {
        Ok(runtime) => runtime.block_on(cli::run(args)),
        Err(e) => {
            eprintln!("error: no threads: {e}");
            ExitCode::from(cli::exit::NO_SERVER)
        }
    }
}
