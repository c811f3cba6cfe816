//! `toponym bag`.

use super::{Failure, exit};
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::PathBuf;
use toponym::log::{self, Narration, Options};
use toponym_proto::Message;
use toponym_ros::bag::BagWriter;
use toponym_ros::robot::AsRos;

/// Arguments of `bag`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  toponym simulate office --building office && toponym bag office/sim.rec office.mcap
  toponym bag tour.clf.gz tour.mcap --narration narration.jsonl

The bag has /scan, /tf (odom → base_link), /tf_static, and what was said on /speech: as a ROS 2 robot records it (rosbag2, MCAP), for
`ros2 bag play`, Foxglove, slam_toolbox, or `toponym-server map`. LOG is what `toponym replay` plays.")]
pub struct BagArgs {
    /// The log.
    log: PathBuf,
    /// The bag, an .mcap; what was there is gone.
    bag: PathBuf,
    /// What the guide says, a JSON object a line.
    #[arg(long, value_name = "FILE")]
    narration: Option<PathBuf>,
}

pub fn bag(args: &BagArgs) -> Result<u8, Failure> {
    let narration = args.narration.as_deref().map(Narration::read).transpose()?.unwrap_or_default();
    let mut log = log::merged(toponym_ros::log::open(&args.log, &Options::default(), &[])?, &narration);
    let file = File::create(&args.bag)
        .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", args.bag.display())))?;
    let why = |e: String| io::Error::other(format!("{}: {e}", args.bag.display()));
    let (mut bag, mut as_ros) = (BagWriter::new(BufWriter::new(file)).map_err(why)?, AsRos::default());
    let mut count = 0;
    for record in log.by_ref() {
        let at = match &record.message {
            Message::Say(say) => say.began,
            _ => None,
        };
        if let Some(published) = as_ros.of(&record.message).map_err(why)? {
            let at_ns = at.unwrap_or(as_ros.newest()).ns;
            bag.put(&published.topic, published.kind, at_ns, &published.data).map_err(why)?;
            count += 1;
        }
    }
    bag.finish().map_err(why)?;
    log.notes().warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
    log.notes().check()?;
    println!("{}: {count} messages", args.bag.display());
    Ok(exit::FOUND)
}
