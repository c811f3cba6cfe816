//! `toponym replay`.

use super::{Failure, exit};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use toponym::log::{self, Narration, Options};
use toponym::replay::{Progress, Replayed};
use toponym::{Connection, Replay, RobotConfig};
use toponym_proto::Clock;

/// Arguments of `replay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym replay office.clf.gz --speed 20
  toponym replay tour.clf.gz --narration narration.jsonl --speed max --map floor2

LOG is CARMEN text (FLASER, ROBOTLASER1, ODOM, PARAM lines) or a file of `serve --record`, either
of them gzipped; or a ROS 2 bag: its folder, an .mcap or a .db3. A narration has a sentence a line: {\"t\": 8, \"text\": \"this is the gym\"}, with t
in the log's own stamps, or t_rel in seconds since its first. Returns when the server has taken in
all of it.")]
pub struct ReplayArgs {
    /// The log.
    log: PathBuf,
    /// Of a bag take these topics alone, and transforms; without, what is there tells which are the robot's.
    #[arg(long, value_name = "TOPIC,…", value_delimiter = ',')]
    topics: Vec<String>,
    /// What the guide says, a JSON object a line.
    #[arg(long, value_name = "FILE")]
    narration: Option<PathBuf>,
    /// Seconds of the log per second, or `max`: as fast as the server takes it.
    #[arg(long, value_name = "X", default_value = "1", value_parser = speed)]
    speed: Speed,
    /// Play it as this robot.
    #[arg(long, default_value = "log")]
    robot: String,
    /// Into this map.
    #[arg(long, default_value = "main")]
    map: String,
    /// Number of this start of the robot, must grow from replay to replay [default: Unix time].
    #[arg(long, value_name = "N")]
    boot: Option<u64>,
    /// Longest time without any acknowledgement: a cut that is shorter is waited out.
    #[arg(long, value_name = "S", default_value = "3600", value_parser = super::seconds)]
    timeout: Duration,
    /// Keep on disk what the server does not have yet: sending does not wait during a cut, and what is left is sent by the
    /// next replay.
    #[arg(long, value_name = "FOLDER")]
    spool: Option<PathBuf>,
}

/// Seconds of the log per second; none: unlimited.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Speed(Option<f64>);

fn speed(text: &str) -> Result<Speed, String> {
    match text.parse::<f64>() {
        _ if text == "max" => Ok(Speed(None)),
        Ok(x) if x.is_finite() && x > 0.0 => Ok(Speed(Some(x))),
        _ => Err("must be a number above 0, or max".into()),
    }
}

pub async fn replay(to: &Connection, site: &str, args: &ReplayArgs) -> Result<u8, Failure> {
    let narration = args.narration.as_deref().map(Narration::read).transpose()?.unwrap_or_default();
    let options = Options { robot: args.robot.clone(), map: args.map.clone(), boot: 0 };
    let mut log = log::merged(toponym_ros::log::open(&args.log, &options, &args.topics)?, &narration);
    let session = to.open().await?;
    let mut robot = RobotConfig::new(&args.robot);
    robot.site = site.into();
    robot.clock = Clock::Log;
    robot.boot = args.boot.unwrap_or(robot.boot);
    robot.patience = args.timeout;
    robot.spool.clone_from(&args.spool);
    let boot = robot.boot;
    let replay = Replay { robot, map: Some(args.map.clone()), speed: args.speed.0 };
    let (bar, begin) = (bar(), Instant::now());
    let played = replay.run(&session, &mut *log, &mut |progress| show(&bar, &progress)).await;
    bar.finish_and_clear();
    log.notes().warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
    let played = played?;
    println!("{}", summary(&played, boot, begin.elapsed()));
    log.notes().check()?;
    match played.ack.map_or(0, |ack| ack.lost) {
        0 if played.heard < played.sentences => Err(Failure::Unheard(played.sentences - played.heard)),
        0 => Ok(exit::FOUND),
        lost => Err(Failure::Lost(lost)),
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {percent:>3} % {msg}");
    ProgressBar::new(1).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    match progress {
        Progress::Sent { bytes: (done, all), log_s, in_flight } => {
            bar.set_length(*all);
            bar.set_position(*done);
            bar.set_message(format!("{log_s:.0} s of the log, {in_flight} messages in flight"));
        }
        Progress::Heard(text, heard) => {
            let line = format!("{text:?}: {}", heard.words);
            if bar.is_hidden() { eprintln!("{line}") } else { bar.println(line) }
        }
        Progress::Settling => bar.set_message("waiting for the acknowledgement of the last message"),
        Progress::Filtering => bar.set_message("waiting for the map"),
    }
}

fn summary(played: &Replayed, boot: u64, took: Duration) -> String {
    let acked = played.ack.as_ref().map_or("nothing".into(), |ack| format!("all up to seq {}", ack.seq));
    format!(
        "{} messages and {} sentences in {:.1} s into map {}; the server acknowledged {acked} of {} (boot {boot})",
        played.messages,
        played.sentences,
        took.as_secs_f64(),
        played.map,
        played.last_seq,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::Ack;

    #[test]
    fn speeds() {
        assert_eq!(speed("max"), Ok(Speed(None)));
        assert_eq!(speed("2.5"), Ok(Speed(Some(2.5))));
        for bad in ["0", "-1", "nan", "inf", "fast"] {
            assert!(speed(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_summary_tells_the_watermark() {
        let ack = Ack { v: 1, robot: "log".into(), boot: 7, seq: 41, lost: 0 };
        let played = Replayed {
            messages: 42,
            last_seq: 41,
            map: "main".into(),
            ack: Some(ack),
            ..Replayed::default()
        };
        let text = summary(&played, 7, Duration::from_secs(2));
        assert!(text.contains("acknowledged all up to seq 41 of 41 (boot 7)"), "{text}");
    }
}
