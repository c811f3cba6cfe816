//! `toponym status`: how a server does, from outside.

use super::{Failure, exit};
use std::fmt::Write as _;
use std::time::{Duration, Instant};
use toponym::{Connection, Planner};
use toponym_proto::answer::Info;

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
    Ok(if info.troubles().is_empty() { exit::FOUND } else { exit::NOT_KNOWN })
}

fn told(info: &Info, took: Duration) -> String {
    let mut text = format!("{}, site {}: answered in {} ms\n", info.server, info.site, took.as_millis());
    for map in &info.maps {
        let _ = write!(text, "map    {:<16} epoch {}, rev {}", map.id, map.epoch, map.rev);
        if let Some(work) = info.work.iter().find(|work| work.map == map.id) {
            let kb = work.backlog_bytes.div_ceil(1000);
            let _ = write!(
                text,
                "; robot {}, {kb} kB on their way, {} held, filter {:.1} s behind, last sync {:.0} ms",
                work.robot,
                work.held,
                work.lag_s,
                1e3 * work.sync_s
            );
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
    let left = [("disk", info.machine.disk_left_bytes), ("memory", info.machine.memory_left_bytes)];
    let left =
        left.iter().filter_map(|(what, bytes)| Some(format!("{what} {:.1} GB", (*bytes)? as f64 / 1e9)));
    let _ = writeln!(text, "left   {}", left.collect::<Vec<_>>().join(", "));
    if !info.reached.is_empty() {
        let reached: Vec<String> =
            info.reached.iter().map(|(limit, times)| format!("{limit} {times}×")).collect();
        let _ = writeln!(text, "limits reached: {}", reached.join(", "));
    }
    if info.overrun > 0 {
        let _ = writeln!(text, "{} messages were dropped because they came too fast", info.overrun);
    }
    let troubles = info.troubles();
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
    use toponym_proto::answer::{Counts, Machine, MapWork, RobotState};

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
            reached: [("maps".to_owned(), 2)].into(),
            machine: Machine { disk_left_bytes: Some(2_500_000_000), ..Machine::default() },
        };
        let all = told(&info(well.clone(), None), Duration::ZERO);
        assert!(all.ends_with("left   disk 2.5 GB\nlimits reached: maps 2×\nall is well\n"), "{all}");
        let full = told(&info(well.clone(), Some("no space left")), Duration::ZERO);
        assert!(full.contains("TROUBLE  map main: no space left"), "{full}");
        let ill = RobotState { counts: Counts { lost: 3, ..Counts::default() }, ..well };
        let lost = told(&info(ill, None), Duration::ZERO);
        assert!(lost.contains("TROUBLE  robot r1: 3 messages lost"), "{lost}");
    }
}
