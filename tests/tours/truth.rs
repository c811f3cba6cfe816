//! What is true of a tour, and what might be: the robot's path, the hypotheses about it, names and rooms.

use toponym_core::Pose2;

/// Steps below this are gathered before they count: the jitter of a robot that stands adds up to metres.
const STEP_M: f64 = 0.01;
/// Steps above this are none: the robot was carried.
const CARRIED_M: f64 = 2.0;

/// Corners of a room, metres.
pub type Outline = Vec<[f64; 2]>;

/// Where the robot was, by time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    rows: Vec<(f64, Pose2)>,
    /// Metres driven until each row.
    driven_m: Vec<f64>,
}

/// From `from_s` on the robot would be at `world_from_true ∘` its true pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Seconds of the tour's stamps.
    pub from_s: f64,
    /// What is added to the true pose, on the left.
    pub world_from_true: Pose2,
}

/// What the robot's path may have been; without pieces: the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What is told of it.
    pub name: String,
    /// In order of time.
    pub pieces: Vec<Piece>,
}

/// A name said outright ("this is the gym"), and truly.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// When.
    pub t_s: f64,
    /// The name.
    pub name: String,
}

/// A question and the rooms that are right; none: the name was never said.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// "where is the gym"
    pub text: String,
    /// Outlines of the right rooms, in the frame of the true path.
    pub rooms: Vec<Outline>,
    /// By how many relations alone the name was told; 0: outright, or nobody looked.
    pub relations: usize,
}

/// All that a run is scored against.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Where the robot was.
    pub path: Path,
    /// What may be believed; the first is the truth.
    pub hypotheses: Vec<Hypothesis>,
    /// Stretches in which nothing is seen, from and to. A hypothesis' piece begins where one ends.
    pub dark_s: Vec<(f64, f64)>,
    /// When the graphs are looked at, the last at the end.
    pub checkpoints_s: Vec<f64>,
    /// Names said outright.
    pub named: Vec<Named>,
    /// Asked at the end.
    pub questions: Vec<Question>,
}

impl Path {
    /// Of stamps (ascending, seconds) and poses.
    pub fn new(rows: Vec<(f64, Pose2)>) -> Self {
        let (mut driven_m, mut total_m) = (Vec::with_capacity(rows.len()), 0.0);
        let mut last: Option<Pose2> = None;
        for (_, pose) in &rows {
            let step_m = last.map_or(0.0, |l| l.distance_m(pose));
            if last.is_none() || step_m >= STEP_M {
                total_m += if step_m <= CARRIED_M { step_m } else { 0.0 };
                last = Some(*pose);
            }
            driven_m.push(total_m);
        }
        Self { rows, driven_m }
    }

    /// Stamps and poses.
    pub fn rows(&self) -> &[(f64, Pose2)] {
        &self.rows
    }

    /// First and last stamp.
    pub fn span_s(&self) -> (f64, f64) {
        (self.rows.first().map_or(0.0, |r| r.0), self.rows.last().map_or(0.0, |r| r.0))
    }

    /// The pose at a time, between two rows blended; before the first and after the last row theirs.
    pub fn at(&self, t_s: f64) -> Pose2 {
        let Some((a, b, f)) = self.around(t_s) else { return Pose2::default() };
        self.rows[a].1.blend(&self.rows[b].1, f)
    }

    /// Metres driven until then.
    pub fn driven_m(&self, t_s: f64) -> f64 {
        let Some((a, b, f)) = self.around(t_s) else { return 0.0 };
        self.driven_m[a] + f * (self.driven_m[b] - self.driven_m[a])
    }

    /// The rows that are each so much further along the path, up to a time.
    pub fn each_m(&self, step_m: f64, until_s: f64) -> Vec<f64> {
        let mut next_m = 0.0;
        let mut stamps_s = Vec::new();
        for ((t_s, _), driven_m) in self.rows.iter().zip(&self.driven_m).take_while(|(r, _)| r.0 <= until_s) {
            if *driven_m >= next_m {
                stamps_s.push(*t_s);
                next_m = driven_m + step_m;
            }
        }
        stamps_s
    }

    /// The rows on either side of a time and how far it is from one to the other.
    fn around(&self, t_s: f64) -> Option<(usize, usize, f64)> {
        let last = self.rows.len().checked_sub(1)?;
        let next = self.rows.partition_point(|r| r.0 <= t_s);
        if next == 0 || next > last {
            let end = next.min(last);
            return Some((end, end, 0.0));
        }
        let (from_s, to_s) = (self.rows[next - 1].0, self.rows[next].0);
        Some((next - 1, next, (t_s - from_s) / (to_s - from_s)))
    }
}

