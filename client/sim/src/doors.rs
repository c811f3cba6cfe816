//! From contours to walls: where two spaces' portals face each other, a doorway stands open.

use super::floorplan::{Edge, FloorPlan};
use crate::geom::{Area, Point, Segment, distance_m, uncovered};
use std::collections::BTreeMap;

/// Portals further apart do not face each other through one wall.
const DEEP_MAX_M: f64 = 0.8;
/// Narrower gaps are the drawing's, not doors.
const WIDTH_MIN_M: f64 = 0.3;
/// Facing portals run parallel, but for the drawing's accuracy: cosine of the angle.
const PARALLEL: f64 = 0.94;

/// The walls of a plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walls {
    /// Each with whether it is a window.
    pub lines: Vec<(Segment, bool)>,
    /// The floor in the doorways, through the walls' thickness.
    pub doorways: Vec<Area>,
    /// Doorways per space, in the plan's order.
    pub doors: Vec<usize>,
}

/// A portal that leads to another space of the plan.
struct Portal {
    space: usize,
    target: usize,
    line: Segment,
    /// From where to where along the line it is open, metres.
    open: Vec<(f64, f64)>,
}

/// Puts up the walls. A portal stands open as far as one of its target faces it; where none does
/// (an outer door, a slip of the drawing), it is a shut door, which is a wall.
pub(crate) fn walls(plan: &FloorPlan) -> Walls {
    let index: BTreeMap<&str, usize> =
        plan.spaces.iter().zip(0..).map(|(s, k)| (s.name.as_str(), k)).collect();
    let mut built = Walls { doors: vec![0; plan.spaces.len()], ..Walls::default() };
    let mut portals = Vec::new();
    for (space, drawn) in plan.spaces.iter().enumerate() {
        for (line, edge) in drawn.closed() {
            let target = if let Edge::Portal(to) = &edge { index.get(to.as_str()) } else { None };
            match target {
                Some(&target) => portals.push(Portal { space, target, line, open: Vec::new() }),
                None => built.lines.push((line, edge == Edge::Window)),
            }
        }
    }
    for i in 0..portals.len() {
        for j in i + 1..portals.len() {
            let (p, q) = (&portals[i], &portals[j]);
            if p.space == p.target || (p.space, p.target) != (q.target, q.space) {
                continue;
            }
            if let Some(doorway) = facing(&p.line, &q.line) {
                built.doors[p.space] += 1;
                built.doors[q.space] += 1;
                let [a, b, c, d] = doorway;
                built.doorways.push(Area { corners: doorway.into() });
                let jambs = [Segment { a: b, b: c }, Segment { a: d, b: a }];
                built.lines.extend(jambs.into_iter().map(|jamb| (jamb, false)));
                portals[i].open(a, b);
                portals[j].open(c, d);
            }
        }
    }
    built.lines.extend(portals.into_iter().flat_map(Portal::shut).map(|line| (line, false)));
    built.lines.retain(|(line, _)| distance_m(line.a, line.b) > 1e-6);
    built
}

impl Portal {
    fn open(&mut self, a: Point, b: Point) {
        let [from, to] = [a, b].map(|p| distance_m(self.line.a, p));
        self.open.push((from.min(to), from.max(to)));
    }

    /// What of it is not open.
    fn shut(self) -> impl Iterator<Item = Segment> {
        let Segment { a, b } = self.line;
        let length_m = distance_m(a, b);
        let at = move |m: f64| [0, 1].map(|k| a[k] + m / length_m * (b[k] - a[k]));
        uncovered(0.0, length_m, self.open)
            .into_iter()
            .map(move |(from, to)| Segment { a: at(from), b: at(to) })
    }
}

/// The doorway between two portals: its corners, first two on `p`, then two on `q`, in order round
/// it; none if they don't face each other.
fn facing(p: &Segment, q: &Segment) -> Option<[Point; 4]> {
    let (length_m, other_m) = (distance_m(p.a, p.b), distance_m(q.a, q.b));
    if length_m < WIDTH_MIN_M || other_m < WIDTH_MIN_M {
        return None;
    }
    let along = [(p.b[0] - p.a[0]) / length_m, (p.b[1] - p.a[1]) / length_m];
    let project = |r: Point| (r[0] - p.a[0]) * along[0] + (r[1] - p.a[1]) * along[1];
    let (from, to) = (project(q.a), project(q.b));
    if (to - from).abs() < PARALLEL * other_m {
        return None;
    }
    let (low, high) = (from.min(to).max(0.0), from.max(to).min(length_m));
    let on_p = |m: f64| [0, 1].map(|k| p.a[k] + m * along[k]);
    let on_q = |m: f64| [0, 1].map(|k| q.a[k] + (m - from) / (to - from) * (q.b[k] - q.a[k]));
    let deep_m = distance_m(on_p(low), on_q(low)).max(distance_m(on_p(high), on_q(high)));
    let open = high - low >= WIDTH_MIN_M && deep_m <= DEEP_MAX_M;
    open.then(|| [on_p(low), on_p(high), on_q(high), on_q(low)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(a: Point, b: Point) -> Segment {
        Segment { a, b }
    }

    #[test]
    fn portals_face_each_other_as_far_as_they_overlap() {
        let p = line([0.0, 0.0], [1.0, 0.0]);
        let doorway = facing(&p, &line([1.5, 0.2], [0.25, 0.2])).unwrap();
        assert_eq!(doorway, [[0.25, 0.0], [1.0, 0.0], [1.0, 0.2], [0.25, 0.2]]);
        assert_eq!(facing(&p, &line([1.5, 0.9], [0.25, 0.9])), None, "through a room");
        assert_eq!(facing(&p, &line([2.5, 0.2], [0.9, 0.2])), None, "beside");
        assert_eq!(facing(&p, &line([0.5, 0.0], [0.5, 0.7])), None, "across");
    }

    #[test]
    fn what_is_not_open_is_shut() {
        let mut portal = Portal { space: 0, target: 1, line: line([0.0, 0.0], [0.0, 4.0]), open: Vec::new() };
        portal.open([0.0, 2.0], [0.0, 1.0]);
        let shut: Vec<_> = portal.shut().collect();
        assert_eq!(shut, [line([0.0, 0.0], [0.0, 1.0]), line([0.0, 2.0], [0.0, 4.0])]);
    }
}
