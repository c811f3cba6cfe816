//! Scales of the templates: how far and how narrowly relations reach.

/// Numbers that templates of static relations, and the envelopes of path relations, are made of.
///
/// A reach is the scale of exp(−gap/reach) round a landmark, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Reach of "next to".
    pub next_to_m: f64,
    /// Reach of "between".
    pub between_m: f64,
    /// Reach of "across from", round the floor that faces the landmark.
    pub across_from_m: f64,
    /// Reach of "near", round a room's door.
    pub near_m: f64,
    /// Reach of "at the end of", round the end.
    pub at_end_m: f64,
    /// Reach of "on the left of", "the second door on the right", round the way.
    pub side_of_m: f64,
    /// Reach of "left of", "right of".
    pub left_of_m: f64,
    /// Reach of "past".
    pub past_m: f64,
    /// Reach of "through".
    pub through_m: f64,
    /// "Just past": so much closer.
    pub just: f64,
    /// How narrow "left of" is: concentration of exp(κ(cos − 1)).
    pub side_kappa: f64,
    /// What a place over the hallway still counts as beside a room.
    pub other_side: f64,
    /// Said distances: standard deviation, as share. Plans can't tell how guides err: set by hand.
    pub distance_share: f64,
    /// Said distances: least standard deviation. Set by hand.
    pub distance_least_m: f64,
    /// From a door to the next on the same side of a hallway.
    pub door_pitch_m: f64,
    /// How far a counted door is off from so many pitches, as a share: standard deviation.
    pub door_share: f64,
    /// A counted door for each that comes before it and was not driven through.
    pub door_missed: f64,
    /// What a counted door still counts at any distance.
    pub door_any: f64,
}

impl Scales {
    /// Set by hand, where choosing begins, and doubted by a factor of two.
    pub const BY_HAND: Self = Self {
        next_to_m: 1.5,
        between_m: 1.5,
        across_from_m: 1.5,
        near_m: 3.0,
        at_end_m: 3.0,
        side_of_m: 3.0,
        left_of_m: 4.0,
        past_m: 6.0,
        through_m: 6.0,
        just: 0.4,
        side_kappa: 3.0,
        other_side: 0.1,
        distance_share: 0.2,
        distance_least_m: 1.5,
        door_pitch_m: 4.5,
        door_share: 0.35,
        door_missed: 0.3,
        door_any: 0.3,
    };

    /// Chosen on every other building of the KTH campus plans:
    /// `cargo run --release -p toponym-core --example plans -- PLANS --choose`, which prints them.
    pub const FITTED: Self = Self {
        next_to_m: 1.70,
        between_m: 1.09,
        across_from_m: 1.09,
        near_m: 1.46,
        at_end_m: 1.29,
        side_of_m: 2.73,
        left_of_m: 2.44,
        past_m: 3.30,
        through_m: 6.00,
        just: 0.36,
        side_kappa: 7.68,
        other_side: 0.09,
        door_pitch_m: 5.62,
        door_share: 0.35,
        door_missed: 0.21,
        door_any: 0.15,
        ..Self::BY_HAND
    };
}
