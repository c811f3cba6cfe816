//! The pages, in the binary.

use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use toponym_proto::answer::{ErrorCode, Problem};

use super::api::refuse;

/// Name, type, content.
const ASSETS: [(&str, &str, &str); 9] = [
    ("style.css", "text/css", include_str!("pages/style.css")),
    ("api.js", "text/javascript", include_str!("pages/api.js")),
    ("map.js", "text/javascript", include_str!("pages/map.js")),
    ("drawing.js", "text/javascript", include_str!("pages/drawing.js")),
    ("guide.js", "text/javascript", include_str!("pages/guide.js")),
    ("outbox.js", "text/javascript", include_str!("pages/outbox.js")),
    ("listening.js", "text/javascript", include_str!("pages/listening.js")),
    ("icon.svg", "image/svg+xml", include_str!("pages/icon.svg")),
    ("manifest.webmanifest", "application/manifest+json", include_str!("pages/manifest.webmanifest")),
];

fn page(content: &'static str) -> Response {
    served("text/html", content)
}

fn served(kind: &str, content: &'static str) -> Response {
    let kind = format!("{kind}; charset=utf-8");
    // A newer server has newer pages.
    ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "no-cache".into())], content).into_response()
}

/// The map.
pub async fn map() -> Response {
    page(include_str!("pages/map.html"))
}

/// For whoever talks.
pub async fn guide() -> Response {
    page(include_str!("pages/guide.html"))
}

/// Keeps the pages for when there is no connection.
pub async fn worker() -> Response {
    served("text/javascript", include_str!("pages/sw.js"))
}

/// What pages are made of.
pub async fn asset(Path(file): Path<String>) -> Response {
    if let Some((_, kind, content)) = ASSETS.iter().find(|(name, ..)| *name == file) {
        return served(kind, content);
    }
    let problem = Problem::new(ErrorCode::NoSuchQuery, "there is no such file").field("path");
    refuse(StatusCode::NOT_FOUND, problem)
}
