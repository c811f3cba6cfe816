//! Ready-made scenarios: buildings and the tours through them.

use super::building::{OfficeStyle, demo_building, random_office};
use super::floorplan::FloorPlan;
use super::guide::GuideStyle;
use super::random::Draw;
use super::storey::Storey;
use super::world::{RoomKind, World};
use super::{Scenario, SimError};
use crate::geom::Point;

impl Scenario {
    /// The tour of the demo: round the building, back through the first lobby, and to the gym
    /// again.
    pub fn demo(seed: u64) -> Self {
        let world = demo_building();
        let stops = [
            "elevator lobby",
            "gym",
            "kitchen",
            "lecture hall",
            "mail room",
            "",
            "cafe",
            "library",
            "workshop",
            "elevator lobby",
            "gym",
            "kitchen",
        ];
        // The second lobby bears the first one's name: it is the last room so called.
        let other_lobby = world.rooms.iter().rposition(|r| r.name == "elevator lobby");
        let tour = stops
            .iter()
            .filter_map(|name| if name.is_empty() { other_lobby } else { world.room(name) })
            .collect();
        let mut scenario = Self::new(world, tour, seed);
        scenario.motion.speed_mps = (0.8, 1.0);
        scenario.guide = GuideStyle { named: 1.0, revisits: 1.0, foretold: 0.4, corridors: 1.0 };
        scenario
    }

    /// A random office and a tour of `stops` rooms: mostly round in one direction, at times back
    /// to where it was before.
    pub fn office(style: &OfficeStyle, stops: usize, seed: u64) -> Self {
        let world = random_office(style, seed);
        let mut draw = Draw::new(seed, 2);
        let mut order: Vec<usize> =
            (0..world.rooms.len()).filter(|&k| world.rooms[k].kind == RoomKind::Room).collect();
        let middle = centre(&world);
        let bearing = |k: &usize| {
            let [x, y] = world.rooms[*k].area.centre();
            (y - middle[1]).atan2(x - middle[0])
        };
        order.sort_by(|a, b| bearing(a).total_cmp(&bearing(b)));
        let mut tour: Vec<usize> = vec![0];
        let mut next = draw.below(order.len());
        while tour.len() < stops && !order.is_empty() {
            if tour.len() > 4 && draw.chance(0.2) {
                tour.push(tour[1 + draw.below(tour.len() - 3)]);
            } else {
                next += 1 + draw.below(2);
                tour.push(order[next % order.len()]);
            }
        }
        tour.dedup();
        Self::new(world, tour, seed)
    }

    /// A floor plan and a tour of `stops` of its rooms, drawn by chance: at times back to where it
    /// was before, and in the end to where it began.
    ///
    /// # Errors
    /// If fewer than two rooms are in reach of each other.
    pub fn floor_plan(plan: &FloorPlan, stops: usize, seed: u64) -> Result<Self, SimError> {
        let Storey { world, stops: rooms } = Storey::new(plan, &mut Draw::new(seed, 3));
        if rooms.len() < 2 {
            return Err(SimError::TooSmall(rooms.len()));
        }
        let mut draw = Draw::new(seed, 2);
        let (mut tour, mut left): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
        while tour.len() < stops {
            if tour.len() > 4 && draw.chance(0.2) {
                tour.push(tour[draw.below(tour.len() - 1)]);
                continue;
            }
            if left.is_empty() {
                left.clone_from(&rooms);
            }
            tour.push(left.swap_remove(draw.below(left.len())));
        }
        tour.extend(tour.first().copied());
        tour.dedup();
        Ok(Self::new(world, tour, seed))
    }
}

fn centre(world: &World) -> Point {
    let n = world.rooms.len().max(1) as f64;
    let sum = world.rooms.iter().map(|r| r.area.centre()).fold([0.0, 0.0], |s, c| [s[0] + c[0], s[1] + c[1]]);
    [sum[0] / n, sum[1] / n]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laser::LaserModel;
    use crate::storey::tests::ROW;
    use crate::wheels::Wheels;
    use std::path::Path;
    use toponym_proto::{Limits, Message};

    fn toured(seed: u64) -> Scenario {
        let plan = FloorPlan::parse(ROW, Path::new("row.xml")).unwrap();
        Scenario::floor_plan(&plan, 6, seed).unwrap()
    }

    #[test]
    fn a_tour_of_a_plan_keeps_clear_of_its_walls_and_ends_where_it_began() {
        for seed in 0..4 {
            let scenario = toured(seed);
            assert_eq!(scenario.tour.first(), scenario.tour.last());
            let recording = scenario.run().unwrap();
            for (_, pose) in &recording.truth.scans {
                let clearance_m = scenario.world.clearance_m([pose.x_m, pose.y_m]);
                assert!(clearance_m > 0.18, "{clearance_m} m at {pose:?}");
            }
            let (first, last) = (recording.truth.scans[0].1, recording.truth.scans.last().unwrap().1);
            assert!((first.x_m - last.x_m).hypot(first.y_m - last.y_m) < 0.2);
            assert!(recording.truth.path_m > 20.0);
        }
    }

    #[test]
    fn every_message_of_an_rplidar_among_people_is_one_that_a_server_takes() {
        let mut scenario = toured(1);
        scenario.lasers = vec![LaserModel::rplidar()];
        scenario.wheels = Wheels::rough();
        scenario.people = 3;
        let messages = scenario.run().unwrap().messages;
        for message in &messages {
            message.validate(&Limits::default()).unwrap();
        }
        let text = |messages: &[Message]| format!("{messages:?}");
        assert_eq!(text(&messages), text(&scenario.run().unwrap().messages), "same scenario, same bytes");
        scenario.people = 0;
        assert_ne!(text(&messages), text(&scenario.run().unwrap().messages), "people are seen");
    }

    #[test]
    fn a_plan_with_a_single_room_is_no_tour() {
        let plan = FloorPlan::parse(super::super::storey::tests::TWO_ROOMS, Path::new("p.xml")).unwrap();
        assert_eq!(Scenario::floor_plan(&plan, 6, 1).err(), Some(SimError::TooSmall(1)));
    }
}
