//! Whether a graph is that of a hypothesis: its edges are true there, and it closes the loops that are.

use crate::graph::{Edge, Particle};
use crate::truth::{Hypothesis, Truth};
use toponym_core::Pose2;

/// A transform is right within this.
const RIGHT_M: f64 = 1.0;
/// A transform is right within this.
const RIGHT_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Places nearer than this are one place again.
const REVISIT_M: f64 = 2.0;
/// With less path between them, two places are neighbours and no loop.
const LOOP_PATH_M: f64 = 20.0;
/// A revisit that has gone on for so much path must have been seen.
const REQUIRED_M: f64 = 8.0;

/// Where the places of a graph are by a hypothesis, and which loops must be closed there.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Of each place: two only in the dark, where it is on its way from one to the other.
    poses: Vec<[Pose2; 2]>,
    loops: Vec<Loop>,
}

/// A revisit long enough to be required: pairs of places, old and new, at its beginning and its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loop {
    /// Where it had gone on for long enough.
    pub first: (usize, usize),
    /// The newest place of it.
    pub last: (usize, usize),
}

/// Where a place is by a hypothesis; in the dark, where nobody can know it, no pose.
struct Spot {
    pose: Option<Pose2>,
    driven_m: f64,
}

/// A place that is where an older one is.
#[derive(Clone, Copy)]
struct Revisit {
    old: usize,
    new: usize,
}

impl Layout {
    /// By a hypothesis, for places of these stamps (ascending, seconds).
    pub fn new(hypothesis: &Hypothesis, truth: &Truth, stamps_s: &[f64]) -> Self {
        let Truth { path, dark_s, .. } = truth;
        let poses: Vec<[Pose2; 2]> =
            stamps_s.iter().map(|&t_s| hypothesis.around(path, dark_s, t_s)).collect();
        let spot = |(&t_s, pose): (&f64, &[Pose2; 2])| Spot {
            pose: (!truth.is_dark(t_s)).then_some(pose[0]),
            driven_m: path.driven_m(t_s),
        };
        let loops = required(&stamps_s.iter().zip(&poses).map(spot).collect::<Vec<_>>());
        Self { poses, loops }
    }

    /// The loops that must be closed.
    pub fn loops(&self) -> &[Loop] {
        &self.loops
    }

    /// Whether an edge says what is so.
    pub fn is_true(&self, edge: &Edge) -> bool {
        let right =
            |from: &Pose2| self.poses[edge.j].iter().any(|to| is_right(&edge.i_from_j, &from.between(to)));
        self.poses[edge.i].iter().any(right)
    }

    /// Whether a graph has a loop closed: its poses of both pairs are right.
    pub fn is_closed(&self, graph: &Particle, l: &Loop) -> bool {
        [l.first, l.last].iter().all(|&(i, j)| {
            is_right(&graph.poses[i].between(&graph.poses[j]), &self.poses[i][0].between(&self.poses[j][0]))
        })
    }

    /// Whether a graph is of the hypothesis: all its edges are true and all required loops closed.
    pub fn is_of(&self, graph: &Particle) -> bool {
        graph.edges.iter().all(|e| self.is_true(e)) && self.loops.iter().all(|l| self.is_closed(graph, l))
    }
}

/// Whether a hypothesis asks for no other graph than the truth does, until then: each loop that either
/// requires is the same to the other. Before ways part it does, and where the robot is in one or another
/// of two places that are both new. Places are a metre apart.
pub fn is_as_true(hypothesis: &Hypothesis, truth: &Truth, until_s: f64) -> bool {
    let Some(what_is) = truth.hypotheses.first() else { return false };
    let stamps_s = truth.path.each_m(1.0, until_s);
    let [a, b] = [what_is, hypothesis].map(|h| Layout::new(h, truth, &stamps_s));
    let between = |layout: &Layout, (i, j): (usize, usize)| layout.poses[i][0].between(&layout.poses[j][0]);
    let mut pairs = a.loops.iter().chain(&b.loops).flat_map(|l| [l.first, l.last]);
    pairs.all(|pair| is_right(&between(&a, pair), &between(&b, pair)))
}

