//! The server's settings: every one with its default beside it; a TOML file may change them, and
//! none need be given.

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toponym_core::language::Glossary;
use toponym_core::language::glossary::GlossaryError;
use toponym_proto::keys::{DEFAULT_ENDPOINT, DEFAULT_SITE, check_id, check_link};
use toponym_proto::{Invalid, Limits};
use toponym_ros::live::RosRobot;

/// Where the pages are by default.
pub const DEFAULT_HTTP: &str = "127.0.0.1:7458";

/// Settings of `toponym-server serve`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServerConfig {
    /// Site: second part of every key; several servers with different sites share one network.
    pub site: String,
    /// Zenoh endpoints to listen on. Beyond loopback everybody on the network can connect.
    pub listen: Vec<String>,
    /// Address of the pages, of `/healthz` and of `/metrics` (Prometheus); everybody who reaches it may read these. Pages
    /// are served to this machine alone.
    pub http: Option<String>,
    /// Other names under which pages are asked for, such as `maps.example.org` of a proxy in front.
    pub http_hosts: Vec<String>,
    /// Words and names of the site's own, see `toponym_core::language::glossary`.
    pub lexicon: Option<PathBuf>,
    /// Folder of the maps: a journal and checkpoints of each.
    pub data: PathBuf,
    /// How long a robot's stream waits for sentences that come over other connections.
    pub hold_back_s: f64,
    /// How long a missing message is waited for.
    pub gap_wait_s: f64,
    /// The same for a robot in whose stream the server comes in the middle: until it sends again.
    pub join_wait_s: f64,
    /// Over how many later messages a missing one is waited for.
    pub gap_window: usize,
    /// Shortest time between two published graphs of a map.
    pub graph_period_s: f64,
    /// Whether what people say goes into the log.
    pub log_speech: bool,
    /// Limits of what is taken in.
    pub limits: Limits,
    /// Who may do what.
    pub access: AccessConfig,
    /// File in which poses, maps and what is heard are written as ROS messages, for Foxglove and rerun.
    pub mcap: Option<PathBuf>,
    /// Robots that speak ROS 2.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ros: Vec<RosRobot>,
    /// The filter of new maps.
    pub mapper: toponym_core::Config,
}

/// Who may do what, and how it is known who they are.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AccessConfig {
    /// Users and their roles; by default `policy.toml` in the data folder. As long as it is not there, whoever connects
    /// from this machine may do everything, and nobody else anything.
    pub policy: Option<PathBuf>,
    /// For endpoints such as `quic/0.0.0.0:7457`.
    pub tls: Option<TlsConfig>,
}

/// Certificates, as files in PEM.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TlsConfig {
    /// The server's.
    pub certificate: PathBuf,
    /// The server's private key.
    pub key: PathBuf,
    /// Clients must have a certificate from here; their users have its common name.
    pub clients_ca: Option<PathBuf>,
}

impl Default for ServerConfig {
    fn default() -> Self {
        Self {
            site: DEFAULT_SITE.into(),
            listen: vec![DEFAULT_ENDPOINT.into()],
            http: Some(DEFAULT_HTTP.into()),
            http_hosts: Vec::new(),
            lexicon: None,
            data: "./toponym-data".into(),
            hold_back_s: 0.5,
            gap_wait_s: 10.0,
            join_wait_s: 15.0,
            gap_window: 1024,
            graph_period_s: 1.0,
            log_speech: false,
            limits: Limits::default(),
            access: AccessConfig::default(),
            mcap: None,
            ros: Vec::new(),
            mapper: toponym_core::Config::default(),
        }
    }
}

/// A configuration can't be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file can't be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It isn't TOML, or has a key that doesn't exist, or a value of the wrong type; the text
    /// shows the line.
    #[error("{}: {source}", path.display())]
    Parse {
        /// Which file.
        path: PathBuf,
        /// What and where.
        source: Box<toml::de::Error>,
    },
    /// A value out of its range.
    #[error("configuration: {0}")]
    Invalid(#[from] Invalid),
    /// Words that can't be used.
    #[error("{}: {source}", path.display())]
    Lexicon {
        /// Which file.
        path: PathBuf,
        /// What and where.
        source: GlossaryError,
    },
}

/// A site's own words, as a file has them.
///
/// # Errors
/// If it can't be read, or a line of it says nothing.
pub fn words_of(path: &Path) -> Result<String, ConfigError> {
    let read = std::fs::read_to_string(path);
    let lines = read.map_err(|source| ConfigError::Read { path: path.into(), source })?;
    Glossary::read(&lines).map_err(|source| ConfigError::Lexicon { path: path.into(), source })?;
    Ok(lines)
}

