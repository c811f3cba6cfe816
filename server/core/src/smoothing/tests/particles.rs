//! Particles on one structure against smoothers of their own.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::chart;
use crate::smoothing::tests::script::{GOOD, POOR, Script};
use crate::smoothing::{Belief, Factor, FactorId, Smoother, Structure};
use proptest::prelude::*;
use rand::RngExt;
use std::collections::BTreeMap;

const PARTICLES: usize = 8;

/// A particle, and a smoother that holds its factors and no others.
#[derive(Clone)]
struct Twin {
    belief: Belief,
    alone: Smoother,
    /// The smoother's handles of the structure's factors held.
    held: BTreeMap<FactorId, FactorId>,
}

impl Twin {
    fn hold(&mut self, id: FactorId, factor: &Factor) {
        self.belief.hold(id);
        self.held.insert(id, self.alone.add_factor(factor.clone()).unwrap());
    }

    fn release(&mut self, id: FactorId) {
        self.belief.release(id);
        if let Some(own) = self.held.remove(&id) {
            self.alone.remove_factor(own).unwrap();
        }
    }

    fn settle(&mut self, structure: &Structure) {
        self.belief.settle(structure).unwrap();
        self.alone.settle().unwrap();
    }

    /// The two agree.
    fn check(&self, structure: &Structure, present: &[u32]) -> Result<(), TestCaseError> {
        let extent = present.iter().map(|&p| chart(&self.alone.pose(p)).xy().norm()).fold(1.0, f64::max);
        let scale = present.iter().map(|&p| self.alone.marginal(p).amax()).fold(0.0, f64::max);
        for &p in present {
            let off = chart(&self.alone.pose(p).between(&self.belief.pose(p)));
            prop_assert!(off.amax() < 1e-9 * extent, "pose {p} off by {off:?}");
            let off = (self.belief.marginal(structure, p) - self.alone.marginal(p)).amax();
            prop_assert!(off <= 1e-8 * scale, "marginal {p} off by {off:e}");
        }
        let chi2 = self.alone.chi2();
        prop_assert!((self.belief.chi2(structure) - chi2).abs() < 1e-6 * (1.0 + chi2));
        let (got, want) = (self.belief.log_evidence(structure), self.alone.log_evidence());
        prop_assert!((got - want).abs() < 1e-6 * (1.0 + want.abs()), "evidence {got} {want}");
        let a = present[present.len() / 2];
        let both =
            (self.belief.relative(structure, a, present).unwrap(), self.alone.relative(a, present).unwrap());
        for (got, want) in both.0.iter().zip(&both.1) {
            prop_assert!((got.covariance - want.covariance).amax() <= 1e-8 * want.covariance.amax());
        }
        let newest = [self.belief.joint(structure, present).unwrap(), self.alone.joint(present).unwrap()];
        for (got, want) in newest[0].others.iter().zip(&newest[1].others) {
            prop_assert!((got.cross - want.cross).amax() <= 1e-8 * scale);
        }
        Ok(())
    }
}

/// What happens between two steps of the robot.
#[derive(Clone, Debug)]
enum Event {
    Nothing,
    /// A loop that some particles believe in.
    Offer,
    /// A particle changes its mind about a loop.
    Turn,
    Resample,
    Anchor,
    /// A loop is given up by all.
    Remove,
    /// Once: what a pose leaves on poses that others' factors joined to it is one Gaussian over all of
    /// them, to the second order in how far they move later.
    Marginalise,
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        3 => Just(Event::Nothing),
        5 => Just(Event::Offer),
        3 => Just(Event::Turn),
        2 => Just(Event::Resample),
        1 => Just(Event::Anchor),
        1 => Just(Event::Remove),
        1 => Just(Event::Marginalise),
    ]
}

/// All particles. The script knows what is true and measures.
struct Crowd {
    script: Script,
    structure: Structure,
    twins: Vec<Twin>,
    loops: BTreeMap<FactorId, Factor>,
    present: Vec<u32>,
}

impl Crowd {
    fn new(seed: u64) -> Self {
        let script = Script::new(seed);
        let mut structure = Structure::new();
        structure.add_pose(Pose2::default(), &nalgebra::Matrix3::identity()).unwrap();
        let twin = Twin { belief: Belief::new(), alone: script.smoother.clone(), held: BTreeMap::new() };
        Self { script, structure, twins: vec![twin; PARTICLES], loops: BTreeMap::new(), present: vec![0] }
    }

