//! `toponym`: talk to a mapping server, ask it where things are, play logs to it.

mod commands;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let args = commands::Args::parse();
    match tokio::runtime::Runtime::new() {
        Ok(runtime) => runtime.block_on(commands::run(args)),
        Err(e) => {
            eprintln!("error: no threads: {e}");
            ExitCode::from(commands::exit::NO_SERVER)
        }
    }
}
