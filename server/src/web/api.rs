//! Questions, sentences, commands: as over Zenoh.

use super::Web;
use super::guard::Who;
use crate::serve::aside;
use crate::serve::queries::{self, Reply};
use axum::body::{Body, to_bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{Instant, timeout, timeout_at};
use toponym::guide::is_final;
use toponym_core::answers::constraints::Sentence;
use toponym_proto::answer::{ANSWER_VERSION, ErrorCode, ErrorReply, Heard, HeardStatus, Problem};
use toponym_proto::codec::{ENCODING_JSON, ENCODING_PNG};
use toponym_proto::{Message, Say};

/// A sentence is no longer, with all that may be said of it, bytes.
const BODY_MAX: usize = 64 << 10;
/// Who sends it must have done so within this.
const BODY_WAIT: Duration = Duration::from_secs(10);
/// What becomes of a sentence is waited for so long.
const HEARD_WAIT: Duration = Duration::from_secs(5);

/// An error, as Zenoh's clients get it.
pub fn refuse(status: StatusCode, error: Problem) -> Response {
    let json = serde_json::to_vec(&ErrorReply { error }).unwrap_or_default();
    (status, [(header::CONTENT_TYPE, ENCODING_JSON)], json).into_response()
}

fn status(problem: &Problem) -> StatusCode {
    match problem.code {
        ErrorCode::NoSuchMap | ErrorCode::NoSuchQuery | ErrorCode::NoSuchRobot => StatusCode::NOT_FOUND,
        ErrorCode::Busy => StatusCode::SERVICE_UNAVAILABLE,
        ErrorCode::Internal => StatusCode::INTERNAL_SERVER_ERROR,
        _ => StatusCode::BAD_REQUEST,
    }
}

fn told(problem: Problem) -> Response {
    refuse(status(&problem), problem)
}

/// The key of a path, and its arguments as Zenoh has them.
fn selected(web: &Web, uri: &Uri) -> (String, String) {
    let key = format!("toponym/v1/{}{}", web.board.site, uri.path());
    (key, uri.query().unwrap_or_default().replace('&', ";").replace('+', "%20"))
}

/// What was said of a map: id, text, stamp, and whether it still stands.
pub async fn sentences(
    State(web): State<Arc<Web>>,
    Extension(who): Extension<Who>,
    Path(id): Path<String>,
) -> Response {
    let Some(view) = web.board.maps.load().get(&id).cloned() else {
        return told(Problem::new(ErrorCode::NoSuchMap, format!("there is no map {id:?}")).field("map"));
    };
    if !who.may_hear(&view.robot) {
        let problem = Problem::new(ErrorCode::BadArgument, "you may not hear this robot").field("map");
        return refuse(StatusCode::FORBIDDEN, problem);
    }
    let snapshot = view.snapshot.load_full();
    let sentence =
        |s: Sentence| json!({"id": s.id, "stamp_ns": s.stamp_ns, "text": s.text, "stands": s.stands});
    let all: Vec<Value> = snapshot.sentences().into_iter().map(sentence).collect();
    Json(json!({"v": ANSWER_VERSION, "map": view.identity(&snapshot), "sentences": all})).into_response()
}

/// A question, or a command.
pub async fn answer(State(web): State<Arc<Web>>, uri: Uri) -> Response {
    let (key, arguments) = selected(&web, &uri);
    let Some(permit) = web.permits.take(&key) else {
        web.board.reach("queries");
        return told(Problem::new(ErrorCode::Busy, "too many queries: try again"));
    };
    let answered = tokio::task::spawn_blocking(move || {
        aside::give_way();
        let answered = queries::answer(&web.board, &key, &arguments, &[]);
        drop(permit);
        answered
    });
    match answered.await {
        Ok(Ok(Reply { payload, encoding })) => {
            let kind = if encoding == ENCODING_PNG { ENCODING_PNG } else { ENCODING_JSON };
            ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "no-store")], payload).into_response()
        }
        Ok(Err(problem)) => told(problem),
        Err(e) => told(Problem::new(ErrorCode::Internal, e.to_string())),
    }
}

