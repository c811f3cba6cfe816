//! Grounding: which place is "the gym" in "the gym is down the hallway"? Paper III-E, eqs. (14–16),
//! the Generalized Grounding Graph with one factor per part of the clause.
//!
//! The relation's factor is a *density over the floor* (per m²), given speaker and landmark; a place
//! gets the mass of the floor that the robot saw as that place, and what lies on floor not yet seen
//! goes to "elsewhere". So nothing but the share of the neighbourhood that is already mapped decides
//! how far an unknown figure is trusted to be in the map. (The paper's σ(−d/30 m) for "near" has no
//! scale of its own and can't say "not here yet".)

use super::Relation;

/// A place as grounding sees it, in one particle's map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundPlace {
    /// Position in the map.
    pub x_m: f64,
    /// Position in the map.
    pub y_m: f64,
    /// Heading of the robot at the place, in the map.
    pub yaw_rad: f64,
    /// Path travelled up to the place.
    pub path_m: f64,
}

/// Which place is the figure; `p` and `p_elsewhere` sum to one.
#[derive(Clone, Debug, PartialEq)]
pub struct Grounding {
    /// Per place: probability that it is the figure.
    pub p: Vec<f64>,
    /// Probability that the figure is not in the map yet.
    pub p_elsewhere: f64,
}

/// Landmark hypotheses summed over; the likeliest are kept.
const MAX_LANDMARKS: usize = 16;
/// "Near": standard deviation of the figure's offset from the landmark, each axis.
const NEAR_M: f64 = 6.0;
/// "Away from": scale of the hole round the landmark, and of the neighbourhood it lies in.
const AWAY_M: f64 = 10.0;
const AWAY_BOUND_M: f64 = 40.0;
/// "Down", "through": decay of the figure's distance beyond the landmark.
const BEYOND_M: f64 = 15.0;
/// Half width of "straight on", and its growth per metre.
const ACROSS_M: f64 = 2.0;
const ACROSS_PER_M: f64 = 0.25;
/// Closer landmarks give no direction: the robot's heading does.
const DIRECTION_MIN_M: f64 = 2.0;
/// "Down the hallway" said in the hallway means ahead, rather than behind, with this probability.
const AHEAD: f64 = 0.75;
/// A detour of the travelled path by this much makes it a poor guide to directions.
const DETOUR_M: f64 = 20.0;
/// A place stands for a strip of floor this wide, and no longer than this.
const CELL_WIDTH_M: f64 = 3.0;
const CELL_LENGTH_MAX_M: f64 = 3.0;
/// Floor on which a place known by name might lie: turns densities into likelihood ratios.
const FLOOR_M2: f64 = 3000.0;
/// Bounds of that ratio: no description moves a taught name further.
const RATIO: (f64, f64) = (0.05, 20.0);
/// Prior that a figure whose name was never taught has not been visited, even where all floor that
/// the words allow has been: guides describe what is yet to come, and a visit is when names are taught.
const NOT_YET: f64 = 0.5;
/// No name is so well known that it can't also apply to a place not yet seen.
const KNOWN_MAX: f64 = 0.95;

