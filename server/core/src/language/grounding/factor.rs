//! One factor of eq. (16): how likely a figure lies here, if it lies `relation` the landmark.
//!
//! Every factor is an envelope round a footprint times a score from 0 to 1: learned for relations of
//! paths, a template for the others. Divided by its integral it is a density over the floor (per m²).
//! Scales are chosen on plans ([`Scales::FITTED`]), but for those in [`reach_m`] that no plan tells of.

use crate::language::act::Frame;
use crate::language::grounding::clause::Narrowing;
use crate::language::grounding::doors::Doors;
use crate::language::grounding::envelope::Envelope;
use crate::language::grounding::footprint::Footprint;
use crate::language::grounding::path_factors::PathFactor;
use crate::language::grounding::scales::Scales;
use crate::language::grounding::scene::{Scene, WAY_HALF_M, unit};
use crate::language::grounding::ways::Step;
use crate::language::relation::Relation;

/// "Down the hallway" said in the hallway means ahead, rather than behind, with this probability.
const AHEAD: f64 = 0.8;
/// How narrow "ahead", and "behind" or "in front of", are: concentration of exp(κ(cos − 1)). By hand.
const AHEAD_KAPPA: f64 = 8.0;
const FRONT_KAPPA: f64 = 3.0;
/// Doors are not counted further.
const DOORS_MAX: u32 = 100;
/// More doors come before than were counted: the guide miscounts, or a door is none. By hand.
const MISCOUNTED: f64 = 0.02;
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
    /// Anything outside the footprint, rather on the landmark's side of the hallway.
    Beside(Option<Wall>),
    /// Anything.
    Anywhere,
    /// A learned relation of the path there.
    Path(PathFactor),
    /// A direction from a point: unit vector, concentration; rather on the landmark's side.
    Cone((f64, f64), (f64, f64), f64, Option<Wall>),
    /// A side of the footprint's axis (1 left, −1 right of `along`), ahead of `from_m` on it; with a
    /// door counted there.
    Side { along: (f64, f64), side: f64, from_m: f64, nth: Option<(usize, Doors)> },
}

/// One side of a hallway: a point in its middle, and the unit vector to that side.
#[derive(Clone, Copy)]
struct Wall {
    at: (f64, f64),
    inward: (f64, f64),
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
        let (footprint, shape) = shape(scene, relation, frame, narrowing, target)?;
        let from = match shape {
            Shape::Side { along, .. } => From::Along(along),
            _ if target.way => From::Along(scene.onward_along(footprint.axis)),
            _ if target.place == scene.speaker => From::Walk,
            _ => From::Landmark,
        };
        let said = said_distance_m(&scene.scales, narrowing);
        let distance = said.map(|(mean_m, sigma_m)| Distance { mean_m, sigma_m, from });
        let mut scale_m =
            reach_m(&scene.scales, relation) * if narrowing.just { scene.scales.just } else { 1.0 };
        if let Some(d) = distance {
            // What is counted along a hallway is beside it, as far as the hallway is known.
            let known_m = match shape {
                Shape::Side { from_m, .. } => footprint.half_length_m - from_m,
                _ => 0.0,
            };
            scale_m = scale_m.max(d.mean_m - known_m);
        }
        let envelope = Envelope::new(footprint, scale_m);
        let mut factor = Self { scene, footprint, envelope, shape, distance, scale_per_m2: 0.0 };
        // Between few samples, a narrow cone would be lost.
        let round = if matches!(factor.shape, Shape::Cone(..)) { 36 } else { 12 };
        let score = |at| factor.score(at) * factor.distance_score(at, || scene.straight_m(at));
        let mean = factor.envelope.mean(round, score);
        factor.scale_per_m2 = 1.0 / (factor.envelope.area_m2() * mean.max(MEAN_MIN));
        Some(factor)
    }

    /// Adds to every place's sum `weight` times the density of the figure there, per m².
    pub fn add_densities(&self, weight: f64, sums: &mut [f64]) {
        let Shape::Path(path) = &self.shape else {
            for (place, sum) in sums.iter_mut().enumerate() {
                *sum += weight * self.density(place, |at| self.score_of_place(place, at));
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
            Shape::Beside(wall) => f64::from(self.gap_m(at) > 0.0) * self.same_side(*wall, at),
            Shape::Path(path) => path.p_straight(self.scene.stand(), at) * self.onward(at),
            &Shape::Cone(from, to, kappa, wall) => {
                let cos = unit(at, from).map_or(0.0, |d| d.0 * to.0 + d.1 * to.1);
                (kappa * (cos - 1.0)).exp() * self.same_side(wall, at)
            }
            Shape::Side { .. } => self.beside_way(at, None),
        }
    }

    fn score_of_place(&self, place: usize, at: (f64, f64)) -> f64 {
        match &self.shape {
            Shape::Side { nth: Some((_, doors)), .. } => self.beside_way(at, doors.of_place_m(place)),
            _ => self.score(at),
        }
    }

    /// How well a point beside a way fits that is entered by a door so far along, where that is known.
    fn beside_way(&self, at: (f64, f64), door_m: Option<f64>) -> f64 {
        let Shape::Side { along, side, from_m, nth } = &self.shape else { return 0.0 };
        let (dx, dy) = (at.0 - self.footprint.x_m, at.1 - self.footprint.y_m);
        let (u, v) = (dx * along.0 + dy * along.1, dy * along.0 - dx * along.1);
        let u = door_m.unwrap_or(u);
        let ahead = if u > from_m - SIDE_M { AHEAD } else { 1.0 - AHEAD };
        let fit = nth
            .as_ref()
            .map_or(1.0, |(before, doors)| doors.fit(u, *before, self.scene.scales.door_missed, MISCOUNTED));
        fit * ahead * beyond(side * v, SIDE_M)
    }

    /// 1 on the landmark's side of the hallway, less on the other.
    fn same_side(&self, wall: Option<Wall>, at: (f64, f64)) -> f64 {
        let Some(Wall { at: from, inward }) = wall else { return 1.0 };
        let across_m = (at.0 - from.0) * inward.0 + (at.1 - from.1) * inward.1;
        let other = self.scene.scales.other_side;
        other + (1.0 - other) * beyond(across_m, SIDE_M)
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
        let as_said = (-0.5 * ((is_m - said.mean_m) / said.sigma_m).powi(2)).exp();
        // Where doors were gone through, they are counted; how far they are tells less.
        let counts = matches!(self.shape, Shape::Side { nth: Some(_), .. });
        let any = if counts { self.scene.scales.door_any } else { 0.0 };
        any + (1.0 - any) * as_said
    }
}

