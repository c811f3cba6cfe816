//! Command line of `serve`.

use super::board::Board;
use super::commands::save_all;
use super::{ServeError, Server, network};
use crate::access::Policy;
use crate::config::ServerConfig;
use clap::Args;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use toponym_proto::Invalid;
use toponym_ros::live::RosRobot;
use tracing::{error, info};

/// How often it is looked whether users have changed.
const POLICY_PERIOD: Duration = Duration::from_secs(1);

/// Arguments of `serve`.
#[derive(Args, Clone, Debug, Default)]
pub struct ServeArgs {
    /// Settings (TOML); without it the defaults hold
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Record what the map takes in, in its order; `map FILE` plays it back. A record that is there goes on
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Check the settings and show them, but do not serve
    #[arg(long)]
    pub check_config: bool,
    /// Listen here instead of where the settings say, e.g. tcp/0.0.0.0:7457
    #[arg(long, value_name = "ENDPOINT")]
    pub listen: Vec<String>,
    /// Folder of the maps, instead of the settings'
    #[arg(long, value_name = "FOLDER")]
    pub data: Option<PathBuf>,
    /// Serve the pages (the map, and one to talk to), /healthz and /metrics at this address [default: 127.0.0.1:7458]
    #[arg(long, value_name = "ADDRESS")]
    pub http: Option<String>,
    /// Serve no pages
    #[arg(long, conflicts_with = "http")]
    pub no_http: bool,
    /// Words and names of your site, one to a line: "refectory = canteen", "name: Room to Grow"
    #[arg(long, value_name = "FILE")]
    pub lexicon: Option<PathBuf>,
    /// Map for a robot that speaks ROS 2 (rmw_zenoh), by the router on it; nothing is installed there. By default its
    /// name is "robot", and its router at tcp/localhost:7447. Again for each robot
    #[arg(
        long,
        value_name = "NAME=ENDPOINT[,domain=N][,namespace=/r1][,map=ID][,topic=/scan]",
        num_args = 0..=1,
        default_missing_value = "",
        value_parser = parse_robot
    )]
    pub ros: Vec<RosRobot>,
    /// Write poses, maps and what is heard as ROS messages, for Foxglove and rerun; one that is there is left alone
    #[arg(long, value_name = "FILE.mcap")]
    pub mcap: Option<PathBuf>,
    /// Log what people say, too
    #[arg(long)]
    pub log_speech: bool,
}

fn parse_robot(text: &str) -> Result<RosRobot, Invalid> {
    text.parse()
}

impl ServeArgs {
    /// The settings: the file's, changed by the arguments.
    pub fn settings(&self) -> Result<ServerConfig, ServeError> {
        let mut config = match &self.config {
            Some(path) => ServerConfig::read(path)?,
            None => ServerConfig::default(),
        };
        if !self.listen.is_empty() {
            config.listen.clone_from(&self.listen);
        }
        if let Some(data) = &self.data {
            config.data.clone_from(data);
        }
        config.http = self.http.clone().or(config.http).filter(|_| !self.no_http);
        config.lexicon = self.lexicon.clone().or(config.lexicon);
        config.mcap = self.mcap.clone().or(config.mcap);
        config.ros.extend(self.ros.iter().cloned());
        config.log_speech |= self.log_speech;
        config.check()?;
        Ok(config)
    }
}

/// `serve` as a program: until SIGTERM or ctrl-c; anew when its users have changed.
pub async fn run(args: ServeArgs) -> anyhow::Result<()> {
    let config = args.settings()?;
    if args.check_config {
        network::check_tls(&config)?;
        Policy::read(&config.policy_path())?;
        config.words()?;
        print!("{}", toml::to_string(&config)?);
        return Ok(());
    }
    let mut shutdown = std::pin::pin!(shutdown_signal()?);
    loop {
        let policy = Policy::read(&config.policy_path())?;
        let server = Server::start(config.clone(), args.record.clone()).await?;
        let saving = renew_on_hangup(server.board(), config.clone())?;
        let changed = tokio::select! {
            () = &mut shutdown => false,
            () = changed(&config, &policy) => true,
        };
        info!("{}", if changed { "users have changed: all have to connect again" } else { "stopping" });
        saving.abort();
        let stopped = server.stop().await;
        if !changed {
            return Ok(stopped?);
        }
        if let Err(e) = stopped {
            // The journals have it.
            error!("{e}");
        }
    }
}

/// Ready when the policy is another. One that can't be read changes nothing.
async fn changed(config: &ServerConfig, policy: &Policy) {
    let (path, mut told) = (config.policy_path(), false);
    loop {
        tokio::time::sleep(POLICY_PERIOD).await;
        match Policy::read(&path) {
            Ok(new) if new == *policy => told = false,
            // Whoever removes the file wants no users, but hardly to let everybody on this machine in.
            Ok(new) if new.local => {}
            Ok(_) => return,
            Err(e) if !told => {
                error!("users stay as they are: {e}");
                told = true;
            }
            Err(_) => {}
        }
    }
}

/// Saves all maps and reads the site's words anew each time the process is told to (SIGHUP).
#[cfg(unix)]
fn renew_on_hangup(board: Arc<Board>, config: ServerConfig) -> std::io::Result<tokio::task::JoinHandle<()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut hangup = signal(SignalKind::hangup())?;
    Ok(tokio::spawn(async move {
        while hangup.recv().await.is_some() {
            let (board, config) = (board.clone(), config.clone());
            let renew = move || {
                match config.words() {
                    Ok(words) => board.learn(words),
                    Err(e) => error!("words stay as they are: {e}"),
                }
                save_all(&board)
            };
            let saved = tokio::task::spawn_blocking(renew).await;
            match saved {
                Ok(Ok(maps)) => info!(maps = maps.join(" "), "saved"),
                Ok(Err(problem)) => error!("not saved: {problem}"),
                Err(e) => error!("not saved: {e}"),
            }
        }
    }))
}

/// Saves all maps each time the process is told to.
#[cfg(not(unix))]
fn renew_on_hangup(_: Arc<Board>, _: ServerConfig) -> std::io::Result<tokio::task::JoinHandle<()>> {
    Ok(tokio::spawn(std::future::pending()))
}

/// Ready when the process is asked to end.
#[cfg(unix)]
fn shutdown_signal() -> std::io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let (mut term, mut int) = (signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?);
    Ok(async move {
        tokio::select! {
            _ = term.recv() => {}
            _ = int.recv() => {}
        }
    })
}

/// Ready when the process is asked to end.
#[cfg(not(unix))]
fn shutdown_signal() -> std::io::Result<impl Future<Output = ()>> {
    Ok(async {
        let _ = tokio::signal::ctrl_c().await;
    })
}
