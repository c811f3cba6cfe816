//! One factor of eq. (16): how likely a figure lies here, if it lies `relation` the landmark.
//!
//! Every factor is an envelope round a footprint times a score from 0 to 1: learned for relations of
//! paths, a template for the others. Divided by its integral it is a density over the floor (per m²).
//! Scales ([`reach_m`]) are set by hand, and looked at on the plans of `examples/plans --fit` alone.

use super::Relation;
use super::act::Frame;
use super::clause::Narrowing;
use super::envelope::Envelope;
use super::footprint::Footprint;
use super::path_factors::PathFactor;
use super::scene::{Scene, unit};
use super::ways::Step;

/// "Just past": so much closer.
const JUST: f64 = 0.4;
/// Said distances: standard deviation, as share and least.
const DISTANCE_SHARE: f64 = 0.2;
const DISTANCE_LEAST_M: f64 = 1.5;
/// From a door to the next on the same side of a hallway, of 3 to 5 m tried the best on the plans of
/// `examples/plans --fit`; how much that varies is a guess.
const DOOR_PITCH_M: f64 = 4.5;
const DOOR_SHARE: f64 = 0.35;
/// "Down the hallway" said in the hallway means ahead, rather than behind, with this probability.
const AHEAD: f64 = 0.8;
/// How narrow a direction is: concentration of exp(κ(cos − 1)).
const SIDE_KAPPA: f64 = 3.0;
const AHEAD_KAPPA: f64 = 8.0;
/// Off the middle of a hallway from where it is its left or right.
const SIDE_M: f64 = 1.0;
/// From the middle of a hallway to the middle of a room on it.
const ACROSS_M: f64 = 4.0;
/// Least mean score: of a scene in which a relation hardly holds anywhere, little is believed.
const MEAN_MIN: f64 = 0.02;

/// A landmark hypothesis: one place, or two for "between".
#[derive(Clone, Copy)]
pub struct Target {
    /// Index of the place.
    pub place: usize,
    /// It is long, and one goes along it.
    pub way: bool,
    /// The other one.
    pub other: Option<usize>,
}

/// What a template asks of a point.
enum Shape {
    /// Anything outside the footprint.
    Beside,
    /// Anything.
    Anywhere,
    /// A learned relation of the path there.
    Path(PathFactor),
    /// A direction from a point: unit vector, concentration.
    Cone((f64, f64), (f64, f64), f64),
    /// A side of the footprint's axis (1 left, −1 right of `along`), ahead of `from_m` on it.
    Side { along: (f64, f64), side: f64, from_m: f64 },
}

/// A factor, ready to be asked for any point.
pub struct Factor<'a> {
    scene: &'a Scene<'a>,
    footprint: Footprint,
    envelope: Envelope,
    shape: Shape,
    distance: Option<Distance>,
    /// One over the integral of envelope times score.
    scale_per_m2: f64,
}

/// A distance that was said.
#[derive(Clone, Copy)]
struct Distance {
    mean_m: f64,
    sigma_m: f64,
    from: From,
}

/// What a distance is measured from.
#[derive(Clone, Copy)]
enum From {
    /// "Ten meters past the kitchen": the landmark.
    Landmark,
    /// "Ten meters down the hallway": the speaker, along the footprint's axis, however deep rooms are.
    Along((f64, f64)),
    /// "Ten meters ahead": the speaker, as one walks.
    Walk,
}

impl<'a> Factor<'a> {
    /// None if the relation says nothing of this floor.
    pub fn new(
        scene: &'a Scene<'a>,
        relation: Relation,
        frame: Frame,
        narrowing: Narrowing,
        target: Target,
    ) -> Option<Self> {
        let (footprint, shape) = shape(scene, relation, frame, target)?;
        let from = match shape {
            Shape::Side { along, .. } => From::Along(along),
            _ if target.way => From::Along(scene.onward_along(footprint.axis)),
            _ if target.place == scene.speaker => From::Walk,
            _ => From::Landmark,
        };
        let distance = said_distance_m(narrowing).map(|(mean_m, sigma_m)| Distance { mean_m, sigma_m, from });
        let mut scale_m = reach_m(relation) * if narrowing.just { JUST } else { 1.0 };
        if let Some(d) = distance {
            scale_m = scale_m.max(d.mean_m);
        }
        let envelope = Envelope::new(footprint, scale_m);
        let mut factor = Self { scene, footprint, envelope, shape, distance, scale_per_m2: 0.0 };
        let mean =
            factor.envelope.mean(|at| factor.score(at) * factor.distance_score(at, || scene.straight_m(at)));
        factor.scale_per_m2 = 1.0 / (factor.envelope.area_m2() * mean.max(MEAN_MIN));
        Some(factor)
    }

