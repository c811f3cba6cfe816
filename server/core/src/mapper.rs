//! The core's public face: events in, effects out.

use crate::answers::snapshot::{Snapshot, open_poses};
use crate::edge::Vertex;
use crate::effects::{Effect, Effects, TrackState};
use crate::event::{Odom, Scan, StampNs, Utterance};
use crate::filter::Filter;
use crate::filter::particle::{Edge, Particle};
use crate::filter::propose::is_lost;
use crate::geometry::Pose2;
use crate::graph::Graph;
use crate::smoothing::SmoothError;
use crate::talk::{Here, Talk};
use crate::track::Track;
use crate::track::front::{FrozenPlace, OpenPlace};
use crate::trial::Trial;
use crate::{Answer, Config, Event, Query};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// One map and the robot on it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mapper {
    track: Track,
    filter: Filter,
    talk: Talk,
    /// +1 when coordinates jump.
    epoch: u64,
    /// +1 per change.
    rev: u64,
    /// What is spoilt on purpose; goes with a restart.
    #[serde(skip)]
    trial: Trial,
}

/// A saved map could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The encoder refused.
    #[error("the map could not be encoded: {0}")]
    Encode(#[from] bincode::error::EncodeError),
    /// These bytes are not a saved map.
    #[error("not a saved map: {0}")]
    Decode(#[from] bincode::error::DecodeError),
    /// They are a saved map, but of another format.
    #[error("a saved map of format {found:?}; this build reads {expected:?}")]
    Format {
        /// What the file says.
        found: String,
        /// What this build writes.
        expected: String,
    },
    /// They are a saved map whose poses contradict themselves.
    #[error("the saved map's poses can't be made anew: {0}")]
    Poses(#[from] SmoothError),
}

/// Format of a saved map; its number changes whenever its content does.
const FORMAT: &str = concat!("toponym map 8 of ", env!("CARGO_PKG_VERSION"), " ");

/// A map is exact only on the kind of machine that it was made on.
fn format_here() -> String {
    format!("{FORMAT}{}", std::env::consts::ARCH)
}

impl Mapper {
    /// An empty map.
    pub fn new(config: Config) -> Self {
        Self::on_trial(config, Trial::default())
    }

    /// An empty map for which some of what is measured will be spoilt.
    pub fn on_trial(config: Config, trial: Trial) -> Self {
        let track = Track::new(config.place_spacing_m);
        Self { track, filter: Filter::new(config), talk: Talk::default(), epoch: 0, rev: 0, trial }
    }

    /// Takes one event.
    pub fn step(&mut self, event: Event) -> Effects {
        let mut effects = Effects::new();
        match event {
            Event::Setup(setup) => self.track.set_up(setup),
            Event::Odom(odom) => self.odom(&odom, &mut effects),
            Event::Scan(scan) => self.scan(scan, &mut effects),
            Event::Utterance(utterance) => self.hear(&utterance, &mut effects),
            Event::Command(command) => {
                self.change(&mut effects, |filter, talk| vec![Effect::Mended(talk.mend(filter, &command))]);
            }
            Event::Flush => self.flush(&mut effects),
        }
        effects
    }

    /// Answers from the newest snapshot.
    pub fn answer(&self, query: &Query) -> Answer {
        self.snapshot().answer(query)
    }

    /// The posterior now.
    pub fn snapshot(&self) -> Arc<Snapshot> {
        Arc::new(Snapshot::new(
            &self.filter,
            self.talk.ledger.clone(),
            self.track.front.open_places().cloned().collect(),
            self.map_from_body(),
            (self.epoch, self.rev),
        ))
    }

    /// The whole mapper as bytes.
    pub fn save(&self) -> Result<Vec<u8>, SaveError> {
        Ok(bincode::serde::encode_to_vec((format_here(), self), bincode::config::standard())?)
    }

    /// What [`Mapper::save`] wrote.
    pub fn load(bytes: &[u8]) -> Result<Self, SaveError> {
        let config = bincode::config::standard();
        let (found, read): (String, usize) = bincode::serde::decode_from_slice(bytes, config)?;
        let expected = format_here();
        if found != expected {
            return Err(SaveError::Format { found, expected });
        }
        let rest = bytes.get(read..).unwrap_or_default();
        let (mut mapper, _): (Self, usize) = bincode::serde::decode_from_slice(rest, config)?;
        mapper.filter.restore()?;
        Ok(mapper)
    }

    /// What all particles share.
    pub fn graph(&self) -> &Graph {
        &self.filter.graph
    }

    /// Its settings.
    pub fn config(&self) -> &Config {
        &self.filter.config
    }

    fn odom(&mut self, odom: &Odom, effects: &mut Effects) {
        self.track.odom(odom, effects);
        self.place_waiting(Some(odom.stamp_ns), effects);
    }

    fn scan(&mut self, scan: Scan, effects: &mut Effects) {
        let now_ns = scan.stamp_ns;
        self.track.scan(scan, effects);
        self.place_waiting(Some(now_ns), effects);
    }

    /// Places the scans that odometry brackets, or whose time is up. None: all of them.
    fn place_waiting(&mut self, now_ns: Option<StampNs>, effects: &mut Effects) {
        while let Some(scan) = self.track.next_due(now_ns) {
            if let Some(placed) = self.track.place(&scan, effects) {
                self.rev += u64::from(placed.began);
                self.grow(placed.frozen, effects);
                effects.push(self.tracked(scan.stamp_ns, placed.odom_from_body));
            }
        }
    }

    /// Algorithm 1 for each place just left, and what was described is looked for in the map as it is now.
    fn grow(&mut self, frozen: Vec<FrozenPlace>, effects: &mut Effects) {
        for place in frozen {
            let trial = self.trial.clone();
            self.change(effects, |filter, talk| {
                let effects = filter.step(place, &|t, measured| trial.spoil(t, &mut measured.fits));
                trial.force(filter);
                talk.reground(filter);
                effects
            });
        }
    }

    /// Changes the posterior. Where another particle is best then, the map's coordinates jump.
    fn change(&mut self, effects: &mut Effects, change: impl FnOnce(&mut Filter, &mut Talk) -> Effects) {
        let (before, edges) = (self.map_from_body(), self.filter.best().edges.clone());
        effects.extend(change(&mut self.filter, &mut self.talk));
        self.rev += 1;
        if !continues(&edges, &self.filter.best().edges)
            && let (Some(old), Some(new)) = (before, self.map_from_body())
        {
            self.epoch += 1;
            effects.push(Effect::Jumped { epoch: self.epoch, new_from_old: new.compose(&old.inverse()) });
        }
    }

    fn hear(&mut self, u: &Utterance, effects: &mut Effects) {
        let open: Vec<OpenPlace> = self.track.front.open_places().cloned().collect();
        let places = self.filter.graph.places().to_vec();
        let path_m: Vec<f64> = places.iter().map(|p| p.path_m).chain(open.iter().map(|p| p.path_m)).collect();
        let stamps = places.iter().map(|p| p.stamp_ns).chain(open.iter().map(|p| p.stamp_ns));
        let stamps: Vec<StampNs> = stamps.collect();
        // The place held when the sentence began; one from before the map is said of its first.
        let held = stamps.iter().rposition(|&s| s <= u.began_ns).or((!stamps.is_empty()).then_some(0));
        let poses = |p: &Particle| {
            let mut poses = p.belief.poses();
            poses.extend(open_poses(p, &places, &open));
            poses
        };
        let here = Here { held: held.map(|v| v as Vertex), poses: &poses, path_m };
        self.change(effects, |filter, talk| vec![Effect::Heard(talk.hear(filter, u, &here))]);
    }

    fn flush(&mut self, effects: &mut Effects) {
        self.place_waiting(None, effects);
        let frozen = self.track.front.freeze(f64::INFINITY);
        self.grow(frozen, effects);
        self.change(effects, |filter, talk| {
            talk.reground_all(filter);
            filter.finish()
        });
    }

    /// The robot in the best particle's map.
    fn map_from_body(&self) -> Option<Pose2> {
        let (front, best) = (&self.track.front, &self.filter.best().belief);
        let body = front.front_from_body();
        if let Some(v) = best.len().checked_sub(1) {
            let place = self.filter.graph.place(v as Vertex);
            return Some(best.pose(v as Vertex).compose(&place.front_from_place.between(&body)));
        }
        front.open_places().next().map(|first| first.front_from_place.between(&body))
    }

    fn tracked(&self, stamp_ns: StampNs, odom_from_body: Pose2) -> Effect {
        let map_from_body = self.map_from_body().unwrap_or_default();
        Effect::Tracked {
            stamp_ns,
            map_from_body,
            map_from_odom: map_from_body.compose(&odom_from_body.inverse()),
            covariance: self.covariance(),
            state: if self.is_lost() { TrackState::Lost } else { TrackState::Mapping },
        }
    }

    /// Whether the link to older places is broken and not mended yet.
    fn is_lost(&self) -> bool {
        let Filter { graph, structure, .. } = &self.filter;
        let best = &self.filter.best().belief;
        self.track.front.open_places().any(|p| p.chain.broken)
            || best.len().checked_sub(1).is_some_and(|v| is_lost(graph, structure, best, v as Vertex))
    }

    /// Covariance of the robot's pose in the best particle's map: that of the newest vertex, carried
    /// along the chain of the places not frozen yet to the body. Right perturbation.
    fn covariance(&self) -> Matrix3<f64> {
        let (front, best) = (&self.track.front, &self.filter.best().belief);
        let newest = best.len().checked_sub(1).map(|v| v as Vertex);
        let mut covariance = newest.map_or_else(Matrix3::zeros, |v| best.marginal(&self.filter.structure, v));
        let mut at = newest.map(|v| self.filter.graph.place(v).front_from_place);
        let mut carry = |to: Pose2, added: Matrix3<f64>| {
            if let Some(from) = at.replace(to) {
                let f = to.between(&from).adjoint();
                covariance = f * covariance * f.transpose() + added;
            }
        };
        for place in front.open_places() {
            carry(
                place.front_from_place,
                place.chain.information.try_inverse().unwrap_or_else(Matrix3::zeros),
            );
        }
        carry(front.front_from_body(), front.since_place());
        covariance
    }
}

/// Whether a graph is another one with edges added.
fn continues(before: &[Edge], after: &[Edge]) -> bool {
    after.len() >= before.len() && after.iter().zip(before).all(|(a, b)| a == b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edge::EdgeKind;
    use crate::event::{Laser, Setup};

    #[test]
    fn whatever_makes_another_particle_the_best_tells_that_coordinates_jump() {
        let mut mapper = Mapper::new(Config::default());
        let laser = Laser {
            id: "l".into(),
            body_from_laser: Pose2::default(),
            upside_down: false,
            range_min_m: 0.1,
            range_max_m: 30.0,
            ignored_rad: vec![],
        };
        mapper.step(Event::Setup(Setup { robot: "r".into(), lasers: vec![laser] }));
        let still = Odom { robot: "r".into(), boot: 0, stamp_ns: 0, odom_from_body: Pose2::default() };
        mapper.step(Event::Odom(still));
        mapper.step(Event::Scan(Scan {
            robot: "r".into(),
            laser: "l".into(),
            stamp_ns: 0,
            angle_min_rad: -1.5,
            angle_increment_rad: 0.1,
            time_increment_s: 0.0,
            ranges_m: vec![5.0; 31],
        }));
        let edge = Edge {
            i: 0,
            j: 1,
            kind: EdgeKind::Distance,
            i_from_j: Pose2::default(),
            covariance: Matrix3::identity(),
            revisit: 0,
            named: None,
            factor: 0,
        };
        let other = mapper.filter.best().clone();
        mapper.filter.particles = vec![Particle { edges: Arc::new(vec![edge]), ..other.clone() }, other];
        let mut effects = Effects::new();
        mapper.change(&mut effects, |_, _| Effects::new());
        assert_eq!((effects.len(), mapper.epoch), (0, 0));
        mapper.change(&mut effects, |filter, _| {
            filter.particles.swap(0, 1);
            Effects::new()
        });
        assert!(matches!(effects[..], [Effect::Jumped { epoch: 1, .. }]), "{effects:?}");
    }
}
