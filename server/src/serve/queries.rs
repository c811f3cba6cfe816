//! Questions: every query gets a reply, an error if need be. Answers come from the snapshot that a
//! map shows, whatever its filter is doing.

use axum::body::Bytes;
use serde::Serialize;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use toponym_core::{Answer, Query, Snapshot};
use toponym_proto::answer::{ANSWER_VERSION, Clocks, ErrorCode, MapIdentity, Problem, RobotState};
use toponym_proto::codec::{ENCODING_JSON, ENCODING_PNG};
use toponym_proto::keys::Ask;
use toponym_proto::selector::{self, Arguments};
use toponym_proto::{Invalid, Limits, Stamp};

use super::arguments::{asked, check_localised, check_robot, known, point, resolution_m, take, understood};
use super::board::{Board, MapView, lock};
use super::{commands, watch};
use crate::convert;

const RESOLUTION_DEFAULT_M: f64 = 0.05;

/// All keys there are something to ask on, for queries with wildcards.
pub fn askable(board: &Board) -> Vec<String> {
    let mut keys = vec![board.keys.info(), board.keys.time()];
    for map in board.maps.load().keys() {
        keys.extend(Ask::ALL.map(|ask| board.keys.ask(map, ask)));
        keys.push(board.keys.graph(map));
    }
    keys.extend(lock(&board.latest).keys().cloned());
    keys
}

/// What bounds the queries answered at the same time, kind by kind.
pub struct Permits {
    light: Arc<Semaphore>,
    heavy: Arc<Semaphore>,
    commands: Arc<Semaphore>,
}

impl Permits {
    /// As many as the limits say. Commands may not keep grids from being made.
    pub fn new(limits: &Limits) -> Self {
        let of = |permits| Arc::new(Semaphore::new(permits));
        Self {
            light: of(limits.short_queries),
            heavy: of(limits.long_queries),
            commands: of(limits.commands),
        }
    }

    /// A permit to answer a query on this key, which may have wildcards; none if there are too many
    /// of its kind. Holds until it is dropped.
    pub fn take(&self, key: &str) -> Option<OwnedSemaphorePermit> {
        // A wildcard may select a grid.
        let kind = if key.contains('*') || key.ends_with("/ask/grid") || key.ends_with("/ask/regions") {
            &self.heavy
        } else if key.contains("/do/") {
            &self.commands
        } else {
            &self.light
        };
        kind.clone().try_acquire_owned().ok()
    }
}

/// An answer as it goes out.
#[derive(Clone)]
pub struct Reply {
    /// Its bytes, which many may share.
    pub payload: Bytes,
    /// What they are.
    pub encoding: &'static str,
}

impl Reply {
    /// One in JSON.
    pub fn json(payload: Vec<u8>) -> Self {
        Self { payload: payload.into(), encoding: ENCODING_JSON }
    }
}

/// Answers one query on a key without wildcards.
pub fn answer(board: &Board, key: &str, parameters: &str, payload: &[u8]) -> Result<Reply, Problem> {
    let arguments = selector::decode(parameters, payload)?;
    match board.keys.chunks(key).unwrap_or_default().as_slice() {
        ["info"] => info(board, &arguments),
        ["time"] => time(board, arguments),
        ["do", command] => commands::done(board, command, arguments),
        ["map", id, "ask", what] => {
            let map = map(board, id)?;
            match Ask::ALL.into_iter().find(|ask| ask.as_str() == *what) {
                Some(ask) => answer_about(&map, ask, arguments),
                None => {
                    Err(no_such_query(key)
                        .hint("ask one of where, what, nearest, labels, graph, grid, regions"))
                }
            }
        }
        ["map", id, "out", "graph"] => {
            let map = map(board, id)?;
            graph(&map)
        }
        ["robot" | "map", _, "out", _] => {
            let told = lock(&board.latest).get(key).cloned();
            told.map(|payload| Reply { payload, encoding: ENCODING_JSON }).ok_or_else(|| {
                Problem::new(ErrorCode::NoSuchQuery, format!("nothing was published on {key} yet"))
            })
        }
        _ => Err(no_such_query(key).hint("keys are listed in proto/PROTOCOL.md")),
    }
}

fn no_such_query(key: &str) -> Problem {
    Problem::new(ErrorCode::NoSuchQuery, format!("{key} can't be asked")).field("key")
}

/// A map by its id.
pub fn map(board: &Board, id: &str) -> Result<Arc<MapView>, Problem> {
    if let Some(problem) = lock(&board.broken).get(id) {
        return Err(problem.clone());
    }
    let maps = board.maps.load();
    maps.get(id).cloned().ok_or_else(|| {
        let known: Vec<&str> = maps.keys().map(String::as_str).collect();
        let hint = if known.is_empty() {
            "there is no map yet: a robot's setup brings one into being".to_string()
        } else {
            format!("there are: {}", known.join(", "))
        };
        Problem::new(ErrorCode::NoSuchMap, format!("there is no map {id:?}")).field("map").hint(hint)
    })
}

/// An answer as JSON.
pub fn json<T: Serialize>(value: &T) -> Result<Reply, Problem> {
    serde_json::to_vec(value).map(Reply::json).map_err(|e| Problem::new(ErrorCode::Internal, e.to_string()))
}

