//! A laser that is mounted otherwise than setup says.

use crate::run;
use crate::world::{drive, events, laser};
use std::f64::consts::{FRAC_PI_2, PI};
use toponym_core::effects::{Effect, Suspicion, TrackState};
use toponym_core::event::{Event, Laser, Setup};
use toponym_core::geometry::{Pose2, wrap};
use toponym_core::{Config, Mapper};

/// Drives with a laser mounted so, of which setup says that it is mounted as usual: what was suspected, the states told,
/// and where it was at each scan.
fn driven(poses: &[Pose2], really: &Laser) -> (Vec<Suspicion>, Vec<TrackState>, Vec<Pose2>) {
    let mut all = events(poses, really, &[]);
    all[0] = Event::Setup(Setup { robot: "r".into(), lasers: vec![laser()] });
    let (mut suspected, mut states, mut tracked) = (vec![], vec![], vec![]);
    for effect in run(&mut Mapper::new(Config::default()), &all) {
        match effect {
            Effect::Suspected { what, .. } => suspected.push(what),
            Effect::StateChanged { state, .. } => states.push(state),
            Effect::Tracked { map_from_body, .. } => tracked.push(map_from_body),
            _ => {}
        }
    }
    (suspected, states, tracked)
}

#[test]
fn a_laser_mounted_otherwise_is_taken_for_that() {
    let poses = drive(1);
    let turned = |yaw_rad| Laser { body_from_laser: Pose2::new(0.2, 0.0, yaw_rad), ..laser() };
    let others = [turned(PI), turned(FRAC_PI_2), turned(-0.6), Laser { upside_down: true, ..laser() }];
    for really in others {
        let (suspected, states, tracked) = driven(&poses, &really);
        assert_eq!(suspected, [Suspicion::Mounting], "{really:?}");
        assert_eq!(states, [TrackState::Mapping], "{really:?}");
        // From the second leg on it is where it is, and looks where it looks, seen from the last pose.
        let (end, true_end) = (tracked.last().unwrap(), poses.last().unwrap());
        for (pose, truth) in tracked.iter().zip(&poses).skip(110) {
            let (made, is) = (end.between(pose), true_end.between(truth));
            assert!(made.distance_m(&is) < 0.4, "{really:?}: {made:?} {is:?}");
            assert!(wrap(made.yaw_rad - is.yaw_rad).abs() < 0.1, "{really:?}: {made:?} {is:?}");
        }
    }
    let (suspected, ..) = driven(&poses, &laser());
    assert_eq!(suspected, []);
}