/// Which place is the figure of a clause, eqs. (14–16).
///
/// `speaker` is the index of the place held when the sentence began. `landmark` holds (index,
/// probability) pairs of the places that may be the landmark; what they lack to one is "an unknown
/// place", so an empty slice is an unknown landmark. `figure_prior` holds, per place, the probability
/// that the figure's name applies there; equal values (or a slice of another length) mean that the
/// name was never taught. Linear in the places (at most [`MAX_LANDMARKS`] landmarks are summed over).
pub fn ground(
    relation: Relation,
    places: &[GroundPlace],
    speaker: usize,
    landmark: &[(usize, f64)],
    figure_prior: &[f64],
) -> Grounding {
    let cells_m2: Vec<f64> = (0..places.len()).map(|i| cell_length_m(places, i) * CELL_WIDTH_M).collect();
    let landmarks = likeliest(places, speaker, landmark);
    let p_unknown = (1.0 - landmarks.iter().map(|l| l.1).sum::<f64>()).max(0.0);
    let density = relation_density(relation, places, speaker, &landmarks);
    let seen: f64 = density.iter().zip(&cells_m2).map(|(f, a)| f * a).sum();
    // Several passes over the same floor must not count it twice.
    let cap = if seen > 1.0 { 1.0 / seen } else { 1.0 };
    let (known, share) = taught(figure_prior, places.len());
    // (14), the sum over what the figure is: a place taught by that name, a place seen without being
    // named, or one not in the map yet.
    let mut p: Vec<f64> = (0..places.len())
        .map(|i| {
            let ratio = (density[i] * FLOOR_M2 + p_unknown).clamp(RATIO.0, RATIO.1);
            known * share[i] * ratio + (1.0 - known) * (1.0 - NOT_YET) * density[i] * cells_m2[i] * cap
        })
        .collect();
    let elsewhere = (1.0 - known) * (1.0 - (1.0 - NOT_YET) * (seen * cap));
    let z = p.iter().sum::<f64>() + elsewhere; // 1/Z of (16)
    if !(z.is_finite() && z > 0.0) {
        return Grounding { p: vec![0.0; places.len()], p_elsewhere: 1.0 };
    }
    for x in &mut p {
        *x /= z;
    }
    Grounding { p, p_elsewhere: elsewhere / z }
}

/// Σ over landmarks of p(landmark) f(figure, landmark), per m² at every place: (15), whose terms are
/// the products of factors of (16).
fn relation_density(
    relation: Relation,
    places: &[GroundPlace],
    speaker: usize,
    landmarks: &[(usize, f64)],
) -> Vec<f64> {
    let mut density = vec![0.0; places.len()];
    for &(at, p) in landmarks {
        let scene = Scene::new(places[speaker], places[at]);
        for (sum, place) in density.iter_mut().zip(places) {
            *sum += p * scene.density(relation, *place);
        }
    }
    // A thing is not located by itself: the likelier a place is the landmark, the less the figure.
    let top = landmarks.iter().map(|l| l.1).fold(f64::MIN_POSITIVE, f64::max);
    for &(at, p) in landmarks {
        density[at] *= 1.0 - p / top;
    }
    density
}

/// One landmark hypothesis, seen by the speaker.
struct Scene {
    speaker: GroundPlace,
    landmark: GroundPlace,
    /// Distance from speaker to landmark.
    reach_m: f64,
    /// Unit vector from the speaker to the landmark, or the robot's heading if it stands there.
    ahead: (f64, f64),
    /// The landmark lies where the speaker stands.
    here: bool,
    /// How well the travelled path tells the way to the landmark, 0…1.
    path_trust: f64,
}

impl Scene {
    fn new(speaker: GroundPlace, landmark: GroundPlace) -> Self {
        let (dx, dy) = (landmark.x_m - speaker.x_m, landmark.y_m - speaker.y_m);
        let reach_m = dx.hypot(dy);
        let here = reach_m < DIRECTION_MIN_M;
        let ahead =
            if here { (speaker.yaw_rad.cos(), speaker.yaw_rad.sin()) } else { (dx / reach_m, dy / reach_m) };
        let detour_m = ((landmark.path_m - speaker.path_m).abs() - reach_m).max(0.0);
        Self { speaker, landmark, reach_m, ahead, here, path_trust: (-detour_m / DETOUR_M).exp() }
    }

