//! The command line: arguments, exit codes, and one function per command.

mod area;
mod bag;
mod dictate;
mod find;
mod grid;
mod mend;
mod play;
mod status;
mod talk;

use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;
use toponym::{ClientError, Connection};
use toponym_proto::Invalid;
use toponym_proto::keys::DEFAULT_SITE;
use toponym_sim::args::SimulateArgs;

/// Exit codes.
pub mod exit {
    /// It was found, said, played.
    pub const FOUND: u8 = 0;
    /// The name is not known, the sentence was not understood.
    pub const NOT_KNOWN: u8 = 1;
    /// Wrong arguments or input files.
    pub const USAGE: u8 = 2;
    /// Nobody answers.
    pub const NO_SERVER: u8 = 3;
    /// The answer did not come in time.
    pub const TIMEOUT: u8 = 4;
    /// The server said no.
    pub const REFUSED: u8 = 5;
}

/// Talk to a toponym mapping server.
///
/// Robots send it what they see, people tell it what places are called, and it answers where
/// the kitchen is.
#[derive(Debug, Parser)]
#[command(
    name = "toponym",
    version,
    after_help = "\
Try, with `toponym-server serve` running in another terminal:
  toponym simulate tour                          make a log of a simulated robot
  toponym simulate tour2 --plan FILE.xml --lidar rplidar --wheels rough --people 5
  toponym replay tour/sim.clf --narration tour/narration.jsonl --speed 20
  toponym labels                                 what was it told?
  toponym where kitchen                          how far, which way, how sure?
  toponym what                                   what is the room called where the robot is?
  toponym nearest restroom                       which one is nearest by the way there?
  toponym rooms                                  how large, what called, where do they lead?
  toponym grid map.png                           what stands where, as a picture
  toponym say 'this is the workshop'             teach it another name

Exit codes: 0 found, 1 not known, 2 usage, 3 no server, 4 timeout, 5 refused."
)]
pub struct Args {
    /// Where the server listens [env: TOPONYM_CONNECT] [default: tcp/127.0.0.1:7457].
    #[arg(long, global = true, value_name = "ENDPOINT")]
    connect: Option<String>,
    /// Site, the second part of every key.
    #[arg(long, global = true, default_value = DEFAULT_SITE)]
    site: String,
    #[command(flatten)]
    who: Who,
    #[command(subcommand)]
    command: Command,
}

/// As whom to connect.
#[derive(Debug, clap::Args)]
struct Who {
    /// As this user [env: TOPONYM_USER]; the password is in TOPONYM_PASSWORD, or in a file.
    #[arg(long, global = true, value_name = "NAME")]
    user: Option<String>,
    /// First line is the user's password.
    #[arg(long, global = true, value_name = "FILE")]
    password_file: Option<PathBuf>,
    /// Authority that signed the server's certificate, for quic/… [env: TOPONYM_CA].
    #[arg(long, global = true, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// The user's certificate [env: TOPONYM_CERT].
    #[arg(long, global = true, value_name = "FILE", requires = "key")]
    cert: Option<PathBuf>,
    /// The certificate's key [env: TOPONYM_KEY].
    #[arg(long, global = true, value_name = "FILE", requires = "cert")]
    key: Option<PathBuf>,
}

