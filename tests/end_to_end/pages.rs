//! Pages, and what they ask: over plain HTTP, as a browser, a script or an attacker would.

use crate::site::{Folder, PATIENCE, Site, connect, drive, settings};
use base64::Engine as _;
use base64::engine::general_purpose;
use serde_json::{Value, json};
use std::fmt::Write as _;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;
use toponym_proto::answer::ErrorReply;
use toponym_proto::{Keys, Limits};
use toponym_server::access::{Policy, Role, User};
use toponym_server::serve::Server;

/// A server with pages, and where they are.
struct Pages {
    site: Site,
    host: String,
    _folder: Folder,
}

/// A request to be sent.
#[derive(Clone)]
struct Request {
    method: &'static str,
    path: String,
    headers: Vec<(String, String)>,
    body: Vec<u8>,
}

fn request(method: &'static str, path: &str) -> Request {
    Request { method, path: path.into(), headers: Vec::new(), body: Vec::new() }
}

impl Request {
    fn with(mut self, name: &str, value: &str) -> Self {
        self.headers.push((name.into(), value.into()));
        self
    }

    fn json(self, body: &Value) -> Self {
        Self { body: body.to_string().into_bytes(), ..self.with("content-type", "application/json") }
    }
}

struct Answered {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answered {
    fn value(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&self.body)))
    }
}

/// A server, where its pages are, and its folder.
async fn start(policy: Option<Policy>) -> (Server, String, Folder) {
    start_with(policy, Limits::default()).await
}

async fn start_with(policy: Option<Policy>, limits: Limits) -> (Server, String, Folder) {
    let folder = Folder::new();
    let mut config = settings(&folder);
    config.limits = limits;
    config.http = Some("127.0.0.1:0".into());
    if let Some(policy) = policy {
        std::fs::create_dir_all(&config.data).unwrap();
        policy.write(&config.policy_path()).unwrap();
    }
    let server = Server::start(config, None).await.unwrap();
    let host = server.pages().unwrap().to_string();
    (server, host, folder)
}

async fn ask(host: &str, request: Request) -> Answered {
    let Request { method, path, headers, body } = request;
    let mut head =
        format!("{method} {path} HTTP/1.1\r\nconnection: close\r\ncontent-length: {}\r\n", body.len());
    if !headers.iter().any(|(name, _)| name == "host") {
        let _ = write!(head, "host: {host}\r\n");
    }
    for (name, value) in &headers {
        let _ = write!(head, "{name}: {value}\r\n");
    }
    let mut stream = TcpStream::connect(host).await.unwrap();
    // It may answer, and hang up, before all of it is sent.
    let _ = stream.write_all(&[head.as_bytes(), b"\r\n", &body].concat()).await;
    let mut all = Vec::new();
    let _ = timeout(PATIENCE, stream.read_to_end(&mut all)).await.expect("it never ended");
    let at = all.windows(4).position(|four| four == b"\r\n\r\n").expect("no answer");
    let head = String::from_utf8_lossy(&all[..at]).to_lowercase();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    let body = all[at + 4..].to_vec();
    let body = if head.contains("transfer-encoding: chunked") { dechunked(&body) } else { body };
    Answered { status, head, body }
}

impl Pages {
    async fn start() -> Self {
        let (server, host, folder) = start(None).await;
        let session = connect(&server).await;
        let site = Site { server, session, keys: Keys::new("default").unwrap() };
        Self { site, host, _folder: folder }
    }

    /// The same with a robot that has driven.
    async fn with_a_map() -> Self {
        let pages = Self::start().await;
        let acks = pages.site.acks("r1").await;
        for message in drive("r1", "main").iter().take(81) {
            pages.site.send(message).await;
        }
        acks.ack_of(80).await;
        pages.site.settle().await;
        pages
    }

    async fn ask(&self, request: Request) -> Answered {
        ask(&self.host, request).await
    }
}

/// The parts of a body that comes in chunks, together.
fn dechunked(mut rest: &[u8]) -> Vec<u8> {
    let mut body = Vec::new();
    while let Some(at) = rest.windows(2).position(|two| two == b"\r\n") {
        let length = usize::from_str_radix(std::str::from_utf8(&rest[..at]).unwrap(), 16).unwrap();
        if length == 0 {
            break;
        }
        body.extend_from_slice(&rest[at + 2..at + 2 + length]);
        rest = &rest[at + 4 + length..];
    }
    body
}

