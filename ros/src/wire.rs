//! rmw_zenoh's names: on which key a topic is, which token tells of it, what is attached to each message.
//!
//! Source: ros2/rmw_zenoh, `docs/design.md` and `rmw_zenoh_cpp/src/detail/{liveliness_utils,attachment_helpers}.cpp`.

use crate::plan::kind;

/// Length of an attachment, bytes.
const ATTACHED: usize = 33;

/// Types that are written, or asked for, with their hashes: RIHS01 of Iron to Lyrical.
const HASHES: [(&str, &str); 10] = [
    (kind::SCAN, "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828"),
    (kind::TF, "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"),
    (kind::TEXT, "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"),
    (kind::GRID, "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7"),
    (kind::GRID_METADATA, "2772d4b2000ef2b35dbaeb80fd3946c1369f817fb4f75677d916d27c17d763c8"),
    (kind::POSE, "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"),
    (kind::POSE_WITH_COVARIANCE, "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e"),
    (kind::MARKERS, "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf"),
    (kind::TRIGGER, "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f"),
    // Of `deploy/ros2/toponym_msgs`.
    (kind::WHERE, "d2dad0d1cf557e073cbe3b03b141e00fbc6be087cb45b7a722fd69ff1deba728"),
];

/// What Humble writes in place of each.
const NO_HASH: &str = "TypeHashNotSupported";

/// Whether keys tell types by hashes: who does and who does not never meet, and neither is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hashes {
    /// Iron to Lyrical.
    #[default]
    OfTypes,
    /// Humble.
    None,
}

impl Hashes {
    /// The hash of a type as it stands in keys; a `*` for one that is only read.
    pub fn of(self, kind: &str) -> String {
        let known = HASHES.iter().find(|(name, _)| *name == kind);
        match (self, known) {
            (Self::None, _) => NO_HASH.into(),
            (Self::OfTypes, Some((_, hash))) => format!("RIHS01_{hash}"),
            (Self::OfTypes, None) => "*".into(),
        }
    }

    /// Which a key has.
    pub fn in_key(key: &str) -> Self {
        if key.split('/').any(|chunk| chunk == NO_HASH) { Self::None } else { Self::OfTypes }
    }
}

/// `sensor_msgs/msg/LaserScan` is `sensor_msgs::msg::dds_::LaserScan_`.
pub fn dds_type(kind: &str) -> String {
    match kind.rsplit_once('/') {
        Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
        None => kind.into(),
    }
}

/// And back.
fn ros_type(dds: &str) -> Option<String> {
    let (package, name) = dds.split_once("::dds_::")?;
    Some(format!("{}/{}", package.replace("::", "/"), name.strip_suffix('_')?))
}

/// The key of a topic or service; `name` with its first slash, and perhaps with `**`.
pub fn key(domain: u32, name: &str, kind: &str, hash: &str) -> String {
    format!("{domain}/{}/{}/{hash}", name.trim_matches('/'), dds_type(kind))
}

/// The topic and type of a key.
pub fn topic_of(key: &str) -> Option<(String, String)> {
    let chunks: Vec<&str> = key.split('/').collect();
    // Lyrical has chunks behind the hash.
    let at = chunks.iter().rposition(|chunk| chunk.contains("::dds_::"))?;
    let name = chunks.get(1..at).filter(|name| !name.is_empty())?;
    Some((format!("/{}", name.join("/")), ros_type(chunks[at])?))
}

/// What a token tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Writes a topic.
    Publisher,
    /// Reads one.
    Subscriber,
    /// Answers.
    Server,
    /// Asks.
    Client,
}

impl Role {
    const ALL: [(Self, &str); 4] =
        [(Self::Publisher, "MP"), (Self::Subscriber, "MS"), (Self::Server, "SS"), (Self::Client, "SC")];

    fn text(self) -> &'static str {
        Self::ALL.iter().find(|(role, _)| *role == self).map_or("", |(_, text)| text)
    }
}

/// How messages are kept: as rmw_zenoh writes it, what is usual left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Qos {
    /// Reliable, of so many.
    Reliable(u32),
    /// Best effort, of so many.
    BestEffort(u32),
    /// The newest also for those who come later.
    Latched,
}

impl Qos {
    fn text(self) -> String {
        match self {
            Self::Reliable(depth) => format!("::,{depth}:,:,:,,"),
            Self::BestEffort(depth) => format!("2::,{depth}:,:,:,,"),
            Self::Latched => ":1:,1:,:,:,,".into(),
        }
    }
}

/// A node, as others see it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// `ROS_DOMAIN_ID`
    pub domain: u32,
    /// As the robot has it.
    pub hashes: Hashes,
    /// Of its session, as Zenoh prints it.
    pub zid: String,
    /// One counter for nodes and what they have.
    pub id: u32,
    /// `/`, or `/r1`.
    pub namespace: String,
    /// Without slashes.
    pub name: String,
}

/// Tokens have one chunk for what has slashes.
fn mangled(name: &str) -> String {
    if name.is_empty() { "%".into() } else { name.replace('/', "%") }
}

