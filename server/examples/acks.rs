//! How long a robot waits until what it sent is on disk, and a planner for an answer, from the map and without: a server, a robot at 40 Hz and a
//! planner in one process, over loopback, for `SECONDS` (10).
//!
//! `cargo run --release -p toponym-server --example acks -- [SECONDS] [DATA_FOLDER]`

use std::path::PathBuf;
use std::time::{Duration, Instant};
use toponym::{Guide, Planner, Robot, RobotConfig};
use toponym_proto::{Clock, Keys};
use toponym_server::config::ServerConfig;
use toponym_server::serve::Server;
use toponym_sim::hall::message;

/// From message to message.
const PERIOD: Duration = Duration::from_millis(25);
/// Rays of a sweep.
const BEAMS: u16 = 361;

#[tokio::main]
async fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let seconds: u64 = arguments.next().map_or(Ok(10), |text| text.parse())?;
    let given = arguments.next().map(PathBuf::from);
    let data = given
        .clone()
        .unwrap_or_else(|| std::env::temp_dir().join(format!("toponym-acks-{}", std::process::id())));
    let listen = vec!["tcp/127.0.0.1:0".into()];
    let server =
        Server::start(ServerConfig { listen, data: data.clone(), ..ServerConfig::default() }, None).await?;
    let endpoint = server.endpoints().first().ok_or("no endpoint")?.clone();
    let session = toponym::open(&endpoint).await?;
    let config = RobotConfig { clock: Clock::Log, ..RobotConfig::new("r1") };
    let mut robot = Robot::connect(&session, config).await?;
    let planner = Planner::new(&session, "default", "main", Duration::from_secs(10))?;
    let guide = Guide::connect(&session, "default", Some("r1")).await?;
    let time = Keys::new("default")?.time();
    let (mut acks, mut answers, mut floor) = (Vec::new(), Vec::new(), Vec::new());
    let began = Instant::now();
    for n in 0.. {
        let sent = Instant::now();
        if began.elapsed() >= Duration::from_secs(seconds) {
            break;
        }
        robot.send(message(n, "main", BEAMS)).await?;
        robot.settle().await?;
        acks.push(sent.elapsed());
        if n == 10 {
            guide.publish(&guide.sentence("this is the gym")).await?;
        }
        // After odometry, when the filter rests: what is measured is the way and the answer.
        if n > 40 && n % 4 == 1 {
            let asked = Instant::now();
            planner.where_is("gym").await?;
            answers.push(asked.elapsed());
        }
        // What needs no map.
        if n > 40 && n % 4 == 3 {
            let asked = Instant::now();
            let reply = session.get(&time).await.map_err(|e| e.to_string())?;
            reply.recv_async().await.map_err(|e| e.to_string())?;
            floor.push(asked.elapsed());
        }
        tokio::time::sleep((sent + PERIOD).saturating_duration_since(Instant::now())).await;
    }
    tell("acknowledged", &mut acks);
    tell("answered where", &mut answers);
    tell("answered the time", &mut floor);
    server.stop().await?;
    if given.is_none() {
        std::fs::remove_dir_all(data)?;
    }
    Ok(())
}

fn tell(what: &str, times: &mut [Duration]) {
    times.sort_unstable();
    let at = |share: f64| times.get((times.len() as f64 * share) as usize).copied().unwrap_or_default();
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    println!(
        "{what}: {} times, p50 {:.2} ms, p99 {:.2} ms, longest {:.2} ms",
        times.len(),
        ms(at(0.5)),
        ms(at(0.99)),
        times.last().map_or(0.0, |time| ms(*time))
    );
}