fn sentence(id: u8, text: &str) -> Value {
    json!({"id": format!("01J0000000000000000000{id:04}"), "text": text})
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_said_on_a_page_is_on_the_map_and_can_be_taken_back() {
    let pages = Pages::with_a_map().await;
    let say = |id, text: &str| request("POST", "/robot/r1/say?until=final").json(&sentence(id, text));
    let heard = pages.ask(say(1, "this is the gym")).await;
    assert_eq!(
        (heard.status, heard.value()["status"].as_str()),
        (200, Some("understood")),
        "{:?}",
        heard.value()
    );
    // Said again, it is the same.
    assert_eq!(pages.ask(say(1, "this is the gym")).await.value()["status"], "understood");
    let found = async || pages.ask(request("GET", "/map/main/ask/where?name=gym&robot=r1")).await.value();
    assert!(found().await["candidates"][0]["probability"].as_f64().unwrap() > 0.5);
    let said = pages.ask(request("GET", "/map/main/sentences")).await.value();
    assert_eq!(said["sentences"].as_array().unwrap().len(), 1, "{said}");
    let undone = pages.ask(request("POST", "/do/undo?id=01J00000000000000000000001&map=main")).await;
    assert_eq!(undone.status, 200, "{:?}", undone.value());
    assert_eq!(found().await["p_none"], 1.0);
    pages.site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_sees_the_map_in_tiles_that_it_may_keep() {
    let pages = Pages::with_a_map().await;
    let list = pages.ask(request("GET", "/map/main/tiles")).await.value();
    let tiles = list["tiles"].as_array().unwrap();
    assert!(!tiles.is_empty() && list["tile_cells"] == 128, "{list}");
    let tile = &tiles[0];
    let path = format!("/map/main/tile/{}/{}?hash={}", tile["x"], tile["y"], tile["hash"].as_str().unwrap());
    let answered = pages.ask(request("GET", &path)).await;
    assert!(answered.status == 200 && answered.body.starts_with(b"\x89PNG"));
    assert!(answered.head.contains("immutable"));
    let old = pages.ask(request("GET", &path.replace("hash=", "hash=x"))).await;
    assert!(old.status == 200 && old.head.contains("no-store"), "it has changed since");
    assert_eq!(pages.ask(request("GET", "/map/main/tile/999/999")).await.status, 404);
    pages.site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_happens_is_told_as_it_happens() {
    let pages = Pages::with_a_map().await;
    let mut stream = TcpStream::connect(&pages.host).await.unwrap();
    let ask = format!("GET /events HTTP/1.1\r\nhost: {}\r\n\r\n", pages.host);
    stream.write_all(ask.as_bytes()).await.unwrap();
    let mut seen = String::new();
    let mut read = async |until: &str| {
        let wait = async {
            let mut part = [0; 4096];
            while !seen.contains(until) {
                let n = stream.read(&mut part).await.unwrap();
                assert!(n > 0, "it ended: {seen}");
                seen.push_str(&String::from_utf8_lossy(&part[..n]));
            }
        };
        timeout(PATIENCE, wait).await.expect(until);
    };
    read("text/event-stream").await;
    let said = pages.ask(request("POST", "/robot/r1/say").json(&sentence(2, "this is the kitchen"))).await;
    assert_eq!((said.status, said.value()["durable"].as_bool()), (200, Some(true)));
    read("event: heard").await;
    read("understood").await;
    pages.site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pages_ask_nobody_else_for_anything() {
    let pages = Pages::start().await;
    for (path, kind) in [
        ("/", "text/html"),
        ("/guide", "text/html"),
        ("/sw.js", "text/javascript"),
        ("/assets/map.js", "text/javascript"),
        ("/assets/drawing.js", "text/javascript"),
        ("/assets/style.css", "text/css"),
        ("/assets/icon.svg", "image/svg+xml"),
        ("/assets/manifest.webmanifest", "application/manifest+json"),
    ] {
        let answered = pages.ask(request("GET", path)).await;
        assert!(answered.status == 200 && answered.head.contains(kind), "{path}: {}", answered.head);
        assert!(answered.head.contains("content-security-policy: default-src 'none'"), "{path}");
        let text = String::from_utf8(answered.body).unwrap().replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("http://") && !text.contains("https://"), "{path} names another host");
        assert!(!text.contains("innerHTML") && !text.contains("<script>"), "{path} makes HTML of text");
    }
    pages.site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn hostile_requests_are_refused_with_an_error_each() {
    let pages = Pages::with_a_map().await;
    let say = |body: &str| Request { body: body.into(), ..request("POST", "/robot/r1/say") };
    let json_of = |body: &str| say(body).with("content-type", "application/json");
    let good = sentence(9, "this is the lab");
    let long = "a".repeat(100_000);
    let nested = "[".repeat(50_000);
    let mut all: Vec<(&str, Request)> = vec![
        ("another host", request("GET", "/info").with("host", "evil.example")),
        ("another port", request("GET", "/info").with("host", "127.0.0.1:1")),
        ("no host", request("GET", "/info").with("host", "")),
        ("rebound", request("POST", "/do/undo").with("host", "127.0.0.1.evil.example")),
        ("another site", json_of(&good.to_string()).with("origin", "https://evil.example")),
        ("null origin", json_of(&good.to_string()).with("origin", "null")),
        ("another site's command", request("POST", "/do/undo").with("origin", "http://evil.example")),
        ("form", say("text=hello").with("content-type", "application/x-www-form-urlencoded")),
        ("plain text", say(&good.to_string()).with("content-type", "text/plain")),
        ("no type", say(&good.to_string())),
        ("empty", json_of("")),
        ("no JSON", json_of("this is the lab")),
        ("half", json_of("{\"id\": \"a\"")),
        ("list", json_of("[]")),
        ("number", json_of("7")),
        ("nested", json_of(&nested)),
        ("unknown field", json_of(r#"{"id": "a", "text": "hi", "admin": true}"#)),
        ("no text", json_of(r#"{"id": "a"}"#)),
        ("empty text", json_of(r#"{"id": "a", "text": ""}"#)),
        ("empty id", json_of(r#"{"id": "", "text": "hi"}"#)),
        ("text of a number", json_of(r#"{"id": "a", "text": 7}"#)),
        ("null bytes", json_of("{\"id\": \"a\", \"text\": \"\u{0}\"}")),
        ("long", json_of(&json!({"id": "a", "text": long}).to_string())),
        ("bad stamp", json_of(r#"{"id": "a", "text": "hi", "began": {"sec": 1e300}}"#)),
        ("bad ago", json_of(r#"{"id": "a", "text": "hi", "ago_s": -1e9}"#)),
        ("bad chance", json_of(r#"{"id": "a", "text": "hi", "alternatives": [{"text": "ho", "p": 7}]}"#)),
        ("no UTF-8", Request { body: vec![0xff, 0xfe], ..json_of("") }),
        ("say by GET", request("GET", "/robot/r1/say")),
        ("undo by GET", request("GET", "/do/undo")),
        ("delete by GET", request("GET", "/do/delete?map=main")),
        ("ask by POST", request("POST", "/map/main/ask/where?name=gym")),
        ("DELETE", request("DELETE", "/map/main/ask/where")),
        ("PUT", request("PUT", "/robot/r1/in/setup")),
        ("publish as a robot", request("POST", "/robot/r1/in/odom").json(&json!({}))),
        ("no such command", request("POST", "/do/shutdown")),
        ("no such map", request("GET", "/map/attic/ask/where?name=gym")),
        ("no such question", request("GET", "/map/main/ask/everything")),
        ("no name", request("GET", "/map/main/ask/where")),
        ("no such argument", request("GET", "/map/main/ask/where?name=gym&admin=1")),
        ("half an escape", request("GET", "/map/main/ask/where?name=%f")),
        ("no escape in a path", request("GET", "/map/%zz/tiles")),
        ("no UTF-8 in a path", request("GET", "/map/%ff/sentences")),
        ("fine grid", request("GET", "/map/main/ask/grid?resolution_m=0.0000001")),
        ("no number", request("GET", "/map/main/ask/what?x_m=NaN&y_m=inf")),
        ("wildcard", request("GET", "/map/*/ask/where?name=gym")),
        ("all wildcards", request("GET", "/map/**/ask/grid")),
        ("out of the folder", request("GET", "/assets/../../policy.toml")),
        ("out of it, escaped", request("GET", "/assets/..%2f..%2fpolicy.toml")),
        ("absolute", request("GET", "/assets//etc/passwd")),
        ("script in a name", request("GET", "/map/%3Cscript%3Ealert(1)%3C%2Fscript%3E/ask/where?name=a")),
        ("script in a path", request("GET", "/%3Cimg%20src=x%20onerror=alert(1)%3E")),
        ("tile of no number", request("GET", "/map/main/tile/a/b")),
        ("tile far out", request("GET", "/map/main/tile/9223372036854775807/-9223372036854775808")),
    ];
    all.push(("long path", request("GET", &format!("/{}", "a/".repeat(3000)))));
    assert!(all.len() >= 50);
    for (name, request) in all {
        let answered = pages.ask(request).await;
        assert!((400..600).contains(&answered.status), "{name}: {}", answered.status);
        assert!(!answered.head.contains("text/html"), "{name}: {}", answered.head);
        assert!(answered.head.contains("x-content-type-options: nosniff"), "{name}: {}", answered.head);
        let error: ErrorReply = serde_json::from_slice(&answered.body)
            .unwrap_or_else(|e| panic!("{name}: {e}: {}", String::from_utf8_lossy(&answered.body)));
        assert!(!error.error.message.is_empty(), "{name}");
    }
    // Nothing of all that was said, taken back or deleted.
    let said = pages.ask(request("GET", "/map/main/sentences")).await.value();
    assert_eq!(said["sentences"], json!([]));
    assert_eq!(pages.ask(request("GET", "/info")).await.value()["maps"][0]["id"], "main");
    pages.site.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn users_do_on_pages_what_their_role_may() {
    let user = |role| User { role, robots: Vec::new(), password: Some("secret-of-theirs".into()) };
    let mut policy = Policy::default();
    for (name, role) in [("anna", Role::Guide), ("vera", Role::Viewer), ("otto", Role::Operator)] {
        policy.users.insert(name.into(), user(role));
    }
    policy.users.insert("gina".into(), User { robots: vec!["r2".into()], ..user(Role::Guide) });
    let (server, host, _folder) = start(Some(policy)).await;
    let ask = async |request: Request, who: Option<&str>| {
        let request = match who {
            Some(both) => {
                request.with("authorization", &format!("Basic {}", general_purpose::STANDARD.encode(both)))
            }
            None => request,
        };
        ask(&host, request).await.status
    };
    let (info, page) = (|| request("GET", "/info"), || request("GET", "/guide"));
    for who in [None, Some("anna:wrong"), Some("nobody:secret-of-theirs"), Some("anna"), Some("")] {
        assert_eq!((ask(info(), who).await, ask(page(), who).await), (401, 401), "{who:?}");
    }
    let say = || request("POST", "/robot/r1/say").json(&sentence(3, "this is the gym"));
    let (undo, delete) = (|| request("POST", "/do/undo"), || request("POST", "/do/delete?map=attic"));
    let sentences = || request("GET", "/map/attic/sentences");
    for (who, may) in [
        ("anna", [true, true, false, true]),
        ("vera", [false, false, false, false]),
        ("otto", [false, true, true, true]),
    ] {
        let who = format!("{who}:secret-of-theirs");
        assert_eq!(ask(info(), Some(&who)).await, 200);
        for (request, may) in [say(), undo(), delete(), sentences()].into_iter().zip(may) {
            let what = request.path.clone();
            assert_eq!(ask(request, Some(&who)).await != 403, may, "{who} {what}");
        }
    }
    // A guide of one robot has to do with that alone.
    let gina = "gina:secret-of-theirs";
    for (path, may) in
        [("/robot/r1/out/pose", false), ("/robot/r2/out/pose", true), ("/robot/r1/out/heard", false)]
    {
        assert_eq!(ask(request("GET", path), Some(gina)).await != 403, may, "{path}");
    }
    assert_eq!(ask(say(), Some(gina)).await, 403);
    server.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_that_say_nothing_leave_room_for_no_more_than_may_be() {
    let (server, host, _folder) = start_with(None, Limits { connections: 4, ..Limits::default() }).await;
    let mut silent = Vec::new();
    for _ in 0..4 {
        let mut stream = TcpStream::connect(&host).await.unwrap();
        // An answer tells that the connection was taken.
        let asks = format!("GET /time HTTP/1.1\r\nhost: {host}\r\n\r\n");
        stream.write_all(asks.as_bytes()).await.unwrap();
        assert!(stream.read(&mut [0; 16]).await.unwrap() > 0);
        silent.push(stream);
    }
    let mut fifth = TcpStream::connect(&host).await.unwrap();
    // Closed, or reset, without a word.
    let end = timeout(PATIENCE, fifth.read(&mut [0; 16])).await.expect("it was taken");
    assert!(!matches!(end, Ok(1..)), "{end:?}");
    // One that ends makes room.
    drop(silent.pop());
    let info = loop {
        let mut stream = TcpStream::connect(&host).await.unwrap();
        let asks = format!("GET /info HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n");
        let _ = stream.write_all(asks.as_bytes()).await;
        let mut all = Vec::new();
        if stream.read_to_end(&mut all).await.is_ok_and(|n| n > 0) {
            break String::from_utf8_lossy(&all).into_owned();
        }
    };
    assert!(info.contains("\"connections\""), "it is counted: {info}");
    server.stop().await.unwrap();
}
