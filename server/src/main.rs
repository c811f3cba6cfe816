//! Command line of the mapping server.

use clap::{Parser, Subcommand};
use std::process::ExitCode;
use toponym_server::access::{CertArgs, UserArgs};
use toponym_server::serve::{self, LogFormat, ServeArgs};
use toponym_server::{access, demo, export, journals, map};

/// Particles make and drop many arrays of a few kilobytes, which the system's allocator scatters.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Maps buildings from robots' scans and people's sentences.
#[derive(Debug, Parser)]
#[command(name = "toponym-server", version, arg_required_else_help = true)]
#[command(after_help = "Start with `toponym-server demo`: it needs no robot and takes half a minute.")]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// How logs are written to stderr
    #[arg(long, global = true, value_enum, default_value_t)]
    log_format: LogFormat,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve maps over Zenoh
    Serve(ServeArgs),
    Map(Box<map::MapArgs>),
    Show(map::ShowArgs),
    Ask(map::AskArgs),
    Export(export::ExportArgs),
    Demo(demo::DemoArgs),
    Journal(journals::JournalArgs),
    User(UserArgs),
    Cert(CertArgs),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Command::Serve(serve) => {
            serve::init_logging(cli.log_format);
            block_on(serve::run(serve))
        }
        Command::Map(map) => map::run(&map),
        Command::Show(show) => map::show(&show),
        Command::Export(export) => export::run(&export),
        Command::Ask(ask) => match map::ask(&ask) {
            Ok(false) => return ExitCode::FAILURE,
            done => done.map(|_| ()),
        },
        Command::Journal(journal) => journals::run(&journal),
        Command::User(user) => access::edit_users(&user),
        Command::Cert(cert) => access::make_certificate(&cert),
        Command::Demo(demo) => {
            demo::init_logging();
            block_on(demo::run(demo))
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {}", told(&e));
            ExitCode::FAILURE
        }
    }
}

fn block_on(work: impl Future<Output = anyhow::Result<()>>) -> anyhow::Result<()> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build()?.block_on(work)
}

/// An error and its causes, each once: some repeat their cause already.
fn told(error: &anyhow::Error) -> String {
    error.chain().map(ToString::to_string).fold(String::new(), |text, cause| {
        if text.is_empty() {
            cause
        } else if text.ends_with(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn a_cause_is_told_once() {
        let error = anyhow!("no such file").context("log.clf: no such file").context("--start-map");
        assert_eq!(told(&error), "--start-map: log.clf: no such file");
    }

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
