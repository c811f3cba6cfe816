//! Between the wire and the core: validated messages to events, answers and effects to JSON types.
//! Nothing is judged here: `toponym-proto` has refused what is wrong, the core decides what a
//! range means.

mod rooms;

pub use self::rooms::{regions_reply, what_reply};
use nalgebra::Matrix3;
use toponym_core::answers::query::{self, GraphAnswer, WhereAnswer};
use toponym_core::edge::EdgeKind;
use toponym_core::effects::{self, TrackState};
use toponym_core::event::{self, Event};
use toponym_core::{Pose2, geometry};
use toponym_proto::answer::{
    ANSWER_VERSION, Candidate, Difference, Edge, FromRobot, Goal, GraphReply, GridReply, Grounded, Heard,
    HeardStatus, LabelEntry, LabelsReply, MapIdentity, Particle, Place, PoseState, Reachable, Resolved,
    WhereReply,
};
use toponym_proto::grid::png_of;
use toponym_proto::{Invalid, Mend, Message, Pose, Stamp};

/// A message as the core takes it. A sentence without `began` counts as said at the clock's zero:
/// the merge has filled it in before.
pub fn event(message: Message) -> Event {
    match message {
        Message::Setup(m) => Event::Setup(event::Setup {
            robot: m.header.robot,
            lasers: m.lasers.into_iter().map(laser).collect(),
        }),
        Message::Odom(m) => Event::Odom(event::Odom {
            robot: m.header.robot,
            boot: m.header.boot,
            stamp_ns: m.header.stamp.ns,
            odom_from_body: pose_in(&m.odom_from_body),
        }),
        Message::Scan(m) => Event::Scan(event::Scan {
            robot: m.header.robot,
            laser: m.laser,
            stamp_ns: m.header.stamp.ns,
            angle_min_rad: m.angle_min_rad,
            angle_increment_rad: m.angle_increment_rad,
            time_increment_s: m.time_increment_s,
            ranges_m: m.ranges_m,
        }),
        Message::Say(m) => {
            let began = m.began.unwrap_or_default();
            Event::Utterance(event::Utterance {
                id: m.id,
                text: m.text,
                lang: m.lang,
                alternatives: m.alternatives.into_iter().map(|h| (h.text, h.p)).collect(),
                speaker: m.speaker,
                began_ns: began.ns,
                ended_ns: m.ended.unwrap_or(began).ns,
                retracts: m.retracts,
                answers: m.answers,
            })
        }
        Message::End(_) => Event::Flush,
        Message::Mend(m) => Event::Command(match m {
            Mend::Undo { id } => event::Command::Undo { utterance: id },
            Mend::Rename { from, to } => event::Command::Rename { from, to },
            Mend::Forget { name } => event::Command::Forget { name },
            Mend::Pose { id, map_from_body, sigma_m, sigma_rad } => {
                let map_from_body = pose_in(&map_from_body);
                event::Command::Pose(event::Told { id, map_from_body, sigma_m, sigma_rad })
            }
            Mend::Area { id, polygon_m, name, instead, forbidden } => {
                let polygon_m = polygon_m.into_iter().map(|[x, y]| (x, y)).collect();
                event::Command::Area(event::Area { id, polygon_m, name, instead, forbidden })
            }
        }),
    }
}

fn laser(l: toponym_proto::Laser) -> event::Laser {
    event::Laser {
        id: l.id,
        body_from_laser: Pose2::new(l.x_m, l.y_m, l.yaw_rad),
        upside_down: l.upside_down,
        range_min_m: l.range_min_m,
        range_max_m: l.range_max_m,
        ignored_rad: l.ignored_rad,
    }
}

fn pose_in(p: &Pose) -> Pose2 {
    Pose2::new(p.x_m, p.y_m, p.yaw_rad)
}

/// A pose as it goes out.
pub fn pose(p: &Pose2) -> Pose {
    Pose { x_m: p.x_m, y_m: p.y_m, yaw_rad: p.yaw_rad }
}

/// A covariance, row-major x y yaw.
pub fn covariance(m: &Matrix3<f64>) -> [f64; 9] {
    std::array::from_fn(|k| m[(k / 3, k % 3)])
}

/// How far a pose is to be believed.
pub fn pose_state(state: TrackState) -> PoseState {
    match state {
        TrackState::Mapping => PoseState::Mapping,
        TrackState::Localised => PoseState::Localised,
        TrackState::Doubtful => PoseState::Doubtful,
        TrackState::Lost => PoseState::Lost,
    }
}

