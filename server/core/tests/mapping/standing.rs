//! What is told of how well the robot knows where it is, and of coordinates that change.

use crate::alike;
use crate::world::{drive, events, laser, say};
use crate::{run, where_is};
use toponym_core::effects::{Effect, Effects, TrackState};
use toponym_core::event::Event;
use toponym_core::geometry::{Pose2, wrap};
use toponym_core::{Config, Mapper};

fn states(effects: &Effects) -> Vec<(TrackState, String)> {
    let state = |e: &Effect| match e {
        Effect::StateChanged { state, why, .. } => Some((*state, why.clone())),
        _ => None,
    };
    effects.iter().filter_map(state).collect()
}

#[test]
fn who_maps_steadily_is_mapping_however_far_from_the_start() {
    let effects = run(&mut Mapper::new(Config::default()), &events(&drive(1), &laser(), &[]));
    let states = states(&effects);
    assert_eq!(states.iter().map(|s| s.0).collect::<Vec<_>>(), [TrackState::Mapping], "{states:?}");
}

#[test]
fn in_the_dark_doubt_grows_until_the_robot_is_lost() {
    let poses = alike::drive(0.0, 8.0);
    let mut mapper = Mapper::new(Config::default());
    let mut all = alike::events(&poses, 0.3);
    all.insert(20, Event::Utterance(say("u", "this is the kitchen", 0)));
    // Setup, the sentence, and two for each pose: the yard ends 8 m before the last.
    let effects = run(&mut mapper, &all[..all.len() - 90]);
    let told = states(&effects);
    let order: Vec<TrackState> = told.iter().map(|s| s.0).collect();
    assert_eq!(order, [TrackState::Mapping, TrackState::Doubtful, TrackState::Lost], "{told:?}");
    assert!(told[1].1.starts_with("in the dark for "), "{}", told[1].1);
    assert!(effects.iter().any(|e| matches!(e, Effect::Tracked { state: TrackState::Doubtful, .. })));
    // What is in the map is there still; only how far it is from the robot nobody can tell.
    let answer = where_is(&mapper, "kitchen");
    assert!(answer.robot.is_none() && mapper.snapshot().state() == TrackState::Lost);
    assert_eq!(answer.candidates[0].label, "kitchen");
}

/// A robot that drives half a metre a second at most: what its pose in the map does beyond that is told.
#[test]
fn the_robots_pose_in_the_map_jumps_only_where_that_is_told() {
    let poses = drive(2);
    let mut mapper = Mapper::new(Config::default());
    let mut effects = run(&mut mapper, &events(&poses, &laser(), &[]));
    effects.extend(mapper.step(Event::Flush));
    let (mut before, mut jumps): (Option<Pose2>, Vec<Pose2>) = (None, Vec::new());
    let mut epochs = 0;
    for effect in &effects {
        match effect {
            Effect::Jumped { epoch, new_from_old } => {
                epochs += 1;
                assert_eq!(*epoch, epochs);
                jumps.push(*new_from_old);
            }
            Effect::Tracked { map_from_body, .. } => {
                let expected = before.map(|p| jumps.drain(..).fold(p, |p, jump| jump.compose(&p)));
                if let Some(expected) = expected {
                    // 0.2 m or 11° a scan, and what is not worth telling.
                    assert!(
                        expected.distance_m(map_from_body) < 0.2 + 0.12,
                        "{expected:?} {map_from_body:?}"
                    );
                    let turned_rad = wrap(map_from_body.yaw_rad - expected.yaw_rad).abs();
                    assert!(turned_rad.to_degrees() < 11.3 + 2.5, "{expected:?} {map_from_body:?}");
                }
                before = Some(*map_from_body);
            }
            _ => {}
        }
    }
    assert!(epochs > 0, "the loop that odometry leaves open by metres moves the map");
    assert_eq!(mapper.snapshot().epoch(), epochs);
}
