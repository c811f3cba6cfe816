//! `toponym say`.

use super::{Failure, exit};
use std::time::Duration;
use toponym::Guide;
use toponym_proto::answer::HeardStatus;

/// Arguments of `say`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym say 'this is the gym'
  toponym say 'the library is down the hall' --robot r07 --speaker anna

It speaks of the place where the robot is now. Exit code 1 if it was not understood.")]
pub struct SayArgs {
    /// The sentence.
    text: String,
    /// To which robot; may be left out where there is exactly one.
    #[arg(long)]
    robot: Option<String>,
    /// Who says it.
    #[arg(long)]
    speaker: Option<String>,
    /// How long to wait for the robot's answer.
    #[arg(long, value_name = "S", default_value = "10", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn say(endpoint: &str, site: &str, args: &SayArgs) -> Result<u8, Failure> {
    let session = toponym::open(endpoint).await?;
    let mut guide = Guide::connect(&session, site, args.robot.as_deref()).await?;
    guide.speaker.clone_from(&args.speaker);
    let heard = guide.say(&args.text, args.timeout).await?;
    println!("{}", heard.words);
    Ok(match heard.status {
        HeardStatus::Understood => exit::FOUND,
        HeardStatus::NotUnderstood => exit::NOT_KNOWN,
        HeardStatus::Refused => exit::REFUSED,
    })
}
