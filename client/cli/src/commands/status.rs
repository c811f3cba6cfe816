//! `toponym status`: how a server does, from outside.

use super::{Failure, exit};
use std::fmt::Write as _;
use std::time::{Duration, Instant};
use toponym::{Connection, Planner};
use toponym_proto::answer::{Info, MapWork, RobotState};

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Exit code 0 if all is well, 1 if a map is not served, a journal can't be written, a robot's messages are refused, lost
or of no use; 3 without a server.")]
pub struct StatusArgs {
    /// The answer as JSON.
    #[arg(long)]
    json: bool,
    /// How long to wait for the answer.
    #[arg(long, value_name = "S", default_value = "10", value_parser = super::seconds)]
    timeout: Duration,
}

pub async fn status(to: &Connection, site: &str, args: &StatusArgs) -> Result<u8, Failure> {
    let session = to.open().await?;
    let asked = Instant::now();
    let info = Planner::new(&session, site, "main", args.timeout)?.info().await?;
    let took = asked.elapsed();
    if args.json {
        println!("{}", serde_json::to_string_pretty(&info).unwrap_or_default());
    } else {
        print!("{}", told(&info, took));
    }
    Ok(if troubles(&info).is_empty() { exit::FOUND } else { exit::NOT_KNOWN })
}

/// What is not as it should be, in words.
fn troubles(info: &Info) -> Vec<String> {
    let broken = info.broken.iter().map(|problem| problem.message.clone());
    let journal = |map: &MapWork| Some(format!("map {}: {}", map.map, map.trouble.as_ref()?));
    let robot = |robot: &RobotState| {
        let counts = &robot.counts;
        let mut why: Vec<String> =
            [(counts.lost, "lost"), (counts.refused, "refused"), (counts.unused, "of no use")]
                .into_iter()
                .filter(|(count, _)| *count > 0)
                .map(|(count, what)| format!("{count} messages {what}"))
                .collect();
        why.extend(robot.error.as_ref().map(|e| e.message.clone()));
        why.extend(robot.unused.clone());
        (!why.is_empty()).then(|| format!("robot {}: {}", robot.robot, why.join("; ")))
    };
    broken.chain(info.work.iter().filter_map(journal)).chain(info.robots.iter().filter_map(robot)).collect()
}

fn told(info: &Info, took: Duration) -> String {
    let mut text = format!("{}, site {}: answered in {} ms\n", info.server, info.site, took.as_millis());
    for map in &info.maps {
        let _ = write!(text, "map    {:<16} epoch {}, rev {}", map.id, map.epoch, map.rev);
        if let Some(work) = info.work.iter().find(|work| work.map == map.id) {
            let kb = work.backlog_bytes.div_ceil(1000);
            let _ = write!(text, "; robot {}, {kb} kB on their way, {} held", work.robot, work.held);
        }
        text.push('\n');
    }
    for robot in &info.robots {
        let (map, counts) = (robot.map.as_deref().unwrap_or("no map"), &robot.counts);
        let _ = writeln!(
            text,
            "robot  {:<16} on {map}: {} taken, {} came again, {} stale, {} refused, {} lost, {} of no use",
            robot.robot,
            counts.taken,
            counts.repeated,
            counts.stale,
            counts.refused,
            counts.lost,
            counts.unused
        );
    }
    if info.overrun > 0 {
        let _ = writeln!(text, "{} messages were dropped because they came too fast", info.overrun);
    }
    let troubles = troubles(info);
    for trouble in &troubles {
        let _ = writeln!(text, "TROUBLE  {trouble}");
    }
    if troubles.is_empty() {
        text.push_str("all is well\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::Counts;

    #[test]
    fn what_is_wrong_is_told() {
        let well = RobotState { robot: "r1".into(), map: Some("main".into()), ..RobotState::default() };
        let info = |robot, trouble: Option<&str>| Info {
            v: 1,
            server: "toponym-server".into(),
            site: "default".into(),
            maps: vec![],
            robots: vec![robot],
            overrun: 0,
            work: vec![MapWork {
                map: "main".into(),
                trouble: trouble.map(Into::into),
                ..MapWork::default()
            }],
            broken: vec![],
        };
        assert!(told(&info(well.clone(), None), Duration::ZERO).ends_with("all is well\n"));
        let full = told(&info(well.clone(), Some("no space left")), Duration::ZERO);
        assert!(full.contains("TROUBLE  map main: no space left"), "{full}");
        let ill = RobotState { counts: Counts { lost: 3, ..Counts::default() }, ..well };
        let lost = told(&info(ill, None), Duration::ZERO);
        assert!(lost.contains("TROUBLE  robot r1: 3 messages lost"), "{lost}");
    }
}
