//! What pages look at: the real server in a process of its own, and a simulated robot that drives in its own time.

use anyhow::{Context, bail};
use std::fs::OpenOptions;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use toponym::log::Options;
use toponym::{Connection, Replay, RobotConfig};
use toponym_proto::{Clock, Message};
use toponym_sim::{OfficeStyle, Scenario, write};

/// The robot, and its map.
pub const ROBOT: &str = "r1";
/// Longest wait for the server to listen.
const PATIENCE: Duration = Duration::from_secs(60);

/// A server with pages, and its folder; gone when dropped.
pub struct World {
    child: Option<Child>,
    program: PathBuf,
    folder: PathBuf,
    endpoint: String,
    /// Host and port of its pages.
    pub host: String,
}

impl World {
    /// Starts it.
    ///
    /// # Errors
    /// If it can't be started, or does not listen.
    pub fn start(program: &Path) -> anyhow::Result<Self> {
        let folder = std::env::temp_dir().join(format!("toponym-browse-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        let free = || TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr());
        let (endpoint, host) = (format!("tcp/{}", free()?), free()?.to_string());
        let mut world = Self { child: None, program: program.to_owned(), folder, endpoint, host };
        world.start_again()?;
        Ok(world)
    }

    /// Starts it again in the same folder, and waits until it listens.
    ///
    /// # Errors
    /// As [`World::start`].
    pub fn start_again(&mut self) -> anyhow::Result<()> {
        let log = OpenOptions::new().create(true).append(true).open(self.folder.join("log"))?;
        let child = Command::new(&self.program)
            .args(["serve", "--listen", &self.endpoint, "--http", &self.host, "--data"])
            .arg(self.folder.join("data"))
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .with_context(|| self.program.display().to_string())?;
        self.child = Some(child);
        let begin = Instant::now();
        while TcpStream::connect(&self.host).is_err() {
            if begin.elapsed() > PATIENCE {
                let log = std::fs::read_to_string(self.folder.join("log")).unwrap_or_default();
                bail!("the server does not listen: {log}");
            }
            thread::sleep(Duration::from_millis(20));
        }
        Ok(())
    }

    /// kill -9.
    pub fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// Processor time that it has used since it was last started, seconds.
    pub fn cpu_s(&self) -> f64 {
        let Some(child) = &self.child else { return 0.0 };
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap_or_default();
        let after = stat.rsplit(')').next().unwrap_or_default();
        let ticks = after.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok());
        // As Linux counts them everywhere.
        ticks.sum::<f64>() / 100.0
    }

    /// A simulated robot drives through an office for about so long, seconds, at its own pace.
    ///
    /// # Errors
    /// If its log can't be made.
    pub fn drive(&self, seconds: f64) -> anyhow::Result<()> {
        // An office's rooms are half a minute apart.
        let stops = (seconds / 25.0) as usize + 4;
        let recording = Scenario::office(&OfficeStyle::default(), stops, 5).run()?;
        let quiet: Vec<Message> =
            recording.messages.into_iter().filter(|m| !matches!(m, Message::Say(_))).collect();
        let file = self.folder.join("drive.rec");
        write::record(&quiet, std::fs::File::create(&file)?)?;
        self.play(&file, 1.0)
    }

    /// A robot plays a log, at so many times its pace.
    ///
    /// # Errors
    /// If it can't be read.
    pub fn play(&self, log: &Path, speed: f64) -> anyhow::Result<()> {
        let options = Options { robot: ROBOT.into(), map: "main".into(), boot: 0 };
        let mut log = toponym_ros::log::open(log, &options, &[])?;
        let mut robot = RobotConfig::new(ROBOT);
        robot.clock = Clock::Log;
        robot.patience = Duration::from_secs(3600);
        let replay = Replay { robot, map: Some("main".into()), speed: Some(speed) };
        let connection = Connection::to(&self.endpoint);
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
        // It drives until the program ends.
        thread::spawn(move || {
            let played = runtime.block_on(async {
                let session = connection.open().await?;
                replay.run(&session, &mut *log, &mut |_| ()).await
            });
            if let Err(e) = played {
                eprintln!("the robot: {e}");
            }
        });
        Ok(())
    }
}

impl Drop for World {
    fn drop(&mut self) {
        self.kill();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}
