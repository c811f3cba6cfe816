//! Questions: every query gets a reply, an error if need be. Answers come from the snapshot that a
//! map shows, whatever its filter is doing.

use serde::Serialize;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use toponym_core::{Answer, Query};
use toponym_proto::answer::{ANSWER_VERSION, Clocks, Done, ErrorCode, Mended, Problem, RobotState};
use toponym_proto::codec::{ENCODING_JSON, ENCODING_PNG};
use toponym_proto::keys::Ask;
use toponym_proto::selector::{self, Arguments};
use toponym_proto::{Invalid, Limits, Mend, Message, Stamp};

use super::arguments::{asked, check_localised, check_robot, known, point, resolution_m, take, understood};
use super::board::{Board, MapView, lock};
use super::door::Arrival;
use super::scribe::Work;
use super::watch;
use crate::convert;

/// How long a command waits for a map that is busy.
const COMMAND_WAIT: Duration = Duration::from_secs(60);
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
pub struct Reply {
    /// Its bytes.
    pub payload: Vec<u8>,
    /// What they are.
    pub encoding: &'static str,
}

impl Reply {
    fn json(payload: Vec<u8>) -> Self {
        Self { payload, encoding: ENCODING_JSON }
    }
}

/// Answers one query on a key without wildcards.
pub fn answer(board: &Board, key: &str, parameters: &str, payload: &[u8]) -> Result<Reply, Problem> {
    let arguments = selector::decode(parameters, payload)?;
    match board.keys.chunks(key).unwrap_or_default().as_slice() {
        ["info"] => info(board, &arguments),
        ["time"] => time(board, arguments),
        ["do", "save"] => save(board, &arguments),
        ["do", "delete"] => delete(board, arguments),
        ["do", command @ ("undo" | "rename" | "forget")] => mend(board, command, arguments),
        ["do", command] => {
            Err(Problem::new(ErrorCode::Unsupported, format!("there is no command {command:?}"))
                .field("key")
                .hint("this server knows do/save, do/delete, do/undo, do/rename, do/forget"))
        }
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
            graph(&map).map(Reply::json)
        }
        ["robot" | "map", _, "out", _] => {
            lock(&board.latest).get(key).cloned().map(Reply::json).ok_or_else(|| {
                Problem::new(ErrorCode::NoSuchQuery, format!("nothing was published on {key} yet"))
            })
        }
        _ => Err(no_such_query(key).hint("keys are listed in proto/PROTOCOL.md")),
    }
}

fn no_such_query(key: &str) -> Problem {
    Problem::new(ErrorCode::NoSuchQuery, format!("{key} can't be asked")).field("key")
}