impl Node {
    fn token_of(&self, id: u32, role: &str) -> String {
        let Self { domain, zid, id: own, namespace, name, .. } = self;
        format!("@ros2_lv/{domain}/{zid}/{own}/{id}/{role}/%/{}/{name}", mangled(namespace))
    }

    /// The token of the node itself.
    pub fn token(&self) -> String {
        self.token_of(self.id, "NN")
    }

    /// The token of what it has, by its number.
    pub fn token_of_entity(&self, id: u32, role: Role, name: &str, kind: &str, qos: Qos) -> String {
        let (name, dds, hash, qos) = (mangled(name), dds_type(kind), self.hashes.of(kind), qos.text());
        format!("{}/{name}/{dds}/{hash}/{qos}", self.token_of(id, role.text()))
    }
}

/// What a token of others tells.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Told {
    /// `ROS_DOMAIN_ID`
    pub domain: u32,
    /// Of whom.
    pub zid: String,
    /// Which node, with its namespace.
    pub node: String,
    /// The topic.
    pub topic: String,
    /// Its type.
    pub kind: String,
}

/// Reads the token of a publisher; none of anything else.
pub fn publisher_of(token: &str) -> Option<Told> {
    let chunks: Vec<&str> = token.split('/').collect();
    let [_, domain, zid, _, _, "MP", _, namespace, node, topic, dds, ..] = chunks[..] else { return None };
    let unmangled = |text: &str| text.replace('%', "/");
    Some(Told {
        domain: domain.parse().ok()?,
        zid: zid.into(),
        node: format!("{}/{node}", unmangled(namespace).trim_end_matches('/')),
        topic: unmangled(topic),
        kind: ros_type(dds)?,
    })
}

/// Who sends: XXH3-128 of its token, low half first.
pub fn gid(token: &str) -> [u8; 16] {
    twox_hash::XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// What is attached to a message: its number, from 1; when it is sent, Unix nanoseconds; by whom.
pub fn attachment(seq: i64, sent_ns: i64, gid: &[u8; 16]) -> [u8; ATTACHED] {
    let mut bytes = [0; ATTACHED];
    bytes[..8].copy_from_slice(&seq.to_le_bytes());
    bytes[8..16].copy_from_slice(&sent_ns.to_le_bytes());
    bytes[16] = gid.len() as u8;
    bytes[17..].copy_from_slice(gid);
    bytes
}

/// Number and sender of an attachment, in the form since 2025 or that before; none of anything else.
pub fn attached(bytes: &[u8]) -> Option<(i64, [u8; 16])> {
    let number = |bytes: &[u8]| Some(i64::from_le_bytes(bytes.try_into().ok()?));
    if bytes.len() == ATTACHED {
        return Some((number(&bytes[..8])?, bytes[17..].try_into().ok()?));
    }
    // Each value after its name, which has its length in front.
    let named = |rest: &mut &[u8], name: &str| {
        let found = rest.strip_prefix(&[name.len() as u8]).and_then(|r| r.strip_prefix(name.as_bytes()));
        found.map(|after| *rest = after)
    };
    let mut rest = bytes;
    named(&mut rest, "sequence_number")?;
    let (seq, after) = rest.split_at_checked(8)?;
    rest = after;
    named(&mut rest, "source_timestamp")?;
    rest = rest.get(8..)?;
    named(&mut rest, "source_gid")?;
    Some((number(seq)?, rest.strip_prefix(&[16])?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_found_in_their_keys() {
        let key = key(7, "/r1/front/scan", kind::SCAN, &Hashes::OfTypes.of(kind::SCAN));
        assert!(key.starts_with("7/r1/front/scan/sensor_msgs::msg::dds_::LaserScan_/RIHS01_64c1"), "{key}");
        let told = Some(("/r1/front/scan".to_owned(), kind::SCAN.to_owned()));
        assert_eq!(topic_of(&key), told);
        assert_eq!(topic_of(&format!("{key}/_buf_cpu")), told);
        for other in ["0/scan", "0/sensor_msgs::msg::dds_::LaserScan_/x", "", "a/b/c::dds_::D/e"] {
            assert_eq!(topic_of(other), None, "{other}");
        }
    }

    #[test]
    fn tokens_and_attachments_are_read_back() {
        let node = Node {
            domain: 3,
            hashes: Hashes::OfTypes,
            zid: "ab".into(),
            id: 2,
            namespace: "/r1".into(),
            name: "toponym".into(),
        };
        let token = node.token_of_entity(9, Role::Publisher, "/r1/map", kind::GRID, Qos::Latched);
        let told = publisher_of(&token).unwrap();
        assert_eq!((told.domain, told.node.as_str(), told.topic.as_str()), (3, "/r1/toponym", "/r1/map"));
        assert_eq!(told.kind, kind::GRID);
        assert_eq!(publisher_of(&node.token()), None);
        let gid = gid(&token);
        assert_eq!(attached(&attachment(5, 6, &gid)), Some((5, gid)));
        assert_eq!(attached(b"sequence"), None);
    }
}