/// Feedback on a sentence that entered the map, and so is on disk.
pub fn heard(h: effects::Heard) -> Heard {
    Heard {
        id: h.id,
        status: match h.status {
            effects::HeardStatus::Understood => HeardStatus::Understood,
            effects::HeardStatus::Asked => HeardStatus::Asked,
            effects::HeardStatus::NotUnderstood => HeardStatus::NotUnderstood,
            effects::HeardStatus::Refused => HeardStatus::Refused,
        },
        durable: true,
        parse: h.parse,
        grounded: h.grounded.into_iter().map(|(place, p)| Grounded { place, p }).collect(),
        words: h.words,
        question: h.question,
        error: None,
    }
}

/// Answer of `ask/where`; `robot` is the map's, from whose newest pose distances count.
pub fn where_reply(answer: WhereAnswer, map: MapIdentity, stamp: Stamp, robot: &str) -> WhereReply {
    let from = answer.robot;
    WhereReply {
        v: ANSWER_VERSION,
        query: "where".into(),
        name: answer.text,
        resolved: Resolved { label: answer.label, via: answer.via, suggestions: answer.suggestions },
        map,
        stamp,
        p_none: answer.p_none,
        unresolved: answer.unresolved,
        candidates: answer.candidates.into_iter().map(|c| candidate(c, from.as_ref(), robot)).collect(),
    }
}

fn candidate(c: query::Candidate, from: Option<&Pose2>, robot: &str) -> Candidate {
    let Pose2 { x_m, y_m, yaw_rad } = c.pose;
    Candidate {
        region: c.place,
        label: c.label,
        shown: c.shown,
        probability: c.probability,
        p_is: c.p_is,
        x_m,
        y_m,
        yaw_rad,
        cov: covariance(&c.covariance),
        polygon_m: line(&c.polygon_m),
        goal: Some(goal(&c.goal)),
        from_robot: from.map(|from| FromRobot {
            robot: robot.into(),
            distance_m: from.distance_m(&c.pose),
            bearing_rad: geometry::wrap((y_m - from.y_m).atan2(x_m - from.x_m) - from.yaw_rad),
        }),
        walk_m: c.walk_m.map(millimetres),
        because: c.because,
    }
}

/// Answer of `ask/nearest`.
pub fn nearest_reply(answer: WhereAnswer, map: MapIdentity, stamp: Stamp, robot: &str) -> WhereReply {
    WhereReply { query: "nearest".into(), ..where_reply(answer, map, stamp, robot) }
}

fn goal(goal: &query::Goal) -> Goal {
    let reachable = match goal.is_reachable {
        None => Reachable::Unknown,
        Some(true) => Reachable::Yes,
        Some(false) => Reachable::No,
    };
    let Pose2 { x_m, y_m, yaw_rad } = goal.pose;
    Goal { x_m, y_m, yaw_rad, reachable }
}

fn millimetres(m: f64) -> f64 {
    (m * 1000.0).round() / 1000.0
}

fn line(line: &[(f64, f64)]) -> Vec<[f64; 2]> {
    line.iter().map(|p| [millimetres(p.0), millimetres(p.1)]).collect()
}

/// Answer of `ask/labels`.
pub fn labels_reply(labels: Vec<query::LabelCount>, map: MapIdentity) -> LabelsReply {
    let labels = labels
        .into_iter()
        .map(|l| LabelEntry { label: l.label, shown: l.shown, utterances: l.utterances, region: l.place })
        .collect();
    LabelsReply { v: ANSWER_VERSION, query: "labels".into(), map, labels }
}

/// Answer of `ask/graph`.
pub fn graph_reply(graph: GraphAnswer, map: MapIdentity) -> GraphReply {
    let places = graph.places.into_iter().map(|p| Place {
        id: p.id,
        stamp: Stamp { ns: p.stamp_ns },
        x_m: p.pose.x_m,
        y_m: p.pose.y_m,
        yaw_rad: p.pose.yaw_rad,
        labels: p.labels.into_iter().collect(),
    });
    let particles = graph
        .particles
        .into_iter()
        .map(|p| Particle { weight: p.weight, edges: p.edges.iter().map(edge).collect() });
    GraphReply {
        v: ANSWER_VERSION,
        query: "graph".into(),
        map,
        places: places.collect(),
        particles: particles.collect(),
        unresolved: graph.unresolved,
        differences: graph.differences.into_iter().map(difference).collect(),
        effective_sample_size: graph.effective_sample_size,
    }
}

/// What a graph differs in, as it goes out.
pub fn difference(d: query::Difference) -> Difference {
    Difference { weight: d.weight, words: d.words }
}

