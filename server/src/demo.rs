//! `demo`: a simulated robot and guide tour a building, through the real network path, and a
//! planner asks where things are.

use crate::config::ServerConfig;
use crate::picture::{self, Drawn};
use crate::serve::Server;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write, stderr};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::sync::broadcast::Receiver;
use tokio::time::{Instant, sleep_until, timeout};
use toponym::{Guide, Planner, Robot, RobotConfig};
use toponym_core::Pose2;
use toponym_core::answers::query::{Difference, EdgeView, GraphAnswer, Grid, ParticleView, PlaceView};
use toponym_core::edge::EdgeKind;
use toponym_proto::answer::{Candidate, GraphReply, GridReply, Heard, WhereReply};
use toponym_proto::keys::DEFAULT_SITE;
use toponym_proto::merge::order_stamp;
use toponym_proto::{Clock, Message, Pose};
use toponym_sim::{Recording, Scenario};
use tracing_subscriber::EnvFilter;
use zenoh::Session;

/// The tour is played so fast that it takes this long.
const TOUR: Duration = Duration::from_secs(20);
/// How long the server may take for an answer, the last part of the tour before it included.
const PATIENCE: Duration = Duration::from_secs(60);
/// What the planner asks in the end.
const QUESTIONS: [&str; 3] = ["where is the gym", "where is the kitchen", "where is the elevator lobby"];

/// Watch a simulated robot map a building while a guide names its rooms
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// Leave the server running afterwards, to be asked and talked to
    #[arg(long)]
    pub keep: bool,
    /// Picture to write, as PNG or SVG by the name's end
    #[arg(long, value_name = "FILE", default_value = "toponym-demo.png")]
    pub image: PathBuf,
    /// Seed of the wheels', the laser's and the guide's chances
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
}

/// Logs only what went wrong: the demo tells the rest itself.
pub fn init_logging() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,zenoh=error"));
    // An error means that somebody logs already.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(stderr).try_init();
}

/// Runs `demo`.
pub async fn run(args: DemoArgs) -> Result<()> {
    let data = DataFolder::new();
    let config = ServerConfig {
        http: None,
        // Port 0: any free one, so that the demo disturbs no server that is up.
        listen: vec!["tcp/127.0.0.1:0".into()],
        data: data.0.clone(),
        ..ServerConfig::default()
    };
    let server = Server::start(config, None).await.context("the server does not start")?;
    let endpoint = server.endpoints().first().cloned().context("the server listens nowhere")?;
    println!("A server listens on {endpoint}. A simulated robot connects and tours a building;");
    println!("a guide walks along and says what places are called.\n");

    let session = toponym::open(&endpoint).await?;
    let planner = Planner::new(&session, DEFAULT_SITE, "main", PATIENCE)?;
    let recording = Scenario::demo(args.seed).run()?;
    tour(&session, &recording).await?;
    planner.save().await?;

    println!("\nA planner asks:");
    for question in QUESTIONS {
        print!("{}", told(&planner.where_is(question).await?));
    }
    picture(&planner, &args.image).await?;
    println!("\nThe map, as a picture: {}", args.image.display());
    if args.keep {
        stay(&endpoint).await?;
    }
    session.close().await.map_err(anyhow::Error::from_boxed)?;
    server.stop().await?;
    Ok(())
}

/// A folder for the server's maps that goes when the demo ends.
struct DataFolder(PathBuf);

impl DataFolder {
    fn new() -> Self {
        Self(std::env::temp_dir().join(format!("toponym-demo-{}", std::process::id())))
    }
}

