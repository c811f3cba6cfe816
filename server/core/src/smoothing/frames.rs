//! Rigid moves of a belief's newer poses.
//!
//! Linearisation points are kept in frames: those from some pose on in a frame of their own, which a
//! rigid move turns and shifts while the points in it stay as they are, to the bit. Perturbations are
//! those of the right, and between-factors see relative poses: whatever is linearised within a frame
//! holds after the move, and beliefs that shared it go on to do so.

use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// Frames of stretches of poses, each up to where the next begins. Before the first: the origin's.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Frames(Vec<(u32, Pose2)>);

impl Frames {
    /// Which stretch a pose is in; zero is the origin's.
    fn stretch(&self, pose: u32) -> usize {
        self.0.partition_point(|&(from, _)| from <= pose)
    }

    /// Whether poses are all in one stretch.
    pub fn one_has(&self, poses: &[u32]) -> bool {
        self.0.is_empty() || poses.windows(2).all(|w| self.stretch(w[0]) == self.stretch(w[1]))
    }

    /// A value of a pose, in its stretch's frame, as seen from the origin.
    pub fn outward(&self, pose: u32, value: Pose2) -> Pose2 {
        match self.stretch(pose).checked_sub(1) {
            Some(k) => self.0[k].1.compose(&value),
            None => value,
        }
    }

    /// A value of a pose, seen from the origin, in its stretch's frame.
    pub fn inward(&self, pose: u32, value: Pose2) -> Pose2 {
        match self.stretch(pose).checked_sub(1) {
            Some(k) => self.0[k].1.between(&value),
            None => value,
        }
    }

    /// Moves all poses from one on: what was at p is at `moved ∘ p`.
    pub fn rebase(&mut self, from: u32, moved: &Pose2) {
        let at = self.0.partition_point(|&(begins, _)| begins < from);
        if self.0.get(at).is_none_or(|&(begins, _)| begins != from) {
            let before = at.checked_sub(1).map_or_else(Pose2::default, |k| self.0[k].1);
            self.0.insert(at, (from, before));
        }
        for (_, frame) in &mut self.0[at..] {
            *frame = moved.compose(frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_add_up_from_where_they_begin() {
        let mut frames = Frames::default();
        let moves = [
            (5, Pose2::new(1.0, 2.0, 0.5)),
            (9, Pose2::new(-3.0, 0.1, 3.0)),
            (5, Pose2::new(0.3, 0.0, -1.0)),
        ];
        let mut poses = vec![Pose2::new(4.0, -1.0, 2.0); 12];
        let kept = poses.clone();
        for (from, moved) in &moves {
            frames.rebase(*from, moved);
            poses[*from as usize..].iter_mut().for_each(|p| *p = moved.compose(p));
        }
        frames.rebase(2, &moves[0].1);
        poses[2..].iter_mut().for_each(|p| *p = moves[0].1.compose(p));
        for (k, (pose, kept)) in (0..).zip(poses.iter().zip(&kept)) {
            assert!(frames.outward(k, *kept).between(pose).log().amax() < 1e-12, "{k}");
            assert!(frames.inward(k, *pose).between(kept).log().amax() < 1e-12, "{k}");
        }
        assert!(frames.one_has(&[5, 8, 6]) && frames.one_has(&[0, 1]) && frames.one_has(&[]));
        assert!(!frames.one_has(&[1, 5]) && !frames.one_has(&[9, 8]) && !frames.one_has(&[2, 1]));
    }
}