impl Who {
    /// To where, as whom: what is given here goes before the environment.
    fn connection(&self, endpoint: &str) -> Result<Connection, Failure> {
        let mut to = Connection::of_environment(endpoint);
        if let Some(file) = &self.password_file {
            let text = std::fs::read_to_string(file)
                .map_err(|e| Invalid::new("password-file", format!("{}: {e}", file.display())))
                .map_err(ClientError::Invalid)?;
            to.password = text.lines().next().map(str::to_owned);
        }
        to.user = self.user.clone().or(to.user);
        to.ca = self.ca.clone().or(to.ca);
        to.certificate = self.cert.clone().zip(self.key.clone()).or(to.certificate);
        Ok(to)
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Tell a robot what a place is called.
    Say(talk::SayArgs),
    /// Ask where a place is.
    Where(find::WhereArgs),
    /// List all names taught so far.
    Labels(find::AskedArgs),
    /// What is this, where the robot is or at a point of the map?
    What(find::WhatArgs),
    /// Where is the nearest of its kind, by the way there from the robot?
    Nearest(find::WhereArgs),
    /// Send the robot to where something is.
    Go(find::GoArgs),
    /// List the rooms: how large, what they are called, where they lead.
    Rooms(find::AskedArgs),
    /// Write what stands where as a picture.
    Grid(grid::GridArgs),
    /// Take a sentence back.
    Undo(mend::UndoArgs),
    /// Give a misheard name its right spelling.
    Rename(mend::RenameArgs),
    /// Forget a name.
    Forget(mend::ForgetArgs),
    /// Tell where the robot is.
    InitialPose(mend::InitialPoseArgs),
    /// Tell what an area is called, or that robots keep out of it.
    Area(area::AreaArgs),
    /// Tell all names and areas of a file.
    Import(area::ImportArgs),
    /// End a map, and make room for another.
    Delete(mend::DeleteArgs),
    /// How does the server do?
    Status(status::StatusArgs),
    /// Play a recorded log to the server, as robot and guide.
    Replay(play::ReplayArgs),
    Simulate(SimulateArgs),
    /// Write a recorded log as a ROS 2 bag.
    Bag(bag::BagArgs),
}

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
enum Failure {
    #[error(transparent)]
    Client(#[from] ClientError),
    #[error(transparent)]
    Log(#[from] toponym::log::LogError),
    #[error(transparent)]
    Misread(#[from] toponym::log::Misread),
    #[error(transparent)]
    Narration(#[from] toponym::log::NarrationError),
    #[error(transparent)]
    Simulate(#[from] toponym_sim::args::SimulateError),
    #[error("DATA LOSS: the server gave up {0} messages; see its log")]
    Lost(u64),
    #[error("{0} sentences without an answer: it is not known what became of them")]
    Unheard(u64),
    #[error("{0}")]
    Unreadable(String),
    #[error("output: {0}")]
    Output(#[from] std::io::Error),
}

impl Failure {
    fn code(&self) -> u8 {
        match self {
            Self::Client(ClientError::NoServer { .. } | ClientError::Zenoh(_)) => exit::NO_SERVER,
            Self::Client(ClientError::Timeout { .. }) | Self::Unheard(_) => exit::TIMEOUT,
            Self::Client(ClientError::Refused(_) | ClientError::Unreadable { .. }) | Self::Lost(_) => {
                exit::REFUSED
            }
            Self::Client(ClientError::Invalid(_) | ClientError::Spool(_))
            | Self::Log(_)
            | Self::Misread(_)
            | Self::Narration(_)
            | Self::Simulate(_)
            | Self::Unreadable(_)
            | Self::Output(_) => exit::USAGE,
        }
    }
}

/// Runs a command; errors go to standard error.
pub async fn run(args: Args) -> ExitCode {
    ExitCode::from(done(&args).await.unwrap_or_else(|failure| {
        eprintln!("error: {failure}");
        failure.code()
    }))
}

async fn done(args: &Args) -> Result<u8, Failure> {
    let to = args.who.connection(&toponym::endpoint(args.connect.as_deref()))?;
    match &args.command {
        Command::Say(say) => talk::say(&to, &args.site, say).await,
        Command::Where(asked) => find::find(&to, &args.site, asked).await,
        Command::Labels(asked) => find::labels(&to, &args.site, asked).await,
        Command::What(asked) => find::what(&to, &args.site, asked).await,
        Command::Nearest(asked) => find::nearest(&to, &args.site, asked).await,
        Command::Go(asked) => find::go(&to, &args.site, asked).await,
        Command::Rooms(asked) => find::rooms(&to, &args.site, asked).await,
        Command::Grid(grid) => grid::grid(&to, &args.site, grid).await,
        Command::Undo(undo) => mend::undo(&to, &args.site, undo).await,
        Command::Rename(rename) => mend::rename(&to, &args.site, rename).await,
        Command::Forget(forget) => mend::forget(&to, &args.site, forget).await,
        Command::InitialPose(told) => mend::initial_pose(&to, &args.site, told).await,
        Command::Area(told) => area::area(&to, &args.site, told).await,
        Command::Import(told) => area::import(&to, &args.site, told).await,
        Command::Delete(delete) => mend::delete(&to, &args.site, delete).await,
        Command::Status(asked) => status::status(&to, &args.site, asked).await,
        Command::Replay(replay) => play::replay(&to, &args.site, replay).await,
        Command::Simulate(simulate) => simulated(simulate),
        Command::Bag(asked) => bag::bag(asked),
    }
}

fn simulated(args: &SimulateArgs) -> Result<u8, Failure> {
    println!("{}", toponym_sim::args::run(args)?);
    Ok(exit::FOUND)
}

/// Seconds to wait, as an argument.
fn seconds(text: &str) -> Result<std::time::Duration, String> {
    let s: f64 = text.parse().map_err(|_| format!("{text:?} is not a number"))?;
    std::time::Duration::try_from_secs_f64(s).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::time::Duration;
    use toponym_proto::answer::{ErrorCode, Problem};

    #[test]
    fn the_arguments_are_sound() {
        Args::command().debug_assert();
    }

    #[test]
    fn failures_have_the_documented_exit_codes() {
        let refused = Problem::new(ErrorCode::MapTaken, "taken");
        let timeout = ClientError::Timeout { what: "a".into(), after: Duration::ZERO };
        let nobody = ClientError::NoServer { endpoint: "a".into(), why: "b".into() };
        let invalid = toponym_proto::Invalid::new("text", "is empty");
        for (error, code) in [
            (ClientError::Invalid(invalid), 2),
            (nobody, 3),
            (timeout, 4),
            (ClientError::Refused(refused), 5),
        ] {
            assert_eq!(Failure::from(error).code(), code);
        }
    }

    #[test]
    fn seconds_are_not_negative() {
        assert_eq!(seconds("1.5"), Ok(Duration::from_millis(1500)));
        assert!(seconds("-1").is_err() && seconds("soon").is_err() && seconds("nan").is_err());
    }
}