    /// f(figure at `place` | relation, landmark, speaker) per m² of floor; its integral is at most 1.
    fn density(&self, relation: Relation, place: GroundPlace) -> f64 {
        let d2 = (place.x_m - self.landmark.x_m).powi(2) + (place.y_m - self.landmark.y_m).powi(2);
        match relation {
            Relation::Near => gauss2(d2, NEAR_M),
            Relation::AwayFrom => {
                let (s2, b2) = (AWAY_M * AWAY_M, AWAY_BOUND_M * AWAY_BOUND_M);
                let area_m2 = std::f64::consts::TAU * (b2 - b2 * s2 / (b2 + s2));
                (1.0 - (-d2 / (2.0 * s2)).exp()) * (-d2 / (2.0 * b2)).exp() / area_m2
            }
            Relation::Down | Relation::Through => {
                let by_path = 0.5 * self.path_trust;
                (1.0 - by_path) * self.straight(relation, place) + by_path * self.travelled(relation, place)
            }
            // Not modelled: somewhere about.
            _ => gauss2(d2, AWAY_BOUND_M),
        }
    }

    /// Straight on from the speaker past the landmark.
    fn straight(&self, relation: Relation, place: GroundPlace) -> f64 {
        let (dx, dy) = (place.x_m - self.speaker.x_m, place.y_m - self.speaker.y_m);
        let along_m = dx * self.ahead.0 + dy * self.ahead.1;
        let across_m = dy * self.ahead.0 - dx * self.ahead.1;
        let one_way = |along_m: f64| {
            let spread_m = ACROSS_M + ACROSS_PER_M * along_m.abs();
            beyond(relation, along_m, self.reach_m) * gauss1(across_m, spread_m)
        };
        if self.here {
            AHEAD * one_way(along_m) + (1.0 - AHEAD) * one_way(-along_m)
        } else {
            one_way(along_m)
        }
    }

    /// Along the path that the robot travelled, round its bends; per m² of a strip.
    fn travelled(&self, relation: Relation, place: GroundPlace) -> f64 {
        let way_m = self.landmark.path_m - self.speaker.path_m;
        let along_m = place.path_m - self.speaker.path_m;
        let one_way = |along_m: f64| beyond(relation, along_m, way_m.abs()) / CELL_WIDTH_M;
        if self.here {
            AHEAD * one_way(along_m) + (1.0 - AHEAD) * one_way(-along_m)
        } else {
            one_way(along_m * way_m.signum())
        }
    }
}

/// How far along the way to the landmark at `reach_m` the figure lies, per metre: beyond it for
/// "through", along it or beyond for "down".
fn beyond(relation: Relation, along_m: f64, reach_m: f64) -> f64 {
    let over_m = along_m - reach_m;
    let tail = (-over_m.max(0.0) / BEYOND_M).exp();
    match relation {
        Relation::Down if along_m > 0.0 => tail / (reach_m + BEYOND_M),
        Relation::Through if over_m > 0.0 => tail / BEYOND_M,
        _ => 0.0,
    }
}

fn gauss1(x: f64, sigma: f64) -> f64 {
    (-x * x / (2.0 * sigma * sigma)).exp() / (sigma * std::f64::consts::TAU.sqrt())
}

fn gauss2(d2: f64, sigma: f64) -> f64 {
    (-d2 / (2.0 * sigma * sigma)).exp() / (std::f64::consts::TAU * sigma * sigma)
}

/// Length of path that a place stands for: half way to its neighbours.
fn cell_length_m(places: &[GroundPlace], i: usize) -> f64 {
    let path = |j: usize| places.get(j).map_or(places[i].path_m, |p| p.path_m);
    let before = path(i.saturating_sub(1));
    ((path(i + 1) - before).abs() / 2.0).clamp(0.1, CELL_LENGTH_MAX_M)
}

/// The likeliest landmarks, the nearer first among equals, with their total kept.
fn likeliest(places: &[GroundPlace], speaker: usize, landmark: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let Some(from) = places.get(speaker) else { return Vec::new() };
    let distance_m = |i: usize| (places[i].x_m - from.x_m).hypot(places[i].y_m - from.y_m);
    let mut kept: Vec<(usize, f64)> =
        landmark.iter().copied().filter(|&(i, p)| i < places.len() && p.is_finite() && p > 0.0).collect();
    let total: f64 = kept.iter().map(|l| l.1).sum();
    kept.sort_by(|a, b| {
        b.1.total_cmp(&a.1).then(distance_m(a.0).total_cmp(&distance_m(b.0))).then(a.0.cmp(&b.0))
    });
    kept.truncate(MAX_LANDMARKS);
    let left: f64 = kept.iter().map(|l| l.1).sum();
    let scale = total.min(1.0) / left;
    for l in &mut kept {
        l.1 *= scale;
    }
    kept
}

