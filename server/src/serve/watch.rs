//! How the server does: for `info`, for Prometheus, for systemd.

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::registry::Registry;
use sd_notify::NotifyState;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use toponym_proto::answer::{ANSWER_VERSION, Info, Machine, MapWork};

use super::board::{Board, MapView, lock};

/// The intake goes round each few milliseconds; one that has not for so long hangs.
const HANGS: Duration = Duration::from_secs(10);

/// How the server does.
pub fn info(board: &Board) -> Info {
    let maps = board.maps.load();
    Info {
        v: ANSWER_VERSION,
        server: concat!("toponym-server ", env!("CARGO_PKG_VERSION")).into(),
        site: board.site.clone(),
        maps: maps.values().map(|map| map.identity(&map.snapshot.load())).collect(),
        robots: lock(&board.robots).values().cloned().collect(),
        overrun: board.overrun.load(Ordering::Relaxed),
        work: maps.values().map(|map| work(map)).collect(),
        broken: lock(&board.broken).values().cloned().collect(),
        machine: machine(board),
        reached: lock(&board.reached).iter().map(|(limit, times)| ((*limit).to_owned(), *times)).collect(),
    }
}

fn work(map: &MapView) -> MapWork {
    let ns = |value: &AtomicU64| value.load(Ordering::Relaxed);
    let ended = map.ended.load(Ordering::Acquire).then(|| "its filter has ended, see the log".to_owned());
    MapWork {
        map: map.id.clone(),
        robot: map.robot.clone(),
        held: map.held.load(Ordering::Relaxed) as u64,
        backlog_bytes: map.backlog_bytes.load(Ordering::Relaxed) as u64,
        lag_s: ns(&map.written_at_ns).saturating_sub(ns(&map.taken_at_ns)) as f64 / 1e9,
        sync_s: ns(&map.sync_ns) as f64 / 1e9,
        trouble: lock(&map.trouble).clone().or(ended),
    }
}

fn machine(board: &Board) -> Machine {
    // "VmRSS:     1234 kB"
    let kilobytes = |file: &str, field: &str| {
        let text = std::fs::read_to_string(file).ok()?;
        let line = text.lines().find_map(|line| line.strip_prefix(field))?;
        Some(line.split_whitespace().next()?.parse::<u64>().ok()? << 10)
    };
    let disk = rustix::fs::statvfs(&board.data).ok();
    Machine {
        disk_left_bytes: disk.map(|disk| disk.f_bavail.saturating_mul(disk.f_frsize)),
        memory_bytes: kilobytes("/proc/self/status", "VmRSS:"),
        memory_left_bytes: kilobytes("/proc/meminfo", "MemAvailable:"),
    }
}

/// Whether robots and guides are served, and why not.
fn health(board: &Board) -> Result<(), String> {
    let age =
        board.began.elapsed().saturating_sub(Duration::from_millis(board.beat_ms.load(Ordering::Relaxed)));
    if age > HANGS {
        return Err(format!("nothing was taken in for {} s", age.as_secs()));
    }
    let info = info(board);
    let broken = info.broken.iter().map(|problem| problem.message.clone());
    let maps = info.work.iter().filter_map(|map| Some(format!("map {}: {}", map.map, map.trouble.as_ref()?)));
    let troubles: Vec<String> = broken.chain(maps).collect();
    if troubles.is_empty() { Ok(()) } else { Err(troubles.join("\n")) }
}

