//! Plays a bag as its robot would have sent it, over a router of its own, and looks up transforms as its navigation would.

use anyhow::{Context, bail};
use clap::Parser;
use rand::{RngExt, SeedableRng};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use toponym_ros::bag::Bag;
use toponym_ros::cdr;
use toponym_ros::msg::LaserScan;
use toponym_ros::plan::{Plan, Survey, kind};
use toponym_ros::wire::Hashes;
use toponym_tests::ros_robot::RosRobot;

/// Play a bag over a Zenoh router, as rmw_zenoh would
#[derive(Parser)]
#[command(after_help = "\
Example:
  play_ros BAG --rate 20 &
  toponym-server serve --ros")]
struct Args {
    /// Folder or file of rosbag2
    bag: PathBuf,
    /// Where its router listens
    #[arg(long, default_value = "tcp/127.0.0.1:7447")]
    listen: String,
    /// So many times faster than it was
    #[arg(long, default_value_t = 1.0)]
    rate: f64,
    /// ROS_DOMAIN_ID
    #[arg(long, default_value_t = 0)]
    domain: u32,
    /// Put in front of all topics
    #[arg(long, default_value = "")]
    namespace: String,
    /// Transforms come so much later, seconds of the bag
    #[arg(long, default_value_t = 0.0)]
    late_tf: f64,
    /// Share of scans that get lost
    #[arg(long, default_value_t = 0.0)]
    lose: f64,
    /// Tell types as Humble does, without hashes
    #[arg(long)]
    humble: bool,
    /// Stay for so long afterwards, seconds
    #[arg(long, default_value_t = 5.0)]
    stay: f64,
}

struct Played {
    at_ns: i64,
    topic: String,
    kind: String,
    data: Vec<u8>,
    is_lost: bool,
}

fn messages(args: &Args) -> anyhow::Result<(Vec<Played>, Plan)> {
    let mut bag = Bag::open(&args.bag).map_err(anyhow::Error::msg)?;
    let (mut survey, mut all) = (Survey::new(&[]), Vec::new());
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    while let Some(raw) = bag.next() {
        let topic = bag.topics()[raw.topic].clone();
        let _ = survey.take(&topic, &raw.data);
        let is_lost = topic.kind == kind::SCAN && rng.random::<f64>() < args.lose;
        let late_s = if topic.name.ends_with("/tf") { args.late_tf } else { 0.0 };
        let at_ns = raw.received_ns + (late_s * 1e9) as i64;
        let name = format!("{}{}", args.namespace, topic.name);
        all.push(Played { at_ns, topic: name, kind: topic.kind, data: raw.data, is_lost });
    }
    all.sort_by_key(|m| m.at_ns);
    Ok((all, survey.plan().map_err(anyhow::Error::msg)?))
}

#[tokio::main]
async fn main() -> anyhow::Result<()> {
    let args = Args::parse();
    let (all, plan) = messages(&args)?;
    let Some(first) = all.first() else { bail!("there is nothing in it") };
    let why = |e: zenoh::Error| anyhow::anyhow!("{e}");
    let hashes = if args.humble { Hashes::None } else { Hashes::OfTypes };
    let mut robot = RosRobot::start(&args.listen, args.domain, &args.namespace, hashes).await.map_err(why)?;
    println!("a robot at {}; waiting for toponym", robot.endpoint());
    robot.wait_for_toponym().await.map_err(why)?;
    let transforms = robot.transforms(&format!("{}/tf", args.namespace)).await.map_err(why)?;
    let moving = plan.moving().cloned();
    let (start, first_ns) = (Instant::now(), first.at_ns);
    let (mut scans, mut missed, mut first_found) = (Vec::new(), 0, None);
    for message in &all {
        let due = Duration::from_secs_f64((message.at_ns - first_ns) as f64 * 1e-9 / args.rate);
        tokio::time::sleep(due.saturating_sub(start.elapsed())).await;
        if message.is_lost {
            robot.lose(&message.topic, &message.kind);
            continue;
        }
        if message.kind == kind::SCAN {
            let scan: LaserScan = cdr::read(&message.data).map_err(anyhow::Error::msg)?;
            scans.push(scan.header.stamp.ns());
        }
        let sent = robot.publish(&message.topic, &message.kind, message.data.clone()).await;
        sent.map_err(anyhow::Error::msg).context(message.topic.clone())?;
        if let (kind::SCAN, Some(m), Some(&stamp_ns)) = (message.kind.as_str(), &moving, scans.last()) {
            // Where its navigation would ask: at the scan, as soon as that is there.
            let found = transforms.look_up("map", &m.parent, stamp_ns);
            first_found = first_found.or(found.map(|_| scans.len()));
            missed += usize::from(found.is_none());
        }
    }
    tokio::time::sleep(Duration::from_secs_f64(args.stay)).await;
    let mut periods_s = transforms.periods_s();
    periods_s.sort_by(f64::total_cmp);
    let at =
        |share: f64| periods_s.get((share * periods_s.len() as f64) as usize).copied().unwrap_or_default();
    println!("played {} messages, {} scans", all.len(), scans.len());
    println!(
        "map → {}: found first at scan {}, not found at {missed}; every {:.1} ms, p99 {:.1} ms",
        moving.map_or_else(|| "?".to_owned(), |m| m.parent),
        first_found.unwrap_or_default(),
        1e3 * at(0.5),
        1e3 * at(0.99)
    );
    robot.stop().await.map_err(why)
}