impl ServerConfig {
    /// Reads a TOML file and checks it.
    pub fn read(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| ConfigError::Read { path: path.into(), source })?;
        let config: Self = toml::from_str(&text)
            .map_err(|source| ConfigError::Parse { path: path.into(), source: Box::new(source) })?;
        config.check()?;
        Ok(config)
    }

    /// Whether only this machine can connect.
    pub fn is_local(&self) -> bool {
        let local = |endpoint: &String| {
            let address = endpoint.split('/').nth(1).unwrap_or_default();
            ["127.", "localhost:", "[::1]:"].iter().any(|start| address.starts_with(start))
        };
        self.listen.iter().all(local)
    }

    /// The site's own words, checked; none without a file.
    ///
    /// # Errors
    /// If the file can't be read, or a line of it says nothing.
    pub fn words(&self) -> Result<String, ConfigError> {
        self.lexicon.as_deref().map_or(Ok(String::new()), words_of)
    }

    /// Where users and their roles are.
    pub fn policy_path(&self) -> PathBuf {
        self.access.policy.clone().unwrap_or_else(|| self.data.join("policy.toml"))
    }

    /// Checks the values.
    pub fn check(&self) -> Result<(), ConfigError> {
        check_id("site", &self.site)?;
        if self.listen.is_empty() {
            return Err(Invalid::new("listen", "is empty: nobody could connect").into());
        }
        for endpoint in &self.listen {
            check_link("listen", endpoint)?;
            if endpoint.starts_with("quic/") && self.access.tls.is_none() {
                let message = format!("has {endpoint}, but there is no certificate: see [access.tls]");
                return Err(Invalid::new("listen", message).into());
            }
        }
        for (field, value, min) in [
            ("hold_back_s", self.hold_back_s, 0.0),
            ("gap_wait_s", self.gap_wait_s, 0.0),
            ("join_wait_s", self.join_wait_s, 0.0),
            ("graph_period_s", self.graph_period_s, 0.01),
        ] {
            if !(min..=60.0).contains(&value) {
                return Err(Invalid::new(field, format!("is {value}, must be from {min} to 60")).into());
            }
        }
        self.limits.check()?;
        for (k, robot) in self.ros.iter().enumerate() {
            robot.check()?;
            if self.ros[..k].iter().any(|other| other.robot == robot.robot) {
                let message = format!("has two robots called {:?}: give each its name", robot.robot);
                return Err(Invalid::new("ros", message).into());
            }
        }
        for (field, value, range) in [
            ("mapper.place_spacing_m", self.mapper.place_spacing_m, 0.1..=100.0),
            ("mapper.gamma_per_m2", self.mapper.gamma_per_m2, 0.0..=1e3),
            ("mapper.particles", f64::from(self.mapper.particles), 1.0..=10_000.0),
            ("gap_window", self.gap_window as f64, 1.0..=1e6),
        ] {
            if !range.contains(&value) {
                let message = format!("is {value}, must be from {} to {}", range.start(), range.end());
                return Err(Invalid::new(field, message).into());
            }
        }
        if let Some(http) = &self.http
            && http
                .rsplit_once(':')
                .is_none_or(|(host, port)| host.is_empty() || port.parse::<u16>().is_err())
        {
            return Err(Invalid::new("http", format!("is {http:?}, must be such as 127.0.0.1:7458")).into());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ServerConfig, String> {
        let config: ServerConfig = toml::from_str(text).map_err(|e| e.to_string())?;
        config.check().map_err(|e| e.to_string())?;
        Ok(config)
    }

    #[test]
    fn an_empty_file_means_the_defaults() {
        assert_eq!(read("").unwrap(), ServerConfig::default());
    }

    #[test]
    fn settings_are_taken() {
        let config = read("site = \"lab\"\n[mapper]\nparticles = 5\n[limits]\nbeams = 9\n").unwrap();
        assert_eq!((config.site.as_str(), config.mapper.particles, config.limits.beams), ("lab", 5, 9));
    }

    #[test]
    fn an_unknown_key_is_shown_with_its_line() {
        let error = read("site = \"lab\"\nhold_back = 1\n").unwrap_err();
        assert!(error.contains("line 2") && error.contains("hold_back"), "{error}");
    }

    #[test]
    fn values_out_of_range_are_named() {
        for (text, name) in [
            ("site = \"A\"", "site"),
            ("listen = []", "listen"),
            ("hold_back_s = nan", "hold_back_s"),
            ("gap_wait_s = -1.0", "gap_wait_s"),
            ("[limits]\nqueue_messages = 0", "queue_messages"),
            ("[[ros]]\nnamespace = \"r1\"", "ros.namespace"),
            ("[[ros]]\n[[ros]]", "two robots"),
        ] {
            assert!(read(text).unwrap_err().contains(name), "{text}");
        }
    }
}
