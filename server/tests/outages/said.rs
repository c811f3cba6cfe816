//! A guide who speaks while the server is away, and whose own program ends meanwhile: what was said counts where the robot
//! was then.

use crate::drive::{PATIENCE, Server, connected};
use std::time::{Duration, Instant};
use toponym::{Connection, Guide, Planner, Robot, RobotConfig};
use toponym_proto::record::RecordReader;
use toponym_proto::{Clock, Header, Message, Stamp};
use toponym_sim::hall;

/// Times on the robot's clock are right to this.
const RIGHT_S: f64 = 0.5;

/// A robot that keeps time with the server, on a clock of its own.
struct Live {
    robot: Robot,
    began: Instant,
    sent: u64,
}

impl Live {
    fn now(&self) -> Stamp {
        Stamp { ns: 1_000_000_000_000 + self.began.elapsed().as_nanos() as i64 }
    }

    async fn go_while(&mut self, goes_on: impl Fn() -> bool) {
        let mut tick = tokio::time::interval(Duration::from_millis(20));
        while goes_on() {
            let (header, x_m) = (Header { stamp: self.now(), ..Header::default() }, 2.0);
            let message = match self.sent {
                0 => hall::setup(header, "main"),
                n if n % 2 == 1 => hall::odom(header, x_m),
                _ => hall::scan(header, x_m, 61),
            };
            self.robot.send(message).await.unwrap();
            self.sent += 1;
            tick.tick().await;
        }
    }

    async fn go_for(&mut self, time: Duration) {
        let began = Instant::now();
        self.go_while(|| began.elapsed() < time).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_said_while_the_server_was_away_counts_where_the_robot_was() {
    let mut server = Server::new();
    let to = Connection::to(&server.endpoint);
    let folder = server.folder.join("said");
    let session = connected(&to).await;
    let config = RobotConfig { clock: Clock::Log, boot: 1, ..RobotConfig::new("r1") };
    let robot = Robot::connect(&session, config).await.unwrap();
    let mut live = Live { robot, began: Instant::now(), sent: 0 };
    live.go_for(Duration::from_secs(1)).await;
    server.end();
    let guide = Guide::connect(&session, "default", Some("r1")).await.unwrap();
    assert_eq!(guide.keep_in(&folder).await.unwrap(), 0);
    let said = live.now();
    guide.publish(&guide.sentence("this is the workshop")).await.unwrap();
    drop(guide);
    live.go_for(Duration::from_secs(2)).await;
    server.restart();
    let guide = Guide::connect(&session, "default", Some("r1")).await.unwrap();
    assert_eq!(guide.keep_in(&folder).await.unwrap(), 1);
    let deadline = Instant::now() + PATIENCE;
    live.go_while(|| guide.unheard() > 0 && Instant::now() < deadline).await;
    assert_eq!(guide.unheard(), 0, "nothing is heard of it");
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0, "nothing is left");
    live.robot.settle().await.unwrap();
    Planner::new(&session, "default", "main", PATIENCE).unwrap().save().await.unwrap();
    let record = RecordReader::new(std::fs::File::open(server.folder.join("run.rec")).unwrap()).unwrap();
    let began = |m: Message| if let Message::Say(say) = m { say.began } else { None };
    let entered: Vec<Stamp> = record.filter_map(|m| began(m.unwrap().1)).collect();
    let off_s: Vec<f64> = entered.iter().map(|began| began.seconds() - said.seconds()).collect();
    assert!(off_s.len() == 1 && off_s[0].abs() < RIGHT_S, "{off_s:?}");
}
