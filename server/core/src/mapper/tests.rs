use super::*;
use crate::effects::TrackState;
use crate::event::{Laser, Setup};

/// A mapper that has seen one scan, from inside a box.
fn begun() -> (Mapper, Effects) {
    let mut mapper = Mapper::new(Config::default());
    let laser = Laser {
        id: "l".into(),
        body_from_laser: Pose2::default(),
        upside_down: false,
        range_min_m: 0.1,
        range_max_m: 30.0,
        ignored_rad: vec![],
    };
    mapper.step(Event::Setup(Setup { robot: "r".into(), lasers: vec![laser] }));
    let still = Odom { robot: "r".into(), boot: 0, stamp_ns: 0, odom_from_body: Pose2::default() };
    mapper.step(Event::Odom(still));
    let effects = mapper.step(Event::Scan(Scan {
        robot: "r".into(),
        laser: "l".into(),
        stamp_ns: 0,
        angle_min_rad: -1.5,
        angle_increment_rad: 0.1,
        time_increment_s: 0.0,
        ranges_m: vec![5.0; 31],
    }));
    (mapper, effects)
}

#[test]
fn the_first_scan_tells_the_state_and_no_other_does_until_it_changes() {
    let (mut mapper, effects) = begun();
    let told = |e: &&Effect| matches!(e, Effect::StateChanged { state: TrackState::Mapping, .. });
    assert_eq!(effects.iter().filter(told).count(), 1, "{effects:?}");
    let mut effects = Effects::new();
    mapper.stand(&mut effects);
    assert_eq!(effects, []);
}

#[test]
fn coordinates_jump_by_the_sum_of_what_was_not_told() {
    let (mut mapper, _) = begun();
    let here = Pose2::new(30.0, 4.0, 0.5);
    let mut effects = Effects::new();
    let nudge = |by: Pose2, mapper: &mut Mapper, effects: &mut Effects| {
        mapper.moved(&here, &here.compose(&by), effects);
    };
    nudge(Pose2::new(0.03, 0.0, 0.0), &mut mapper, &mut effects);
    nudge(Pose2::new(0.0, 0.0, 0.5_f64.to_radians()), &mut mapper, &mut effects);
    assert_eq!((effects.len(), mapper.epoch), (0, 0));
    nudge(Pose2::new(0.03, 0.0, 0.0), &mut mapper, &mut effects);
    let [Effect::Jumped { epoch: 1, new_from_old }] = effects[..] else { panic!("{effects:?}") };
    let moved = here.between(&new_from_old.compose(&here));
    assert!((moved.x_m - 0.06).abs() < 1e-3 && (moved.yaw_rad.to_degrees() - 0.5).abs() < 1e-9, "{moved:?}");
    nudge(Pose2::new(0.0, 0.0, -1.5_f64.to_radians()), &mut mapper, &mut effects);
    assert!(matches!(effects[1], Effect::Jumped { epoch: 2, .. }), "{effects:?}");
    nudge(Pose2::new(0.04, 0.0, 0.0), &mut mapper, &mut effects);
    assert_eq!(effects.len(), 2, "from there it counts anew");
}
