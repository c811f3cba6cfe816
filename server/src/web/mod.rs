//! What a browser, a headset or `curl` sees of the server: pages, and the same questions, sentences and commands as over
//! Zenoh.
//!
//! ```text
//! GET  /                         the map;  /guide: hold to talk
//! GET  /map/{map}/ask/{what}?…   as toponym/v1/{site}/map/{map}/ask/{what}, JSON or PNG
//! GET  /map/{map}/sentences      what was said, by id
//! GET  /map/{map}/tiles          the grid in tiles that a page keeps until they change
//! POST /robot/{robot}/say        a sentence; answers what became of it
//! POST /do/{command}?…           undo, rename, forget, save, delete
//! GET  /events                   server-sent events: poses, what was heard, maps that changed, jumps
//! GET  /healthz, /metrics        how the server does
//! ```
//!
//! The path is the key after `toponym/v1/{site}`. Pages ask nothing of any other host, and their policy forbids it.

mod api;
mod events;
mod guard;
mod pages;
mod tiles;

pub use events::Published;
pub use guard::Guard;

use crate::access::Policy;
use crate::config::{DEFAULT_HTTP, ServerConfig};
use crate::serve::board::Board;
use crate::serve::door::Door;
use crate::serve::{queries, watch};
use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::{get, post};
use std::io::ErrorKind;
use std::sync::Arc;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tracing::{error, info, warn};

/// What all handlers know.
pub struct Web {
    board: Arc<Board>,
    door: Door,
    guard: Guard,
    permits: queries::Permits,
    tiles: tiles::Tiles,
}

/// Serves at `config.http` until the task is aborted.
///
/// # Errors
/// If nobody can listen there.
pub async fn serve(
    board: Arc<Board>,
    door: Door,
    config: &ServerConfig,
    policy: &Policy,
    address: &str,
) -> std::io::Result<JoinHandle<()>> {
    let listener = match TcpListener::bind(address).await {
        Ok(listener) => listener,
        // Nobody asked for it here: two servers on one machine are no error.
        Err(e) if e.kind() == ErrorKind::AddrInUse && address == DEFAULT_HTTP => {
            warn!("no pages: {address} is in use, perhaps by another server; --http names another address");
            return Ok(tokio::spawn(std::future::pending()));
        }
        Err(e) => return Err(std::io::Error::new(e.kind(), format!("cannot listen on http {address}: {e}"))),
    };
    let local = listener.local_addr()?;
    let health = watch::routes(board.clone());
    let router = if local.ip().is_loopback() {
        info!("pages: http://{local}/ shows the map, http://{local}/guide is for whoever talks");
        let permits = queries::Permits::new(&config.limits);
        let guard = Guard::new(config, policy, address, local.port());
        routes(Arc::new(Web { board, door, guard, permits, tiles: tiles::Tiles::default() })).merge(health)
    } else {
        warn!(
            "http: /healthz and /metrics alone at {local}: pages are for this machine only, as a browser beyond needs \
             encryption: put a proxy with TLS in front of --http 127.0.0.1:{}",
            local.port()
        );
        health
    };
    Ok(tokio::spawn(async move {
        if let Err(e) = axum::serve(listener, router).await {
            error!("http: {e}");
        }
    }))
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
        .route("/map/{map}/ask/{what}", get(api::ask))
        .route("/map/{map}/out/{what}", get(api::ask))
        .route("/robot/{robot}/out/{what}", get(api::ask))
        .route("/info", get(api::ask))
        .route("/time", get(api::ask))
        .route("/robot/{robot}/say", post(api::say))
        .route("/do/{command}", post(api::command))
        .route("/events", get(events::events))
        .fallback(api::nothing)
        .method_not_allowed_fallback(api::other_method)
        .layer(from_fn_with_state(web.clone(), guard::guard))
        .with_state(web)
}
