//! The Zenoh router inside the server.

use crate::config::ServerConfig;
use serde_json::{Value, json};
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
    /// Anything else.
    #[error("zenoh: {0}")]
    Zenoh(#[source] zenoh::Error),
}

/// The router's settings: no discovery of others, no access from outside but by `listen`.
pub fn zenoh_config(config: &ServerConfig) -> Result<zenoh::Config, NetworkError> {
    // Longer than any payload that is taken; what is still longer is dropped before it fills memory.
    let message_max_bytes = (2 * config.limits.payload_bytes).max(16 << 20);
    let settings: [(&str, Value); 8] = [
        ("mode", json!("router")),
        ("listen/endpoints", json!(config.listen)),
        ("connect/endpoints", json!([])),
        ("scouting/multicast/enabled", json!(false)),
        ("scouting/gossip/enabled", json!(false)),
        // Opening a router sleeps this long, whether there is anything to scout for or not.
        ("scouting/delay", json!(0)),
        // A router that stamps messages makes advanced subscribers drop whatever overtakes.
        ("timestamping/enabled", json!(false)),
        ("transport/link/rx/max_message_size", json!(message_max_bytes)),
    ];
    let mut zenoh = zenoh::Config::default();
    for (key, value) in settings {
        zenoh.insert_json5(key, &value.to_string()).map_err(NetworkError::Zenoh)?;
    }
    Ok(zenoh)
}

/// Opens the router.
pub async fn open(config: &ServerConfig) -> Result<Session, NetworkError> {
    zenoh::open(zenoh_config(config)?).await.map_err(|e| {
        let text = e.to_string();
        let taken = text.contains("in use") || text.contains("os error 98");
        let endpoint = config.listen.iter().find(|l| text.contains(l.as_str())).or(config.listen.first());
        match endpoint {
            Some(endpoint) if taken => NetworkError::PortInUse { endpoint: endpoint.clone() },
            _ => NetworkError::Zenoh(e),
        }
    })
}
