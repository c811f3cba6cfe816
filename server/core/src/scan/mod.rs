//! Laser scans: from beams to points, from points to transforms between places.
//!
//! - [`sweep`]: one scan, de-skewed, as points with normals and as a range image.
//! - [`cloud`]: sets of points and their spatial index.
//! - [`align`]: point-to-line registration from a guess, with an information matrix.
//! - `weak`: the direction of which a registration knows little, and noise that looks like knowledge.
//! - [`correlate`]: prior-free search for all transforms under which two clouds overlap.
//! - [`agree`]: do two places see each other's walls, or through them?
//! - [`enclosure`]: how far the room of a place reaches.
//! - `local`: the surfaces of the last metres of path, kept as scans come and go.
//! - [`front`]: the front end, every scan against the recent ones.
//! - `wheels`: online calibration of odometry, and what its increments are worth.
//! - [`place`]: a place's matchable content, frozen when the robot has left it.
//! - [`matching`]: two places' scans to modes; the measurement behind every loop edge.

pub mod agree;
pub mod align;
pub mod cloud;
pub mod correlate;
pub mod enclosure;
pub mod matching;
pub mod place;
pub mod sweep;
#[cfg(test)]
pub(crate) mod tests;
pub mod view;
pub(crate) mod weak;
