//! How well the robot knows where it is: how much of the posterior is near the pose told.
//!
//! ```text
//! m = Σ_i (1 − unresolved) w_i P(x within 1 m and 10° of the pose told | particle i)
//! ```
//!
//! The pose told is the best graph's. Particle i has its own mean, and around it what its graph leaves open
//! ([`crate::mapper::unseen`]): stretches that no scan measured count, steady mapping does not. Graphs that
//! were dropped are taken to have the robot elsewhere.

use crate::answers::differences::sentence;
use crate::answers::query::Difference;
use crate::edge::Vertex;
use crate::effects::TrackState;
use crate::filter::Filter;
use crate::filter::particle::Particle;
use crate::geometry::{Pose2, wrap};
use crate::graph::spread::Spread;
use crate::mapper::unseen::{Way, ahead};
use crate::track::front::FrontEnd;
use serde::{Deserialize, Serialize};

/// Less of the posterior near the pose told, and it is doubtful …
const SURE: f64 = 0.95;
/// … or more likely wrong.
const LIKELY: f64 = 0.5;
/// Share of what is near that may not be, where wheels and scans contradict each other: one of them is wrong, and nobody
/// knows which.
const EITHER: f64 = 0.4;
/// Reasons that weigh less than this share of the heaviest are not told.
const WORTH_TELLING: f64 = 0.5;

/// What is remembered from scan to scan.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Standing {
    /// As told last; none before the first scan.
    state: Option<TrackState>,
    /// Each particle's way, until the posterior changes.
    #[serde(skip)]
    ways: Option<Vec<Way>>,
    /// What came of it, until then or until the robot moves in the dark.
    #[serde(skip)]
    doubt: Option<Doubt>,
}

/// Where the posterior is that is not near the pose told.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// m.
    near: f64,
    /// Mass that graphs themselves have elsewhere: they know no better.
    vague: f64,
    /// Mass that other graphs have elsewhere.
    split: f64,
    /// Mass of graphs that were dropped.
    unresolved: f64,
    /// What made the best graph vague.
    cause: String,
}

impl Standing {
    /// As told last.
    pub fn state(&self) -> TrackState {
        self.state.unwrap_or(TrackState::Mapping)
    }

    /// The posterior has changed.
    pub fn renew(&mut self) {
        (self.ways, self.doubt) = (None, None);
    }

    /// Looks again. Some if the state is another one than told last: what it is now, and why.
    pub fn changed(
        &mut self,
        filter: &Filter,
        front: &FrontEnd,
        told: &Pose2,
    ) -> Option<(TrackState, Doubt)> {
        let map_from_front = told.compose(&front.front_from_body().inverse());
        let ahead = ahead(front, &map_from_front);
        if ahead.is_some() {
            self.doubt = None;
        }
        let doubt = match self.doubt.take() {
            Some(known) => known,
            None => self.look(filter, front, told, ahead.unwrap_or_default()),
        };
        let state = doubt.state();
        let changed = (self.state.replace(state) != Some(state)).then(|| (state, doubt.clone()));
        // What lies ahead grows with each scan; the rest holds until the posterior changes.
        self.doubt = ahead.is_none().then_some(doubt);
        changed
    }

    fn look(&mut self, filter: &Filter, front: &FrontEnd, told: &Pose2, ahead: Spread) -> Doubt {
        let vague = filter.graph.stretches.vague();
        let ways =
            self.ways.get_or_insert_with(|| filter.particles.iter().map(|p| Way::of(p, &vague)).collect());
        let kept = 1.0 - filter.unresolved();
        let (mut near, mut at_best) = (0.0, 0.0);
        for (p, way) in filter.particles.iter().zip(&*ways) {
            let spread = way.spread.plus(ahead);
            near += kept * p.weight() * spread.near(off(filter, front, p, told));
            at_best += kept * p.weight() * spread.near([0.0; 3]);
        }
        let contradiction = front.contradiction();
        let either = if contradiction.is_some() { EITHER * near } else { 0.0 };
        let cause = match ways.first().and_then(|way| way.stretch(&vague)) {
            _ if contradiction.is_some() => contradiction.unwrap_or_default(),
            _ if front.open_places().any(|p| p.chain.broken) => "odometry broke".to_owned(),
            _ if front.sees_nothing() => format!("in the dark for {:.0} m", front.unseen_m()),
            Some(stretch) if stretch.broken => "odometry broke".to_owned(),
            Some(stretch) => format!("nothing known seen since {:.0} m in the dark", stretch.path_m),
            None => "nothing known seen since it was dark".to_owned(),
        };
        let (vague, split) = ((kept - at_best).max(0.0) + either, (at_best - near).max(0.0));
        Doubt { near: near - either, vague, split, unresolved: filter.unresolved(), cause }
    }
}

/// From the pose told to where a particle has the robot: x, y in the map's axes, yaw.
fn off(filter: &Filter, front: &FrontEnd, p: &Particle, told: &Pose2) -> [f64; 3] {
    let Some(last) = p.belief.len().checked_sub(1) else { return [0.0; 3] };
    let front_from_place = filter.graph.place(last as Vertex).front_from_place;
    let body = p.belief.pose(last as Vertex).compose(&front_from_place.between(&front.front_from_body()));
    [body.x_m - told.x_m, body.y_m - told.y_m, wrap(body.yaw_rad - told.yaw_rad)]
}

impl Doubt {
    /// What it comes to.
    pub fn state(&self) -> TrackState {
        match self.near {
            near if near >= SURE => TrackState::Mapping,
            near if near >= LIKELY => TrackState::Doubtful,
            _ => TrackState::Lost,
        }
    }

