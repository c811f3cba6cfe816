//! Nine identities try twelve operations on a router with the server's rules, its users and its certificates; and a server
//! whose users change.
#![allow(clippy::unwrap_used)]

use rcgen::{CertificateParams, DnType, Issuer, KeyPair};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};
use toponym::Connection;
use toponym_proto::Keys;
use toponym_server::access::trial::{Effects, Ground, Op, judge};
use toponym_server::access::{Policy, Role, User};
use toponym_server::config::{AccessConfig, ServerConfig, TlsConfig};
use toponym_server::serve::network;

const DAY: Duration = Duration::from_secs(86_400);

/// A folder that is gone with the test.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn server(arguments: &[&str], folder: &Path) {
    let done = Command::new(env!("CARGO_BIN_EXE_toponym-server"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(done.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&done.stderr));
}

fn policy(by_password: bool) -> Policy {
    let user = |role, robot: &str| User {
        role,
        robots: if robot.is_empty() { vec![] } else { vec![robot.into()] },
        password: by_password.then(|| format!("of {role:?}")),
    };
    let users = BTreeMap::from([
        ("a".to_owned(), user(Role::Robot, "own")),
        ("b".to_owned(), user(Role::Robot, "other")),
        ("guide".to_owned(), user(Role::Guide, "")),
        ("planner".to_owned(), user(Role::Planner, "")),
        ("viewer".to_owned(), user(Role::Viewer, "")),
        ("operator".to_owned(), user(Role::Operator, "")),
        ("trusted".to_owned(), user(Role::Trusted, "")),
    ]);
    Policy { local: false, users }
}

/// A router with rules and certificates, and where it listens.
async fn ground(folder: &Scratch, policy: &Policy, mutual: bool) -> (Ground, String) {
    let tls = TlsConfig {
        certificate: folder.path("tls/server.pem"),
        key: folder.path("tls/server-key.pem"),
        clients_ca: mutual.then(|| folder.path("tls/ca.pem")),
    };
    let config = ServerConfig {
        http: None,
        listen: vec!["quic/127.0.0.1:0".into()],
        data: folder.0.clone(),
        access: AccessConfig { policy: None, tls: Some(tls) },
        ..ServerConfig::default()
    };
    config.check().unwrap();
    let keys = Keys::new(&config.site).unwrap();
    let ground = Ground::open(network::open(&config, policy).await.unwrap(), &keys).await.unwrap();
    let endpoint = ground.endpoints().await.remove(0);
    (ground, endpoint)
}

async fn effects(ground: &Ground, connection: &Connection) -> Effects {
    match connection.open().await {
        Ok(client) => ground.effects(&client, Duration::from_secs(10)).await.unwrap(),
        Err(error) => {
            println!("{}: {error}", connection.user.as_deref().unwrap_or("nobody"));
            Effects::new()
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn nine_identities_can_do_what_they_may() {
    let folder = Scratch::new("identities");
    server(&["cert", "new"], &folder.0);
    let with_password = policy(true);
    let (ground_1, endpoint) = ground(&folder, &with_password, false).await;
    assert!(!folder.path("passwords").exists(), "passwords lie about");
    let mut to = Connection { ca: Some(folder.path("tls/ca.pem")), ..Connection::to(&endpoint) };
    for (name, user) in &with_password.users {
        (to.user, to.password) = (Some(name.clone()), user.password.clone());
        let got = effects(&ground_1, &to).await;
        if name == "b" {
            assert_eq!(got, Effects::from([(Op::StreamAsAnother, true)]), "another robot's");
        } else {
            judge(user.role, &got).unwrap_or_else(|e| panic!("{name}: {e}: {got:?}"));
        }
    }
    to.password = Some("wrong".into());
    assert_eq!(effects(&ground_1, &to).await, Effects::new(), "wrong password");
    to = Connection { user: None, password: None, ..to };
    assert_eq!(effects(&ground_1, &to).await, Effects::new(), "nobody");

    let (ground_2, endpoint) = ground(&folder, &policy(false), true).await;
    to.endpoint = endpoint;
    assert_eq!(effects(&ground_2, &to).await, Effects::new(), "no certificate");
    server(&["cert", "new", "--client", "guide"], &folder.0);
    server(&["cert", "new", "--client", "guide", "--folder", "elsewhere"], &folder.0);
    let own = |folder: &Scratch, path: &str| {
        Some((folder.path(&format!("{path}.pem")), folder.path(&format!("{path}-key.pem"))))
    };
    to.certificate = own(&folder, "tls/guide");
    judge(Role::Guide, &effects(&ground_2, &to).await).unwrap();
    to.certificate = own(&folder, "elsewhere/guide");
    assert_eq!(effects(&ground_2, &to).await, Effects::new(), "another authority");
    expired(&folder, "tls/late");
    to.certificate = own(&folder, "tls/late");
    assert_eq!(effects(&ground_2, &to).await, Effects::new(), "expired");
}

/// A certificate of the guide's, from the right authority, that was valid until yesterday.
fn expired(folder: &Scratch, path: &str) {
    let mut ca = CertificateParams::new(vec![]).unwrap();
    ca.distinguished_name = rcgen::DistinguishedName::new();
    ca.distinguished_name.push(DnType::CommonName, "toponym local authority");
    let key = KeyPair::from_pem(&std::fs::read_to_string(folder.path("tls/ca-key.pem")).unwrap()).unwrap();
    let issuer = Issuer::new(ca, key);
    let mut leaf = CertificateParams::new(vec![]).unwrap();
    leaf.distinguished_name = rcgen::DistinguishedName::new();
    leaf.distinguished_name.push(DnType::CommonName, "guide");
    leaf.extended_key_usages = vec![rcgen::ExtendedKeyUsagePurpose::ClientAuth];
    leaf.use_authority_key_identifier_extension = true;
    leaf.not_before = (SystemTime::now() - 9 * DAY).into();
    leaf.not_after = (SystemTime::now() - DAY).into();
    let key = KeyPair::generate().unwrap();
    let signed = leaf.signed_by(&key, &issuer).unwrap();
    std::fs::write(folder.path(&format!("{path}.pem")), signed.pem()).unwrap();
    std::fs::write(folder.path(&format!("{path}-key.pem")), key.serialize_pem()).unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn without_rules_all_that_is_tried_succeeds() {
    let mut open = zenoh::Config::default();
    for (key, value) in [
        ("mode", "\"router\""),
        ("listen/endpoints", "[\"tcp/127.0.0.1:0\"]"),
        ("scouting/multicast/enabled", "false"),
    ] {
        open.insert_json5(key, value).unwrap();
    }
    let keys = Keys::new("default").unwrap();
    let ground = Ground::open(zenoh::open(open).await.unwrap(), &keys).await.unwrap();
    let to = Connection::to(&ground.endpoints().await.join(","));
    let all = Op::ALL.into_iter().map(|op| (op, true)).collect();
    assert_eq!(effects(&ground, &to).await, all, "the trial sees nothing where everything is possible");
}

#[tokio::test(flavor = "multi_thread")]
async fn without_users_this_machine_may_everything() {
    let folder = Scratch::new("local");
    let config = ServerConfig {
        http: None,
        listen: vec!["tcp/127.0.0.1:0".into()],
        data: folder.0.clone(),
        ..ServerConfig::default()
    };
    let keys = Keys::new(&config.site).unwrap();
    let session = network::open(&config, &Policy::of_this_machine()).await.unwrap();
    let ground = Ground::open(session, &keys).await.unwrap();
    let to = Connection::to(&ground.endpoints().await.join(","));
    judge(Role::Trusted, &effects(&ground, &to).await).unwrap();
}
