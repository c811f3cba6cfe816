//! The Zenoh router inside the server.

use crate::access::{Policy, rules, write_secret};
use crate::config::ServerConfig;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use toponym_proto::Keys;
use zenoh::Session;

/// The network part can't start.
#[derive(Debug, thiserror::Error)]
pub enum NetworkError {
    /// Somebody listens there already.
    #[error(
        "cannot listen on {endpoint}: the port is in use, perhaps by another toponym server; stop it, or \
         set another `listen` endpoint in the configuration"
    )]
    PortInUse {
        /// Which endpoint.
        endpoint: String,
    },
    /// A file of the settings for TLS is not there.
    #[error("access.tls.{field}: {}: {source}; `toponym-server cert new` makes certificates", path.display())]
    Tls {
        /// Which setting.
        field: &'static str,
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Passwords can't be handed to Zenoh.
    #[error("{}: {source}", path.display())]
    Passwords {
        /// The file through which they go.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Anything else.
    #[error("zenoh: {0}")]
    Zenoh(#[source] zenoh::Error),
}

/// The router's settings: no discovery of others, no access from outside but by `listen`, and there only what the policy
/// grants. `passwords`: the file with the users', where they are known by these.
pub fn zenoh_config(
    config: &ServerConfig,
    policy: &Policy,
    passwords: Option<&Path>,
) -> Result<zenoh::Config, NetworkError> {
    let keys = Keys::new(&config.site).map_err(|e| NetworkError::Zenoh(e.into()))?;
    // Longer than any payload that is taken; what is still longer is dropped before it fills memory.
    let message_max_bytes = (2 * config.limits.payload_bytes).max(16 << 20);
    let mut settings: Vec<(&str, Value)> = vec![
        ("mode", json!("router")),
        ("listen/endpoints", config.listen.iter().map(|endpoint| in_order(endpoint)).collect()),
        ("connect/endpoints", json!([])),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        // Opening a router sleeps this long, whether there is anything to scout for or not.
        ("scouting/delay", json!(0)),
        // A router that stamps messages makes advanced subscribers drop whatever overtakes.
        ("timestamping/enabled", json!(false)),
        ("transport/link/rx/max_message_size", json!(message_max_bytes)),
        ("adminspace/enabled", json!(false)),
        // Whoever connects and then says nothing must not keep others out.
        ("transport/unicast/accept_timeout", json!(3000)),
        ("transport/unicast/accept_pending", json!(10_000)),
        ("access_control", rules(&keys, policy)),
        ("qos/network", replies()),
        // Who does not read a long answer for so long, us, is disconnected, and connects again by itself. Meanwhile Zenoh's one
        // thread that sends may wait for them, too, and with it all others.
        ("transport/link/tx/queue/congestion_control/block/wait_before_close", json!(90_000)),
        ("transport/link/tx/queue/size/data_low", json!(16)),
    ];
    if let Some(path) = passwords {
        settings.push(("transport/auth/usrpwd/dictionary_file", json!(path)));
    }
    if let Some(tls) = &config.access.tls {
        let mutual = tls.clients_ca.is_some();
        settings.extend([
            ("transport/link/tls/listen_certificate", json!(tls.certificate)),
            ("transport/link/tls/listen_private_key", json!(tls.key)),
            ("transport/link/tls/root_ca_certificate", json!(tls.clients_ca)),
            ("transport/link/tls/enable_mtls", json!(mutual)),
            ("transport/link/tls/close_link_on_expiration", json!(mutual)),
        ]);
    }
    let mut zenoh = zenoh::Config::default();
    for (key, value) in settings {
        zenoh.insert_json5(key, &value.to_string()).map_err(NetworkError::Zenoh)?;
    }
    Ok(zenoh)
}

/// One stream for all priorities over QUIC, as over TCP: what was declared before a question is known when that is answered.
fn in_order(endpoint: &str) -> String {
    if !endpoint.starts_with("quic/") || endpoint.contains('?') {
        return endpoint.into();
    }
    match endpoint.split_once('#') {
        Some((address, settings)) => format!("{address}?multistream=0#{settings}"),
        None => format!("{endpoint}?multistream=0"),
    }
}

/// Replies go as their queries came, and those may ask to be waited for, in the queue of all else. So queries are changed on
/// their way in: long answers wait for those who read slowly, in a queue of their own; short ones do not wait.
fn replies() -> Value {
    let short =
        ["where", "what", "nearest", "labels"].map(|ask| format!("toponym/v1/*/map/*/ask/{ask}")).into_iter();
    let told = ["robot/*/out/*", "info", "time"].map(|key| format!("toponym/v1/*/{key}"));
    let short: Vec<String> = short.chain(told).collect();
    json!([
        {
            "id": "long", "messages": ["query"], "flows": ["ingress"], "key_exprs": ["**"],
            "overwrite": {"priority": "data_low", "congestion_control": "block"}
        },
        {
            "id": "short", "messages": ["query"], "flows": ["ingress"], "key_exprs": short,
            "overwrite": {"priority": "data", "congestion_control": "drop"}
        },
    ])
}

/// Whether the files for TLS are there.
pub fn check_tls(config: &ServerConfig) -> Result<(), NetworkError> {
    let Some(tls) = &config.access.tls else {
        return Ok(());
    };
    let files = [
        ("certificate", Some(&tls.certificate)),
        ("key", Some(&tls.key)),
        ("clients_ca", tls.clients_ca.as_ref()),
    ];
    for (field, path) in files {
        if let Some(path) = path {
            std::fs::File::open(path).map_err(|source| NetworkError::Tls {
                field,
                path: path.clone(),
                source,
            })?;
        }
    }
    Ok(())
}

/// Opens the router. The data folder must be there.
pub async fn open(config: &ServerConfig, policy: &Policy) -> Result<Session, NetworkError> {
    check_tls(config)?;
    if !policy.by_password() {
        return open_with(config, zenoh_config(config, policy, None)?).await;
    }
    // Zenoh reads passwords from a file, once.
    let path = config.data.join("passwords");
    let failed = |source| NetworkError::Passwords { path: path.clone(), source };
    write_secret(&path, policy.dictionary().as_bytes()).map_err(failed)?;
    let opened = open_with(config, zenoh_config(config, policy, Some(&path))?).await;
    std::fs::remove_file(&path).map_err(failed)?;
    opened
}

async fn open_with(config: &ServerConfig, zenoh: zenoh::Config) -> Result<Session, NetworkError> {
    zenoh::open(zenoh).await.map_err(|e| {
        let text = e.to_string();
        let taken = text.contains("in use") || text.contains("os error 98");
        let endpoint = config.listen.iter().find(|l| text.contains(l.as_str())).or(config.listen.first());
        match endpoint {
            Some(endpoint) if taken => NetworkError::PortInUse { endpoint: endpoint.clone() },
            _ => NetworkError::Zenoh(e),
        }
    })
}
