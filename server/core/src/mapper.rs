//! The core's public face: events in, effects out.

mod hearing;
mod standing;
mod unseen;

use crate::answers::snapshot::{Now, Shared, Snapshot};
use crate::edge::Vertex;
use crate::effects::{Effect, Effects};
use crate::event::{Command, Odom, Scan, StampNs};
use crate::filter::Filter;
use crate::filter::loops::Measured;
use crate::geometry::{Pose2, wrap};
use crate::graph::Graph;
use crate::mapper::standing::Standing;
use crate::smoothing::SmoothError;
use crate::talk::Talk;
use crate::track::Track;
use crate::track::places::FrozenPlace;
use crate::trial::Trial;
use crate::{Answer, Config, Event, Query};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The robot's pose in the map has changed by this without a motion: that is told …
const JUMP_M: f64 = 0.05;
/// … or by this.
const JUMP_RAD: f64 = 1.0_f64.to_radians();

/// One map and the robot on it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mapper {
    track: Track,
    filter: Filter,
    talk: Talk,
    standing: Standing,
    /// +1 when coordinates jump.
    epoch: u64,
    /// +1 per change.
    rev: u64,
    /// Changes of coordinates since the last jump, too small to tell each: the map's frame now from that told.
    untold: Pose2,
    /// With snapshots of the posterior as it is.
    #[serde(skip)]
    shared: Shared,
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
const FORMAT: &str = concat!("toponym map 18 of ", env!("CARGO_PKG_VERSION"), " ");

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
        Self {
            track,
            filter: Filter::new(config),
            talk: Talk::default(),
            standing: Standing::default(),
            epoch: 0,
            rev: 0,
            untold: Pose2::default(),
            shared: Shared::default(),
            trial,
        }
    }

    /// Takes one event.
    pub fn step(&mut self, event: Event) -> Effects {
        let mut effects = Effects::new();
        match event {
            Event::Setup(setup) => self.track.set_up(setup),
            Event::Odom(odom) => self.odom(&odom, &mut effects),
            Event::Scan(scan) => self.scan(scan, &mut effects),
            Event::Utterance(utterance) => self.hear(&utterance, &mut effects),
            Event::Command(Command::Pose(told)) => self.told(&told, &mut effects),
            Event::Command(Command::Area(area)) => self.drawn(&area, &mut effects),
            Event::Command(command) => {
                self.change(&mut effects, |filter, talk| vec![Effect::Mended(talk.mend(filter, &command))]);
                self.stand(&mut effects);
            }
            Event::Glossary(lines) => {
                self.talk.learn(&lines);
                self.rev += 1;
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
            self.shared.clone(),
            self.track.front.open_places().cloned().collect(),
            Now {
                robot: self.map_from_body(),
                state: self.standing.state(),
                epoch: self.epoch,
                rev: self.rev,
            },
        ))
    }

    /// The whole mapper as bytes.
    pub fn save(&self) -> Result<Vec<u8>, SaveError> {
        let mut bytes = Vec::new();
        self.save_to(&mut bytes)?;
        Ok(bytes)
    }

    /// Writes the same behind what is there.
    ///
    /// # Errors
    /// As [`Mapper::save`].
    pub fn save_to(&self, bytes: &mut Vec<u8>) -> Result<(), SaveError> {
        bincode::serde::encode_into_std_write((format_here(), self), bytes, bincode::config::standard())?;
        Ok(())
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

    /// What seems wrong with the robot's senses, each kind once, in words.
    pub fn suspicions(&self) -> impl Iterator<Item = &str> {
        self.track.suspicions()
    }

    /// What all particles share.
    pub fn graph(&self) -> &Graph {
        &self.filter.graph
    }

    /// Words of the site's own that it has learnt, as lines of a [`crate::language::Glossary`].
    pub fn words(&self) -> &str {
        self.talk.ledger.glossary.text()
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
        while let Some(waiting) = self.track.next_due(now_ns) {
            if let Some(placed) = self.track.place(&waiting, effects) {
                if placed.began {
                    self.rev += 1;
                    self.shared = self.shared.with_place();
                }
                self.corrected(placed.new_from_old, effects);
                self.grow(placed.frozen, effects);
                self.stand(effects);
                effects.push(self.tracked(waiting.scan.stamp_ns, placed.odom_from_body));
            }
        }
    }

    /// Algorithm 1 for each place just left, and what was described is looked for in the map as it is now.
    fn grow(&mut self, frozen: Vec<FrozenPlace>, effects: &mut Effects) {
        for place in frozen {
            let trial = self.trial.clone();
            self.change(effects, |filter, talk| {
                let spoil = |t, measured: &mut Measured| trial.spoil(t, &mut measured.fits);
                let effects = filter.step(place, talk, &spoil);
                trial.force(filter);
                talk.reground(filter);
                effects
            });
        }
    }

    /// Changes the posterior. Where that moves the robot in the best particle's map, coordinates jump.
    fn change(&mut self, effects: &mut Effects, change: impl FnOnce(&mut Filter, &mut Talk) -> Effects) {
        let before = self.map_from_body();
        effects.extend(change(&mut self.filter, &mut self.talk));
        self.rev += 1;
        self.shared = self.shared.anew();
        self.standing.renew();
        if let (Some(old), Some(new)) = (before, self.map_from_body()) {
            self.moved(&old, &new, effects);
        }
    }

    /// The front end has corrected where the body is: places not left yet move along with it.
    fn corrected(&mut self, new_from_old: Option<Pose2>, effects: &mut Effects) {
        if let (Some(new_from_old), Some(new)) = (new_from_old, self.map_from_body()) {
            let body = self.track.front.front_from_body();
            let body_before = new_from_old.inverse().compose(&body);
            self.moved(&new.compose(&body.between(&body_before)), &new, effects);
        }
    }

    /// The robot's pose in the map is another one without a motion. Small changes are told together, once
    /// they come to something.
    fn moved(&mut self, old: &Pose2, new: &Pose2, effects: &mut Effects) {
        self.untold = new.compose(&old.inverse()).compose(&self.untold);
        let as_told = self.untold.inverse().compose(new);
        let turned_rad = wrap(new.yaw_rad - as_told.yaw_rad).abs();
        if as_told.distance_m(new) > JUMP_M || turned_rad > JUMP_RAD {
            self.epoch += 1;
            let new_from_old = std::mem::take(&mut self.untold);
            effects.push(Effect::Jumped { epoch: self.epoch, new_from_old });
        }
    }

    /// Looks how well the robot knows where it is, and tells if that has changed.
    fn stand(&mut self, effects: &mut Effects) {
        let front = &self.track.front;
        let (Some(stamp_ns), Some(told)) = (front.newest_ns(), self.map_from_body()) else { return };
        if let Some((state, doubt)) = self.standing.changed(&self.filter, front, &told) {
            let why = doubt.why(&self.snapshot().differences());
            effects.push(Effect::StateChanged { stamp_ns, state, why });
        }
    }

    fn flush(&mut self, effects: &mut Effects) {
        self.place_waiting(None, effects);
        let frozen = self.track.front.freeze(f64::INFINITY);
        self.grow(frozen, effects);
        self.change(effects, |filter, talk| {
            talk.reground_all(filter);
            filter.finish(talk)
        });
        self.stand(effects);
    }

    /// The robot in the best particle's map.
    fn map_from_body(&self) -> Option<Pose2> {
        let (front, best) = (&self.track.front, &self.filter.best().belief);
        let body = front.front_from_body();
        if let Some(v) = best.len().checked_sub(1) {
            let place = self.filter.graph.place(v as Vertex);
            return Some(best.pose(v as Vertex).compose(&place.front_from_place.between(&body)));
        }
        // Until a place is left, both frames begin at the first scan.
        front.newest_ns().map(|_| body)
    }

    fn tracked(&self, stamp_ns: StampNs, odom_from_body: Pose2) -> Effect {
        let map_from_body = self.map_from_body().unwrap_or_default();
        Effect::Tracked {
            stamp_ns,
            map_from_body,
            map_from_odom: map_from_body.compose(&odom_from_body.inverse()),
            covariance: self.covariance(),
            state: self.standing.state(),
        }
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

#[cfg(test)]
mod tests;