impl Hypothesis {
    /// What is true.
    pub fn truth(name: &str) -> Self {
        Self { name: name.into(), pieces: Vec::new() }
    }

    /// Where the robot would have been, said twice: in the dark it is on its way from one piece to the
    /// next, so that both are told, in the light they are one.
    pub fn around(&self, path: &Path, dark_s: &[(f64, f64)], t_s: f64) -> [Pose2; 2] {
        let dark = dark_s.iter().find(|d| is_in(d, t_s));
        let (before_s, after_s) = dark.map_or((t_s, t_s), |d| (t_s.min(d.0), d.1));
        [before_s, after_s].map(|of_s| self.world_from_true(of_s).compose(&path.at(t_s)))
    }

    fn world_from_true(&self, t_s: f64) -> Pose2 {
        let piece = self.pieces.iter().rev().find(|p| p.from_s <= t_s);
        piece.map_or(Pose2::default(), |p| p.world_from_true)
    }
}

fn is_in(dark: &(f64, f64), t_s: f64) -> bool {
    dark.0 < t_s && t_s < dark.1
}

impl Truth {
    /// Whether nothing is seen then.
    pub fn is_dark(&self, t_s: f64) -> bool {
        self.dark_s.iter().any(|d| is_in(d, t_s))
    }

    /// Checkpoints at 25, 50, 75 and 100 % of a span of stamps.
    pub fn checkpoints_s((from_s, to_s): (f64, f64)) -> Vec<f64> {
        [0.25, 0.5, 0.75, 1.0].map(|share| from_s + share * (to_s - from_s)).to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight() -> Path {
        Path::new((0..=10).map(|k| (f64::from(k), Pose2::new(f64::from(k), 0.0, 0.0))).collect())
    }

    #[test]
    fn between_rows_pose_and_path_are_blended_and_beyond_them_held() {
        let path = straight();
        for (t_s, x_m) in [(-1.0, 0.0), (2.5, 2.5), (10.0, 10.0), (99.0, 10.0)] {
            assert!((path.at(t_s).x_m - x_m).abs() < 1e-12 && (path.driven_m(t_s) - x_m).abs() < 1e-12);
        }
        assert_eq!(Path::default().at(1.0), Pose2::default());
    }

    #[test]
    fn rows_are_taken_along_the_path() {
        assert_eq!(straight().each_m(2.5, 8.0), [0.0, 3.0, 6.0]);
    }

    #[test]
    fn jitter_is_no_path() {
        let standing = (0..1000).map(|k| (f64::from(k), Pose2::new(f64::from(k % 2) * 0.004, 0.0, 0.0)));
        assert!(Path::new(standing.collect()).driven_m(999.0) < 1e-9);
        let slow = (0..=1000).map(|k| (f64::from(k), Pose2::new(f64::from(k) * 0.004, 0.0, 0.0)));
        assert!((Path::new(slow.collect()).driven_m(1000.0) - 4.0).abs() < 0.02);
    }

    #[test]
    fn a_piece_moves_the_robot_from_then_on() {
        let moved = Pose2::new(0.0, 5.0, std::f64::consts::FRAC_PI_2);
        let other =
            Hypothesis { name: "other".into(), pieces: vec![Piece { from_s: 4.0, world_from_true: moved }] };
        let path = straight();
        let at = |t_s| other.around(&path, &[], t_s)[0];
        assert_eq!(at(3.0), Pose2::new(3.0, 0.0, 0.0));
        assert!((at(6.0).x_m).abs() < 1e-12 && (at(6.0).y_m - 11.0).abs() < 1e-12);
    }

    #[test]
    fn in_the_dark_a_hypothesis_is_on_its_way() {
        let world_from_true = Pose2::new(0.0, 5.0, 0.0);
        let other = Hypothesis { name: "o".into(), pieces: vec![Piece { from_s: 6.0, world_from_true }] };
        let y_m = |t_s| other.around(&straight(), &[(2.0, 6.0)], t_s).map(|p| p.y_m);
        assert_eq!([y_m(2.0), y_m(4.0), y_m(6.0)], [[0.0, 0.0], [0.0, 5.0], [5.0, 5.0]]);
    }

    #[test]
    fn who_is_carried_drives_no_path() {
        let rows =
            (0..=10).map(|k| (f64::from(k), Pose2::new(f64::from(k + if k > 5 { 30 } else { 0 }), 0.0, 0.0)));
        assert!((Path::new(rows.collect()).driven_m(10.0) - 9.0).abs() < 1e-12);
    }

    #[test]
    fn checkpoints_are_quarters() {
        assert_eq!(Truth::checkpoints_s((10.0, 50.0)), [20.0, 30.0, 40.0, 50.0]);
    }
}