/// A sentence. Answers that it is on disk and how it was read, as soon as that is so; with `until=final`, what became of it.
pub async fn say(State(web): State<Arc<Web>>, request: Request) -> Response {
    let is_json = |kind: &HeaderValue| kind.to_str().is_ok_and(|kind| kind.starts_with(ENCODING_JSON));
    if !request.headers().get(header::CONTENT_TYPE).is_some_and(is_json) {
        let problem = Problem::new(ErrorCode::BadArgument, "a sentence is application/json");
        return refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, problem.field("content-type"));
    }
    let (key, arguments) = selected(&web, request.uri());
    let to_the_end = arguments == "until=final";
    let bytes = match body(request.into_body()).await {
        Ok(bytes) => bytes,
        Err(refused) => return *refused,
    };
    let said: Say = match serde_json::from_slice(&bytes) {
        Ok(said) => said,
        Err(e) => return told(Problem::new(ErrorCode::BadArgument, format!("no sentence: {e}"))),
    };
    let id = said.id.clone();
    if let Err(e) = Message::Say(said).validate(&toponym_proto::Limits::default()) {
        return told(Problem::new(ErrorCode::BadArgument, e.to_string()));
    }
    let mut heard = web.board.events.subscribe();
    if !web.door.enter(key, ENCODING_JSON.into(), bytes.len(), || bytes) {
        return told(Problem::new(ErrorCode::Busy, "too much is said at once: say it again"));
    }
    let (until, mut last) = (Instant::now() + HEARD_WAIT, None);
    let is_enough = |heard: &Heard| is_final(heard) || (heard.durable && !to_the_end);
    loop {
        match timeout_at(until, heard.recv()).await {
            Ok(Ok(event)) if event.name == "heard" => {
                let of_it = serde_json::from_slice::<Heard>(&event.json).ok().filter(|heard| heard.id == id);
                let Some(of_it) = of_it else { continue };
                if is_enough(&of_it) {
                    return answered(&of_it);
                }
                last = Some(of_it);
            }
            Ok(Ok(_) | Err(RecvError::Lagged(_))) => {}
            Ok(Err(RecvError::Closed)) | Err(_) => break,
        }
    }
    match last {
        Some(read) => answered(&read),
        None => refuse(
            StatusCode::GATEWAY_TIMEOUT,
            Problem::new(ErrorCode::Busy, "nothing was heard of it yet: say it again, with the same id"),
        ),
    }
}

fn answered(heard: &Heard) -> Response {
    if let (HeardStatus::Refused, Some(problem)) = (&heard.status, &heard.error) {
        return told(problem.clone());
    }
    let json = serde_json::to_vec(heard).unwrap_or_default();
    ([(header::CONTENT_TYPE, ENCODING_JSON)], json).into_response()
}

async fn body(body: Body) -> Result<Vec<u8>, Box<Response>> {
    let no = |status, message: &str| {
        Box::new(refuse(status, Problem::new(ErrorCode::BadArgument, message).field("body")))
    };
    match timeout(BODY_WAIT, to_bytes(body, BODY_MAX)).await {
        Ok(Ok(bytes)) => Ok(bytes.to_vec()),
        Ok(Err(_)) => Err(no(StatusCode::PAYLOAD_TOO_LARGE, "it is too long for a sentence")),
        Err(_) => Err(no(StatusCode::REQUEST_TIMEOUT, "it does not come")),
    }
}

/// There is no such path.
pub async fn nothing(uri: Uri) -> Response {
    let problem = Problem::new(ErrorCode::NoSuchQuery, format!("there is nothing at {}", uri.path()));
    refuse(StatusCode::NOT_FOUND, problem.field("path").hint("paths are keys: see proto/PROTOCOL.md"))
}

/// There is, but not so.
pub async fn other_method() -> Response {
    let problem = Problem::new(ErrorCode::BadArgument, "questions are GET, sentences and commands POST");
    refuse(StatusCode::METHOD_NOT_ALLOWED, problem.field("method"))
}
