//! A place as grounding sees it.

/// A place as grounding sees it, in one particle's map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundPlace {
    /// Position in the map.
    pub x_m: f64,
    /// Position in the map.
    pub y_m: f64,
    /// Heading of the robot at the place, in the map.
    pub yaw_rad: f64,
    /// Path travelled up to the place.
    pub path_m: f64,
}