    /// Adds to every place's sum `weight` times the density of the figure there, per m².
    pub fn add_densities(&self, weight: f64, sums: &mut [f64]) {
        let Shape::Path(path) = &self.shape else {
            for (place, sum) in sums.iter_mut().enumerate() {
                *sum += weight * self.density(place, |at| self.score(at));
            }
            return;
        };
        let ways = self.scene.ways();
        for (place, sum) in sums.iter_mut().enumerate() {
            // As the crow flies, where no way is known.
            if ways.walk_m(place).is_none() {
                *sum += weight * self.density(place, |at| self.score(at));
            }
        }
        // Of each step on the way: where the way first came near the landmark, with the number of steps
        // up to there, or how far before that it still is.
        let mut trail: Vec<Result<(Step, usize), f64>> = Vec::new();
        ways.visit(self.scene.places, |place, way| {
            let Some((&here, before)) = way.split_last() else { return };
            trail.truncate(before.len());
            let state = match (before.last(), trail.last()) {
                (_, Some(&Ok(start))) => Ok(start),
                (Some(&last), Some(&Err(last_m))) => {
                    let here_m = path.before_m(here.at);
                    path.start(last, last_m, here, here_m).map(|start| (start, before.len())).ok_or(here_m)
                }
                _ => Err(path.before_m(here.at)),
            };
            trail.push(state);
            // What never comes near a landmark does not lead past it.
            if let Ok((start, steps)) = state {
                let onset = self.scene.at(ways.onset(place));
                let score = |_| path.p(start, &way[steps..]) * self.onward(onset);
                sums[place] += weight * self.density(place, score);
            }
        });
    }

    /// Density at a place, given how well it fits but for a distance said, 0…1.
    fn density(&self, place: usize, score: impl FnOnce((f64, f64)) -> f64) -> f64 {
        let at = self.scene.at(place);
        if self.envelope.is_far(at) {
            return 0.0;
        }
        let falloff = self.envelope.at_gap(self.gap_m(at));
        if falloff <= 0.0 {
            return 0.0;
        }
        let distance = self.distance_score(at, || self.scene.walk_m(place));
        let density = falloff * distance * score(at) * self.scale_per_m2;
        if density.is_finite() { density } else { 0.0 }
    }

    fn gap_m(&self, at: (f64, f64)) -> f64 {
        self.footprint.signed_distance_m(self.footprint.local(at.0, at.1)).max(0.0)
    }

    /// How well a point fits but for a distance said, 0…1; a path there is straight.
    fn score(&self, at: (f64, f64)) -> f64 {
        match &self.shape {
            Shape::Anywhere => 1.0,
            Shape::Beside => f64::from(self.gap_m(at) > 0.0),
            Shape::Path(path) => path.p_straight(self.scene.stand(), at) * self.onward(at),
            &Shape::Cone(from, to, kappa) => {
                let cos = unit(at, from).map_or(0.0, |d| d.0 * to.0 + d.1 * to.1);
                (kappa * (cos - 1.0)).exp()
            }
            &Shape::Side { along, side, from_m } => {
                let (dx, dy) = (at.0 - self.footprint.x_m, at.1 - self.footprint.y_m);
                let (u, v) = (dx * along.0 + dy * along.1, dy * along.0 - dx * along.1);
                let ahead = if u > from_m - SIDE_M { AHEAD } else { 1.0 - AHEAD };
                ahead / (1.0 + (-(side * v - SIDE_M) / (0.25 * SIDE_M)).exp())
            }
        }
    }

    /// How a way sets off to a point: ahead, or back where the speaker came from.
    fn onward(&self, onset: (f64, f64)) -> f64 {
        let ahead = self.scene.ahead;
        let cos = unit(onset, self.scene.stand()).map_or(0.0, |d| d.0 * ahead.0 + d.1 * ahead.1);
        1.0 - AHEAD + (2.0 * AHEAD - 1.0) * 0.5 * (1.0 + cos)
    }

    /// How well a point fits a distance said; `walk_m` is the way there from the speaker.
    fn distance_score(&self, at: (f64, f64), walk_m: impl FnOnce() -> f64) -> f64 {
        let Some(said) = self.distance else { return 1.0 };
        let stand = self.scene.stand();
        let is_m = match said.from {
            From::Landmark => (at.0 - self.footprint.x_m).hypot(at.1 - self.footprint.y_m),
            From::Along(d) => (at.0 - stand.0) * d.0 + (at.1 - stand.1) * d.1,
            From::Walk => walk_m(),
        };
        (-0.5 * ((is_m - said.mean_m) / said.sigma_m).powi(2)).exp()
    }
}

fn said_distance_m(narrowing: Narrowing) -> Option<(f64, f64)> {
    if let Some(m) = narrowing.distance_m.filter(|m| m.is_finite() && *m >= 0.0) {
        let m = m.min(1e3);
        return Some((m, DISTANCE_SHARE * m + DISTANCE_LEAST_M));
    }
    let doors = f64::from(narrowing.doors?.clamp(1, 100));
    let pitches = (doors - 0.5).max(0.5);
    Some((pitches * DOOR_PITCH_M, DOOR_SHARE * doors * DOOR_PITCH_M))
}

