//! A chain as long as a robot's life.

use crate::geometry::Pose2;
use crate::smoothing::tests::script::{GOOD, information};
use crate::smoothing::{Factor, JointRoom, Smoother};

#[test]
fn a_hundred_thousand_poses_fit_a_small_stack() {
    let tour = || {
        let mut s = Smoother::new();
        let step = Pose2::new(1.0, 0.0, 0.001);
        for _ in 0..=100_000 {
            s.add_pose(step, &information(GOOD)).unwrap();
            s.update_newest().unwrap();
        }
        let f = Factor { i: 0, j: 100_000, i_from_j: s.pose(100_000), information: information(GOOD) };
        s.add_factor(f).unwrap();
        s.update().unwrap();
        let mut copy = s.clone();
        copy.add_pose(step, &information(GOOD)).unwrap();
        copy.settle().unwrap();
        assert_eq!((s.len(), copy.len()), (100_001, 100_002));
        drop(s);
        assert!(copy.marginal(100_001).amax() < 0.1);
        assert_eq!(copy.joint_all(&mut JointRoom::default()).unwrap().others.len(), copy.len());
    };
    let thread = std::thread::Builder::new().stack_size(256 << 10).spawn(tour).unwrap();
    thread.join().unwrap();
}
