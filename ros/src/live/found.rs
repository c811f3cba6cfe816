//! What was found of a robot, for who connects it: within ten seconds, with what is missing and how to mend it.

use super::session::Arrived;
use super::{RosRobot, Shared};
use crate::plan::{Plan, Source, kind};
use crate::wire;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, MutexGuard, PoisonError};
use std::time::Duration;
use tracing::{info, warn};
use zenoh::Session;

/// When it is told for the first time, …
const FIRST: Duration = Duration::from_secs(7);
/// … and how often again as long as something is missing.
const AGAIN: Duration = Duration::from_secs(60);
/// Clocks that differ by less are set alike.
const SKEW_S: f64 = 2.0;
/// By more than this it is another kind of clock.
const OTHER_CLOCK_S: f64 = 86_400.0;
/// Senders whose numbers are watched.
const SENDERS_MAX: usize = 1000;
/// How long the router may take to tell who is there.
const TOKENS_WAIT: Duration = Duration::from_secs(2);

/// What came so far.
#[derive(Debug, Default)]
pub struct Found {
    /// By topic and type.
    topics: BTreeMap<(String, String), Came>,
    /// What was of no use, by topic: how often, and why last.
    unused: BTreeMap<String, (u64, String)>,
    /// Why there is no plan.
    pub problem: Option<String>,
    dropped: u64,
    /// The newest number of each sender on each topic.
    numbers: BTreeMap<(String, [u8; 16]), i64>,
    /// By topic: numbers that never came.
    lost: BTreeMap<String, u64>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Came {
    count: u64,
    first_ns: i64,
    last_ns: i64,
}

impl Came {
    fn hz(self) -> f64 {
        let over_s = (self.last_ns - self.first_ns) as f64 * 1e-9;
        if over_s > 0.0 { (self.count - 1) as f64 / over_s } else { 0.0 }
    }
}

impl Found {
    /// A message came; so many found no room.
    pub fn see(&mut self, arrived: &Arrived, dropped: u64) {
        let key = (arrived.topic.name.clone(), arrived.topic.kind.clone());
        let came =
            self.topics.entry(key).or_insert(Came { first_ns: arrived.received_ns, ..Came::default() });
        (came.count, came.last_ns) = (came.count + 1, arrived.received_ns);
        self.count_lost(arrived);
        if dropped > self.dropped {
            let lost = dropped - self.dropped;
            self.dropped = dropped;
            warn!("{lost} messages of a robot are lost: they come faster than they can be taken in");
        }
    }

    /// Who sends numbers what he sends. The first that is missing is told, and then each doubling.
    fn count_lost(&mut self, arrived: &Arrived) {
        let Some((number, gid)) = arrived.numbered else { return };
        let topic = &arrived.topic.name;
        if self.numbers.len() >= SENDERS_MAX && !self.numbers.contains_key(&(topic.clone(), gid)) {
            return;
        }
        let before = number.saturating_sub(1);
        let last = self.numbers.insert((topic.clone(), gid), number).unwrap_or(before);
        let Some(missing) =
            u64::try_from(number.saturating_sub(last).saturating_sub(1)).ok().filter(|missing| *missing > 0)
        else {
            return;
        };
        let lost = self.lost.entry(topic.clone()).or_default();
        let before = *lost;
        *lost = lost.saturating_add(missing);
        if before == 0 || before.ilog2() < lost.ilog2() {
            warn!(
                topic,
                lost = *lost,
                "messages got lost on the way from the robot: is its network good enough?"
            );
        }
    }

    /// A message was of no use. The first of a topic is told, and then each doubling.
    pub fn unused(&mut self, topic: &str, why: String) {
        let (count, last) = self.unused.entry(topic.to_owned()).or_default();
        *count += 1;
        if count.is_power_of_two() {
            warn!(topic, times = *count, "not used: {why}");
        }
        *last = why;
    }

    fn of(&self, kind: &str) -> impl Iterator<Item = (&String, Came)> {
        self.topics.iter().filter(move |((_, of), _)| of == kind).map(|((topic, _), came)| (topic, *came))
    }