fn is_right(got: &Pose2, want: &Pose2) -> bool {
    got.distance_m(want) <= RIGHT_M && got.between(want).yaw_rad.abs() <= RIGHT_RAD
}

/// Runs of successive revisits that have gone on for long enough.
fn required(spots: &[Spot]) -> Vec<Loop> {
    let mut loops = Vec::new();
    let mut run: Vec<Revisit> = Vec::new();
    for new in 0..=spots.len() {
        let old = (new < spots.len()).then(|| older(spots, new)).flatten();
        if let Some(old) = old {
            run.push(Revisit { old, new });
        } else {
            loops.extend(required_of(&run, spots));
            run.clear();
        }
    }
    loops
}

fn required_of(run: &[Revisit], spots: &[Spot]) -> Option<Loop> {
    let began_m = spots[run.first()?.new].driven_m;
    let first = run.iter().find(|r| spots[r.new].driven_m - began_m >= REQUIRED_M)?;
    let last = run.last()?;
    Some(Loop { first: (first.old, first.new), last: (last.old, last.new) })
}

/// The nearest older place where a place is, with enough path between them to be a loop.
fn older(spots: &[Spot], new: usize) -> Option<usize> {
    let here = spots[new].pose?;
    let before = spots.partition_point(|s| s.driven_m < spots[new].driven_m - LOOP_PATH_M);
    let away = |old: usize| Some((old, spots[old].pose?.distance_m(&here)));
    let near = (0..before.min(new)).filter_map(away).filter(|(_, m)| *m <= REVISIT_M);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(old, _)| old)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::truth::{Path, Piece};

    /// 30 m out along x, turned on the spot, and back past the start: a metre a second.
    pub fn out_and_back() -> Path {
        let out = (0..=30).map(|k| (f64::from(k), Pose2::new(f64::from(k), 0.0, 0.0)));
        let back =
            (31..=60).map(|k| (f64::from(k), Pose2::new(60.0 - f64::from(k), 0.0, std::f64::consts::PI)));
        Path::new(out.chain(back).collect())
    }

    /// By this one the way back ran 50 m to the side.
    pub fn elsewhere() -> Hypothesis {
        let world_from_true = Pose2::new(0.0, 50.0, 0.0);
        Hypothesis { name: "elsewhere".into(), pieces: vec![Piece { from_s: 31.0, world_from_true }] }
    }

    pub fn stamps(until: u32) -> Vec<f64> {
        (0..=until).map(f64::from).collect()
    }

    /// A graph whose map is a hypothesis'.
    pub fn map_of(hypothesis: &Hypothesis, until: u32) -> Particle {
        let poses =
            stamps(until).iter().map(|&t_s| hypothesis.around(&out_and_back(), &[], t_s)[0]).collect();
        Particle { weight: 1.0, edges: Vec::new(), poses }
    }

    fn layout(hypothesis: &Hypothesis, until: u32) -> Layout {
        in_the_dark(hypothesis, &[], until)
    }

    fn in_the_dark(hypothesis: &Hypothesis, dark_s: &[(f64, f64)], until: u32) -> Layout {
        let truth = Truth { path: out_and_back(), dark_s: dark_s.to_vec(), ..Truth::default() };
        Layout::new(hypothesis, &truth, &stamps(until))
    }

    fn truth() -> Hypothesis {
        Hypothesis::truth("truth")
    }

    #[test]
    fn an_edge_is_true_within_a_metre_and_ten_degrees() {
        let layout = layout(&truth(), 60);
        let edge = |dx_m: f64, turn_deg: f64| Edge {
            i: 10,
            j: 50,
            i_from_j: Pose2::new(dx_m, 0.0, std::f64::consts::PI - turn_deg.to_radians()),
        };
        assert!(layout.is_true(&edge(0.9, 9.0)) && layout.is_true(&edge(-0.9, -9.0)));
        assert!(!layout.is_true(&edge(1.1, 0.0)) && !layout.is_true(&edge(0.0, 11.0)));
    }

    #[test]
    fn an_edge_that_is_false_in_truth_is_true_elsewhere() {
        let edge = Edge { i: 10, j: 50, i_from_j: Pose2::new(0.0, 50.0, std::f64::consts::PI) };
        assert!(!layout(&truth(), 60).is_true(&edge) && layout(&elsewhere(), 60).is_true(&edge));
    }

    #[test]
    fn a_loop_is_required_only_after_eight_metres() {
        // The first with more than 20 m between them and less than 2 m apart are 19 and 40.
        assert_eq!(layout(&truth(), 47).loops(), []);
        assert_eq!(layout(&truth(), 48).loops(), [Loop { first: (12, 48), last: (12, 48) }]);
        assert_eq!(layout(&truth(), 60).loops(), [Loop { first: (12, 48), last: (0, 60) }]);
        assert_eq!(layout(&elsewhere(), 60).loops(), []);
    }

    #[test]
    fn a_run_that_breaks_off_begins_anew() {
        // Back along the way out, but from 45 s to 47 s somewhere else.
        let mut hypothesis = truth();
        let piece = |from_s: f64, y_m: f64| Piece { from_s, world_from_true: Pose2::new(0.0, y_m, 0.0) };
        hypothesis.pieces = vec![piece(44.5, 9.0), piece(47.5, 0.0)];
        assert_eq!(layout(&hypothesis, 60).loops(), [Loop { first: (4, 56), last: (0, 60) }]);
    }

    #[test]
    fn in_the_dark_no_loop_is_required_and_an_edge_may_belong_to_either_end() {
        let dark_s = [(28.5, 46.0)];
        let loops = [Loop { first: (6, 54), last: (0, 60) }];
        assert_eq!(in_the_dark(&truth(), &dark_s, 60).loops(), loops, "8 m after it got light");
        let moved = Hypothesis {
            pieces: vec![Piece { from_s: 46.0, world_from_true: Pose2::new(0.0, 50.0, 0.0) }],
            ..elsewhere()
        };
        let layout = in_the_dark(&moved, &dark_s, 60);
        let edge =
            |j, y_m| Edge { i: 10, j, i_from_j: Pose2::new(50.0 - j as f64, y_m, std::f64::consts::PI) };
        assert!(layout.is_true(&edge(45, 0.0)) && layout.is_true(&edge(45, 50.0)));
        assert!(!layout.is_true(&edge(45, 25.0)) && !layout.is_true(&edge(46, 0.0)));
        assert!(layout.is_true(&edge(46, 50.0)));
    }

    #[test]
    fn a_loop_is_closed_by_poses_at_its_eight_metres_and_at_its_end() {
        let layout = layout(&truth(), 60);
        let mut graph = map_of(&truth(), 60);
        assert!(layout.is_of(&graph));
        graph.poses[60].y_m += 1.1;
        assert!(!layout.is_of(&graph));
        graph.poses[60].y_m -= 1.1;
        graph.poses[48].x_m += 1.1;
        assert!(!layout.is_of(&graph));
        graph.poses[48].x_m -= 1.1;
        graph.poses[55].x_m += 9.0;
        assert!(layout.is_of(&graph), "in between nothing is asked");
    }

    #[test]
    fn a_graph_is_of_the_hypothesis_whose_map_it_has() {
        let (here, there) = (layout(&truth(), 60), layout(&elsewhere(), 60));
        let graph = map_of(&elsewhere(), 60);
        assert!(!here.is_of(&graph) && there.is_of(&graph));
        let mut wrong = map_of(&truth(), 60);
        wrong.edges = vec![Edge { i: 3, j: 57, i_from_j: Pose2::new(5.0, 0.0, 0.0) }];
        assert!(!here.is_of(&wrong), "closed, but with a false edge");
    }
}
