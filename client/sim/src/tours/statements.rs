//! All that is true of how the rooms along a tour lie, as people say it: what grounding learns from.

use super::Tour;
use super::layout::Layout;
use crate::geom::distance_m;
use crate::guide::{Visit, visits};
use crate::world::RoomKind;
use std::collections::BTreeSet;

/// Rooms so near to one that was entered are spoken of, too.
const AROUND_M: f64 = 12.0;
/// Said so long after a place was entered.
const PAUSE_S: f64 = 2.3;
/// Doors beside which one walks, and those past another, are no further ahead.
const AHEAD_M: f64 = 15.0;
/// The last door of a corridor is no further from its end.
const END_M: f64 = 3.0;

/// Something true.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// When it may be said, seconds from the start.
    pub at_s: f64,
    /// The room that is located, as an index into the world's rooms.
    pub figure: usize,
    /// How: "next to the {0}".
    pub how: String,
    /// The rooms that are meant by {0} and {1}.
    pub landmarks: Vec<usize>,
}

/// All statements about rooms that were entered, or lie near, by landmarks that were entered.
pub fn statements(tour: &Tour) -> Vec<Statement> {
    let (world, stays) = (&tour.scenario.world, visits(&tour.scenario.world, &tour.drive));
    let is_room = |k: &usize| world.rooms[*k].kind == RoomKind::Room;
    let entered: BTreeSet<usize> = stays.iter().map(|s| s.room).filter(is_room).collect();
    let entered: Vec<usize> = entered.into_iter().collect();
    let centre = |k: usize| world.rooms[k].area.centre();
    let is_near = |k: &usize| entered.iter().any(|&e| distance_m(centre(e), centre(*k)) <= AROUND_M);
    let figures: Vec<usize> = (0..world.rooms.len()).filter(is_room).filter(is_near).collect();
    let layout = Layout::new(world, &figures);
    let mut all = Vec::new();
    for &figure in &figures {
        for lies in layout.of(figure, &entered) {
            let landmarks: Vec<usize> = lies.landmarks().collect();
            let from = stays.iter().filter(|s| landmarks.contains(&s.room)).map(|s| s.from_s + PAUSE_S);
            let how = lies.pattern().to_owned();
            all.extend(from.map(|at_s| Statement {
                at_s,
                figure,
                how: how.clone(),
                landmarks: landmarks.clone(),
            }));
        }
        let corridors = stays.iter().filter(|s| !is_room(&s.room) && s.from_s + PAUSE_S < s.to_s);
        all.extend(corridors.flat_map(|stay| from_corridor(tour, &layout, figure, (stay, &entered))));
    }
    all.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    all
}

/// What may be said of a room by who walks along a corridor.
fn from_corridor(
    tour: &Tour,
    layout: &Layout,
    figure: usize,
    (stay, entered): (&Visit, &[usize]),
) -> Vec<Statement> {
    let at_s = stay.from_s + PAUSE_S;
    let here = tour.drive.at(at_s);
    let (corridor, said) =
        (stay.room, |how: &str, landmarks| Statement { at_s, figure, how: how.into(), landmarks });
    let mut all = Vec::new();
    if layout.is_down(figure, corridor, &here) {
        all.push(said("down the {0}", vec![corridor]));
    }
    let Some([ahead_m, _]) = layout.door_from(figure, corridor, &here) else { return all };
    let side = layout.side_from(figure, corridor, &here);
    if let Some(left) = side.filter(|_| (1.0..AHEAD_M).contains(&ahead_m)) {
        all.push(said(if left { "on the left" } else { "on the right" }, vec![]));
    }
    if ahead_m > 2.0 * END_M && layout.end_m(corridor, &here).is_some_and(|end_m| end_m - ahead_m < END_M) {
        all.push(said("at the end of the {0}", vec![corridor]));
    }
    for &mark in entered.iter().filter(|&&mark| mark != figure) {
        let mark_m = layout.door_from(mark, corridor, &here).map(|d| d[0]);
        if mark_m.is_some_and(|m| m > 1.0 && (1.5..AHEAD_M).contains(&(ahead_m - m))) {
            all.push(said("past the {0}", vec![mark]));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FloorPlan;
    use crate::storey::tests::ROW;
    use crate::tours::planned;
    use std::path::Path;

    #[test]
    fn what_is_said_is_of_all_kinds_and_in_order() {
        let plan = FloorPlan::parse(ROW, Path::new("row.xml")).unwrap();
        let all = statements(&planned(&plan, 1).unwrap());
        for how in ["next to the {0}", "between the {0} and the {1}", "down the {0}"] {
            assert!(all.iter().any(|s| s.how == how), "{how}: {all:?}");
        }
        assert!(all.windows(2).all(|w| w[0].at_s <= w[1].at_s));
        assert!(all.iter().all(|s| !s.landmarks.contains(&s.figure)));
    }
}