fn map(board: &Board, id: &str) -> Result<Arc<MapView>, Problem> {
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

fn json<T: Serialize>(value: &T) -> Result<Reply, Problem> {
    serde_json::to_vec(value).map(Reply::json).map_err(|e| Problem::new(ErrorCode::Internal, e.to_string()))
}

fn answer_about(map: &MapView, ask: Ask, arguments: Arguments) -> Result<Reply, Problem> {
    let snapshot = map.snapshot.load_full();
    let identity = map.identity(&snapshot);
    let query = match ask {
        Ask::Where => {
            let [name, text, lang, robot] = take(arguments, ["name", "text", "lang", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (text, lang) = (asked(name, text)?, known(lang)?);
            check_localised(&snapshot, (&text, lang.as_deref()), robot.is_some())?;
            let (from, answer) = map.answered.where_is(&snapshot, &text, lang.as_deref());
            let (answer, identity) = (understood(answer)?, map.identity(&from));
            return json(&convert::where_reply(answer, identity, map.stamp(), &map.robot));
        }
        Ask::Nearest => {
            let [name, text, lang, robot] = take(arguments, ["name", "text", "lang", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (text, lang) = (asked(name, text)?, known(lang)?);
            // It counts from the robot.
            check_localised(&snapshot, (&text, lang.as_deref()), true)?;
            let answer = understood(snapshot.nearest(&text, lang.as_deref()))?;
            return json(&convert::nearest_reply(answer, identity, map.stamp(), &map.robot));
        }
        Ask::What => {
            let [x_m, y_m, robot] = take(arguments, ["x_m", "y_m", "robot"])?;
            check_robot(map, robot.as_deref())?;
            let (x_m, y_m) = point(&snapshot, x_m, y_m)?;
            return json(&convert::what_reply(snapshot.what(x_m, y_m), identity, map.stamp()));
        }
        Ask::Labels | Ask::Graph => {
            let [] = take(arguments, [])?;
            if ask == Ask::Labels { Query::Labels } else { Query::Graph }
        }
        Ask::Regions => {
            let [] = take(arguments, [])?;
            return json(&convert::regions_reply(&snapshot, identity));
        }
        Ask::Grid => return grid(map, arguments),
    };
    match (ask, snapshot.answer(&query)) {
        (Ask::Labels, Answer::Labels(a)) => json(&convert::labels_reply(a, identity)),
        (Ask::Graph, Answer::Graph(a)) => json(&convert::graph_reply(a, identity)),
        _ => Err(Problem::new(ErrorCode::Internal, "the map answered another question")),
    }
}

/// The grid of a map: as JSON, or as a picture alone.
fn grid(map: &MapView, arguments: Arguments) -> Result<Reply, Problem> {
    let [resolution, format] = take(arguments, ["resolution_m", "format"])?;
    let resolution_m = resolution.map_or(Ok(RESOLUTION_DEFAULT_M), |r| resolution_m(&r))?;
    let snapshot = map.snapshot.load_full();
    let grid = snapshot.grid(resolution_m);
    let internal = |e: Invalid| Problem::new(ErrorCode::Internal, e.to_string());
    let reply = convert::grid_reply(&grid, map.identity(&snapshot)).map_err(internal)?;
    match format.as_deref() {
        None | Some("json") => json(&reply),
        Some("png") if reply.png.is_empty() => {
            Err(Problem::new(ErrorCode::BadArgument, "the map has seen nothing to draw yet").field("format"))
        }
        Some("png") => Ok(Reply { payload: reply.picture().map_err(internal)?, encoding: ENCODING_PNG }),
        Some(other) => Err(Problem::new(ErrorCode::BadArgument, format!("there is no format {other:?}"))
            .field("format")
            .hint("json or png")),
    }
}

/// The graph of a map, as asked and as published.
pub fn graph(map: &MapView) -> Result<Vec<u8>, Problem> {
    answer_about(map, Ask::Graph, Arguments::new()).map(|reply| reply.payload)
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

/// `do/save?map=…`, or all maps.
fn save(board: &Board, arguments: &Arguments) -> Result<Reply, Problem> {
    let [id] = take(arguments.clone(), ["map"])?;
    let maps = match id {
        Some(id) => save_maps(vec![map(board, &id)?])?,
        None => save_all(board)?,
    };
    json(&Done { v: ANSWER_VERSION, query: "save".into(), maps })
}

/// `do/delete?map=…`.
fn delete(board: &Board, arguments: Arguments) -> Result<Reply, Problem> {
    let [id] = take(arguments, ["map"])?;
    let missing = || Problem::new(ErrorCode::BadArgument, "map is missing").field("map");
    let (map, (reply, done)) = (id.ok_or_else(missing)?, sync_channel(1));
    let stops = || Problem::new(ErrorCode::Internal, "the server stops");
    let control = board.control.get().ok_or_else(stops)?;
    control.send(Arrival::Delete { map: map.clone(), reply }).map_err(|_| stops())?;
    done.recv_timeout(COMMAND_WAIT).map_err(|_| stops())??;
    json(&Done { v: ANSWER_VERSION, query: "delete".into(), maps: vec![map] })
}

/// Saves all maps and tells their ids.
pub fn save_all(board: &Board) -> Result<Vec<String>, Problem> {
    save_maps(board.maps.load().values().cloned().collect())
}

fn save_maps(maps: Vec<Arc<MapView>>) -> Result<Vec<String>, Problem> {
    let mut saved = Vec::new();
    for map in maps {
        let (reply, done) = sync_channel(1);
        let stopped = || Problem::new(ErrorCode::Internal, format!("map {:?} has stopped", map.id));
        map.work.send(Work::Save(reply)).map_err(|_| stopped())?;
        match done.recv_timeout(COMMAND_WAIT) {
            Ok(Ok(())) => saved.push(map.id.clone()),
            Ok(Err(e)) => return Err(Problem::new(ErrorCode::Internal, e)),
            Err(_) => return Err(Problem::new(ErrorCode::Busy, format!("map {:?} is busy", map.id))),
        }
    }
    Ok(saved)
}

/// `do/undo?id=…`, `do/rename?from=…;to=…`, `do/forget?name=…`, each with `map=…` where there are several.
fn mend(board: &Board, command: &str, arguments: Arguments) -> Result<Reply, Problem> {
    let given = |field: &str, value: Option<String>| {
        value.ok_or_else(|| Problem::new(ErrorCode::BadArgument, format!("{field} is missing")).field(field))
    };
    let (id, mend) = match command {
        "undo" => {
            let [map, id] = take(arguments, ["map", "id"])?;
            (map, Mend::Undo { id })
        }
        "rename" => {
            let [map, from, to] = take(arguments, ["map", "from", "to"])?;
            (map, Mend::Rename { from: given("from", from)?, to: given("to", to)? })
        }
        _ => {
            let [map, name] = take(arguments, ["map", "name"])?;
            (map, Mend::Forget { name: given("name", name)? })
        }
    };
    Message::Mend(mend.clone()).validate(&Limits::default()).map_err(Problem::from)?;
    let map = match id {
        Some(id) => map(board, &id)?,
        None => only_map(board)?,
    };
    let (reply, done) = sync_channel(1);
    let stopped = || Problem::new(ErrorCode::Internal, format!("map {:?} has stopped", map.id));
    map.work.send(Work::Mend(mend, reply)).map_err(|_| stopped())?;
    match done.recv_timeout(COMMAND_WAIT) {
        Ok(Ok(words)) => {
            let (query, map) = (command.to_owned(), map.id.clone());
            json(&Mended { v: ANSWER_VERSION, query, map, words, durable: true })
        }
        Ok(Err(why)) => Err(Problem::new(ErrorCode::NothingToMend, why)),
        // Not `busy`, which is asked again: it may be done yet.
        Err(_) => Err(Problem::new(ErrorCode::Internal, format!("map {:?} did not answer in time", map.id))),
    }
}

fn only_map(board: &Board) -> Result<Arc<MapView>, Problem> {
    let maps = board.maps.load();
    let mut all = maps.values();
    match (all.next(), all.next()) {
        (Some(only), None) => Ok(only.clone()),
        (None, _) => map(board, ""),
        _ => {
            let known: Vec<&str> = maps.keys().map(String::as_str).collect();
            let hint = format!("say which: {}", known.join(", "));
            Err(Problem::new(ErrorCode::BadArgument, "there are several maps").field("map").hint(hint))
        }
    }
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