impl Drop for DataFolder {
    fn drop(&mut self) {
        // Nothing of worth in it; if it can't go, the system will clear it away.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Plays the recording as robot and guide, at the pace of its stamps but faster.
async fn tour(session: &Session, recording: &Recording) -> Result<()> {
    let setup = recording.messages.iter().find_map(Message::header).context("an empty recording")?;
    let config = RobotConfig { clock: Clock::Sim, ..RobotConfig::new(&setup.robot) };
    let mut robot = Robot::connect(session, config).await?;
    let guide = Guide::connect(session, DEFAULT_SITE, Some(&setup.robot)).await?;
    let sentences = recording.messages.iter().filter(|m| matches!(m, Message::Say(_))).count();
    let bar = progress_bar(recording.messages.len());
    let listener = tokio::spawn(listen(guide.feedback(), sentences, bar.clone()));

    let last_s = recording.truth.scans.last().map_or(0.0, |(stamp, _)| stamp.seconds());
    let speed = (last_s / TOUR.as_secs_f64()).max(1.0);
    let start = Instant::now();
    for message in &recording.messages {
        let due_s = order_stamp(message).seconds().clamp(0.0, last_s) / speed;
        sleep_until(start + Duration::from_secs_f64(due_s)).await;
        match message {
            Message::Say(say) => guide.publish(say).await?,
            message => drop(robot.send(message.clone()).await?),
        }
        bar.inc(1);
    }
    robot.settle().await?;
    // Feedback to the last sentence may still be on its way; its absence is no failure.
    let _ = timeout(PATIENCE, listener).await;
    bar.finish_and_clear();
    let (path_m, scans) = (recording.truth.path_m, recording.truth.scans.len());
    println!(
        "\n{path_m:.0} m driven and {scans} scans sent in {last_s:.0} s, played {speed:.0} times as fast."
    );
    Ok(())
}

fn progress_bar(messages: usize) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(messages as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} of about 20 s") {
        bar.set_style(style);
    }
    bar
}

/// Shows what the server says to each sentence.
async fn listen(mut feedback: Receiver<Heard>, sentences: usize, bar: ProgressBar) {
    for _ in 0..sentences {
        let Ok(heard) = feedback.recv().await else { return };
        if stderr().is_terminal() {
            bar.println(format!("  {}", heard.words));
        } else {
            println!("  {}", heard.words);
        }
    }
}

/// A question and its answer, a line per candidate.
fn told(reply: &WhereReply) -> String {
    let mut lines = vec![format!("  {}?", reply.name)];
    let line = |p: f64, what: String| format!("    {:>3.0} %  {what}", 100.0 * p);
    lines.extend(reply.candidates.iter().map(|c| line(c.probability, place(c) + &way(c))));
    if reply.p_none >= 0.005 {
        lines.push(line(reply.p_none, "somewhere not seen yet".into()));
    }
    lines.join("\n") + "\n"
}

fn place(c: &Candidate) -> String {
    format!("{} at ({:.1} m, {:.1} m)", c.label, c.x_m, c.y_m)
}

fn way(c: &Candidate) -> String {
    c.from_robot.as_ref().map_or(String::new(), |from| {
        format!(", {:.0} m from the robot, bearing {:.0}°", from.distance_m, from.bearing_rad.to_degrees())
    })
}

/// Draws what the planner gets to see.
async fn picture(planner: &Planner, file: &Path) -> Result<()> {
    let graph = graph(planner.graph().await?);
    let grid = grid(&planner.grid(0.05).await?)?;
    let rooms = planner.regions().await?.regions;
    let track: Vec<Pose2> = graph.places.iter().map(|p| p.pose).collect();
    let robot = track.last().copied();
    let drawn = Drawn { grid: &grid, graph: &graph, trajectory: &track, regions: &rooms, robot };
    picture::draw(&drawn).write(file, "demo").context("--image")
}

fn pose(p: &Pose) -> Pose2 {
    Pose2::new(p.x_m, p.y_m, p.yaw_rad)
}

fn grid(reply: &GridReply) -> Result<Grid> {
    Ok(Grid {
        resolution_m: reply.resolution_m,
        width: reply.width,
        height: reply.height,
        map_from_grid: pose(&reply.map_from_grid),
        cells: reply.cells()?,
    })
}