fn answer_about(map: &MapView, ask: Ask, arguments: Arguments) -> Result<Reply, Problem> {
    let snapshot = map.snapshot.load_full();
    let identity = map.identity(&snapshot);
    match ask {
        Ask::Where => {
            let [name, text, lang, robot] = take(arguments, ["name", "text", "lang", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (text, lang) = (asked(name, text)?, known(lang)?);
            check_localised(&snapshot, (&text, lang.as_deref()), robot.is_some())?;
            let (from, answer) = map.answered.where_is(&snapshot, &text, lang.as_deref());
            let (answer, identity) = (understood(answer)?, map.identity(&from));
            json(&convert::where_reply(answer, identity, map.stamp(), &map.robot))
        }
        Ask::Nearest => {
            let [name, text, lang, robot] = take(arguments, ["name", "text", "lang", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (text, lang) = (asked(name, text)?, known(lang)?);
            // It counts from the robot.
            check_localised(&snapshot, (&text, lang.as_deref()), true)?;
            let answer = understood(snapshot.nearest(&text, lang.as_deref()))?;
            json(&convert::nearest_reply(answer, identity, map.stamp(), &map.robot))
        }
        Ask::What => {
            let [x_m, y_m, robot] = take(arguments, ["x_m", "y_m", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (x_m, y_m) = point(&snapshot, x_m, y_m)?;
            json(&convert::what_reply(snapshot.what(x_m, y_m), identity, map.stamp()))
        }
        Ask::Labels => {
            let [] = take(arguments, [])?;
            let Answer::Labels(labels) = snapshot.answer(&Query::Labels) else { return Err(other_answer()) };
            json(&convert::labels_reply(labels, identity))
        }
        Ask::Graph => {
            let [] = take(arguments, [])?;
            map.written.of(&snapshot, "graph", || {
                let Answer::Graph(graph) = snapshot.answer(&Query::Graph) else { return Err(other_answer()) };
                json(&convert::graph_reply(graph, identity))
            })
        }
        Ask::Regions => {
            let [] = take(arguments, [])?;
            map.written.of(&snapshot, "regions", || json(&convert::regions_reply(&snapshot, identity)))
        }
        Ask::Grid => {
            let [resolution, format] = take(arguments, ["resolution_m", "format"])?;
            let resolution_m = resolution.map_or(Ok(RESOLUTION_DEFAULT_M), |r| resolution_m(&r))?;
            let format = format.as_deref().unwrap_or("json");
            if !["json", "png"].contains(&format) {
                let problem = Problem::new(ErrorCode::BadArgument, format!("there is no format {format:?}"));
                return Err(problem.field("format").hint("json or png"));
            }
            let what = format!("grid {resolution_m} {format}");
            map.written.of(&snapshot, &what, || grid(&snapshot, resolution_m, format, identity))
        }
    }
}

fn other_answer() -> Problem {
    Problem::new(ErrorCode::Internal, "the map answered another question")
}

/// The grid of a map: as JSON, or as a picture alone.
fn grid(snapshot: &Snapshot, resolution_m: f64, format: &str, map: MapIdentity) -> Result<Reply, Problem> {
    let internal = |e: Invalid| Problem::new(ErrorCode::Internal, e.to_string());
    let reply = convert::grid_reply(&snapshot.grid(resolution_m), map).map_err(internal)?;
    if format == "json" {
        return json(&reply);
    }
    if reply.png.is_empty() {
        let problem = Problem::new(ErrorCode::BadArgument, "the map has seen nothing to draw yet");
        return Err(problem.field("format"));
    }
    Ok(Reply { payload: reply.picture().map_err(internal)?.into(), encoding: ENCODING_PNG })
}

/// The graph of a map, as asked and as published.
pub fn graph(map: &MapView) -> Result<Reply, Problem> {
    answer_about(map, Ask::Graph, Arguments::new())
}

fn info(board: &Board, arguments: &Arguments) -> Result<Reply, Problem> {
    let [] = take(arguments.clone(), [])?;
    json(&watch::info(board))
}

fn time(board: &Board, arguments: Arguments) -> Result<Reply, Problem> {
    let [] = take(arguments, [])?;
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let newest = |(id, state): (&String, &RobotState)| Some((id.clone(), state.newest?));
    json(&Clocks {
        v: ANSWER_VERSION,
        now: Stamp { ns: since_1970.as_nanos() as i64 },
        robots: lock(&board.robots).iter().filter_map(newest).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Takes permits for a key until there are none.
    fn exhaust(permits: &Permits, key: &str) -> Vec<OwnedSemaphorePermit> {
        std::iter::from_fn(|| permits.take(key)).collect()
    }

    #[test]
    fn a_wildcard_counts_as_the_grid_it_may_select() {
        for wild in ["t/v1/s/map/*/ask/*", "t/v1/s/map/main/ask/g$*", "t/v1/s/**"] {
            let permits = Permits::new(&Limits::DEFAULT);
            let held = exhaust(&permits, "t/v1/s/map/main/ask/grid");
            assert_eq!(held.len(), Limits::DEFAULT.long_queries);
            assert!(permits.take(wild).is_none(), "{wild}");
            assert!(permits.take("t/v1/s/map/main/ask/where").is_some());
        }
    }

    #[test]
    fn saving_keeps_nobody_from_asking() {
        let permits = Permits::new(&Limits::DEFAULT);
        let saves = exhaust(&permits, "t/v1/s/do/save");
        assert_eq!(saves.len(), Limits::DEFAULT.commands);
        assert!(permits.take("t/v1/s/map/main/ask/grid").is_some());
        assert!(permits.take("t/v1/s/map/main/ask/where").is_some());
        drop(saves);
        assert!(permits.take("t/v1/s/do/save").is_some());
    }
}