/// Where, and what of it.
fn shape(scene: &Scene, relation: Relation, frame: Frame, target: Target) -> Option<(Footprint, Shape)> {
    use Relation as R;
    let at = scene.at(target.place);
    let floor = scene.footprint(target.place, target.way);
    let here = target.place == scene.speaker || unit(at, scene.stand()).is_none();
    let left = |d: (f64, f64)| (-d.1, d.0);
    let right = |d: (f64, f64)| (d.1, -d.0);
    let back = |d: (f64, f64)| (-d.0, -d.1);
    // Looking at the landmark: from the hallway in, or from where the speaker stands.
    let view = || {
        let from = scene.room(target.place).map_or(scene.stand(), |e| e.hinge);
        match frame {
            _ if here => scene.ahead,
            Frame::Intrinsic => unit(from, at).unwrap_or(scene.ahead),
            Frame::Path => scene.room(target.place).map_or(scene.ahead, |e| e.along),
            _ => unit(at, from).unwrap_or(scene.ahead),
        }
    };
    let cone = |d, kappa| (floor, Shape::Cone(at, d, kappa));
    Some(match relation {
        R::Above | R::Below | R::LevelUp | R::LevelDown | R::OnLevel => return None,
        R::Through
        | R::Down
        | R::Along
        | R::Past
        | R::Across
        | R::To
        | R::Towards
        | R::AwayFrom
        | R::Around
        | R::OutOf => (floor, Shape::Path(PathFactor::new(relation, floor)?)),
        // What is near a room is near its door.
        R::Near => match scene.room(target.place) {
            Some(room) => (Footprint::spot(room.hinge.0, room.hinge.1, 1.5), Shape::Anywhere),
            None => (floor, Shape::Beside),
        },
        // A map has no north of its own: beside the landmark, somewhere.
        R::NextTo | R::NorthOf | R::SouthOf | R::EastOf | R::WestOf => (floor, Shape::Beside),
        R::At | R::In | R::On | R::Contains => (floor, Shape::Anywhere),
        R::LeftOf => cone(left(view()), SIDE_KAPPA),
        R::RightOf => cone(right(view()), SIDE_KAPPA),
        R::AheadOf => cone(scene.ahead, AHEAD_KAPPA),
        R::Behind => cone(view(), SIDE_KAPPA),
        R::InFrontOf if here => cone(scene.ahead, SIDE_KAPPA),
        R::InFrontOf => cone(back(view()), SIDE_KAPPA),
        R::LeftSide | R::RightSide => {
            let way = scene.stretch(target.place);
            let along = scene.onward_along(way.axis);
            let stand = scene.stand();
            let from_m = (stand.0 - way.x_m) * along.0 + (stand.1 - way.y_m) * along.1;
            let side = if relation == R::LeftSide { 1.0 } else { -1.0 };
            (way, Shape::Side { along, side, from_m })
        }
        R::Between => {
            let other = scene.at(target.other?);
            (Footprint::strip(at, other, 1.0), Shape::Anywhere)
        }
        R::AcrossFrom => (facing(scene, target.place), Shape::Anywhere),
        R::AtEndOf => {
            let way = scene.stretch(target.place);
            let (d, half_m) = (scene.onward_along(way.axis), way.half_length_m);
            (Footprint::spot(way.x_m + half_m * d.0, way.y_m + half_m * d.1, 1.0), Shape::Anywhere)
        }
    })
}

/// The floor that faces a place over the hallway; on either side of it, if the place lies in it.
fn facing(scene: &Scene, place: usize) -> Footprint {
    let at = scene.at(place);
    if let Some(room) = scene.room(place) {
        let (x_m, y_m) = room.mirror(at);
        return Footprint::spot(x_m, y_m, 1.0);
    }
    let (dx, dy) = (-ACROSS_M * scene.ahead.1, ACROSS_M * scene.ahead.0);
    Footprint::strip((at.0 + dx, at.1 + dy), (at.0 - dx, at.1 - dy), 1.0)
}

/// Scale of the distance from the landmark's footprint.
fn reach_m(relation: Relation) -> f64 {
    use Relation as R;
    match relation {
        R::At | R::On | R::In | R::Contains | R::To => 1.0,
        R::NextTo | R::Between | R::AcrossFrom => 1.5,
        R::Near | R::InFrontOf | R::AtEndOf | R::LeftSide | R::RightSide => 3.0,
        R::LeftOf | R::RightOf | R::Behind | R::Across | R::Along | R::Around | R::OutOf | R::Towards => 4.0,
        R::Past | R::Through | R::Down | R::AwayFrom => 6.0,
        R::AheadOf => 8.0,
        _ => 15.0,
    }
}

#[cfg(test)]
mod tests;
