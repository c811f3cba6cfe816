//! How a figure lies to its landmarks: the relations that people use of places indoors.

use serde::{Deserialize, Serialize};

macro_rules! relations {
    ($($(#[$doc:meta])* $variant:ident = $notation:literal, $words:literal;)*) => {
        /// A spatial relation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Relation {
            $($(#[$doc])* $variant,)*
        }

        impl Relation {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// As written in a parse.
            pub fn notation(self) -> &'static str {
                match self { $(Self::$variant => $notation,)* }
            }

            /// As said to a guide, before the landmark.
            pub fn words(self) -> &'static str {
                match self { $(Self::$variant => $words,)* }
            }
        }
    };
}

relations! {
    /// Beyond the landmark, which one passes through.
    Through = "through", "through";
    /// Along the landmark or at its far end.
    Down = "down", "down";
    /// Beside the landmark's length.
    Along = "along", "along";
    /// Beyond the landmark, which one passes.
    Past = "past", "past";
    /// On the landmark's other side.
    Across = "across", "across";
    /// Where the way to the landmark ends.
    To = "to", "to";
    /// On the way to the landmark.
    Towards = "towards", "towards";
    /// Far from the landmark.
    AwayFrom = "away_from", "away from";
    /// Round the landmark: a corner, mostly.
    Around = "around", "around";
    /// Outside the landmark, which one leaves.
    OutOf = "out_of", "out of";
    /// Close to the landmark.
    Near = "near", "near";
    /// Beside the landmark.
    NextTo = "next_to", "next to";
    /// To the landmark's left.
    LeftOf = "left_of", "left of";
    /// To the landmark's right.
    RightOf = "right_of", "right of";
    /// On the left of a path.
    LeftSide = "left_side", "on the left of";
    /// On the right of a path.
    RightSide = "right_side", "on the right of";
    /// Where the landmark faces.
    InFrontOf = "in_front_of", "in front of";
    /// Straight ahead of whom it is said to.
    AheadOf = "ahead_of", "ahead of";
    /// At the landmark's back.
    Behind = "behind", "behind";
    /// Between two landmarks.
    Between = "between", "between";
    /// Facing the landmark, over a hallway.
    AcrossFrom = "across_from", "across from";
    /// Where the landmark ends.
    AtEndOf = "at_end_of", "at the end of";
    /// At the landmark.
    At = "at", "at";
    /// Inside the landmark.
    In = "in", "in";
    /// On the landmark.
    On = "on", "on";
    /// With the landmark inside.
    Contains = "contains", "with";
    /// On the floor above.
    Above = "above", "above";
    /// On the floor below.
    Below = "below", "below";
    /// Upstairs.
    LevelUp = "level_up", "a level up from";
    /// Downstairs.
    LevelDown = "level_down", "a level down from";
    /// On a level of the building.
    OnLevel = "on_level", "on";
    /// North of the landmark.
    NorthOf = "north_of", "north of";
    /// South of the landmark.
    SouthOf = "south_of", "south of";
    /// East of the landmark.
    EastOf = "east_of", "east of";
    /// West of the landmark.
    WestOf = "west_of", "west of";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_written_in_its_own_way() {
        let mut written: Vec<_> = Relation::ALL.iter().map(|r| r.notation()).collect();
        written.sort_unstable();
        written.dedup();
        assert_eq!(written.len(), Relation::ALL.len());
    }
}