fn edge(e: &query::EdgeView) -> Edge {
    let kind = match e.kind {
        EdgeKind::Distance => "distance",
        EdgeKind::Semantic => "semantic",
        EdgeKind::Relocalisation => "relocalisation",
    };
    Edge {
        i: e.i,
        j: e.j,
        kind: kind.into(),
        dx_m: e.i_from_j.x_m,
        dy_m: e.i_from_j.y_m,
        dyaw_rad: e.i_from_j.yaw_rad,
    }
}

/// Answer of `ask/grid`.
///
/// # Errors
/// If it can't be made a picture.
pub fn grid_reply(grid: &query::Grid, map: MapIdentity) -> Result<GridReply, Invalid> {
    Ok(GridReply {
        v: ANSWER_VERSION,
        query: "grid".into(),
        map,
        resolution_m: grid.resolution_m,
        width: grid.width,
        height: grid.height,
        map_from_grid: pose(&grid.map_from_grid),
        png: png_of(grid.width, grid.height, &grid.cells)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;
    use toponym_proto::{Header, Odom, Say, Scan};

    #[test]
    fn what_a_range_means_is_left_to_the_core() {
        let ranges_m = vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e9, -1.0];
        let message = Message::Scan(Scan {
            header: Header { robot: "r1".into(), stamp: Stamp { ns: 5 }, ..Default::default() },
            laser: "front".into(),
            angle_min_rad: -1.0,
            angle_increment_rad: 0.5,
            time_increment_s: 0.001,
            ranges_m: ranges_m.clone(),
        });
        let Event::Scan(scan) = event(message) else { panic!("not a scan") };
        assert_eq!(
            scan.ranges_m.iter().map(|r| r.to_bits()).collect::<Vec<_>>(),
            ranges_m.iter().map(|r| r.to_bits()).collect::<Vec<_>>()
        );
        assert_eq!((scan.stamp_ns, scan.time_increment_s), (5, 0.001));
    }

    #[test]
    fn yaw_is_wrapped_and_the_boot_kept() {
        let header = Header { robot: "r1".into(), boot: 7, ..Default::default() };
        let odom_from_body = Pose { x_m: 1.0, y_m: 2.0, yaw_rad: 7.0 };
        let Event::Odom(odom) = event(Message::Odom(Odom { header, odom_from_body })) else {
            panic!("not odometry")
        };
        assert_eq!((odom.boot, odom.odom_from_body), (7, Pose2::new(1.0, 2.0, 7.0)));
        assert!(odom.odom_from_body.yaw_rad < 1.0);
    }

    #[test]
    fn a_sentence_that_never_ended_ended_when_it_began() {
        let say =
            Say { id: "1".into(), text: "gym".into(), began: Some(Stamp { ns: 9 }), ..Default::default() };
        let Event::Utterance(u) = event(Message::Say(say)) else { panic!("no utterance") };
        assert_eq!((u.began_ns, u.ended_ns), (9, 9));
    }

    #[test]
    fn distance_and_bearing_count_from_the_robot() {
        let candidate = query::Candidate {
            place: 3,
            label: "gym".into(),
            shown: "Gym".into(),
            probability: 1.0,
            p_is: 1.0,
            pose: Pose2::new(1.0, 5.0, 0.0),
            covariance: Matrix3::from_fn(|i, j| (3 * i + j) as f64),
            polygon_m: vec![(0.0, 4.0), (2.0, 4.0), (2.0, 6.0004)],
            goal: query::Goal { pose: Pose2::new(1.5, 5.0, 0.5), is_reachable: Some(false) },
            walk_m: None,
            because: vec![],
        };
        let answer = WhereAnswer {
            text: "gym".into(),
            label: Some("gym".into()),
            via: "exact".into(),
            p_none: 0.0,
            unresolved: 0.0,
            candidates: vec![candidate],
            suggestions: vec![],
            robot: Some(Pose2::new(1.0, 2.0, FRAC_PI_2)),
        };
        let lost = where_reply(
            WhereAnswer { robot: None, ..answer.clone() },
            MapIdentity::default(),
            Stamp { ns: 1 },
            "r07",
        );
        assert_eq!((lost.candidates[0].from_robot.as_ref(), lost.candidates[0].x_m), (None, 1.0));
        let reply = where_reply(answer, MapIdentity::default(), Stamp { ns: 1 }, "r07");
        let from = reply.candidates[0].from_robot.as_ref().unwrap();
        assert!((from.distance_m - 3.0).abs() < 1e-12 && from.bearing_rad.abs() < 1e-12);
        assert!((reply.candidates[0].polygon_m[2][1] - 6.0).abs() < 1e-12, "to a millimetre");
        let goal = reply.candidates[0].goal.as_ref().unwrap();
        assert!((goal.x_m - 1.5).abs() < 1e-12 && goal.reachable == Reachable::No);
        assert_eq!(reply.candidates[0].cov.map(|c| c as u32), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    }
}