/// How surely the figure's name has been taught, and every place's share in it. What all places
/// have in common tells none of them apart and is not evidence of teaching.
fn taught(figure_prior: &[f64], places: usize) -> (f64, Vec<f64>) {
    let unit = |p: &f64| if p.is_finite() { p.clamp(0.0, 1.0) } else { 0.0 };
    let low = figure_prior.iter().map(unit).fold(1.0, f64::min);
    let told: Vec<f64> = figure_prior.iter().map(|p| unit(p) - low).collect();
    let total: f64 = told.iter().sum();
    if told.len() != places || total <= 0.0 {
        return (0.0, vec![0.0; places]);
    }
    let high = told.iter().copied().fold(0.0, f64::max);
    (high.min(KNOWN_MAX), told.iter().map(|p| p / total).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A straight corridor along x, a place per metre from 0 to 40.
    fn corridor() -> Vec<GroundPlace> {
        (0..=40)
            .map(|i| GroundPlace { x_m: f64::from(i), y_m: 0.0, yaw_rad: 0.0, path_m: f64::from(i) })
            .collect()
    }

    fn mass(g: &Grounding, range: std::ops::RangeInclusive<usize>) -> f64 {
        g.p[range].iter().sum()
    }

    #[test]
    fn near_keeps_to_the_neighbourhood() {
        let g = ground(Relation::Near, &corridor(), 40, &[(20, 1.0)], &[]);
        let best = (0..41).max_by(|&a, &b| g.p[a].total_cmp(&g.p[b])).unwrap();
        assert!((18..=22).contains(&best) && best != 20, "beside the landmark, not the landmark: {best}");
        assert!(mass(&g, 8..=32) > 0.95 * g.p.iter().sum::<f64>());
        assert!(g.p[20] < 1e-12);
    }

    #[test]
    fn away_from_grows_with_distance() {
        let g = ground(Relation::AwayFrom, &corridor(), 0, &[(0, 1.0)], &[]);
        assert!(g.p[2] < g.p[8] && g.p[8] < g.p[15]);
        assert!(g.p[15] < 30.0 * g.p[40], "bounded");
    }

    #[test]
    fn through_is_beyond_and_down_is_along_or_beyond() {
        let through = ground(Relation::Through, &corridor(), 5, &[(20, 1.0)], &[]);
        assert!(mass(&through, 0..=20) < 1e-9);
        assert!(mass(&through, 21..=40) > 0.1);
        let down = ground(Relation::Down, &corridor(), 5, &[(20, 1.0)], &[]);
        assert!(mass(&down, 0..=4) < 1e-9);
        assert!(mass(&down, 6..=19) > 0.1 && mass(&down, 21..=40) > 0.05);
        // Seen from the other end, it is the other side.
        let back = ground(Relation::Through, &corridor(), 35, &[(20, 1.0)], &[]);
        assert!(mass(&back, 0..=19) > 0.1 && mass(&back, 20..=40) < 1e-9);
    }

    #[test]
    fn through_follows_the_path_round_a_bend() {
        // 20 m along x, then 20 m along y.
        let bend: Vec<GroundPlace> = (0..=40)
            .map(|i| {
                let s = f64::from(i);
                GroundPlace { x_m: s.min(20.0), y_m: (s - 20.0).max(0.0), yaw_rad: 0.0, path_m: s }
            })
            .collect();
        let g = ground(Relation::Through, &bend, 5, &[(15, 1.0)], &[]);
        assert!(mass(&g, 30..=40) > 0.04, "{}", mass(&g, 30..=40));
    }

    #[test]
    fn a_figure_ahead_of_all_that_was_seen_is_elsewhere() {
        // At the corridor's far end, looking on: what is down this hallway has not been visited.
        let g = ground(Relation::Down, &corridor(), 40, &[(40, 1.0)], &[]);
        assert!(g.p_elsewhere > 0.8, "{}", g.p_elsewhere);
        let g = ground(Relation::Near, &corridor(), 40, &[(40, 1.0)], &[]);
        assert!(g.p_elsewhere > 0.7, "{}", g.p_elsewhere);
    }

    #[test]
    fn a_taught_name_is_told_apart_by_the_relation() {
        let mut prior = vec![0.02; 41];
        prior[5] = 0.9;
        prior[30] = 0.9;
        let g = ground(Relation::Near, &corridor(), 40, &[(28, 1.0)], &prior);
        assert!(g.p[30] > 0.8, "{}", g.p[30]);
        assert!(g.p[30] > 20.0 * g.p[5]);
        // Without a landmark to go by, both stay.
        let g = ground(Relation::Near, &corridor(), 40, &[], &prior);
        assert!((g.p[30] - g.p[5]).abs() < 1e-12 && g.p[5] > 0.2);
    }

    #[test]
    fn nothing_known_says_nothing() {
        let g = ground(Relation::Down, &corridor(), 40, &[], &[0.5; 41]);
        assert!((g.p_elsewhere - 1.0).abs() < 1e-12);
        let g = ground(Relation::Down, &[], 0, &[(0, 1.0)], &[]);
        assert_eq!(g, Grounding { p: vec![], p_elsewhere: 1.0 });
    }

    #[test]
    fn factors_are_densities() {
        // Each factor integrates to at most one over the floor (half-metre grid).
        let at = |x_m: f64, y_m: f64, path_m: f64| GroundPlace { x_m, y_m, yaw_rad: 0.3, path_m };
        for relation in [Relation::Near, Relation::AwayFrom, Relation::Down, Relation::Through] {
            for landmark in [at(0.0, 0.0, 0.0), at(12.0, 5.0, 300.0)] {
                let scene = Scene::new(at(0.0, 0.0, 0.0), landmark);
                let mut total = 0.0;
                for i in -400..400 {
                    for j in -400..400 {
                        // Far off the path, so that only the straight reading counts.
                        let place = at(f64::from(i) * 0.5, f64::from(j) * 0.5, -1e6);
                        total += 0.25 * scene.density(relation, place);
                    }
                }
                assert!(total < 1.02, "{relation:?} {total}");
                assert!(total > 0.45, "{relation:?} {total}");
            }
        }
    }

    proptest! {
        #[test]
        fn probabilities_sum_to_one(
            points in prop::collection::vec((-60.0..60.0, -60.0..60.0, -3.2..3.2), 1..60),
            kind in 0..4usize,
            speaker in 0..70usize,
            landmark in prop::collection::vec((0..70usize, -0.1..1.0), 0..30),
            prior in prop::collection::vec(-0.2..1.2, 0..60),
            same_length: bool,
        ) {
            let mut path_m = 0.0;
            let places: Vec<GroundPlace> = points.iter().map(|&(x_m, y_m, yaw_rad)| {
                path_m += 1.0;
                GroundPlace { x_m, y_m, yaw_rad, path_m }
            }).collect();
            let mut prior = prior;
            if same_length { prior.resize(places.len(), 0.3); }
            let relation = [Relation::Near, Relation::AwayFrom, Relation::Down, Relation::Through][kind];
            let g = ground(relation, &places, speaker, &landmark, &prior);
            prop_assert_eq!(g.p.len(), places.len());
            prop_assert!(g.p.iter().chain([&g.p_elsewhere]).all(|p| (0.0..=1.0).contains(p)));
            prop_assert!((g.p.iter().sum::<f64>() + g.p_elsewhere - 1.0).abs() < 1e-9);
        }
    }
}
