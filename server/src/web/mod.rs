//! What a browser, a headset or `curl` sees of the server: pages, and the same questions, sentences and commands as over
//! Zenoh.
//!
//! ```text
//! GET  /                         the map;  /guide: hold to talk
//! GET  /map/{map}/ask/{what}?…   as toponym/v1/{site}/map/{map}/ask/{what}, JSON or PNG
//! GET  /map/{map}/sentences      what was said, by id
//! GET  /map/{map}/tiles          the grid in tiles that a page keeps until they change
//! POST /robot/{robot}/say        a sentence; answers what became of it
//! POST /do/{command}?…           undo, rename, forget, area, go, initial_pose, save, delete
//! GET  /events                   server-sent events: poses, what was heard, maps that changed, jumps
//! GET  /healthz, /metrics        how the server does
//! GET  /ca.pem                   beyond this machine: the authority to trust, if `cert new` made it
//! ```
//!
//! The path is the key after `toponym/v1/{site}`. Pages ask nothing of any other host, and their policy forbids it.

mod address;
mod api;
mod connections;
mod events;
mod guard;
mod pages;
mod tiles;

pub use events::{LAST_EVENT, Published};

use self::connections::Bounded;
use self::guard::Guard;
use crate::access::Policy;
use crate::config::{DEFAULT_HTTP, ServerConfig};
use crate::serve::board::Board;
use crate::serve::door::Door;
use crate::serve::{queries, watch};
use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::{get, post};
use axum_server::Server;
use axum_server::tls_rustls::RustlsConfig;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tower_http::compression::{CompressionLayer, CompressionLevel};
use tracing::{error, warn};

/// A request's head comes within this.
const HEAD_WAIT: Duration = Duration::from_secs(10);

/// What all handlers know.
pub struct Web {
    board: Arc<Board>,
    door: Door,
    guard: Guard,
    permits: queries::Permits,
    tiles: tiles::Tiles,
}

/// Serves at an address until the task is aborted; tells where.
///
/// # Errors
/// If nobody can listen there; if the certificate can't be used.
pub async fn serve(
    board: Arc<Board>,
    door: Door,
    config: &ServerConfig,
    policy: &Policy,
    address: &str,
) -> io::Result<(JoinHandle<()>, Option<SocketAddr>)> {
    let listener = match TcpListener::bind(address).await {
        Ok(listener) => listener,
        // Nobody asked for it here: two servers on one machine are no error.
        Err(e) if e.kind() == ErrorKind::AddrInUse && address == DEFAULT_HTTP => {
            warn!("no pages: {address} is in use, perhaps by another server; --http names another address");
            return Ok((tokio::spawn(std::future::pending()), None));
        }
        Err(e) => return Err(io::Error::new(e.kind(), format!("cannot listen on http {address}: {e}"))),
    };
    let (local, listener) = (listener.local_addr()?, listener.into_std()?);
    let bounded = Bounded::new(config.limits.connections, board.clone());
    let health = watch::routes(board.clone());
    let tls = config.access.tls.as_ref().filter(|_| !local.ip().is_loopback() && policy.by_password());
    let pages = |guard| {
        let (permits, tiles) = (queries::Permits::new(&config.limits), tiles::Tiles::default());
        routes(Arc::new(Web { board, door, guard, permits, tiles })).merge(health.clone())
    };
    let served = if local.ip().is_loopback() {
        address::tell_local(local);
        let router = pages(Guard::new(policy, Some(hosts(config, address, local.port()))));
        plain(listener, bounded, router)?
    } else if let Some(tls) = tls {
        let authority = address::authority(config);
        address::tell(config, local, authority.is_some());
        // What a certificate is not of, no browser shows.
        let mut router = pages(Guard::new(policy, None));
        if let Some(file) = authority {
            // For whoever does not trust the rest yet, and so has not said who they are.
            router = router.route("/ca.pem", get(move || address::ca(file.clone())));
        }
        let tls = RustlsConfig::from_pem_file(&tls.certificate, &tls.key).await?;
        let server = hurried(axum_server::from_tcp_rustls(listener, tls)?).map(|tls| tls.acceptor(bounded));
        tokio::spawn(async move { ended(server.serve(router.into_make_service()).await) })
    } else {
        warn!(
            "http: /healthz and /metrics alone at {local}: beyond this machine pages need users (`toponym-server user add \
             anna --role guide`) and a certificate (`toponym-server cert new`, [access.tls])"
        );
        plain(listener, bounded, health)?
    };
    Ok((served, Some(local)))
}

fn plain(listener: std::net::TcpListener, bounded: Bounded, router: Router) -> io::Result<JoinHandle<()>> {
    let server = hurried(axum_server::from_tcp(listener)?).acceptor(bounded);
    Ok(tokio::spawn(async move { ended(server.serve(router.into_make_service()).await) }))
}

/// Who says nothing does not keep a connection.
fn hurried<A>(server: Server<SocketAddr, A>) -> Server<SocketAddr, A> {
    let mut server = server.first_request_timeout(HEAD_WAIT);
    server.http_builder().http1().header_read_timeout(HEAD_WAIT);
    server
}

fn ended(served: io::Result<()>) {
    if let Err(e) = served {
        error!("http: {e}");
    }
}

/// Names under which a server without a certificate may be asked for.
fn hosts(config: &ServerConfig, address: &str, port: u16) -> Vec<String> {
    let own = address.rsplit_once(':').map_or(address, |(host, _)| host);
    let names = ["localhost", "127.0.0.1", "[::1]", own].into_iter();
    names.map(|name| format!("{name}:{port}")).chain(config.http_hosts.iter().cloned()).collect()
}

fn routes(web: Arc<Web>) -> Router {
    Router::new()
        .route("/", get(pages::map))
        .route("/guide", get(pages::guide))
        .route("/assets/{file}", get(pages::asset))
        // A service worker may serve what is below its own path.
        .route("/sw.js", get(pages::worker))
        .route("/map/{map}/tiles", get(tiles::list))
        .route("/map/{map}/tile/{x}/{y}", get(tiles::tile))
        .route("/map/{map}/sentences", get(api::sentences))
        .route("/map/{map}/ask/{what}", get(api::answer))
        .route("/map/{map}/out/{what}", get(api::answer))
        .route("/robot/{robot}/out/{what}", get(api::answer))
        .route("/info", get(api::answer))
        .route("/time", get(api::answer))
        .route("/robot/{robot}/say", post(api::say))
        .route("/do/{command}", post(api::answer))
        .route("/events", get(events::events))
        .fallback(api::nothing)
        .method_not_allowed_fallback(api::other_method)
        .layer(from_fn_with_state(web.clone(), guard::guard))
        // Pages ask anew all day. Pictures and events go as they are.
        .layer(CompressionLayer::new().quality(CompressionLevel::Fastest))
        .with_state(web)
}
