//! Settled, the smoother is where a batch optimiser of others ends: Levenberg–Marquardt of factrs.

use crate::geometry::Pose2;
use crate::smoothing::tests::dense::{Graph, Term, chart};
use crate::smoothing::tests::script::{GOOD, Script, Sigma};
use factrs::assign_symbols;
use factrs::containers::{Factor, FactorBuilder, Graph as Batch, Values};
use factrs::linalg::{Const, ForwardProp, Matrix3, Numeric, VectorX};
use factrs::noise::GaussianNoise;
use factrs::optimizers::{BaseOptParams, LevenMarquardt, LevenParams, Optimizer};
use factrs::residuals::{PriorResidual, Residual2};
use factrs::variables::{SE2, Variable};
use rand::RngExt;
use std::f64::consts::FRAC_PI_2;

assign_symbols!(X: SE2);

/// The error of a factor: the chart (x, y, yaw) of `z⁻¹ · a⁻¹b`, where factrs takes the logarithm.
#[derive(Clone, Debug)]
struct Measured(SE2);

#[factrs::mark]
impl Residual2 for Measured {
    type Differ = ForwardProp<Const<6>>;
    type V1 = SE2;
    type V2 = SE2;
    type DimIn = Const<6>;
    type DimOut = Const<3>;

    fn residual2<T: Numeric>(&self, a: SE2<T>, b: SE2<T>) -> VectorX<T> {
        let e = self.0.cast::<T>().inverse().compose(&a.inverse().compose(&b));
        VectorX::from_vec(vec![e.x(), e.y(), e.theta()])
    }
}

fn se2(p: &Pose2) -> SE2 {
    SE2::new(p.yaw_rad, p.x_m, p.y_m)
}

fn factor(term: &Term) -> Factor {
    let Term::Between(f) = term else { panic!("{term:?}") };
    let information = Matrix3::from_column_slice(f.information.as_slice());
    let noise = GaussianNoise::from_matrix_inf(information.as_view()).unwrap();
    FactorBuilder::new2(Measured(se2(&f.i_from_j)), X(f.i), X(f.j)).noise(noise).build()
}

/// Takes the poses to the optimum; what holds the first one costs nothing there.
fn optimise(graph: &mut Graph) {
    let mut batch = Batch::new();
    batch.add_factor(FactorBuilder::new1(PriorResidual::new(SE2::identity()), X(0)).build());
    graph.terms.values().for_each(|term| batch.add_factor(factor(term)));
    let mut values = Values::new();
    for (&k, pose) in &graph.poses {
        values.insert(X(k), se2(pose));
    }
    let base = BaseOptParams { error_tol_relative: 1e-11, error_tol_absolute: 0.0, ..Default::default() };
    let mut optimiser = LevenMarquardt::new(LevenParams { base, ..LevenParams::default() }, batch);
    let values = optimiser.optimize(values).unwrap();
    for (&k, pose) in &mut graph.poses {
        let value = values.get(X(k)).unwrap();
        *pose = Pose2::new(value.x(), value.y(), value.theta());
    }
    // Twice what factrs calls the error is chi²: both have the same objective.
    let (chi2, theirs) = (graph.chi2(), 2.0 * optimiser.error(&values));
    assert!((chi2 - theirs).abs() < 1e-9 * chi2, "{chi2} {theirs}");
}

/// A walk along the streets of a city of square blocks, which loops where it was before.
pub fn manhattan(seed: u64, poses: u32, loops: usize, sigma: Sigma) -> Script {
    let mut s = Script::new(seed);
    while s.newest() + 1 < poses {
        let j = s.newest() + 1;
        // Blocks of 4 m; outside of the city, back.
        let at = s.truth[j as usize - 1];
        let turn = match j % 4 {
            0 if at.x_m.abs().max(at.y_m.abs()) > 12.0 => 2.0 * FRAC_PI_2,
            0 => FRAC_PI_2 * f64::from(s.rng.random_range(-1..=1)),
            _ => 0.0,
        };
        s.extend(Pose2::new(1.0, 0.0, turn), sigma);
        let near = |i: &u32| s.truth[*i as usize].distance_m(&s.truth[j as usize]) < 1.5;
        let near: Vec<u32> = (0..j.saturating_sub(20)).filter(near).collect();
        if !near.is_empty() && s.loops.len() < loops && s.rng.random_bool(0.6) {
            let i = near[s.rng.random_range(0..near.len())];
            s.close(i, j, sigma);
        }
        s.smoother.update().unwrap();
    }
    s
}

#[test]
fn settled_it_is_where_levenberg_marquardt_ends() {
    for seed in 0..3 {
        let mut s = manhattan(seed, 300, 100, GOOD);
        assert_eq!((s.smoother.len(), s.loops.len()), (300, 100));
        s.smoother.settle().unwrap();
        // From dead reckoning.
        optimise(&mut s.graph);
        let (got, want) = (s.smoother.chi2(), s.graph.chi2());
        assert!(got <= 1.000_001 * want && (got - want).abs() <= 1e-6 * want, "seed {seed}: {got} {want}");
        for (&k, pose) in &s.graph.poses {
            let off = chart(&pose.between(&s.smoother.pose(k))).amax();
            assert!(off < 1e-6, "seed {seed}: pose {k} off by {off}");
        }
    }
}
