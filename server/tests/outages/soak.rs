//! Long runs: a robot that stands must not make the server grow, one that maps does so by place.
//!
//! `TOPONYM_SOAK_S` sets how long each lasts (5).

use crate::drive::{PATIENCE, Server, connected, setting};
use std::time::{Duration, Instant};
use toponym::{Connection, Planner, Robot, RobotConfig};
use toponym_proto::{Clock, Header, Stamp};
use toponym_sim::hall::{self, PERIOD_NS};

/// Messages a second: 20 times those of a robot at 40 Hz.
const PER_S: u32 = 800;
/// Shorter runs only warm up.
const SOAK: Duration = Duration::from_secs(60);

/// Sends messages for a while; memory of the server by second.
async fn soak(server: &Server, map: &str, robot: &str, x_m: impl Fn(u64) -> f64) -> Vec<u64> {
    let session = connected(&Connection::to(&server.endpoint)).await;
    let config = RobotConfig { clock: Clock::Log, boot: 1, ..RobotConfig::new(robot) };
    let mut robot = Robot::connect(&session, config).await.unwrap();
    let (time, began) = (Duration::from_secs(setting("TOPONYM_SOAK_S", 5)), Instant::now());
    let (mut memory, mut n) = (Vec::new(), 0);
    let mut tick = tokio::time::interval(Duration::from_secs(1) / PER_S);
    while began.elapsed() < time {
        let header = Header { stamp: Stamp { ns: n * PERIOD_NS }, ..Header::default() };
        let message = match n {
            0 => hall::setup(header, map),
            _ if n % 2 == 1 => hall::odom(header, x_m(n as u64)),
            _ => hall::scan(header, x_m(n as u64), 181),
        };
        robot.send(message).await.unwrap();
        n += 1;
        if began.elapsed().as_secs() as usize > memory.len() {
            memory.push(server.memory_bytes());
        }
        tick.tick().await;
    }
    robot.settle().await.unwrap();
    assert_eq!(robot.acked().unwrap().lost, 0);
    let planner = Planner::new(&session, "default", map, PATIENCE).unwrap();
    planner.save().await.unwrap();
    let places = planner.graph().await.unwrap().places.len();
    let tenths = |k: usize| memory[k * memory.len() / 10] >> 10;
    println!("{map}: kB by tenths of the time {:?}", (0..10).map(tenths).collect::<Vec<_>>());
    println!("{map}: {n} messages, {places} places, {} MB at the end", server.memory_bytes() >> 20);
    memory
}

/// Median over the tenth of the time around a share of it: a checkpoint that is just written is no growth.
fn around(memory: &[u64], share: f64) -> u64 {
    let at = |share: f64| (share * memory.len() as f64) as usize;
    let mut tenth = memory[at(share - 0.05)..at(share + 0.05).max(at(share - 0.05) + 1)].to_vec();
    tenth.sort_unstable();
    tenth[tenth.len() / 2]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_robot_that_stands_takes_no_memory() {
    let server = Server::new();
    let memory = soak(&server, "standing", "r1", |_| 2.0).await;
    let (early, late) = (around(&memory, 0.2), around(&memory, 0.95));
    let ratio = late as f64 / early as f64;
    println!("memory {} MB after a fifth of the time, {} MB at the end: {ratio:.3}", early >> 20, late >> 20);
    assert!(Duration::from_secs(memory.len() as u64) < SOAK || ratio <= 1.05, "it grows");
    let mapping = soak(&server, "mapping", "r2", |n| 2.0 + 8.0 * (n as f64 / 500.0).sin().abs()).await;
    println!("mapping: {} MB before, {} MB after", mapping[0] >> 20, mapping.last().unwrap() >> 20);
}