    /// In words; `differences` of the best graphs.
    pub fn why(&self, differences: &[Difference]) -> String {
        let near = format!("within 1 m and 10° with {:.0} %", 100.0 * self.near);
        if self.state() == TrackState::Mapping {
            return near;
        }
        let ways = || sentence(differences).unwrap_or_else(|| "graphs have it at several places".to_owned());
        let dropped = || format!("{:.0} % in graphs that were dropped", 100.0 * self.unresolved);
        let mut reasons: Vec<(f64, String)> =
            vec![(self.vague, self.cause.clone()), (self.split, ways()), (self.unresolved, dropped())];
        reasons.sort_by(|a, b| b.0.total_cmp(&a.0));
        let heaviest = reasons[0].0;
        reasons.retain(|r| r.0 >= WORTH_TELLING * heaviest);
        let reasons: Vec<String> = reasons.into_iter().map(|r| r.1).collect();
        format!("{}; {near}", reasons.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::scan::place::Content;
    use crate::smoothing::Factor;
    use crate::track::places::{Chain, FrozenPlace, OpenPlace};
    use nalgebra::{Matrix3, Vector3};
    use std::sync::Arc;

    /// Two places a metre apart; of two graphs, weighed .7 and .3, one has the second four metres farther.
    fn split() -> Filter {
        let mut filter = Filter::new(Config { loops: false, ..Config::default() });
        let information = Matrix3::from_diagonal(&Vector3::new(100.0, 100.0, 1e6));
        for v in 0_u32..2 {
            let x_m = f64::from(v);
            let chain = Chain {
                previous_from_this: Pose2::new(1.0, 0.0, 0.0),
                information,
                broken: false,
                unseen: false,
                failed: 1e-4,
            };
            let front_from_place = Pose2::new(x_m, 0.0, 0.0);
            let open = OpenPlace { id: v.into(), stamp_ns: 0, front_from_place, path_m: x_m, chain };
            filter.step(
                FrozenPlace { open, content: Content::new(&[]) },
                &crate::filter::words::Silence,
                &|_, _| {},
            );
        }
        let factor =
            Factor { i: 0, j: 1, i_from_j: Pose2::new(5.0, 0.0, 0.0), information: information * 1e4 };
        let structure = Arc::make_mut(&mut filter.structure);
        let factor = structure.add_factor(factor).unwrap();
        structure.arrange();
        let mut far = filter.best().clone();
        far.belief.hold(factor);
        filter.particles.push(far);
        for (p, weight) in filter.particles.iter_mut().zip([0.7_f64, 0.3]) {
            p.log_weight = weight.ln();
            p.update(&filter.structure).unwrap();
        }
        filter
    }

    #[test]
    fn where_graphs_disagree_the_pose_told_is_doubtful() {
        let (mut filter, front, mut standing) = (split(), FrontEnd::new(1.0), Standing::default());
        let told = filter.best().belief.pose(1).compose(&Pose2::new(-1.0, 0.0, 0.0));
        let (state, doubt) = standing.changed(&filter, &front, &told).unwrap();
        assert_eq!((state, standing.state()), (TrackState::Doubtful, TrackState::Doubtful));
        assert!((doubt.near - 0.7).abs() < 1e-3 && (doubt.split - 0.3).abs() < 1e-3, "{doubt:?}");
        assert_eq!(standing.changed(&filter, &front, &told), None, "told once");
        for (p, weight) in filter.particles.iter_mut().zip([0.4_f64, 0.6]) {
            p.log_weight = weight.ln();
        }
        assert_eq!(standing.changed(&filter, &front, &told), None, "nobody said that it changed");
        standing.renew();
        assert_eq!(standing.changed(&filter, &front, &told).unwrap().0, TrackState::Lost);
        filter.particles.truncate(1);
        filter.rank();
        standing.renew();
        assert_eq!(standing.changed(&filter, &front, &told).unwrap().0, TrackState::Mapping);
    }

    fn doubt(vague: f64, split: f64, unresolved: f64) -> Doubt {
        let near = 1.0 - vague - split - unresolved;
        Doubt { near, vague, split, unresolved, cause: "in the dark for 34 m".into() }
    }

    #[test]
    fn the_state_is_by_the_mass_near_the_pose_told() {
        for (away, state) in
            [(0.0, TrackState::Mapping), (0.04, TrackState::Mapping), (0.06, TrackState::Doubtful)]
        {
            assert_eq!(doubt(away, 0.0, 0.0).state(), state);
            assert_eq!(doubt(0.0, 0.0, away).state(), state, "what was dropped is elsewhere");
        }
        assert_eq!(doubt(0.3, 0.1, 0.05).state(), TrackState::Doubtful);
        assert_eq!(doubt(0.3, 0.2, 0.05).state(), TrackState::Lost);
    }

    #[test]
    fn the_heaviest_reasons_are_told() {
        let ways: Vec<Difference> = [(0.72, "place 41 is place 7 again"), (0.25, "place 41 is new ground")]
            .map(|(weight, words)| Difference { weight, words: words.into() })
            .into();
        assert_eq!(
            doubt(0.01, 0.27, 0.02).why(&ways),
            "two ways this map can be: (72 %) place 41 is place 7 again; (25 %) place 41 is new ground; \
             within 1 m and 10° with 70 %"
        );
        assert_eq!(doubt(0.6, 0.1, 0.0).why(&ways), "in the dark for 34 m; within 1 m and 10° with 30 %");
        assert_eq!(
            doubt(0.2, 0.0, 0.2).why(&[]),
            "in the dark for 34 m; 20 % in graphs that were dropped; within 1 m and 10° with 60 %"
        );
        assert_eq!(doubt(0.01, 0.0, 0.0).why(&[]), "within 1 m and 10° with 99 %");
    }
}