fn graph(reply: GraphReply) -> GraphAnswer {
    let places = reply.places.into_iter().map(|p| PlaceView {
        id: p.id,
        stamp_ns: p.stamp.ns,
        pose: Pose2::new(p.x_m, p.y_m, p.yaw_rad),
        labels: p.labels.into_iter().collect(),
    });
    let edge = |e: toponym_proto::answer::Edge| EdgeView {
        i: e.i,
        j: e.j,
        kind: match e.kind.as_str() {
            "semantic" => EdgeKind::Semantic,
            "relocalisation" => EdgeKind::Relocalisation,
            _ => EdgeKind::Distance,
        },
        i_from_j: Pose2::new(e.dx_m, e.dy_m, e.dyaw_rad),
    };
    let particles = reply.particles.into_iter().map(|p| ParticleView {
        weight: p.weight,
        edges: p.edges.into_iter().map(edge).collect(),
        poses: Vec::new(),
    });
    GraphAnswer {
        epoch: reply.map.epoch,
        rev: reply.map.rev,
        places: places.collect(),
        particles: particles.collect(),
        unresolved: reply.unresolved,
        differences: reply
            .differences
            .into_iter()
            .map(|d| Difference { weight: d.weight, words: d.words })
            .collect(),
        effective_sample_size: reply.effective_sample_size,
    }
}

/// Keeps the server up until ctrl-c.
async fn stay(endpoint: &str) -> Result<()> {
    println!("\nThe server stays up until ctrl-c. In another terminal, try:");
    println!("  export TOPONYM_CONNECT={endpoint}");
    println!("  cargo run --release -p toponym-cli -- where library");
    println!("  cargo run --release -p toponym-cli -- say \"this is the dining room\"");
    println!("  cargo run --release -p toponym-cli -- labels");
    std::io::stdout().flush()?;
    Ok(tokio::signal::ctrl_c().await?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use toponym_proto::answer::{FromRobot, MapIdentity, Resolved};

    #[test]
    fn an_answer_tells_place_way_and_doubt() {
        let candidate = Candidate {
            region: 1,
            label: "gym".into(),
            shown: String::new(),
            probability: 0.9,
            p_is: 0.9,
            x_m: 1.0,
            y_m: -2.0,
            yaw_rad: 0.0,
            cov: [0.0; 9],
            polygon_m: vec![],
            goal: None,
            from_robot: Some(FromRobot { robot: "r".into(), distance_m: 7.2, bearing_rad: 0.5 }),
            walk_m: None,
            because: vec![],
        };
        let reply = WhereReply {
            v: 1,
            query: "where".into(),
            name: "where is the gym".into(),
            resolved: Resolved::default(),
            map: MapIdentity::default(),
            stamp: toponym_proto::Stamp::default(),
            p_none: 0.1,
            unresolved: 0.0,
            candidates: vec![candidate],
        };
        assert_eq!(
            told(&reply),
            "  where is the gym?\n     90 %  gym at (1.0 m, -2.0 m), 7 m from the robot, bearing 29°\n     \
             10 %  somewhere not seen yet\n"
        );
    }

    #[test]
    fn the_picture_gets_what_the_planner_got() {
        let reply: GraphReply = serde_json::from_value(serde_json::json!({
            "v": 1, "query": "graph", "map": MapIdentity::default(), "effective_sample_size": 2.0,
            "places": [{"id": 4, "stamp": {"sec": 1, "nanosec": 0}, "x_m": 1.0, "y_m": 2.0, "yaw_rad": 0.5,
                        "labels": {"gym": 0.9}}],
            "particles": [{"weight": 1.0, "edges": [
                {"i": 0, "j": 4, "kind": "semantic", "dx_m": 1.0, "dy_m": 0.0, "dyaw_rad": 0.0}]}]
        }))
        .unwrap();
        let graph = graph(reply);
        assert_eq!(graph.places[0].labels, [("gym".to_string(), 0.9)]);
        assert_eq!(graph.particles[0].edges[0].kind, EdgeKind::Semantic);
        assert_eq!(graph.particles[0].edges[0].i_from_j, Pose2::new(1.0, 0.0, 0.0));
    }
}
