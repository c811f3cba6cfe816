//! The direction in which a registration knows little, and what noise makes it believe there; see
//! [`super::align`].

use nalgebra::Matrix3;

/// Where the least known direction of translation has less than this share of the information in the
/// best known, normals' noise may be most of it …
const WEAK_SHARE: f64 = 0.1;
/// … and as the share goes to nothing, components of normals up to this are taken for noise. Fitted
/// to some centimetres of wall, they are turned by several degrees by a centimetre's noise of ranges,
/// with tails. Both from simulated corridors: twice or half the one, .25 of the other do alike.
const NORMAL_NOISE: f64 = 0.35;

/// A direction of translation of which the pairs say little, source's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weak {
    /// Unit.
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// How weak it is, 0 … 1.
    pub(super) share: f64,
    /// Square of the component along it that noise may give a normal.
    noise2: f64,
}

impl Weak {
    /// The least known direction of translation, if it is known far less than the one across it.
    pub(crate) fn of(information: &Matrix3<f64>) -> Option<Self> {
        let (xx, xy, yy) = (information[(0, 0)], information[(0, 1)], information[(1, 1)]);
        let (mean, half) = (f64::midpoint(xx, yy), (0.5 * (xx - yy)).hypot(xy));
        let share = (mean - half) / (mean + half);
        // The best known direction is at half the angle of (xx − yy, 2 xy), the least is across.
        let (s, c) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
        let weak = 1.0 - share / WEAK_SHARE;
        (share < WEAK_SHARE).then_some(Self { x: -s, y: c, share: weak, noise2: NORMAL_NOISE.powi(2) * weak })
    }

    /// A unit normal less what noise may have given it along the direction; unit again.
    pub(super) fn denoised(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let (along, across) = (a * self.x + b * self.y, b * self.x - a * self.y);
        let kept = along * (1.0 - self.noise2 / (along * along).max(self.noise2));
        let rest = (1.0 - kept * kept).max(0.0).sqrt().copysign(across);
        (kept * self.x - rest * self.y, kept * self.y + rest * self.x)
    }

    /// A normal less its component along the direction, the more the weaker that is.
    pub(super) fn damped(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let off = (a * self.x + b * self.y) * self.share;
        (a - off * self.x, b - off * self.y)
    }
}