/// Labels of one number: which map, which robot.
type Labels = Vec<(&'static str, String)>;

/// All numbers, for Prometheus.
fn metrics(board: &Board) -> Result<String, std::fmt::Error> {
    let (info, mut registry) = (info(board), Registry::with_prefix("toponym"));
    let robots = |count: fn(&toponym_proto::answer::Counts) -> u64| -> Vec<(Labels, u64)> {
        info.robots.iter().map(|r| (vec![("robot", r.robot.clone())], count(&r.counts))).collect()
    };
    counters(&mut registry, "robot_messages_taken", "Messages handed to the map", robots(|c| c.taken));
    counters(&mut registry, "robot_messages_refused", "Messages refused", robots(|c| c.refused));
    counters(&mut registry, "robot_messages_repeated", "Messages that came again", robots(|c| c.repeated));
    counters(&mut registry, "robot_messages_stale", "Messages of an earlier boot", robots(|c| c.stale));
    counters(&mut registry, "robot_messages_lost", "Messages that never came: data loss", robots(|c| c.lost));
    counters(&mut registry, "robot_messages_unused", "Messages of no use to the map", robots(|c| c.unused));
    counters(&mut registry, "overrun", "Messages dropped at the door", vec![(vec![], info.overrun)]);
    let reached =
        info.reached.iter().map(|(limit, times)| (vec![("limit", limit.clone())], *times)).collect();
    counters(&mut registry, "limit_reached", "How often a limit was reached", reached);
    let maps = |value: fn(&MapWork) -> f64| -> Vec<(Labels, f64)> {
        info.work.iter().map(|m| (vec![("map", m.map.clone())], value(m))).collect()
    };
    gauges(
        &mut registry,
        "map_backlog_bytes",
        "Bytes on their way to the filter",
        maps(|m| m.backlog_bytes as f64),
    );
    gauges(&mut registry, "map_held", "Messages held back until time passes", maps(|m| m.held as f64));
    gauges(&mut registry, "map_lag_seconds", "How far the filter is behind the journal", maps(|m| m.lag_s));
    gauges(&mut registry, "map_sync_seconds", "How long the last write to disk took", maps(|m| m.sync_s));
    let ok = |m: &MapWork| f64::from(u8::from(m.trouble.is_none()));
    gauges(&mut registry, "map_ok", "Whether the map takes messages in", maps(ok));
    gauges(
        &mut registry,
        "maps_broken",
        "Maps that are not served",
        vec![(vec![], info.broken.len() as f64)],
    );
    let one = |value: Option<u64>| value.map(|v| (vec![], v as f64)).into_iter().collect();
    gauges(&mut registry, "disk_left_bytes", "What may still be written", one(info.machine.disk_left_bytes));
    gauges(&mut registry, "memory_bytes", "Memory that the server uses", one(info.machine.memory_bytes));
    gauges(
        &mut registry,
        "memory_left_bytes",
        "Memory left to everybody",
        one(info.machine.memory_left_bytes),
    );
    let mut text = String::new();
    encode(&mut text, &registry)?;
    Ok(text)
}

fn counters(registry: &mut Registry, name: &str, help: &str, values: Vec<(Labels, u64)>) {
    let family = Family::<Labels, Counter>::default();
    for (labels, value) in values {
        family.get_or_create(&labels).inc_by(value);
    }
    registry.register(name, help, family);
}

fn gauges(registry: &mut Registry, name: &str, help: &str, values: Vec<(Labels, f64)>) {
    let family = Family::<Labels, Gauge<f64, AtomicU64>>::default();
    for (labels, value) in values {
        family.get_or_create(&labels).set(value);
    }
    registry.register(name, help, family);
}

/// `/healthz` and `/metrics`: everybody who reaches them may read them.
pub fn routes(board: Arc<Board>) -> Router {
    let healthy = board.clone();
    let healthz = move || async move {
        match health(&healthy) {
            Ok(()) => (StatusCode::OK, "ok\n".to_owned()),
            Err(why) => (StatusCode::SERVICE_UNAVAILABLE, why + "\n"),
        }
    };
    let metrics = move || async move {
        match metrics(&board) {
            Ok(text) => {
                let kind = "application/openmetrics-text; version=1.0.0; charset=utf-8";
                ([(header::CONTENT_TYPE, kind)], text).into_response()
            }
            Err(e) => (StatusCode::INTERNAL_SERVER_ERROR, e.to_string()).into_response(),
        }
    };
    Router::new().route("/healthz", get(healthz)).route("/metrics", get(metrics))
}

/// Tells systemd that the server is ready, and then, as often as it wants to know, that it lives: as long as it does.
pub fn tell_systemd(board: Arc<Board>) -> tokio::task::JoinHandle<()> {
    // Without systemd nobody listens.
    let _ = sd_notify::notify(&[NotifyState::Ready]);
    let period = sd_notify::watchdog_enabled();
    tokio::spawn(async move {
        let Some(period) = period else { return };
        loop {
            tokio::time::sleep(period / 3).await;
            let age = board
                .began
                .elapsed()
                .saturating_sub(Duration::from_millis(board.beat_ms.load(Ordering::Relaxed)));
            if age < HANGS {
                let _ = sd_notify::notify(&[NotifyState::Watchdog]);
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use toponym_proto::Keys;
    use toponym_proto::answer::{Counts, ErrorCode, Problem, RobotState};

    #[test]
    fn numbers_are_told_as_prometheus_reads_them() {
        let board = Board::new(Keys::new("lab").unwrap(), "lab", Path::new("."), String::new());
        let counts = Counts { taken: 7, ..Counts::default() };
        let state = RobotState { robot: "r07".into(), counts, ..RobotState::default() };
        lock(&board.robots).insert("r07".into(), state);
        let text = metrics(&board).unwrap();
        assert!(text.contains("toponym_robot_messages_taken_total{robot=\"r07\"} 7\n"), "{text}");
        assert!(text.contains("toponym_disk_left_bytes "), "{text}");
        assert!(text.ends_with("# EOF\n"), "{text}");
    }

    #[test]
    fn a_map_that_is_not_served_is_no_health() {
        let board = Board::new(Keys::new("lab").unwrap(), "lab", Path::new("."), String::new());
        assert_eq!(health(&board), Ok(()));
        lock(&board.broken)
            .insert("attic".into(), Problem::new(ErrorCode::Internal, "attic: damaged at byte 7"));
        assert_eq!(health(&board), Err("attic: damaged at byte 7".into()));
    }
}
