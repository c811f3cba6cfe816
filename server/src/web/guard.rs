//! Who may ask what, and from which page: before any handler.

use super::Web;
use super::api::refuse;
use crate::access::{Policy, Role, User};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use toponym_proto::answer::{ErrorCode, Problem};
use toponym_proto::selector::unescape;

/// What pages may load: what they were served with, and nothing else from anywhere.
const CONTENT_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                              connect-src 'self'; manifest-src 'self'; worker-src 'self'; base-uri 'none'; \
                              form-action 'none'; frame-ancestors 'none'";

/// Whom the pages are for.
pub struct Guard {
    policy: Policy,
    /// Names under which the server may be asked for; none: any.
    hosts: Option<Vec<String>>,
}

/// Who asks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Who {
    /// What they may.
    pub role: Role,
    /// The robots that a guide may talk to; empty: all.
    pub robots: Vec<String>,
}

impl Guard {
    /// For those names; none: for any.
    pub fn new(policy: &Policy, hosts: Option<Vec<String>>) -> Self {
        Self { policy: policy.clone(), hosts }
    }

    /// Who asks; none if it is not known.
    fn who(&self, headers: &HeaderMap) -> Option<Who> {
        if self.policy.local {
            return Some(Who { role: Role::Trusted, robots: Vec::new() });
        }
        let basic = headers.get(header::AUTHORIZATION)?.to_str().ok()?.strip_prefix("Basic ")?;
        let both = String::from_utf8(STANDARD.decode(basic).ok()?).ok()?;
        let (name, password) = both.split_once(':')?;
        let User { role, robots, password: known } = self.policy.users.get(name)?;
        let is_known = same(known.as_deref()?.as_bytes(), password.as_bytes());
        is_known.then(|| Who { role: *role, robots: robots.clone() })
    }
}

/// Whether two secrets are the same, in a time that tells nothing of where they differ.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0
}

impl Who {
    /// Whether they may, as over Zenoh (`access/rules.rs`).
    fn may(&self, method: &Method, path: &str) -> bool {
        let is = |roles: &[Role]| self.role == Role::Trusted || roles.contains(&self.role);
        let chunks: Vec<&str> = path.trim_matches('/').split('/').collect();
        match chunks[..] {
            ["robot", robot, "say"] => is(&[Role::Guide]) && self.is_about(robot),
            ["do", "undo" | "rename" | "forget" | "initial_pose"] => is(&[Role::Guide, Role::Operator]),
            ["do", "go"] => is(&[Role::Planner, Role::Operator]),
            ["do", _] => is(&[Role::Operator]),
            ["robot", robot, "out", "heard"] => self.may_hear(robot),
            ["map", _, "sentences"] => self.may_hear_some(),
            ["robot", robot, "out", _] => self.is_about(robot) && self.may(method, "/events"),
            ["map", ..] | ["events"] => is(&[Role::Guide, Role::Planner, Role::Viewer, Role::Operator]),
            _ => matches!(*method, Method::GET | Method::HEAD),
        }
    }

    /// Whether a robot is one of those that they have to do with.
    pub fn is_about(&self, robot: &str) -> bool {
        self.robots.is_empty() || self.robots.iter().any(|own| own == robot)
    }

    fn may_hear_some(&self) -> bool {
        [Role::Trusted, Role::Guide, Role::Operator].contains(&self.role)
    }

    /// Whether they may know what people say to a robot.
    pub fn may_hear(&self, robot: &str) -> bool {
        self.may_hear_some() && self.is_about(robot)
    }
}

/// Lets through what is asked of this host by one of its own pages, or by no page, by whom it is for.
pub async fn guard(State(web): State<Arc<Web>>, mut request: Request, next: Next) -> Response {
    if web.board.stopped.load(Ordering::Acquire) {
        // A connection that was kept: the next one finds the next server.
        let problem = Problem::new(ErrorCode::Busy, "the server begins anew: ask again");
        let mut response = refuse(StatusCode::SERVICE_UNAVAILABLE, problem);
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        return response;
    }
    let mut response = match admit(&web.guard, &request) {
        Ok(who) => {
            request.extensions_mut().insert(who);
            next.run(request).await
        }
        Err(refused) => *refused,
    };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, CONTENT_POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ] {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn admit(guard: &Guard, request: &Request) -> Result<Who, Box<Response>> {
    let text = |name| request.headers().get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    // HTTP/2 has it in the address.
    let host = request.uri().authority().map(axum::http::uri::Authority::as_str);
    let host = host.or_else(|| text(header::HOST)).unwrap_or_default();
    let no = |status, problem| Box::new(refuse(status, problem));
    let is_named = |known: &Vec<String>| known.iter().any(|name| name.eq_ignore_ascii_case(host));
    if !guard.hosts.as_ref().is_none_or(is_named) {
        // Or any page could have a browser ask by a name of its own that leads here.
        let problem = Problem::new(ErrorCode::BadArgument, "this server has another name")
            .field("host")
            .hint("`http_hosts` in the settings names those by which it is reached");
        return Err(no(StatusCode::MISDIRECTED_REQUEST, problem));
    }
    if let Err(e) = unescape(request.uri().path()) {
        return Err(no(
            StatusCode::BAD_REQUEST,
            Problem::new(ErrorCode::BadArgument, e.to_string()).field("path"),
        ));
    }
    let origin = text(header::ORIGIN).map(|origin| origin.split("://").nth(1).unwrap_or_default());
    let is_safe = matches!(*request.method(), Method::GET | Method::HEAD);
    if !is_safe && origin.is_some_and(|origin| !origin.eq_ignore_ascii_case(host)) {
        let problem = Problem::new(ErrorCode::BadArgument, "pages of other sites can't ask for this");
        return Err(no(StatusCode::FORBIDDEN, problem.field("origin")));
    }
    let Some(who) = guard.who(request.headers()) else {
        let problem = Problem::new(ErrorCode::BadArgument, "say who you are, by name and password");
        let mut response = refuse(StatusCode::UNAUTHORIZED, problem);
        let asks = HeaderValue::from_static("Basic realm=\"toponym\", charset=\"UTF-8\"");
        response.headers_mut().insert(header::WWW_AUTHENTICATE, asks);
        return Err(Box::new(response));
    };
    if !who.may(request.method(), request.uri().path()) {
        let message = format!("a {:?} may not do this", who.role).to_lowercase();
        return Err(no(StatusCode::FORBIDDEN, Problem::new(ErrorCode::BadArgument, message)));
    }
    Ok(who)
}