    fn start(&mut self, f: &Factor) {
        self.present.push(self.structure.add_pose_from(f.clone()).unwrap());
        for twin in &mut self.twins {
            twin.alone.add_pose_from(f.clone()).unwrap();
        }
    }

    fn extend(&mut self) {
        let j = self.script.truth.len() as u32;
        let turn = self.script.rng.random_range(-1.0..1.0);
        self.script.truth.push(self.script.truth[j as usize - 1].compose(&Pose2::new(1.0, 0.2, turn)));
        let f = self.script.measured(j - 1, j, GOOD);
        self.start(&f);
    }

    fn anchor(&mut self) {
        let j = self.script.truth.len() as u32;
        let turn = self.script.rng.random_range(-3.0..3.0);
        self.script.truth.push(Pose2::new(3.0, -4.0, turn));
        let f = self.script.measured(0, j, POOR);
        self.start(&f);
    }

    fn any<T: Clone>(&mut self, of: &[T]) -> Option<T> {
        (!of.is_empty()).then(|| of[self.script.rng.random_range(0..of.len())].clone())
    }

    fn offer(&mut self) {
        let pair = [self.any(&self.present.clone()), self.any(&self.present.clone())];
        let [Some(i), Some(j)] = pair else { return };
        if i == j {
            return;
        }
        let f = self.script.measured(i, j, GOOD);
        let id = self.structure.add_factor(f.clone()).unwrap();
        for twin in &mut self.twins {
            if self.script.rng.random() {
                twin.hold(id, &f);
            }
        }
        self.loops.insert(id, f);
    }

    fn turn(&mut self) {
        let ids: Vec<FactorId> = self.loops.keys().copied().collect();
        let (Some(id), Some(k)) = (self.any(&ids), self.any(&[0, 3, 5, 7])) else { return };
        if self.twins[k].belief.holds(id) {
            self.twins[k].release(id);
        } else {
            self.twins[k].hold(id, &self.loops[&id]);
        }
    }

    fn resample(&mut self) {
        let twins = self.twins.clone();
        self.twins = (0..PARTICLES).filter_map(|_| self.any(&twins)).collect();
    }

    fn remove(&mut self) {
        let ids: Vec<FactorId> = self.loops.keys().copied().collect();
        let Some(id) = self.any(&ids) else { return };
        self.twins.iter_mut().for_each(|twin| twin.release(id));
        self.loops.remove(&id);
        self.structure.remove_factor(id).unwrap();
    }

    fn settle(&mut self) {
        self.structure.arrange();
        for twin in &mut self.twins {
            twin.settle(&self.structure);
        }
    }

    fn marginalise(&mut self) {
        if self.present.len() < self.script.truth.len() {
            return;
        }
        self.settle();
        let inner: Vec<u32> = self.present[1..].split_last().map_or(vec![], |(_, inner)| inner.to_vec());
        let Some(pose) = self.any(&inner) else { return };
        self.structure.marginalise(&[pose]).unwrap();
        for twin in &mut self.twins {
            twin.alone.marginalise(&[pose]).unwrap();
            twin.held.retain(|id, _| self.structure.factor(*id).is_some());
        }
        self.loops.retain(|id, _| self.structure.factor(*id).is_some());
        self.present.retain(|&p| p != pose);
        self.settle();
    }

    fn happen(&mut self, event: &Event) {
        match event {
            Event::Nothing => {}
            Event::Offer => self.offer(),
            Event::Turn => self.turn(),
            Event::Resample => self.resample(),
            Event::Anchor => self.anchor(),
            Event::Remove => self.remove(),
            Event::Marginalise => self.marginalise(),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn particles_on_one_structure_equal_smoothers_of_their_own(
        seed in any::<u64>(), events in prop::collection::vec(event(), 1..25),
    ) {
        let mut crowd = Crowd::new(seed);
        for event in &events {
            crowd.extend();
            crowd.happen(event);
            crowd.structure.arrange();
            // Some lag behind, and are updated by what others leave at different times.
            for twin in &mut crowd.twins {
                match crowd.script.rng.random_range(0..4) {
                    0 => {}
                    1 => drop(twin.belief.update_newest(&crowd.structure).unwrap()),
                    2 => drop(twin.belief.update(&crowd.structure).unwrap()),
                    _ => drop(twin.belief.settle(&crowd.structure).unwrap()),
                }
            }
        }
        crowd.settle();
        for twin in &crowd.twins {
            twin.check(&crowd.structure, &crowd.present)?;
        }
    }
}