/// From 0 to 1 where a coordinate comes to exceed a limit.
fn beyond(m: f64, limit_m: f64) -> f64 {
    1.0 / (1.0 + (-(m - limit_m) / (0.25 * SIDE_M)).exp())
}

fn said_distance_m(scales: &Scales, narrowing: Narrowing) -> Option<(f64, f64)> {
    if let Some(m) = narrowing.distance_m.filter(|m| m.is_finite() && *m >= 0.0) {
        let m = m.min(1e3);
        return Some((m, scales.distance_share * m + scales.distance_least_m));
    }
    let doors = f64::from(narrowing.doors?.clamp(1, DOORS_MAX));
    let pitches = (doors - 0.5).max(0.5);
    Some((pitches * scales.door_pitch_m, scales.door_share * doors * scales.door_pitch_m))
}

/// Where, and what of it.
fn shape(
    scene: &Scene,
    relation: Relation,
    frame: Frame,
    narrowing: Narrowing,
    target: Target,
) -> Option<(Footprint, Shape)> {
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
    let wall = scene.room(target.place).map(|room| Wall { at: room.hinge, inward: room.inward(at) });
    // Seen from the hallway, left and right are along the wall.
    let beside = wall.filter(|_| !here && frame != Frame::Path);
    let side = |d| (floor, Shape::Cone(at, d, scene.scales.side_kappa, beside));
    let cone = |d, kappa| (floor, Shape::Cone(at, d, kappa, None));
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
            None => (floor, Shape::Beside(None)),
        },
        // A map has no north of its own: beside the landmark, somewhere.
        R::NorthOf | R::SouthOf | R::EastOf | R::WestOf => (floor, Shape::Beside(None)),
        R::NextTo => (floor, Shape::Beside(wall)),
        R::At | R::In | R::On | R::Contains => (floor, Shape::Anywhere),
        R::LeftOf => side(left(view())),
        R::RightOf => side(right(view())),
        R::AheadOf => cone(scene.ahead, AHEAD_KAPPA),
        R::Behind => cone(view(), FRONT_KAPPA),
        R::InFrontOf if here => cone(scene.ahead, FRONT_KAPPA),
        R::InFrontOf => cone(back(view()), FRONT_KAPPA),
        R::LeftSide | R::RightSide => {
            let way = scene.stretch(target.place);
            let along = scene.onward_along(way.axis);
            let stand = scene.stand();
            let from_m = (stand.0 - way.x_m) * along.0 + (stand.1 - way.y_m) * along.1;
            let side = if relation == R::LeftSide { 1.0 } else { -1.0 };
            let count =
                |n: u32| (n.clamp(1, DOORS_MAX) as usize - 1, Doors::new(scene, &way, along, side, from_m));
            (way, Shape::Side { along, side, from_m, nth: narrowing.doors.map(count) })
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

/// The floor that faces a place over the hallway, as deep as it lies; on either side of it, if the
/// place lies in the hallway.
fn facing(scene: &Scene, place: usize) -> Footprint {
    let at = scene.at(place);
    if let Some(room) = scene.room(place) {
        let (hinge, inward) = (room.hinge, room.inward(at));
        let depth_m = (at.0 - hinge.0) * inward.0 + (at.1 - hinge.1) * inward.1;
        let opposite = |m: f64| (hinge.0 - m * inward.0, hinge.1 - m * inward.1);
        return Footprint::strip(opposite(WAY_HALF_M), opposite(depth_m.max(2.0 * WAY_HALF_M)), 1.0);
    }
    let (dx, dy) = (-ACROSS_M * scene.ahead.1, ACROSS_M * scene.ahead.0);
    Footprint::strip((at.0 + dx, at.1 + dy), (at.0 - dx, at.1 - dy), 1.0)
}

/// Scale of the distance from the landmark's footprint.
fn reach_m(scales: &Scales, relation: Relation) -> f64 {
    use Relation as R;
    match relation {
        R::At | R::On | R::In | R::Contains | R::To => 1.0,
        R::NextTo => scales.next_to_m,
        R::Between => scales.between_m,
        R::AcrossFrom => scales.across_from_m,
        R::Near => scales.near_m,
        R::AtEndOf => scales.at_end_m,
        R::LeftSide | R::RightSide => scales.side_of_m,
        R::LeftOf | R::RightOf => scales.left_of_m,
        R::Past => scales.past_m,
        R::Through => scales.through_m,
        R::InFrontOf => 3.0,
        R::Behind | R::Across | R::Along | R::Around | R::OutOf | R::Towards => 4.0,
        R::Down | R::AwayFrom => 6.0,
        R::AheadOf => 8.0,
        _ => 15.0,
    }
}

#[cfg(test)]
mod tests;
