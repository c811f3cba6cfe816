//! What is told in ROS's words: topics, with tokens by which nodes find them.

use crate::cdr;
use crate::wire::{self, Hashes, Node, Qos, Role};
use serde::Serialize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};
use std::time::Duration;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh::query::Query;
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

use super::session::now_ns;

/// As rmw_zenoh has it for topics that are latched.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// The node that toponym is, in one robot's graph.
pub struct Speaker {
    session: Session,
    node: Node,
    next_id: AtomicU32,
    tokens: Mutex<Vec<LivelinessToken>>,
}

impl Speaker {
    /// Appears as `toponym` in a namespace.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn new(
        session: &Session,
        domain: u32,
        namespace: &str,
        hashes: Hashes,
    ) -> Result<Self, zenoh::Error> {
        let namespace = if namespace.is_empty() { "/".to_owned() } else { namespace.to_owned() };
        let zid = session.zid().to_string();
        let node = Node { domain, hashes, zid, id: 0, namespace, name: "toponym".into() };
        let speaker =
            Self { session: session.clone(), node, next_id: AtomicU32::new(1), tokens: Mutex::default() };
        let token = speaker.node.token();
        speaker.appear(&token).await?;
        Ok(speaker)
    }

    async fn appear(&self, token: &str) -> Result<(), zenoh::Error> {
        let token = self.session.liveliness().declare_token(token.to_owned()).await?;
        if let Ok(mut tokens) = self.tokens.lock() {
            tokens.push(token);
        }
        Ok(())
    }

    async fn entity(&self, role: Role, name: &str, kind: &str, qos: Qos) -> Result<[u8; 16], zenoh::Error> {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let token = self.node.token_of_entity(id, role, name, kind, qos);
        self.appear(&token).await?;
        Ok(wire::gid(&token))
    }

    /// A name of one's own namespace: `/toponym/heard` is `/r1/toponym/heard`.
    pub fn named(&self, name: &str) -> String {
        format!("{}{name}", self.node.namespace.trim_end_matches('/'))
    }

    fn key(&self, name: &str, kind: &str) -> String {
        wire::key(self.node.domain, name, kind, &self.node.hashes.of(kind))
    }

    /// Will write a topic.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn topic(&self, name: &str, kind: &str, qos: Qos) -> Result<Writer, zenoh::Error> {
        let gid = self.entity(Role::Publisher, name, kind, qos).await?;
        let publisher =
            self.session.declare_publisher(self.key(name, kind)).congestion_control(CongestionControl::Drop);
        let publisher = if qos == Qos::Latched {
            publisher
                .cache(CacheConfig::default().max_samples(1))
                .publisher_detection()
                .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
                .await?
        } else {
            publisher.advanced().await?
        };
        Ok(Writer { publisher, gid, seq: AtomicI64::new(0) })
    }

    /// Is seen to read a topic.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn listens(&self, name: &str, kind: &str, qos: Qos) -> Result<(), zenoh::Error> {
        self.entity(Role::Subscriber, name, kind, qos).await.map(|_| ())
    }

    /// Answers a service; `answer` has the request and the gid to answer with.
    ///
    /// # Errors
    /// Zenoh's.
    pub async fn service(
        &self,
        name: &str,
        kind: &str,
        answer: impl Fn(Asked) + Send + Sync + 'static,
    ) -> Result<(), zenoh::Error> {
        self.entity(Role::Server, name, kind, Qos::Reliable(10)).await?;
        // One that is not complete is never asked.
        let queryable = self.session.declare_queryable(self.key(name, kind)).complete(true);
        queryable.callback(move |query| answer(Asked { query })).background().await
    }
}

/// Writes one topic.
pub struct Writer {
    publisher: AdvancedPublisher<'static>,
    gid: [u8; 16],
    seq: AtomicI64,
}

impl Writer {
    /// Writes a message.
    ///
    /// # Errors
    /// In words.
    pub async fn write<T: Serialize>(&self, message: &T) -> Result<(), String> {
        self.put(cdr::write(message)?).await
    }

    /// Passes over a number, as if its message had got lost.
    pub fn skip(&self) {
        self.seq.fetch_add(1, Ordering::Relaxed);
    }

    /// Writes a message that is CDR already.
    ///
    /// # Errors
    /// In words.
    pub async fn put(&self, bytes: Vec<u8>) -> Result<(), String> {
        let seq = self.seq.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = wire::attachment(seq, now_ns(), &self.gid);
        self.publisher.put(bytes).attachment(&attachment[..]).await.map_err(|e| e.to_string())
    }
}

/// A request.
pub struct Asked {
    query: Query,
}

impl Asked {
    /// What is asked.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn request<T: serde::de::DeserializeOwned>(&self) -> Result<T, String> {
        let payload = self.query.payload().ok_or("it is empty")?;
        cdr::read(&payload.to_bytes())
    }

    /// Answers: with the number and the sender of the request, or its client waits for ever.
    ///
    /// # Errors
    /// In words.
    pub async fn answer<T: Serialize>(&self, response: &T) -> Result<(), String> {
        let attached = self.query.attachment().and_then(|bytes| wire::attached(&bytes.to_bytes()));
        let (seq, gid) = attached.unwrap_or((1, [0; 16]));
        let attachment = wire::attachment(seq, now_ns(), &gid);
        let reply = self.query.reply(self.query.key_expr().clone(), cdr::write(response)?);
        reply.attachment(&attachment[..]).await.map_err(|e| e.to_string())
    }
}
