//! What wheels say of motions that scans saw, in the long run: a laser that is mounted backwards or upside down, wheels
//! that stand still or count in other units show as a ratio that is not near one.
//!
//! ```text
//! ratio = Σ odom · seen / Σ seen²      of windows, ahead and of turns, the older ones forgotten
//! ```

use crate::geometry::{Pose2, wrap};
use serde::{Deserialize, Serialize};

/// Motion seen in a window, metres of way plus radians turned.
const WINDOW: f64 = 0.5;
/// So much is remembered, m² or rad²: that of some metres, or radians …
const LEAST: f64 = 1.0;
/// … and per window so much is forgotten.
const FORGETS: f64 = 0.02;
/// Ratios of wheels that are merely badly calibrated.
const SANE: std::ops::RangeInclusive<f64> = 0.4..=2.5;
/// Below this share of what was seen, wheels stand still.
const STILL: f64 = 0.1;

/// The sums of one coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Sums {
    both: f64,
    seen: f64,
    odom: f64,
}

impl Sums {
    fn add(&mut self, odom: f64, seen: f64) {
        for (sum, term) in
            [(&mut self.both, odom * seen), (&mut self.seen, seen * seen), (&mut self.odom, odom * odom)]
        {
            *sum += term - FORGETS * *sum;
        }
    }

    /// What wheels say of a unit of motion; none as long as too little was seen.
    fn ratio(&self) -> Option<f64> {
        (self.seen > LEAST).then(|| self.both / self.seen)
    }

    fn stands_still(&self) -> bool {
        self.seen > LEAST && self.odom < STILL * STILL * self.seen
    }
}

/// Wheels and scans, side by side.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Contrast {
    /// Where the window began, and odometry's way ahead and turn since: summed up, for composed a wrong turn would spoil
    /// the way.
    from: Option<Pose2>,
    run: (f64, f64),
    ahead: Sums,
    turns: Sums,
}

impl Contrast {
    /// Wheels moved.
    pub fn drive(&mut self, increment: &Pose2) {
        self.run.0 += increment.x_m;
        self.run.1 += wrap(increment.yaw_rad);
    }

    /// Scans told the pose.
    pub fn saw(&mut self, front_from_body: &Pose2) {
        let from = *self.from.get_or_insert(*front_from_body);
        let seen = from.between(front_from_body).log();
        if seen.xy().norm() + seen.z.abs() >= WINDOW {
            self.ahead.add(self.run.0, seen.x);
            self.turns.add(self.run.1, seen.z);
            self.lift();
            self.from = Some(*front_from_body);
        }
    }

    /// The pose has no more to do with the one before.
    pub fn lift(&mut self) {
        (self.from, self.run) = (None, (0.0, 0.0));
    }

    /// Whether wheels say nothing.
    pub fn stands_still(&self) -> bool {
        self.ahead.stands_still()
    }

    /// How wheels and scans contradict each other; none if they do not.
    pub fn contradiction(&self) -> Option<String> {
        let odd = |sums: &Sums| sums.ratio().filter(|r| !sums.stands_still() && !SANE.contains(r));
        match (odd(&self.ahead), odd(&self.turns)) {
            (Some(ahead), _) if ahead < 0.0 => {
                Some("scans move backwards where wheels go ahead: is the laser mounted backwards?".into())
            }
            (_, Some(turns)) if turns < 0.0 => {
                Some("scans turn the other way than wheels: is the laser mounted upside down?".into())
            }
            (Some(ahead), _) => Some(format!("wheels say {ahead:.2} m of each metre that scans see")),
            (None, Some(turns)) => Some(format!("wheels say {turns:.2} rad of each radian that scans see")),
            (None, None) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn driven(odom: Pose2, seen: Pose2) -> Contrast {
        let (mut contrast, mut pose) = (Contrast::default(), Pose2::default());
        contrast.saw(&pose);
        for _ in 0..200 {
            pose = pose.compose(&seen);
            contrast.drive(&odom);
            contrast.saw(&pose);
        }
        contrast
    }

    #[test]
    fn what_contradicts_is_told_and_what_is_merely_off_is_not() {
        let seen = Pose2::new(0.1, 0.0, 0.05);
        for (odom, says) in [
            (seen, None),
            (Pose2::new(0.08, 0.0, 0.06), None),
            (Pose2::new(-0.1, 0.0, 0.05), Some("backwards")),
            (Pose2::new(0.1, 0.0, -0.05), Some("upside down")),
            (Pose2::new(100.0, 0.0, 0.05), Some("m of each metre")),
            (Pose2::new(0.1, 0.0, 0.05 * 57.3), Some("rad of each radian")),
            (Pose2::default(), None),
        ] {
            let told = driven(odom, seen).contradiction();
            assert_eq!(told.is_some(), says.is_some(), "{odom:?}: {told:?}");
            assert!(told.unwrap_or_default().contains(says.unwrap_or_default()), "{odom:?}");
        }
        assert!(driven(Pose2::default(), seen).stands_still());
        assert!(!driven(seen, seen).stands_still());
    }
}