    /// What is there and what is missing, one remark a line; `lag_s`: how far stamps are behind this machine's clock.
    fn report(
        &self,
        robot: &RosRobot,
        plan: Option<&Plan>,
        told: &BTreeSet<wire::Told>,
        lag_s: Option<f64>,
    ) -> Report {
        let mut report = Report::default();
        for (topic, came) in self.of(kind::SCAN) {
            report.heard.push(format!("{topic} {:.0} Hz", came.hz()));
        }
        match plan {
            Some(plan) => report.planned(self, plan),
            None => report.missing.push(self.why_no_plan(robot, told)),
        }
        if let Some(lag_s) = lag_s.filter(|lag_s| lag_s.abs() > SKEW_S && lag_s.abs() < OTHER_CLOCK_S) {
            let way = if lag_s > 0.0 { "behind" } else { "ahead of" };
            report.missing.push(format!(
                "the robot's clock is {:.1} s {way} this machine's: its own navigation does not mind, but sentences of \
                 other devices are put where it was then; set both by NTP",
                lag_s.abs()
            ));
        }
        report
    }

    fn why_no_plan(&self, robot: &RosRobot, told: &BTreeSet<wire::Told>) -> String {
        let scans: Vec<&wire::Told> = told.iter().filter(|t| t.kind == kind::SCAN).collect();
        let here: Vec<&&wire::Told> = scans.iter().filter(|t| t.domain == robot.domain).collect();
        if self.of(kind::SCAN).next().is_some() {
            let why = self.problem.clone();
            return why
                .unwrap_or_else(|| "not yet: how its lasers are mounted (/tf_static, /tf); waiting".into());
        }
        if let Some(other) = scans.first().filter(|_| here.is_empty()) {
            return format!(
                "no scans in ROS_DOMAIN_ID {}, but {} in {}: try --ros {}={},domain={}",
                robot.domain, other.topic, other.domain, robot.robot, robot.endpoint, other.domain
            );
        }
        if let Some(silent) = here.first() {
            let topics: Vec<&str> = here.iter().map(|t| t.topic.as_str()).collect();
            return format!(
                "{} is announced by {}, but no scan came: is the laser running, and is {} within namespace {:?} and --ros's \
                 topics?",
                topics.join(", "),
                silent.node,
                silent.topic,
                robot.namespace
            );
        }
        let others: BTreeSet<&str> = told.iter().map(|t| t.topic.as_str()).take(8).collect();
        if others.is_empty() {
            return format!(
                "nobody publishes anything at {}: is it the robot's rmw_zenohd, and do its nodes run with \
                 RMW_IMPLEMENTATION=rmw_zenoh_cpp?",
                robot.endpoint
            );
        }
        let others: Vec<&str> = others.into_iter().collect();
        format!(
            "nobody publishes a {} there, only {}: start the laser's driver",
            kind::SCAN,
            others.join(", ")
        )
    }
}

/// What is told.
#[derive(Debug, Default)]
struct Report {
    heard: Vec<String>,
    missing: Vec<String>,
}

impl Report {
    fn planned(&mut self, found: &Found, plan: &Plan) {
        let hz = |topic: &str| {
            let of = found.topics.iter().find(|((name, _), _)| name == topic);
            of.map_or(0.0, |(_, came)| came.hz())
        };
        self.heard.push(match &plan.odometry {
            Source::Tf { topic, moving } => {
                format!("tf {}→{} ({topic} {:.0} Hz)", moving.parent, moving.child, hz(topic))
            }
            Source::Topic { topic, .. } => format!("{topic} {:.0} Hz", hz(topic)),
            Source::None => "no odometry".into(),
        });
        self.heard.extend(plan.lasers.iter().map(|(topic, laser)| mounted(topic, laser)));
        let speech: Vec<&str> = plan.speech.iter().map(String::as_str).collect();
        if !speech.is_empty() {
            self.heard.push(format!("speech on {}", speech.join(", ")));
        }
        self.missing.extend(plan.remarks.iter().cloned());
        let count: u64 = found.unused.values().map(|(count, _)| count).sum();
        if let Some((topic, (_, why))) = found.unused.iter().max_by_key(|(_, (count, _))| *count) {
            self.missing.push(format!("{count} messages were of no use, of {topic} as {why}"));
        }
    }
}

fn mounted(topic: &str, laser: &toponym_proto::Laser) -> String {
    let hangs = if laser.upside_down { ", upside down" } else { "" };
    let (x_m, y_m, degrees) = (laser.x_m, laser.y_m, laser.yaw_rad.to_degrees());
    format!("laser of {topic} at x {x_m:.2} m, y {y_m:.2} m, yaw {degrees:.0}°{hangs}")
}

impl Shared {
    /// What was found so far.
    pub fn found(&self) -> MutexGuard<'_, Found> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What is taken from now on.
pub fn tell_plan(shared: &Shared, plan: &Plan) {
    let report = shared.found().report(&shared.robot, Some(plan), &BTreeSet::new(), None);
    info!(robot = shared.robot.robot, "maps from {}", report.heard.join("; "));
    for remark in report.missing {
        warn!(robot = shared.robot.robot, "{remark}");
    }
}

/// Tells within ten seconds what was found, and again as long as there is nothing to map from.
pub async fn tell(shared: Arc<Shared>, ros: Session) -> Result<(), String> {
    let mut wait = FIRST;
    loop {
        tokio::time::sleep(wait).await;
        wait = AGAIN;
        let plan = shared.plan.borrow().clone();
        let told = match &plan {
            Some(_) => BTreeSet::new(),
            None => publishers(&ros).await.map_err(|e| e.to_string())?,
        };
        let lag_s = shared.clock.borrow().newest().map(|(stamp_ns, came)| {
            (super::session::now_ns() - stamp_ns) as f64 * 1e-9 - came.elapsed().as_secs_f64()
        });
        let report = shared.found().report(&shared.robot, plan.as_ref(), &told, lag_s);
        let robot = &shared.robot.robot;
        if !report.heard.is_empty() {
            info!(robot, "heard {}", report.heard.join("; "));
        }
        for remark in &report.missing {
            warn!(robot, "{remark}");
        }
        if plan.is_some() {
            // What changes from now on is told when it does.
            std::future::pending::<()>().await;
        }
    }
}

/// Who publishes what, in any domain.
async fn publishers(ros: &Session) -> Result<BTreeSet<wire::Told>, zenoh::Error> {
    let tokens = ros.liveliness().get("@ros2_lv/*/**").timeout(TOKENS_WAIT).await?;
    let mut told = BTreeSet::new();
    let own = ros.zid().to_string();
    while let Ok(reply) = tokens.recv_async().await {
        if let Ok(token) = reply.result() {
            told.extend(wire::publisher_of(token.key_expr().as_str()).filter(|t| t.zid != own));
        }
    }
    Ok(told)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::Topic;

    fn arrived(name: &str, kind: &str, received_ns: i64) -> Arrived {
        let topic = Topic { name: name.into(), kind: kind.into(), is_cdr: true };
        Arrived { topic, received_ns, hashes: wire::Hashes::OfTypes, numbered: None, data: Vec::new() }
    }

    #[test]
    fn numbers_that_never_come_are_lost() {
        let mut found = Found::default();
        for number in [7, 8, 11, 12, 3] {
            found.see(
                &Arrived { numbered: Some((number, [1; 16])), ..arrived("/scan", kind::SCAN, number) },
                0,
            );
        }
        found.see(&Arrived { numbered: Some((90, [2; 16])), ..arrived("/scan", kind::SCAN, 20) }, 0);
        assert_eq!(found.lost["/scan"], 2, "another sender, and one that begins anew, lose nothing");
    }

    fn missing(found: &Found, told: &[wire::Told]) -> String {
        let report = found.report(&RosRobot::default(), None, &told.iter().cloned().collect(), None);
        report.missing.join("\n")
    }

    #[test]
    fn what_is_missing_is_told_with_the_mend() {
        let told = |domain, topic: &str, kind: &str| wire::Told {
            domain,
            zid: "a".into(),
            node: "/driver".into(),
            topic: topic.into(),
            kind: kind.into(),
        };
        let nothing = Found::default();
        assert!(missing(&nothing, &[]).contains("RMW_IMPLEMENTATION=rmw_zenoh_cpp"));
        assert!(missing(&nothing, &[told(0, "/battery", kind::TEXT)]).contains("only /battery"));
        assert!(missing(&nothing, &[told(7, "/scan", kind::SCAN)]).contains("domain=7"));
        assert!(missing(&nothing, &[told(0, "/scan", kind::SCAN)]).contains("is the laser running"));
        let mut found = Found::default();
        (0..11).for_each(|k| found.see(&arrived("/scan", kind::SCAN, k * 100_000_000), 0));
        assert!(missing(&found, &[]).contains("how its lasers are mounted"));
        let report = found.report(&RosRobot::default(), None, &BTreeSet::new(), Some(100.0));
        assert_eq!(report.heard, ["/scan 10 Hz"]);
        assert!(report.missing[1].contains("100.0 s behind"), "{report:?}");
    }
}
