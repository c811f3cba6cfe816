//! What a tour gives: stand-ins, field by field, for those of the tours with look-alikes.

use super::super::geom::{Point, compose};
use super::super::{Draw, Sentence, Wheels};
use toponym_proto::Pose;

/// From a time on, the robot elsewhere than it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Seconds from the start of the drive.
    pub from_s: f64,
    /// The robot is at `world_from_true ∘ true pose`: a rigid motion of the world.
    pub world_from_true: Pose,
}

/// Something that might have happened, as far as scans can tell until something settles it.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What it is called: where the robot returned to.
    pub name: String,
    /// In order of time, each until the next; before the first, and without any, the truth.
    pub pieces: Vec<Piece>,
}

impl Hypothesis {
    /// Where the robot is by this hypothesis, world frame.
    pub fn at(&self, t_s: f64, true_pose: &Pose) -> Pose {
        let piece = self.pieces.iter().rev().find(|p| p.from_s <= t_s);
        piece.map_or(*true_pose, |p| compose(&p.world_from_true, true_pose))
    }
}

/// What a sentence claims.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// The name said.
    pub name: String,
    /// Middle of the room spoken of, world frame.
    pub at: Point,
    /// Whether that room is called so.
    pub held: bool,
}

/// A sentence of a narration.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// When and what.
    pub sentence: Sentence,
    /// What it claims, if it is about a name.
    pub claim: Option<Claim>,
}

/// What is known of a robot's wheels before it drives: standard deviations, about zero, of what
/// they always get wrong, and the noise itself.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelsPrior {
    /// Of [`Wheels::scale_error`].
    pub scale: f64,
    /// Of [`Wheels::turn_error`].
    pub turn: f64,
    /// Of [`Wheels::yaw_bias_rad_per_m`].
    pub yaw_bias_rad_per_m: f64,
    /// [`Wheels::noise_m`].
    pub noise_m: f64,
    /// [`Wheels::yaw_noise_rad`].
    pub yaw_noise_rad: f64,
    /// [`Wheels::turn_noise_rad`].
    pub turn_noise_rad: f64,
}

impl WheelsPrior {
    /// One robot's wheels.
    pub fn draw(&self, draw: &mut Draw) -> Wheels {
        Wheels {
            scale_error: self.scale * draw.normal(),
            turn_error: self.turn * draw.normal(),
            yaw_bias_rad_per_m: self.yaw_bias_rad_per_m * draw.normal(),
            noise_m: self.noise_m,
            yaw_noise_rad: self.yaw_noise_rad,
            turn_noise_rad: self.turn_noise_rad,
        }
    }
}
